"""A scene that changes while the robot moves: is the way that is left still free?

Owns promise 17: the way ahead is looked at anew, in the planning process, the next seconds of it
first. What would touch is stopped as soon as that is known. Where the answer takes longer than the
deadline, or the robot comes near what was not looked at yet, it is held on its path until the
answer is there. That hold is beside the pause of a person: neither ends the other. A jog that runs
was made for the scene of before, so it ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from openpendant.motion.scene import Scene
from openpendant.simplemsg.pendant import Activity, JogEnd
from openpendant.simplemsg.verdicts import VerdictCode

from ..driving.row_sources import StoredRows
from ..outgoing import Outgoing, Plan, Withdraw
from ..planning.jobs import Planned
from ..planning.way_check_job import WayCheckJob
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..settings import ControllerLink

DEADLINE_NS = 50_000_000
"""The answer must be there by then, or the robot is held."""

NEAR = 3.0
"""How much of the way is looked at first [s]."""

_ROOM = 1.0
"""The robot is held so long before the end of what was looked at [s]; it stops in less."""


@dataclass(slots=True)
class _Look:
    """A look along a motion under way.

    Attributes:
        rows: the motion.
        scene: what stands around.
        asked: when the question was asked [ns].
        near_end: end of the part that is looked at first, as a time of the motion [s].
        free_until: the way is known to be free until this time of the motion [s].
    """

    rows: StoredRows
    scene: Scene
    asked: int
    near_end: float
    free_until: float


class SceneGuard:
    """Watches the motion of one cell while its scene changes."""

    def __init__(self, cell: RobotCell, link: ControllerLink) -> None:
        """Make a guard that has nothing to look at.

        Args:
            cell: whose motion it watches.
            link: how far set-points are ahead of a robot, and how long it goes on unseen.
        """
        self._cell = cell
        # So far behind the set-points that left the robot may be [s].
        self._behind = link.planned_lead + link.abort_age_ns / 1e9
        self._look: _Look | None = None
        self._is_planned_before = False  # what begins may have been planned for another scene
        self._jobs: set[int] = set()
        self._job_id = 0

    def changed(self, scene: Scene, now: int) -> list[Outgoing]:
        """Take note that the scene is another."""
        cell = self._cell
        jog = cell.motions.driven_jog
        if jog is not None:
            jog.release(JogEnd.STOPPED, now)
            return []
        if cell.motion_activity is Activity.PLANNING:
            self._is_planned_before = True
            return []
        rows = cell.motions.playing
        return [] if rows is None else self._look_along(rows, scene, now)

    def began(self, now: int) -> list[Outgoing]:
        """Look along what moves after an answer of the planning process, where that may be due.

        An answer may be one that nobody waits for any more: as long as nothing moves, what is
        planned for the scene of before may still begin. The look is in the scene in force, so that
        it may take the place of any other.
        """
        motions = self._cell.motions
        rows = motions.playing
        if not self._is_planned_before or rows is None or motions.scene is None:
            return []
        self._is_planned_before = False
        return self._look_along(rows, motions.scene, now)

    def _look_along(self, rows: StoredRows, scene: Scene, now: int) -> list[Outgoing]:
        at = rows.path_time
        self._look = _Look(rows, scene, now, at + NEAR, at)
        return self._ask(self._look, at - self._behind, at + NEAR)

    def _ask(self, look: _Look, begins: float, ends: float) -> list[Outgoing]:
        out = self._withdraw()
        self._job_id = self._cell.motions.new_job_id()
        self._jobs.add(self._job_id)
        positions = look.rows.ahead(begins, ends)
        start = tuple(positions[0].tolist())
        out.append(Plan(WayCheckJob(self._job_id, start, positions.tobytes(), look.scene)))
        return out

    def _withdraw(self) -> list[Outgoing]:
        """Wait no longer for what was asked before, if it was not answered."""
        if self._job_id not in self._jobs:
            return []
        self._jobs.discard(self._job_id)
        return [Withdraw(self._job_id)]

    def planned(self, planned: Planned, now: int) -> list[Outgoing] | None:
        """Take the answer to a look.

        Returns:
            What follows; None where the answer is to another question.
        """
        if planned.job_id not in self._jobs:
            return None
        self._jobs.discard(planned.job_id)
        look = self._look
        playing = self._cell.motions.playing
        if look is None or planned.job_id != self._job_id or look.rows is not playing:
            return []
        if isinstance(planned.result, Refusal):
            self._look = None
            text = f"the scene was changed: {planned.result.sentence}"
            return self._cell.end(Refusal(planned.result.code, text), now)
        if look.rows.is_held:
            # It goes on by itself, so that who let go since the last tick must end it first.
            lost = self._cell.lost_enabling(now)
            if lost is not None:
                self._look = None
                return self._cell.end(lost, now)
            look.rows.let_go()
        if look.free_until >= look.near_end or look.rows.duration <= look.near_end:
            self._look = None
            return []
        look.free_until = look.near_end
        return self._ask(look, look.near_end - self._behind, math.inf)

    def tick(self, now: int) -> list[Outgoing]:
        """Hold the robot where an answer is late."""
        look = self._look
        if look is None:
            return []
        rows = look.rows
        if rows is not self._cell.motions.playing:
            self._look = None
            return self._withdraw()
        is_late = now - look.asked >= DEADLINE_NS
        # A robot that is paused is held too, or else a resume would send it on.
        if not is_late or rows.is_held or rows.path_time <= look.free_until - _ROOM:
            return []
        if rows.hold():
            return []
        # All set-points have left, so there is no path to be held on.
        self._look = None
        text = "the scene was changed, and it is not known in time whether the way is free"
        return self._cell.end(Refusal(VerdictCode.PATH_IN_COLLISION, text), now)
