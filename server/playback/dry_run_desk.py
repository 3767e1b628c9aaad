"""Dry runs as pendants ask for them: what would happen if a program ran, while nothing moves.

Owns the one dry run of a cell: it goes to the planning process slice by slice, so that motions are
planned in between; `planning.dry_run_answer` cuts its findings to what fits an answer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count

from openpendant.simplemsg.verdicts import VerdictCode

from ..outgoing import Outgoing, Plan
from ..planning.jobs import DryRunFound, DryRunJob, DryRunSlice, Planned
from ..programs.linking import Linked
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..robot_view import RobotView
from ..world.offered_signals import Offer
from .operations import Asker
from .shelf import ProgramShelf


@dataclass(slots=True)
class _DryRun:
    """The dry run under way."""

    asker: Asker
    linked: Linked | None = None
    job: DryRunJob | None = None
    planned: int = 0


class DryRunDesk:
    """The dry runs of one cell."""

    def __init__(
        self,
        cell: RobotCell,
        robot: RobotView,
        shelf: ProgramShelf,
        signals: Callable[[], Offer],
        name: str,
    ) -> None:
        """Make a desk.

        Args:
            cell: knows where the robot stands.
            robot: knows the frames.
            shelf: the programs.
            signals: tells which signals the controller has.
            name: of the cell.
        """
        self._cell = cell
        self._robot = robot
        self._shelf = shelf
        self._signals = signals
        self._name = name
        self._numbers = count(1)
        self._current: _DryRun | None = None

    def start(self, program: str, asker: Asker) -> list[Outgoing]:
        """Begin a dry run; the answer comes when it is done."""
        if self._current is not None:
            text = "a dry run is under way; accepted: after it"
            return asker.refuse(Refusal(VerdictCode.PROGRAM_RUNNING, text))
        if self._cell.feedback.position is None:
            return asker.refuse(Refusal(VerdictCode.FEEDBACK_STALE))
        self._current = current = _DryRun(asker)
        return self._shelf.fetch_linked(program, lambda found, _: self._loaded(current, found))

    def _loaded(self, current: _DryRun, linked: Linked | Refusal) -> list[Outgoing]:
        position = self._cell.feedback.position
        if isinstance(linked, Refusal) or position is None:
            self._current = None
            refusal = linked if isinstance(linked, Refusal) else None
            return current.asker.refuse(refusal or Refusal(VerdictCode.FEEDBACK_STALE))
        run_id = f"{self._name} {next(self._numbers)}"
        cap = self._cell.modes.tool_speed_cap(self._cell.mode)
        current.linked = linked
        frames, scene = self._robot.frames, self._cell.motions.scene
        current.job = DryRunJob(
            0, run_id, tuple(position), linked, frames, cap, scene, self._signals()
        )
        return self._next_slice(current, current.job)

    def _next_slice(self, current: _DryRun, before: DryRunJob) -> list[Outgoing]:
        job = replace(before, job_id=self._cell.motions.new_job_id())
        current.job = job
        return [Plan(job)]

    def progress(self, asker: Asker) -> list[Outgoing]:
        """Tell how far the dry run is."""
        current = self._current
        return asker.answer(
            running=current is not None, blocks=0 if current is None else current.planned
        )

    def planned(self, planned: Planned) -> list[Outgoing] | None:
        """Take an answer of the planning process; None where it is not to a dry run of ours."""
        current = self._current
        if current is None or current.job is None or current.job.job_id != planned.job_id:
            return None
        match planned.result:
            case DryRunSlice(planned=blocks):
                current.planned = max(current.planned, blocks)
                return self._next_slice(current, current.job)
            case DryRunFound() as found:
                self._current = None
                return current.asker.answer(**told(current.job.linked, found))
            case Refusal() as refusal:
                self._current = None
                return current.asker.refuse(refusal)
        return None


def told(linked: Linked, found: DryRunFound) -> dict[str, object]:
    """Return the findings as JSON data that fits an answer, where they were shortened before."""
    run = found.run
    lines = linked.lines
    return {
        "program": linked.main,
        "revision": linked.revisions[linked.main],
        "duration": run.duration,
        "endless": run.endless,
        "complete": run.complete,
        "refused": found.refused,
        "moves": [
            {
                "program": each.program,
                "line": lines[each.program][each.index],
                "point": each.point,
                "zone_used": each.zone_used,
                **_refused(each.refusal),
            }
            for each in run.moves
        ],
        "scene": [
            {
                "program": each.program,
                "line": lines[each.program][each.index],
                "does": each.statement.statement,
                "object": each.statement.scene_object,
                **_refused(each.refusal),
            }
            for each in run.hand_overs
        ],
        "statements": [
            {
                "program": each.program,
                "line": lines[each.program][each.index],
                "does": each.statement.statement,
                **_refused(each.refusal),
            }
            for each in run.statements
        ],
        "unchecked": [
            {"program": name, "line": lines[name][index]} for name, index in run.unchecked
        ],
        "points": [{"point": each.point, **_refused(each.refusal)} for each in found.points],
        "not_walked": [
            {"program": name, "line": lines[name][index]} for name, index in run.not_walked
        ],
        "path": [[round(value, 6) for value in sample] for sample in run.path],
    }


def _refused(refusal: Refusal | None) -> dict[str, object]:
    if refusal is None:
        return {"reachable": True}
    return {"reachable": False, "code": int(refusal.code), "text": refusal.sentence}
