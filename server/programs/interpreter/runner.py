"""Program runner: events in, actions out; and the run of a program from its start to its end.

The runner owns the requests allowed in each state, breakpoints, and the published status. It moves
nothing: it asks for motions, signals and objects, and continues when an event reports them done.
After a stop or a failure nothing continues by itself; a start makes a new run. Knows no socket, no
planner and no clock: `now` is monotonic time [ns].

The run owns the present statement and the effect of its answer; how a pause holds it and how it
resumes; its position between two statements, its stop before one, and the number of statements
without duration that it passes at once on the way to the next one with duration. A program may hold
thousands of them in a row, and every robot of the server is served in the same tick; so a run
passes `MOST_INSTANT_AT_ONCE` and continues there in the next tick.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from enum import Enum, auto
from itertools import count

from openpendant.simplemsg.pendant.management.program_values import BadValue
from openpendant.simplemsg.pendant.management.statements import (
    MOST_PASSES,
    Attach,
    Detach,
    IfInput,
    Move,
    ReadInput,
    SetOutput,
    Statement,
    Wait,
    WaitInput,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from ..language.grammar import statement_text
from ..language.linking import Linked
from .control_flow import ControlFlow, Position
from .motion_blocks import (
    MOST_INSTANT_AT_ONCE,
    MOST_INSTANT_STATEMENTS,
    ExecutedMoves,
    Gathered,
    Gatherer,
    flag_not_read,
    going_round,
)
from .run_events import (
    Action,
    Event,
    EventRefused,
    Failed,
    Finished,
    InputValue,
    Passed,
    Pause,
    PauseMotion,
    PauseReason,
    QueryInput,
    ReplaceBreakpoints,
    RequestAborted,
    RequestDone,
    RequestMotion,
    Resume,
    ResumeMotion,
    RunPlace,
    RunReport,
    RunState,
    RunStatus,
    Start,
    StepBack,
    StepForward,
    Stop,
    StopMotion,
    TimePassed,
)
from .run_tasks import (
    InputTask,
    MotionTask,
    QuestionTask,
    RequestTask,
    Stopwatch,
    Task,
    WaitTask,
    asked,
    step_back_fault,
    step_forward_fault,
)


class Halt(Enum):
    """Reason why no statement is started now."""

    END = auto()
    BREAKPOINT = auto()
    MORE_NEXT_TICK = auto()


class Passing:
    """Position of a run between two statements.

    Attributes:
        position: the statement that comes next; empty at the end of the run.
        is_leaving: True if that one started, or was passed, although the run is to stop before it.
    """

    def __init__(
        self, flow: ControlFlow, index: int, stops_at: Callable[[Position], bool], *, leaving: bool
    ) -> None:
        """Start before a statement of the main program.

        Args:
            stops_at: True if there is a breakpoint at a position.

        Raises:
            BadValue: there is no such statement.
        """
        self.position = flow.start(index)
        self.is_leaving = leaving
        self._flow = flow
        self._stops_at = stops_at
        self._instants = 0

    def come_to(self, position: Position) -> None:
        """Set the position after a statement that took time."""
        self.position, self._instants = position, 0

    def go(self, flags: Mapping[str, bool]) -> Statement | Halt | Refusal:
        """Pass statements until one takes time, or the run is to stop before one.

        Returns:
            The statement that takes time, at `position`; why there is none to start now; or why
            the run cannot go on.
        """
        for _ in range(MOST_INSTANT_AT_ONCE):
            if not self.position:
                return Halt.END
            if self._stops_at(self.position) and not self.is_leaving:
                return Halt.BREAKPOINT
            self.is_leaving = False
            statement = self._flow.statement(self.position)
            if not self._flow.is_instant(statement):
                return statement
            behind = self._flow.after(self.position, flags)
            if behind is None:
                return flag_not_read(statement)
            self.position = behind
            self._instants += 1
            if self._instants == MOST_INSTANT_STATEMENTS:
                return going_round()
        return Halt.MORE_NEXT_TICK


class InterpretedRun:
    """Run in progress, or as it ended.

    Attributes:
        is_stepping: True if a step is under way, or held by a pause.
        task: what it is doing; None between two statements.
        actions: what is to be done; whoever calls takes them out.
    """

    def __init__(
        self,
        flow: ControlFlow,
        index: int,
        stops_at: Callable[[Position], bool],
        requests: Iterator[int],
        *,
        step: bool,
    ) -> None:
        """Make a run that goes on with `advance`.

        Args:
            step: True if to pause after the first statement.

        Raises:
            BadValue: there is no such statement.
        """
        self.state = RunState.RUNNING
        self.why = PauseReason.NONE
        self.is_stepping = step
        self.failure: Refusal | None = None
        self.task: Task | None = None
        self.flags: dict[str, bool] = {}
        self.actions: list[Action] = []
        self._passing = Passing(flow, index, stops_at, leaving=step)
        self._flow = flow
        self._gatherer = Gatherer(flow)
        self._stops_at = stops_at
        self._requests = requests
        self._approached = False
        self._executed = ExecutedMoves()

    @property
    def position(self) -> Position:
        """Present statement, or the next one; empty at the end."""
        if isinstance(self.task, MotionTask):
            return self.task.gathered.positions[self.task.place]
        return self._passing.position

    @property
    def approaching(self) -> bool:
        """True while the robot is on its slow approach to the first point."""
        return isinstance(self.task, MotionTask) and self.task.gathered.block.approach

    def pause(self, now: int) -> None:
        """Hold the present statement; a motion pauses on its path."""
        self._pause(PauseReason.REQUEST)
        match self.task:
            case MotionTask(request):
                self.actions.append(PauseMotion(request))
            case WaitTask() | InputTask() as task:
                task.watch.hold(now)

    def go_on(self, now: int, *, stepping: bool) -> Refusal | None:
        """Continue after a pause, to the end or for one statement; return why that cannot be."""
        if stepping and (refusal := step_forward_fault(self.task)):
            return refusal
        # The statement that it paused before must not pause it again; a held step continues.
        begins_step = stepping and not self.is_stepping
        self._passing.is_leaving = begins_step or self.why is not PauseReason.REQUEST
        self.state, self.why = RunState.RUNNING, PauseReason.NONE
        self.is_stepping = stepping
        match self.task:
            case None:
                self.advance(now)
            case MotionTask(request):
                self.actions.append(ResumeMotion(request))
            case WaitTask() | InputTask() as task:
                task.watch.go_on(now)
        return None

    def step_back(self) -> Refusal | None:
        """Go back along the last executed move; return the reason if that is not possible."""
        way = step_back_fault(self.task) or self._executed.way_back()
        if isinstance(way, Refusal):
            return way
        self.state, self.why = RunState.RUNNING, PauseReason.NONE
        self.is_stepping = True
        self._request_motion(way, back=True)
        return None

    def stop(self) -> None:
        """End the run at its present statement."""
        if isinstance(self.task, MotionTask):
            self.actions.append(StopMotion(self.task.request))
        self._end(RunState.STOPPED)

    def answer(self, event: RequestDone | Passed | InputValue | RequestAborted, now: int) -> None:
        """Take the answer to a request; one to a request that is not open is ignored."""
        task = self.task
        if task is None or isinstance(task, WaitTask) or event.request != task.request:
            return
        match event, task:
            case RequestAborted(_, refusal), MotionTask() if refusal.code is VerdictCode.NO_MOTION:
                self._arrived(task, now)
            case RequestAborted(_, refusal), _:
                self._fail(refusal)
            case Passed(_, place), MotionTask():
                task.place = min(max(task.place, place + 1), len(task.gathered.positions) - 1)
            case RequestDone(), MotionTask():
                self._arrived(task, now)
            case RequestDone(), RequestTask():
                self._complete(task.behind, now)
            case InputValue(_, value), QuestionTask():
                self._answered(task, value, now)
            case InputValue(_, value), InputTask():
                task.request = 0
                if value is task.statement.value:
                    self._complete(task.behind, now)

    def tick(self, now: int) -> None:
        """Check the time; continue where the last tick stopped."""
        if self.state is not RunState.RUNNING:
            return
        match self.task:
            case None:
                self.advance(now)
            case WaitTask() as task if task.watch.elapsed(now) >= task.duration:
                self._complete(task.behind, now)
            case InputTask() as task if task.timed_out(now):
                self._fail(task.timeout_refusal(now))
            case InputTask() as task if task.wants_to_ask(now):
                task.asked = task.watch.elapsed(now)
                task.request = next(self._requests)
                self.actions.append(QueryInput(task.request, task.statement.signal))

    def _arrived(self, task: MotionTask, now: int) -> None:
        gathered = task.gathered
        if task.back:
            self._executed.forget_last()
        else:
            self._approached = True
            self._executed.note(gathered)
        dwell = gathered.block.moves[-1].move.dwell
        if not dwell:
            self._complete(gathered.behind, now)
            return
        self._passing.come_to(gathered.positions[-1])
        watch = Stopwatch(now)
        if self.state is RunState.PAUSED:
            watch.hold(now)
        self.task = WaitTask(watch, round(dwell * 1e9), gathered.behind)

    def _answered(self, task: QuestionTask, value: bool, now: int) -> None:
        match task.statement:
            case ReadInput(_, flag):
                self.flags[flag] = value
                self._complete(self._flow.behind(task.position), now)
            case IfInput(_, wanted):
                self._complete(self._flow.branch(task.position, value is wanted), now)

    def _complete(self, behind: Position, now: int) -> None:
        """Finish a statement; continue, unless the run is paused or steps."""
        self.task = None
        self._passing.come_to(behind)
        if self.is_stepping and behind:
            # Also in a pause: the step is over, so that resuming is no second step.
            self._pause(PauseReason.STEP)
        elif self.state is RunState.RUNNING:
            self.advance(now)

    def advance(self, now: int) -> None:
        """Start the next statement that takes time, or pause before it, or end."""
        match self._passing.go(self.flags):
            case Halt.END:
                self._end(RunState.FINISHED)
                self.actions.append(Finished())
            case Halt.BREAKPOINT:
                self._pause(PauseReason.BREAKPOINT)
            case Halt.MORE_NEXT_TICK:
                pass
            case Refusal() as refusal:
                self._fail(refusal)
            case statement:
                self._begin(statement, now)

    def _begin(self, statement: Statement, now: int) -> None:
        position = self._passing.position
        match statement:
            case Move() if not self._approached:
                self._request_motion(self._gatherer.approach(position))
            case Move():
                stops_at = (lambda _: True) if self.is_stepping else self._stops_at
                self._request_motion(self._gatherer.block(position, stops_at))
            case Wait(duration):
                behind = self._flow.behind(position)
                self.task = WaitTask(Stopwatch(now), round(duration * 1e9), behind)
            case WaitInput() | ReadInput() | IfInput() | SetOutput() | Attach() | Detach():
                behind, request = self._flow.behind(position), next(self._requests)
                self.task, action = asked(statement, request, position, behind, now)
                self.actions.append(action)
                if isinstance(statement, SetOutput | Attach | Detach):
                    self._executed.note_effect(statement_text(statement))

    def _request_motion(self, gathered: Gathered, *, back: bool = False) -> None:
        request = next(self._requests)
        self.task = MotionTask(request, gathered, back=back)
        self.actions.append(RequestMotion(request, gathered.block))

    def _pause(self, why: PauseReason) -> None:
        self.state, self.why = RunState.PAUSED, why
        # A breakpoint ends a step, as the end of its statement does.
        self.is_stepping = self.is_stepping and why is PauseReason.REQUEST

    def _fail(self, refusal: Refusal) -> None:
        self._end(RunState.FAILED)
        self.failure = refusal
        self.actions.append(Failed(refusal))

    def _end(self, state: RunState) -> None:
        """End the run; the place where it ended stays visible."""
        self._passing.come_to(self.position)
        self.state, self.why, self.task = state, PauseReason.NONE, None
        self.is_stepping = False


_UNDER_WAY = (RunState.RUNNING, RunState.PAUSED)


class Runner:
    """Runner of one program, with the programs that it calls."""

    def __init__(self, linked: Linked) -> None:
        self.status = RunStatus()
        self._linked = linked
        self._breakpoints: frozenset[tuple[str, int]] = frozenset()
        self._requests = count(1)  # continues from run to run, so that late answers match nothing
        self._run: InterpretedRun | None = None

    @property
    def flags(self) -> dict[str, bool]:
        """Flags that were read in this run."""
        return {} if self._run is None else dict(self._run.flags)

    @property
    def is_stepping(self) -> bool:
        """True while a step is in progress, or held by a pause; not once it is done."""
        return self._run is not None and self._run.is_stepping

    def handle(self, event: Event, now: int) -> list[Action]:
        """Take an event.

        Returns:
            What is to be done; the last is a report where the status changed.
        """
        actions: list[Action] = []
        refusal = self._take(event, now)
        if refusal is not None:
            actions.append(EventRefused(refusal))
        if self._run is not None:
            actions += self._run.actions
            self._run.actions = []
            status = self._status(self._run)
            if status != self.status:
                self.status = status
                actions.append(RunReport(status))
        return actions

    def _take(self, event: Event, now: int) -> Refusal | None:
        run = self._run
        match event:
            case ReplaceBreakpoints(places):
                self._breakpoints = places
            case Start():
                return self._start(event, now)
            case Pause():
                return self._pause(now)
            case Resume() | StepForward() | StepBack():
                return self._go_on(event, now)
            case Stop() if run is not None and run.state in _UNDER_WAY:
                run.stop()
            case TimePassed() if run is not None:
                run.tick(now)
            case RequestDone() | Passed() | InputValue() | RequestAborted() if run is not None:
                run.answer(event, now)
        return None

    def _start(self, event: Start, now: int) -> Refusal | None:
        if self.status.state in _UNDER_WAY:
            return Refusal(VerdictCode.PROGRAM_RUNNING)
        if event.passes is not None and not 1 <= event.passes <= MOST_PASSES:
            text = f"{event.passes} passes; accepted: 1 to {MOST_PASSES}"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=event.passes, limit=MOST_PASSES)
        flow = ControlFlow(self._linked, event.passes)
        try:
            run = InterpretedRun(flow, event.index, self._stops_at, self._requests, step=event.step)
        except BadValue as error:
            return Refusal(VerdictCode.BAD_ARGUMENT, str(error))
        self._run = run
        run.advance(now)
        return None

    def _pause(self, now: int) -> Refusal | None:
        if self._run is None or self._run.state is not RunState.RUNNING:
            return self._refused("it is running")
        self._run.pause(now)
        return None

    def _go_on(self, event: Resume | StepForward | StepBack, now: int) -> Refusal | None:
        if self._run is None or self._run.state is not RunState.PAUSED:
            return self._refused("it is paused")
        if isinstance(event, StepBack):
            return self._run.step_back()
        return self._run.go_on(now, stepping=isinstance(event, StepForward))

    def _refused(self, wanted: str) -> Refusal:
        text = f"the program is {self.status.state.value}; accepted: while {wanted}"
        return Refusal(VerdictCode.PROGRAM_NOT_RUNNING, text)

    def _stops_at(self, position: Position) -> bool:
        return (position[-1].program, position[-1].index) in self._breakpoints

    def _status(self, run: InterpretedRun) -> RunStatus:
        position = run.position
        stack = tuple(
            RunPlace(level.program, level.index, self._linked.lines[level.program][level.index])
            for level in position
        )
        # At the end there is no position that could show it.
        passes = position[0].passes[0][1] if position else self.status.passes
        return RunStatus(run.state, run.why, stack, passes, run.approaching, run.failure)
