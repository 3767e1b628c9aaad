"""One run of a program, from its start to its end.

Owns which statement is under way and what becomes of its answer; how a pause holds it and how it
goes on. Whether somebody may ask for that now is the runner's matter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .control_flow import ControlFlow, Position
from .dead_ends import flag_not_read, going_round
from .executed import ExecutedMoves
from .motion_blocks import MOST_INSTANT_STATEMENTS, Gathered, Gatherer
from .run_messages import (
    Aborted,
    Action,
    Done,
    Failed,
    Finished,
    InputValue,
    Passed,
    PauseMotion,
    PauseReason,
    QueryInput,
    RequestMotion,
    ResumeMotion,
    RunState,
    StopMotion,
)
from .run_tasks import (
    InputTask,
    MotionTask,
    QuestionTask,
    RequestTask,
    Stopwatch,
    Task,
    WaitTask,
    effect_action,
)
from .statement_clauses import statement_text
from .statements import (
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


class Run:
    """A run under way, or as it ended.

    Attributes:
        state: how far it is.
        why: why it is paused.
        failure: why it failed.
        task: what it is doing; None between two statements.
        flags: the flags that were read.
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
            flow: the programs.
            index: the statement to begin with, from 0.
            stops_at: whether there is a breakpoint at a position.
            requests: fresh request numbers.
            step: whether to pause after the first statement.

        Raises:
            BadValue: there is no such statement.
        """
        self.state = RunState.RUNNING
        self.why = PauseReason.NONE
        self.failure: Refusal | None = None
        self.task: Task | None = None
        self.flags: dict[str, bool] = {}
        self.actions: list[Action] = []
        self._position = flow.start(index)
        self._flow = flow
        self._gatherer = Gatherer(flow)
        self._stops_at = stops_at
        self._requests = requests
        self._stepping = step
        self._leaving = step
        self._approached = False
        self._executed = ExecutedMoves()

    @property
    def position(self) -> Position:
        """The statement under way, or the next one; empty at the end."""
        if isinstance(self.task, MotionTask):
            return self.task.gathered.positions[self.task.place]
        return self._position

    @property
    def approaching(self) -> bool:
        """Whether the robot is on its slow way to the first point."""
        return isinstance(self.task, MotionTask) and self.task.gathered.block.approach

    # What the runner lets through.

    def pause(self, now: int) -> None:
        """Hold what is under way; a motion pauses on its path."""
        self._pause(PauseReason.REQUEST)
        match self.task:
            case MotionTask(request):
                self.actions.append(PauseMotion(request))
            case WaitTask() | InputTask() as task:
                task.watch.hold(now)

    def go_on(self, now: int, *, stepping: bool) -> None:
        """Go on after a pause, to the end or for one statement."""
        # The statement that it paused before must not pause it again.
        self._leaving = stepping or self.why is not PauseReason.REQUEST
        self.state, self.why = RunState.RUNNING, PauseReason.NONE
        self._stepping = stepping
        match self.task:
            case None:
                self.advance(now)
            case MotionTask(request):
                self.actions.append(ResumeMotion(request))
            case WaitTask() | InputTask() as task:
                task.watch.go_on(now)

    def step_back(self) -> Refusal | None:
        """Go back along the last executed move; return why that cannot be."""
        if self.task is not None:
            text = "a statement is half done; accepted: step forward, then back along all of it"
            return Refusal(VerdictCode.STEP_BACK_REFUSED, text)
        way = self._executed.way_back()
        if isinstance(way, Refusal):
            return way
        self.state, self.why = RunState.RUNNING, PauseReason.NONE
        self._stepping = True
        self._request_motion(way, back=True)
        return None

    def stop(self) -> None:
        """End the run where it is."""
        if isinstance(self.task, MotionTask):
            self.actions.append(StopMotion(self.task.request))
        self._end(RunState.STOPPED)

    # What happened.

    def answer(self, event: Done | Passed | InputValue | Aborted, now: int) -> None:
        """Take the answer to a request; one that is not open is left alone."""
        task = self.task
        if task is None or isinstance(task, WaitTask) or event.request != task.request:
            return
        match event, task:
            case Aborted(_, refusal), MotionTask() if refusal.code is VerdictCode.NO_MOTION:
                self._arrived(task, now)
            case Aborted(_, refusal), _:
                self._fail(refusal)
            case Passed(_, place), MotionTask():
                task.place = min(max(task.place, place + 1), len(task.gathered.positions) - 1)
            case Done(), MotionTask():
                self._arrived(task, now)
            case Done(), RequestTask():
                self._complete(task.behind, now)
            case InputValue(_, value), QuestionTask():
                self._answered(task, value, now)
            case InputValue(_, value), InputTask():
                task.request = 0
                if value is task.statement.value:
                    self._complete(task.behind, now)

    def tick(self, now: int) -> None:
        """Look at the time."""
        if self.state is not RunState.RUNNING:
            return
        match self.task:
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
        self._position = gathered.positions[-1]
        watch = Stopwatch(now)
        if self.state is RunState.PAUSED:
            watch.hold(now)
        self.task = WaitTask(watch, round(dwell * 1e9), gathered.behind)

    def _answered(self, task: QuestionTask, value: bool, now: int) -> None:
        match task.statement:
            case ReadInput(_, flag):
                self.flags[flag] = value
                self._complete(self._behind(task.position), now)
            case IfInput(_, wanted):
                self._complete(self._flow.branch(task.position, value is wanted), now)

    def _complete(self, behind: Position, now: int) -> None:
        """A statement is done; go on, unless the run is paused or steps."""
        self.task, self._position = None, behind
        if self.state is RunState.PAUSED:
            return
        if self._stepping and behind:
            self._pause(PauseReason.STEP)
        else:
            self.advance(now)

    # Going on.

    def advance(self, now: int) -> None:
        """Pass statements until one takes time, or the run pauses or ends."""
        for _ in range(MOST_INSTANT_STATEMENTS):
            if not self._position:
                self._end(RunState.FINISHED)
                self.actions.append(Finished())
                return
            if self._stops_at(self._position) and not self._leaving:
                self._pause(PauseReason.BREAKPOINT)
                return
            self._leaving = False
            statement = self._flow.statement(self._position)
            if not self._flow.is_instant(statement):
                self._begin(statement, now)
                return
            behind = self._flow.after(self._position, self.flags)
            if behind is None:
                self._fail(flag_not_read(statement))
                return
            self._position = behind
        self._fail(going_round())

    def _begin(self, statement: Statement, now: int) -> None:
        position = self._position
        match statement:
            case Move() if not self._approached:
                self._request_motion(self._gatherer.approach(position))
            case Move():
                stops_at = _everywhere if self._stepping else self._stops_at
                self._request_motion(self._gatherer.block(position, stops_at))
            case Wait(duration):
                behind = self._behind(position)
                self.task = WaitTask(Stopwatch(now), round(duration * 1e9), behind)
            case WaitInput():
                request, behind = next(self._requests), self._behind(position)
                self.task = InputTask(statement, Stopwatch(now), request, 0, behind)
                self.actions.append(QueryInput(request, statement.signal))
            case ReadInput() | IfInput():
                request = next(self._requests)
                self.task = QuestionTask(request, statement, position)
                self.actions.append(QueryInput(request, statement.signal))
            case SetOutput() | Attach() | Detach():
                self._request_effect(statement)

    def _request_effect(self, statement: SetOutput | Attach | Detach) -> None:
        request = next(self._requests)
        self._executed.note_effect(statement_text(statement))
        self.task = RequestTask(request, self._behind(self._position))
        self.actions.append(effect_action(request, statement))

    def _request_motion(self, gathered: Gathered, *, back: bool = False) -> None:
        request = next(self._requests)
        self.task = MotionTask(request, gathered, back=back)
        self.actions.append(RequestMotion(request, gathered.block))

    def _behind(self, position: Position) -> Position:
        behind = self._flow.after(position, self.flags)
        if behind is None:
            raise AssertionError("only conditions on flags ask for a flag")
        return behind

    def _pause(self, why: PauseReason) -> None:
        self.state, self.why = RunState.PAUSED, why

    def _fail(self, refusal: Refusal) -> None:
        self._end(RunState.FAILED)
        self.failure = refusal
        self.actions.append(Failed(refusal))

    def _end(self, state: RunState) -> None:
        """End the run; the place where it ended stays visible."""
        self._position = self.position
        self.state, self.why, self.task = state, PauseReason.NONE, None


def _everywhere(position: Position) -> bool:
    return True
