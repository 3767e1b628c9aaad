"""A program under way: what its runner asks for is done, and each request gets its one outcome.

Owns the requests that wait for the run or for a step of it. Who may ask for what, and what ends a
run from outside, is the desk's business; what comes next in the program is the runner's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from openpendant.simplemsg.pendant import ProgramRun, RunKind

from ..authority import Holder
from ..news import Begun, Ended, Refused, Request
from ..outgoing import Outgoing, Send
from ..pendant.replies import outcome
from ..programs import run_messages as run
from ..programs.linking import Linked
from ..programs.runner import Runner
from ..refusal import Refusal
from .motion import ProgramMotion
from .surroundings import Surroundings, answered

Report = Callable[[run.RunStatus, Refusal | None, int], list[Outgoing]]
"""Tells every pendant where the run is, and what ended it from outside, at a time [ns]."""


@dataclass(slots=True)
class Playing:
    """A program under way.

    Attributes:
        linked: the programs.
        by: who runs it.
        motion: its motions.
        surroundings: signals and objects.
        report: tells of it.
        loops: how often it was asked to run; 0 for until it is stopped.
        runner: what comes next.
        is_over: whether it ended; nothing comes of it any more.
    """

    linked: Linked
    by: Holder
    motion: ProgramMotion
    surroundings: Surroundings
    report: Report
    loops: int
    is_over: bool = False
    runner: Runner = field(init=False)
    _places: dict[str, frozenset[int]] = field(default_factory=dict)
    _whole: list[int] = field(default_factory=list)
    _steps: list[int] = field(default_factory=list)
    # Handed over in the next tick, so that a program that only asks does not hold up the server.
    _answers: list[run.Event] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.runner = Runner(self.linked)

    @property
    def is_stepping(self) -> bool:
        """Whether a step is under way, or held by a pause."""
        return self.runner.is_stepping

    def pause_before(self, places: Mapping[str, frozenset[int]], now: int) -> None:
        """Pause before these statements of these programs, in the place of those before."""
        self._places.update(places)
        named = self._places.items()
        wanted = frozenset((name, index) for name, indexes in named for index in indexes)
        self.runner.handle(run.SetBreakpoints(wanted), now)

    def note_request(self, message: ProgramRun) -> None:
        """Take note of a request that ends with the run, or with the step."""
        requests = self._whole if message.run == RunKind.ALL else self._steps
        requests.append(message.request_id)

    def handle(self, event: run.Event, now: int) -> list[Outgoing]:
        """Let the runner take an event, and do what it asks for."""
        return self.perform(self.runner.handle(event, now), now)

    def news(self, news: Begun | Refused | Ended, now: int) -> list[Outgoing]:
        """Take what became of a motion of the cell, of this run or not."""
        event = self.motion.news(news, now)
        return [] if event is None else self.handle(event, now)

    def tick(self, now: int) -> list[Outgoing]:
        """Hand over answers, the place on the way, and the time."""
        answers, self._answers = self._answers, []
        passed = self.motion.passed()
        events: list[run.Event] = [*answers, *([] if passed is None else [passed]), run.Tick()]
        out: list[Outgoing] = []
        for event in events:
            if not self.is_over:
                out += self.handle(event, now)
        return out

    def end(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """End it for a reason from outside; the robot is stopped, where it moves for it."""
        out = self.motion.end(refusal, now)
        return out + self.perform(self.runner.handle(run.Stop(), now), now, ended=refusal)

    def perform(
        self, actions: list[run.Action], now: int, ended: Refusal | None = None
    ) -> list[Outgoing]:
        """Do what the runner asks for, report, and close the requests that are answered by it."""
        out: list[Outgoing] = []
        for action in actions:
            match action:
                case run.RequestMotion(number, block):
                    known = self.linked.lines
                    lines = tuple(known[move.program][move.index] for move in block.moves)
                    asked = self.motion.begin(number, block, lines, now)
                    if isinstance(asked, Refusal):
                        self._answers.append(run.Aborted(number, asked))
                    else:
                        out += asked
                case run.PauseMotion():
                    self.motion.pause(now)
                case run.ResumeMotion():
                    self.motion.resume(now)
                case run.QueryInput() | run.WriteOutput() | run.AttachObject() | run.DetachObject():
                    answer, done = answered(self.surroundings, action, now)
                    self._answers.append(answer)
                    out += done
                case run.Report(status):
                    out += self.report(status, ended, now)
        return out + self._close(ended)

    def _close(self, ended: Refusal | None) -> list[Outgoing]:
        """Tell the outcome of requests that are answered by where the run is now."""
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
        request = Request(self.by.session, request_id)
        times = self.motion.plan_time, self.motion.motion_time
        return Send(self.by.session, outcome(Ended(request, refusal, *times)))
