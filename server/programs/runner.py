"""The runner of a program: events in, actions out.

Owns what may be asked for in which state, breakpoints, and what everybody may see. It moves
nothing: it asks for motions, signals and objects, and goes on when it is told that they are done.
After a stop or a failure nothing goes on by itself; a start begins a new run. Knows no socket, no
planner and no clock: `now` is monotonic time [ns].
"""

from __future__ import annotations

from itertools import count

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .control_flow import ControlFlow, Position
from .errors import BadValue
from .linking import Linked
from .run import Run
from .run_messages import (
    Aborted,
    Action,
    Done,
    Event,
    InputValue,
    Passed,
    Pause,
    Place,
    Refused,
    Report,
    Resume,
    RunState,
    RunStatus,
    SetBreakpoints,
    Start,
    StepBack,
    StepForward,
    Stop,
    Tick,
)
from .statements import MOST_PASSES

_UNDER_WAY = (RunState.RUNNING, RunState.PAUSED)


class Runner:
    """One program, with what it calls, and its run.

    Attributes:
        status: what everybody may see.
    """

    def __init__(self, linked: Linked) -> None:
        """Make a runner that stands before the start.

        Args:
            linked: the program with all that it calls.
        """
        self.status = RunStatus()
        self._linked = linked
        self._breakpoints: frozenset[tuple[str, int]] = frozenset()
        self._requests = count(1)  # goes on from run to run, so that late answers match nothing
        self._run: Run | None = None

    @property
    def flags(self) -> dict[str, bool]:
        """The flags that were read in this run."""
        return {} if self._run is None else dict(self._run.flags)

    @property
    def is_stepping(self) -> bool:
        """Whether a step is under way, or held by a pause; not once it is done."""
        return self._run is not None and self._run.is_stepping

    def handle(self, event: Event, now: int) -> list[Action]:
        """Take an event.

        Args:
            event: what happened, or what somebody wants.
            now: monotonic time [ns].

        Returns:
            What is to be done; the last is a report where the status changed.
        """
        actions: list[Action] = []
        refusal = self._take(event, now)
        if refusal is not None:
            actions.append(Refused(refusal))
        if self._run is not None:
            actions += self._run.actions
            self._run.actions = []
            status = self._status(self._run)
            if status != self.status:
                self.status = status
                actions.append(Report(status))
        return actions

    def _take(self, event: Event, now: int) -> Refusal | None:
        run = self._run
        match event:
            case SetBreakpoints(places):
                self._breakpoints = places
            case Start():
                return self._start(event, now)
            case Pause():
                return self._pause(now)
            case Resume() | StepForward() | StepBack():
                return self._go_on(event, now)
            case Stop() if run is not None and run.state in _UNDER_WAY:
                run.stop()
            case Tick() if run is not None:
                run.tick(now)
            case Done() | Passed() | InputValue() | Aborted() if run is not None:
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
            run = Run(flow, event.index, self._stops_at, self._requests, step=event.step)
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

    def _status(self, run: Run) -> RunStatus:
        position = run.position
        stack = tuple(
            Place(level.program, level.index, self._linked.lines[level.program][level.index])
            for level in position
        )
        # At the end there is no position any more that could say it.
        passes = position[0].passes[0][1] if position else self.status.passes
        return RunStatus(run.state, run.why, stack, passes, run.approaching, run.failure)
