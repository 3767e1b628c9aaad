"""Program runner: events in, actions out.

Owns the requests allowed in each state, breakpoints, and the published status. It moves nothing: it
asks for motions, signals and objects, and continues when an event reports them done. After a
stop or a failure nothing continues by itself; a start makes a new run. Knows no socket, no planner
and no clock: `now` is monotonic time [ns].
"""

from __future__ import annotations

from itertools import count

from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from ..language.linking import Linked
from ..language.program_errors import BadValue
from ..language.statements import MOST_PASSES
from .control_flow import ControlFlow, Position
from .run import InterpretedRun
from .run_events import (
    Action,
    Event,
    EventRefused,
    InputValue,
    Passed,
    Pause,
    ReplaceBreakpoints,
    RequestAborted,
    RequestDone,
    Resume,
    RunPlace,
    RunReport,
    RunState,
    RunStatus,
    Start,
    StepBack,
    StepForward,
    Stop,
    TimePassed,
)

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
