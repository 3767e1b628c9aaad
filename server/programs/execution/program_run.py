"""Program run: carries out the actions of its runner, and gives each request its one outcome.

Owns the requests that wait for the run or for a step of it. Permissions, and the end of a run from
outside, are the executor's; the next statement is the runner's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from openpendant.simplemsg.pendant import ProgramRun, RunKind

from ...control.authority import Holder
from ...events.cell_events import MotionEnded, MotionEvent, MotionRequest
from ...events.effects import Effect, Send
from ...events.replies import outcome
from ...refusal import Refusal
from ..interpreter import run_events as run
from ..interpreter.runner import Runner
from ..language.linking import Linked
from .block_motion import ProgramMotion
from .run_environment import RunEnvironment, answered

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

    def on_cell_event(self, news: MotionEvent, now: int) -> list[Effect]:
        """Take the start or end of a motion of this run, or of one before it."""
        event = self.motion.on_cell_event(news, now)
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
                    answer, done = answered(self.environment, action, now)
                    self._answers.append(answer)
                    out += done
                case run.RunReport(status):
                    out += self.report(status, ended, now)
        return out + self._close(ended)

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
