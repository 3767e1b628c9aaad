"""Dry-run requests of pendants: what a program would do, while nothing moves.

Owns the one dry run of a cell. It goes to the planning process in slices, so that motions are
planned in between; `dry_run_planning` cuts its findings to the size of an answer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count
from typing import Any, cast

from openpendant.motion.trajectory.certificate import Certificate
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.simplemsg.pendant.management import programs as op
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...events.effects import Effect
from ...events.management_requests import ReplyTo, handles
from ...events.pending import Pending, Steps
from ...planning.jobs import CertifiedTrajectory, DryRunFound, DryRunJob, DryRunSlice
from ...refusal import Refusal
from ..language.linking import Linked
from ..library.program_loader import ProgramLoader
from .program_executor import ProgramExecutor


@dataclass(slots=True)
class _DryRun:
    """The dry run under way."""

    reply_to: ReplyTo[op.DryRun]
    planned: int = 0
    preview: tuple[Trajectory, Certificate] | None = None


KeepPreview = Callable[
    [int, str, str, CertifiedTrajectory, int], tuple[int, list[Effect]] | Refusal
]
"""Keeps the motions of a dry run as a plan of a connection, with its name and that of the program,
at a time [ns]; returns the plan's number and who is told, or why it is not kept."""


class DryRunService:
    """Dry runs of one cell."""

    def __init__(
        self,
        cell: RobotCell,
        robot: RobotModel,
        loader: ProgramLoader,
        executor: ProgramExecutor,
        pending: Pending,
        name: str,
        keep_preview: KeepPreview,
    ) -> None:
        """Make a service of which no dry run is under way.

        Args:
            keep_preview: keeps the motions of a dry run as a plan to be looked at.
        """
        self._cell = cell
        self._robot = robot
        self._loader = loader
        self._executor = executor
        self._pending = pending
        self._name = name
        self._keep_preview = keep_preview
        self._numbers = count(1)
        self._current: _DryRun | None = None

    @handles(op.StartDryRun)
    def start(self, asked: op.StartDryRun, reply_to: ReplyTo[op.DryRun], now: int) -> list[Effect]:
        """Start a dry run; the answer follows when it is done."""
        if self._current is not None:
            text = "a dry run is under way; accepted: after it"
            return reply_to.refuse(Refusal(VerdictCode.PROGRAM_RUNNING, text))
        if self._cell.feedback.position is None:
            return reply_to.refuse(Refusal(VerdictCode.FEEDBACK_STALE))
        self._current = current = _DryRun(reply_to)
        steps = self._found(asked.name, current, wants_samples=asked.samples)
        return self._pending.run(steps, self._end, now)

    def _found(
        self, program: str, current: _DryRun, *, wants_samples: bool
    ) -> Steps[op.DryRun | Refusal]:
        """Load a program and walk through it slice by slice; return what an answer says of it."""
        linked = yield from self._loader.linked(program)
        position = self._cell.feedback.position
        if isinstance(linked, Refusal):
            return linked
        if position is None:
            return Refusal(VerdictCode.FEEDBACK_STALE)
        run_id = f"{self._name} {next(self._numbers)}"
        cap = self._cell.modes.tool_speed_cap(self._cell.feedback.mode)
        frames, scene = self._robot.frames, self._cell.motions.scene
        signals = self._executor.environment.offered_signals
        first = DryRunJob(
            *(0, run_id, tuple(position), linked, frames, cap, scene, signals),
            samples=wants_samples,
        )
        while True:
            planned = yield replace(first, job_id=self._cell.motions.new_job_id())
            match planned.result:
                case DryRunSlice(planned=blocks):
                    current.planned = max(current.planned, blocks)
                case DryRunFound() as found:
                    reply = dry_run_reply(linked, found, current.reply_to.code)
                    if wants_samples:
                        current.preview = planned.preview
                        reply["plan"] = None
                    return reply
                case Refusal() as refusal:
                    return refusal

    def _end(self, found: op.DryRun | Refusal, now: int) -> list[Effect]:
        current, self._current = self._current, None
        assert current is not None
        reply_to = current.reply_to
        if isinstance(found, Refusal):
            return reply_to.refuse(found)
        if current.preview is None:
            return reply_to.answer(found)
        certified = CertifiedTrajectory(*current.preview)
        kept = self._keep_preview(reply_to.session, reply_to.name, found["program"], certified, now)
        if isinstance(kept, Refusal):
            return reply_to.refuse(kept)
        found["plan"], out = kept
        return reply_to.answer(found) + out

    @handles(op.AskDryRunProgress)
    def progress(
        self, asked: op.AskDryRunProgress, reply_to: ReplyTo[op.DryRunProgress], now: int
    ) -> list[Effect]:
        """Return the progress of the dry run."""
        current = self._current
        blocks = 0 if current is None else current.planned
        return reply_to.answer({"running": current is not None, "blocks": blocks})


def dry_run_reply(
    linked: Linked, found: DryRunFound, known: Callable[[VerdictCode], int]
) -> op.DryRun:
    """Return the findings as JSON data that fits an answer, where they were shortened before.

    Args:
        known: returns the number by which whoever asked knows a code.
    """
    run = found.run

    def fate(refusal: Refusal | None) -> dict[str, object]:
        if refusal is None:
            return {"reachable": True}
        return {"reachable": False, "code": known(refusal.code), "text": refusal.sentence}

    def place(program: str, index: int) -> dict[str, Any]:
        return {"program": program, "line": linked.lines[program][index]}

    findings: dict[str, Any] = {
        "program": linked.main,
        "revision": linked.revisions[linked.main],
        "duration": run.duration,
        "endless": run.endless,
        "complete": run.complete,
        "refused": found.refused,
        "moves": [
            place(each.program, each.index)
            | {"point": each.point, "zone_used": each.zone_used}
            | fate(each.refusal)
            for each in run.moves
        ],
        "scene": [
            place(each.program, each.index)
            | {"does": each.statement.statement, "object": each.statement.scene_object}
            | fate(each.refusal)
            for each in run.hand_overs
        ],
        "statements": [
            place(each.program, each.index)
            | {"does": each.statement.statement}
            | fate(each.refusal)
            for each in run.statements
        ],
        "unchecked": [place(*each) for each in run.unchecked],
        "points": [{"point": each.point, **fate(each.refusal)} for each in found.points],
        "not_walked": [place(*each) for each in run.not_walked],
        "path": [[round(value, 6) for value in sample] for sample in run.path],
    }
    return cast(op.DryRun, findings)
