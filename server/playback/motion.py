"""The motions of a program's run: each block asked of the cell, and what became of it.

Owns the one block that is planned or moved: that a pause asked for while it is planned holds it at
its start, and which of its moves is under way. Whether it may move is the cell's business.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..authority import Holder
from ..news import Begun, Ended, Refused, Request
from ..operating_mode import MotionKind
from ..outgoing import Outgoing
from ..planning.jobs import BlockJob
from ..programs.motion_blocks import MotionBlock
from ..programs.run_messages import Aborted, Done, Event, Passed
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..robot_view import RobotView


@dataclass(slots=True)
class _Block:
    """The block that the cell has; `number` is the runner's for it."""

    number: int
    begun: bool = False
    pause_wanted: bool = False
    passed: int = 0


class ProgramMotion:
    """The motions of one run.

    Attributes:
        plan_time: wall time that planning took so far [s].
        motion_time: planned duration of the motions that ended [s].
        speed: fraction of the programmed speeds of the blocks from now on.
    """

    def __init__(
        self, cell: RobotCell, robot: RobotView, by: Holder, request_id: int, speed: float
    ) -> None:
        """Begin without a motion.

        Args:
            cell: moves the robot.
            robot: knows the frames.
            by: who runs the program, and holds the authority.
            request_id: the request that is shown as moving.
            speed: fraction of the programmed speeds.
        """
        self.plan_time = 0.0
        self.motion_time = 0.0
        self.speed = speed
        self._cell = cell
        self._robot = robot
        self._by = by
        self._request_id = request_id
        self._block: _Block | None = None

    @property
    def is_asked(self) -> bool:
        """Whether the cell plans or moves a block."""
        return self._block is not None

    def begin(
        self, number: int, block: MotionBlock, lines: tuple[int, ...], now: int
    ) -> Refusal | list[Outgoing]:
        """Have a block planned and moved.

        Args:
            number: the runner's number for it.
            block: the moves.
            lines: the line of each.
            now: monotonic time, ns.

        Returns:
            Why it may not move, or what follows.
        """
        cell = self._cell
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
            cell.modes.tool_speed_cap(cell.mode),
        )
        self._block = _Block(number)
        request = Request(self._by.session, self._request_id, number)
        return cell.motions.ask(request, job, MotionKind.PROGRAM)

    def pause(self, now: int) -> None:
        """Come to rest on the path; before its start, do not leave it."""
        block = self._block
        if block is None:
            return
        if block.begun:
            # Refused only where all has left: then the robot comes to rest at the block's end.
            self._cell.motions.pause(self._by, now)
        else:
            block.pause_wanted = True

    def resume_fault(self, now: int) -> Refusal | None:
        """Return why the run may not go on now."""
        cell, session = self._cell, self._by.session
        if self._block is None:
            return cell.check(session, now, MotionKind.PROGRAM)
        return cell.modes.unready(MotionKind.PROGRAM, session, cell.mode, now)

    def resume(self, now: int) -> None:
        """Go on along the path; `resume_fault` has nothing against it."""
        block = self._block
        if block is None:
            return
        if block.begun:
            self._cell.motions.resume(self._by, now)
        else:
            block.pause_wanted = False

    def end(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """Have the robot stopped, where it moves for this run."""
        asked = self._cell.request
        if self._block is None or asked is None or asked.program != self._block.number:
            return []
        self._block = None
        return self._cell.end(refusal, now)

    def news(self, news: Begun | Refused | Ended, now: int) -> Event | None:
        """Take what became of a block; return what the runner is to be told."""
        block = self._block
        if block is None or block.number != news.request.program:
            return None
        match news:
            case Begun():
                block.begun = True
                if block.pause_wanted:
                    self._cell.motions.pause(self._by, now)
                return None
            case Refused(refusal=refusal):
                self._block = None
                return Aborted(block.number, refusal)
            case Ended(refusal=ended):
                self._block = None
                self.plan_time += news.plan_time
                self.motion_time += news.motion_time
                return Done(block.number) if ended is None else Aborted(block.number, ended)

    def passed(self) -> Passed | None:
        """Return that another move of the block was passed, where one was since the last call."""
        block = self._block
        if block is None or not block.begun:
            return None
        passed = self._cell.motions.waypoints_passed
        if passed <= block.passed:
            return None
        block.passed = passed
        return Passed(block.number, passed - 1)
