"""Block motion of a program's run: the motion of each block, requested from the cell.

Owns the one block that is planned or moved: a pause during its planning holds it at its start, and
the index of its present move. The permission to move is the cell's.
"""

from __future__ import annotations

from dataclasses import dataclass

from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...control.authority import Holder
from ...control.modes import MotionKind
from ...events.cell_events import (
    MotionEnded,
    MotionEvent,
    MotionOwner,
    MotionRefused,
    MotionRequest,
    MotionStarted,
)
from ...events.effects import Effect
from ...planning.jobs import BlockJob
from ...refusal import Refusal
from ..interpreter.motion_blocks import MotionBlock
from ..interpreter.run_events import Event, Passed, RequestAborted, RequestDone


@dataclass(slots=True)
class _Block:
    """Block that the cell has; `number` is the runner's for it."""

    number: int
    begun: bool = False
    pause_wanted: bool = False
    passed: int = 0


class ProgramMotion:
    """Motions of one run.

    Attributes:
        plan_time: wall time that planning took so far [s].
        motion_time: planned duration of the motions that ended [s].
        speed: fraction of the programmed speeds of the blocks from now on.
        is_permitted: True if the interlocks were checked on this call stack, and hold.
    """

    def __init__(
        self, cell: RobotCell, robot: RobotModel, by: Holder, request_id: int, speed: float
    ) -> None:
        self.plan_time = 0.0
        self.motion_time = 0.0
        self.speed = speed
        self.is_permitted = False
        self._cell = cell
        self._robot = robot
        self._by = by
        self._request_id = request_id
        self._block: _Block | None = None

    @property
    def is_asked(self) -> bool:
        """True while the cell plans or moves a block."""
        return self._block is not None

    def begin(
        self, number: int, block: MotionBlock, lines: tuple[int, ...], now: int
    ) -> Refusal | list[Effect]:
        """Request a block from the cell, to be planned and moved.

        Args:
            number: the runner's number for it.
        """
        cell = self._cell
        if not self.is_permitted:
            refusal = cell.check(self._by.session, now, MotionKind.PROGRAM)
            if refusal is not None:
                return refusal
        job = BlockJob(
            cell.motions.new_job_id(),
            cell.standing_at,
            block,
            lines,
            self._robot.frames,
            self.speed,
            cell.modes.tool_speed_cap(cell.feedback.mode),
        )
        self._block = _Block(number)
        request = MotionRequest(self._by.session, self._request_id, number, MotionOwner.PROGRAM)
        return cell.motions.ask(request, job, MotionKind.PROGRAM)

    def pause(self, now: int) -> None:
        """Pause the block: stop on its path, or hold it at its start."""
        block = self._block
        if block is None:
            return
        if block.begun:
            # Refused only where all points have been sent: then the robot rests at the block's end.
            self._cell.motions.pause(self._by, now)
        else:
            block.pause_wanted = True

    def resume_fault(self, now: int) -> Refusal | None:
        """Return the reason why the run may not continue now."""
        cell, session = self._cell, self._by.session
        if self._block is None:
            return cell.check(session, now, MotionKind.PROGRAM)
        return cell.modes.unready(MotionKind.PROGRAM, session, cell.feedback.mode, now)

    def resume(self, now: int) -> None:
        """Continue along the path, after `resume_fault` returned None."""
        block = self._block
        if block is None:
            return
        if block.begun:
            self._cell.motions.resume(self._by, now)
        else:
            block.pause_wanted = False

    def end(self, refusal: Refusal, now: int) -> list[Effect]:
        """Stop the robot, if it moves for this run."""
        asked = self._cell.driving.request
        if self._block is None or asked is None or asked.program != self._block.number:
            return []
        self._block = None
        return self._cell.end(refusal, now)

    def on_cell_event(self, news: MotionEvent, now: int) -> Event | None:
        """Take the start or end of a block; return the event for the runner."""
        block = self._block
        if block is None or block.number != news.request.program:
            return None
        match news:
            case MotionStarted():
                block.begun = True
                if block.pause_wanted:
                    self._cell.motions.pause(self._by, now)
                return None
            case MotionRefused(refusal=refusal):
                self._block = None
                return RequestAborted(block.number, refusal)
            case MotionEnded(refusal=ended):
                self._block = None
                self.plan_time += news.plan_time
                self.motion_time += news.motion_time
                return (
                    RequestDone(block.number)
                    if ended is None
                    else RequestAborted(block.number, ended)
                )

    def passed(self) -> Passed | None:
        """Return the event that another move of the block was passed since the last call."""
        block = self._block
        if block is None or not block.begun:
            return None
        passed = self._cell.motions.waypoints_passed
        if passed <= block.passed:
            return None
        block.passed = passed
        return Passed(block.number, passed - 1)
