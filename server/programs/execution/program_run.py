"""Program run: carries out the actions of its runner, and gives each request its one outcome.

Owns the requests that wait for the run or for a step of it, and the reports of its state. The next
statement is the runner's; permissions, and the end of a run from outside, are the executor's.

Owns the one block that is planned or moved: a pause during its planning holds it at its start, and
the index of its present move. The permission to move is the cell's.

Inputs, outputs and objects of the scene are a `RunEnvironment`, which a cell with signals or a
scene supplies. `BareEnvironment` is that of a cell with neither: it refuses by name, so that no
program waits for a signal that does not exist.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

from openpendant.simplemsg.pendant import ProgramReport, ProgramRun, ProgramState, RunKind
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.interlocks import check_interlocks
from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...control import Holder, MotionKind
from ...events.cell_events import (
    MotionEnded,
    MotionEvent,
    MotionOwner,
    MotionRefused,
    MotionRequest,
    MotionStarted,
    RunningProgram,
)
from ...events.effects import Effect, Send
from ...events.replies import cut, outcome
from ...planning.jobs import BlockJob
from ...refusal import Refusal
from ..interpreter import run_events as run
from ..interpreter.motion_blocks import MotionBlock
from ..interpreter.run_events import (
    AttachToTool,
    DetachFromTool,
    Event,
    InputValue,
    Offer,
    OfferedSignals,
    Passed,
    PauseReason,
    QueryInput,
    RequestAborted,
    RequestDone,
    RunState,
    RunStatus,
    WriteOutput,
)
from ..interpreter.runner import Runner
from ..language.linking import Linked

Rearranged = Callable[[Refusal | None], None]
"""Takes why an object was not attached or detached, None where it was; called once."""


class RunEnvironment(Protocol):
    """Signals and objects of one cell; each call returns a refusal if it is not possible."""

    @property
    def offered_signals(self) -> Offer:
        """Signals that there are."""

    def input(self, signal: int, now: int) -> bool | Refusal:
        """Return the value of an input."""

    def set_output(self, signal: int, value: bool, now: int) -> list[Effect] | Refusal:
        """Set an output."""

    def attach(self, scene_object: str, now: int, then: Rearranged) -> list[Effect]:
        """Attach an object to the tool; `then` may be called later."""

    def detach(self, scene_object: str, now: int, then: Rearranged) -> list[Effect]:
        """Detach an object where it is; `then` may be called later."""


class BareEnvironment:
    """Environment of a cell without signals and without a scene."""

    @property
    def offered_signals(self) -> Offer:
        """None of either kind."""
        return OfferedSignals(inputs=0, outputs=0)

    def input(self, signal: int, now: int) -> bool | Refusal:
        """Refuse: there is no such input."""
        return Refusal(VerdictCode.NO_SIGNAL, f"input {signal}: this cell has no inputs")

    def set_output(self, signal: int, value: bool, now: int) -> list[Effect] | Refusal:
        """Refuse: there is no such output."""
        return Refusal(VerdictCode.NO_SIGNAL, f"output {signal}: this cell has no outputs")

    def attach(self, scene_object: str, now: int, then: Rearranged) -> list[Effect]:
        """Refuse: there is no such object."""
        then(_no_object(scene_object))
        return []

    def detach(self, scene_object: str, now: int, then: Rearranged) -> list[Effect]:
        """Refuse: there is no such object."""
        then(_no_object(scene_object))
        return []


def carry_out(
    environment: RunEnvironment,
    action: QueryInput | WriteOutput | AttachToTool | DetachFromTool,
    answer: Callable[[Event], None],
    now: int,
) -> list[Effect]:
    """Carry out a program's request; `answer` takes the event for its runner, now or later."""

    def rearranged(refusal: Refusal | None) -> None:
        request = action.request
        answer(RequestDone(request) if refusal is None else RequestAborted(request, refusal))

    done: bool | list[Effect] | Refusal
    match action:
        case QueryInput(_, signal):
            done = environment.input(signal, now)
        case WriteOutput(_, signal, value):
            done = environment.set_output(signal, value, now)
        case AttachToTool(_, scene_object):
            return environment.attach(scene_object, now, rearranged)
        case DetachFromTool(_, scene_object):
            return environment.detach(scene_object, now, rearranged)
    if isinstance(done, Refusal):
        answer(RequestAborted(action.request, done))
        return []
    if isinstance(done, bool):
        answer(InputValue(action.request, done))
        return []
    answer(RequestDone(action.request))
    return done


def _no_object(name: str) -> Refusal:
    return Refusal(VerdictCode.UNKNOWN_OBJECT, f"object {name!r}: this cell has no scene")


_NAME_BYTES = 64
_TEXT_BYTES = 160

_PAUSES = {
    PauseReason.BREAKPOINT: ProgramState.AT_BREAKPOINT,
    PauseReason.STEP: ProgramState.STEPPED,
}


def program_state(status: RunStatus) -> ProgramState:
    """Return the state of a program; NONE before its start and after its end."""
    match status.state:
        case RunState.RUNNING:
            return ProgramState.RUNNING
        case RunState.PAUSED:
            return _PAUSES.get(status.pause, ProgramState.PAUSED)
    return ProgramState.NONE


def running_program(linked: Linked, status: RunStatus) -> RunningProgram | None:
    """Return what everybody may see of a program; None where it is not under way."""
    state = program_state(status)
    if state is ProgramState.NONE:
        return None
    name, line = _place(linked, status)
    return RunningProgram(name, state, line, linked.revisions[name])


def program_report(linked: Linked, status: RunStatus, ended: Refusal | None) -> ProgramReport:
    """Return the message with the place of a program's run."""
    name, line = _place(linked, status)
    return ProgramReport(
        state=program_state(status),
        line=line,
        loop=status.passes,
        revision=linked.revisions[name],
        program=cut(name, _NAME_BYTES),
        text=cut(_text(status, ended), _TEXT_BYTES),
    )


def noted(report: ProgramReport, text: str) -> ProgramReport:
    """Return the report with an additional sentence."""
    return replace(report, text=cut(text, _TEXT_BYTES))


def _place(linked: Linked, status: RunStatus) -> tuple[str, int]:
    """Return the program and line of the run, line 0 before and after it."""
    if not status.stack:
        return linked.main, 0
    return status.stack[-1].program, status.stack[-1].line


def _text(status: RunStatus, ended: Refusal | None) -> str:
    refusal = ended or status.failure
    if refusal is not None:
        return refusal.sentence
    if status.state is RunState.FINISHED:
        return "finished"
    if status.approaching:
        return "on the slow way to its first point"
    return ""


def start_index(linked: Linked, line: int) -> int | Refusal:
    """Return the number of the statement on a line, from 0; of the first for line 0."""
    lines = linked.lines[linked.main]
    if not line:
        return 0
    if line in lines:
        return lines.index(line)
    accepted = f"0, or {lines[0]} to {lines[-1]}" if lines else "0, the program is empty"
    text = f"no statement is on line {line} of {linked.main!r}; accepted: {accepted}"
    return Refusal(VerdictCode.BAD_ARGUMENT, text, value=line)


@dataclass(slots=True)
class _Block:
    """Block that the cell has; `number` is the runner's for it."""

    number: int
    started: bool = False
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
        """Request a block from the cell, to be planned and moved."""
        cell = self._cell
        if not self.is_permitted:
            refusal = check_interlocks(cell, self._by.session, now, MotionKind.PROGRAM)
            if refusal is not None:
                return refusal
        job = BlockJob(
            cell.motions.new_job_id(),
            cell.feedback.standing_at,
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
        if block.started:
            # Refused only where all points have been sent: then the robot rests at the block's end.
            self._cell.motions.pause(self._by, now)
        else:
            block.pause_wanted = True

    def resume_fault(self, now: int) -> Refusal | None:
        """Return the reason why the run may not continue now."""
        cell, session = self._cell, self._by.session
        if self._block is None:
            return check_interlocks(cell, session, now, MotionKind.PROGRAM)
        return cell.modes.unready(MotionKind.PROGRAM, session, cell.feedback.mode, now)

    def resume(self, now: int) -> None:
        """Continue along the path, after `resume_fault` returned None."""
        block = self._block
        if block is None:
            return
        if block.started:
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

    def on_cell_event(self, cell_event: MotionEvent, now: int) -> Event | None:
        """Take the start or end of a block; return the event for the runner."""
        block = self._block
        if block is None or block.number != cell_event.request.program:
            return None
        match cell_event:
            case MotionStarted():
                block.started = True
                if block.pause_wanted:
                    self._cell.motions.pause(self._by, now)
                return None
            case MotionRefused(refusal=refusal):
                self._block = None
                return RequestAborted(block.number, refusal)
            case MotionEnded(refusal=ended):
                self._block = None
                self.plan_time += cell_event.plan_time
                self.motion_time += cell_event.motion_time
                return (
                    RequestDone(block.number)
                    if ended is None
                    else RequestAborted(block.number, ended)
                )

    def passed(self) -> Passed | None:
        """Return the event that another move of the block was passed since the last call."""
        block = self._block
        if block is None or not block.started:
            return None
        passed = self._cell.motions.waypoints_passed
        if passed <= block.passed:
            return None
        block.passed = passed
        return Passed(block.number, passed - 1)


Report = Callable[[run.RunStatus, Refusal | None, int], list[Effect]]
"""Reports the state of the run to every pendant, and what ended it from outside, at a time [ns]."""


@dataclass(slots=True)
class ProgramExecution:
    """A program under way.

    Attributes:
        loops: number of passes requested; 0 for until it is stopped.
        is_over: True once the run ended; later events have no effect.
    """

    linked: Linked
    by: Holder
    motion: ProgramMotion
    environment: RunEnvironment
    report: Report
    loops: int
    is_over: bool = False
    runner: Runner = field(init=False)
    _places: dict[str, frozenset[int]] = field(default_factory=dict)
    _whole: list[int] = field(default_factory=list)
    _steps: list[int] = field(default_factory=list)
    # Passed on in the next tick, so that a program that only asks does not hold up the server.
    _answers: list[run.Event] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.runner = Runner(self.linked)

    @property
    def is_stepping(self) -> bool:
        """True while a step is in progress, or held by a pause."""
        return self.runner.is_stepping

    def pause_before(self, places: Mapping[str, frozenset[int]], now: int) -> None:
        """Replace the statements of these programs to pause before."""
        self._places.update(places)
        named = self._places.items()
        wanted = frozenset((name, index) for name, indexes in named for index in indexes)
        self.runner.handle(run.ReplaceBreakpoints(wanted), now)

    def note_request(self, message: ProgramRun) -> None:
        """Record a request that ends with the run, or with the step."""
        requests = self._whole if message.run == RunKind.ALL else self._steps
        requests.append(message.request_id)

    def handle(self, event: run.Event, now: int) -> list[Effect]:
        """Pass an event to the runner, and carry out its actions."""
        return self.perform(self.runner.handle(event, now), now)

    def on_cell_event(self, cell_event: MotionEvent, now: int) -> list[Effect]:
        """Take the start or end of a motion of this run, or of one before it."""
        event = self.motion.on_cell_event(cell_event, now)
        return [] if event is None else self.handle(event, now)

    def tick(self, now: int) -> list[Effect]:
        """Pass on answers, the place on the path, and the time."""
        answers, self._answers = self._answers, []
        passed = self.motion.passed()
        events: list[run.Event] = [
            *answers,
            *([] if passed is None else [passed]),
            run.TimePassed(),
        ]
        out: list[Effect] = []
        for event in events:
            if not self.is_over:
                out += self.handle(event, now)
        return out

    def end(self, refusal: Refusal, now: int) -> list[Effect]:
        """End the run for an outside reason; the robot is stopped, if it moves for it."""
        out = self.motion.end(refusal, now)
        return out + self.perform(self.runner.handle(run.Stop(), now), now, ended=refusal)

    def perform(
        self, actions: list[run.Action], now: int, ended: Refusal | None = None
    ) -> list[Effect]:
        """Carry out the runner's actions, report, and answer the requests that they complete."""
        out: list[Effect] = []
        for action in actions:
            match action:
                case run.RequestMotion(number, block):
                    known = self.linked.lines
                    lines = tuple(known[move.program][move.index] for move in block.moves)
                    asked = self.motion.begin(number, block, lines, now)
                    if isinstance(asked, Refusal):
                        self._answers.append(run.RequestAborted(number, asked))
                    else:
                        out += asked
                case run.PauseMotion():
                    self.motion.pause(now)
                case run.ResumeMotion():
                    self.motion.resume(now)
                case (
                    run.QueryInput() | run.WriteOutput() | run.AttachToTool() | run.DetachFromTool()
                ):
                    out += carry_out(self.environment, action, self._take_answer, now)
                case run.RunReport(status):
                    out += self.report(status, ended, now)
        return out + self._close(ended)

    def _take_answer(self, event: run.Event) -> None:
        self._answers.append(event)

    def _close(self, ended: Refusal | None) -> list[Effect]:
        """Send the outcome of requests that the present state of the run completes."""
        status = self.runner.status
        over = status.state not in (run.RunState.RUNNING, run.RunState.PAUSED)
        stepped = status.pause in (run.PauseReason.STEP, run.PauseReason.BREAKPOINT)
        requests: list[int] = []
        if over or stepped:
            requests, self._steps = self._steps, []
        if over and not self.is_over:
            requests += self._whole
            self.is_over = True
        refusal = ended or status.failure
        return [self._outcome(request_id, refusal) for request_id in requests]

    def _outcome(self, request_id: int, refusal: Refusal | None) -> Send:
        request = MotionRequest(self.by.session, request_id)
        times = self.motion.plan_time, self.motion.motion_time
        return Send(self.by.session, outcome(MotionEnded(request, refusal, *times)))
