"""Scene monitor: the check of the remaining path when the scene changes during a motion.

Owns promise 17: a planning process checks the remaining path again, its next seconds first. A
motion that would collide is stopped as soon as that is known. If the answer takes longer than the
deadline, or the robot comes near an unchecked part, the robot is held on its path until the answer
arrives. This hold is independent of a person's pause: neither ends the other. A jog in progress was
checked against the old scene, so it ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from openpendant.motion.scene.scene import Scene
from openpendant.simplemsg.pendant import Activity, JogEnd
from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.execution.setpoint_sources import StoredRows
from ..cell.robot_cell import RobotCell
from ..events.effects import Effect
from ..events.pending import Pending
from ..planning.jobs import PlanAnswer, WayCheckJob
from ..refusal import Refusal
from ..settings.cell_settings import ControllerLink

DEADLINE_NS = 50_000_000
"""Longest wait for the answer of a check before the robot is held [ns]."""

NEAR = 3.0
"""Length of the part of the path that is checked first [s]."""

_ROOM = 1.0
"""Distance to the end of the checked part at which the robot is held [s]; it stops in less."""


@dataclass(slots=True)
class _Look:
    """Check of the remaining path of a motion.

    Attributes:
        near_end: end of the part that is checked first, as a time of the motion [s].
        free_until: time of the motion until which the path is known to be free [s].
    """

    rows: StoredRows
    scene: Scene
    asked: int
    near_end: float
    free_until: float


class SceneMonitor:
    """Watches the motion of one cell while its scene changes.

    Attributes:
        is_planned_before: the next motion may have been planned for an older scene.
    """

    def __init__(self, cell: RobotCell, link: ControllerLink, pending: Pending) -> None:
        """Make a monitor without a check."""
        self._cell = cell
        self._pending = pending
        # Longest time that the robot may be behind the last set-point sent [s].
        self._behind = link.planned_lead + link.abort_age_ns / 1e9
        self._look: _Look | None = None
        self.is_planned_before = False
        self._job_id = 0

    def changed(self, scene: Scene, now: int, asked: int | None = None) -> list[Effect]:
        """Check the motion in progress against the changed scene; a jog ends.

        Args:
            asked: when the change was asked for, which is when the deadline begins to run [ns];
                now where left out.
        """
        cell = self._cell
        jog = cell.driving.driven_jog
        if jog is not None:
            jog.release(JogEnd.STOPPED, now)
            return []
        if cell.driving.activity is Activity.PLANNING:
            self.is_planned_before = True
            return []
        rows = cell.motions.playing
        if rows is None:
            return []
        return self._look_along(rows, scene, now if asked is None else asked)

    def announced(self, now: int) -> list[Effect]:
        """Take note that objects are being added: `changed` will come with the scene, or the old.

        Until then the motion in progress counts as unchecked; a jog ends.
        """
        jog = self._cell.driving.driven_jog
        if jog is not None:
            jog.release(JogEnd.STOPPED, now)
            return []
        rows = self._cell.motions.playing
        if rows is None:
            return []
        at = rows.path_time
        self._look = _Look(rows, Scene(), now, at, at)
        # What was asked before is about a scene that is no longer the one that counts.
        return self._pending.cancel(self._job_id)

    def motion_started(self, now: int) -> list[Effect]:
        """Check a motion that started after the scene changed during its planning.

        The answer of the planning process may be a cancelled one: while nothing moves, a motion
        planned for the old scene may still start. The check uses the scene in force, so it may
        replace any other check.
        """
        motions = self._cell.motions
        rows = motions.playing
        if not self.is_planned_before or rows is None or motions.scene is None:
            return []
        self.is_planned_before = False
        return self._look_along(rows, motions.scene, now)

    def _look_along(self, rows: StoredRows, scene: Scene, asked: int) -> list[Effect]:
        at = rows.path_time
        self._look = _Look(rows, scene, asked, at + NEAR, at)
        return self._ask(self._look, at - self._behind, at + NEAR)

    def _ask(self, look: _Look, begins: float, ends: float) -> list[Effect]:
        # The question of before is obsolete if it is still unanswered.
        out = self._pending.cancel(self._job_id)
        self._job_id = self._cell.motions.new_job_id()
        positions = look.rows.ahead(begins, ends)
        start = tuple(positions[0].tolist())
        job = WayCheckJob(self._job_id, start, positions.tobytes(), look.scene)
        return out + self._pending.ask(job, self._looked)

    def _looked(self, planned: PlanAnswer, now: int) -> list[Effect]:
        """Take the answer to a check."""
        look = self._look
        playing = self._cell.motions.playing
        if look is None or look.rows is not playing:
            return []
        if isinstance(planned.result, Refusal):
            self._look = None
            text = f"the scene was changed: {planned.result.sentence}"
            return self._cell.end(Refusal(planned.result.code, text), now)
        if look.rows.is_held:
            # The motion resumes without a person, so a release of the enabling device since the
            # last tick must end it first.
            lost = self._cell.hold_to_run.lost_enabling(now)
            if lost is not None:
                self._look = None
                return self._cell.end(lost, now)
            look.rows.let_go()
        if look.free_until >= look.near_end or look.rows.duration <= look.near_end:
            self._look = None
            return []
        look.free_until = look.near_end
        return self._ask(look, look.near_end - self._behind, math.inf)

    def tick(self, now: int) -> list[Effect]:
        """Hold the robot where an answer is late."""
        look = self._look
        if look is None:
            return []
        rows = look.rows
        if rows is not self._cell.motions.playing:
            self._look = None
            return self._pending.cancel(self._job_id)
        is_late = now - look.asked >= DEADLINE_NS
        # A paused robot is held too: otherwise a resume would let it enter the unchecked part.
        if not is_late or rows.is_held or rows.path_time <= look.free_until - _ROOM:
            return []
        if rows.hold():
            return []
        # All set-points have been sent, so the robot cannot be held on the path.
        self._look = None
        text = "the scene was changed, and it is not known in time whether the way is free"
        return self._cell.end(Refusal(VerdictCode.PATH_IN_COLLISION, text), now)
