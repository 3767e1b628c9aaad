"""Running programs as pendants ask for it: all, step by step, paused, resumed, stopped.

Owns the one run of a cell: who asked for what, so that each request has one verdict and one
outcome, and what ends a run from outside. What comes next in a program is the runner's business,
its motions are `program_motion`'s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import ProgramRun, RunKind
from openpendant.simplemsg.verdicts import VerdictCode

from ..authority import Holder
from ..news import (
    AuthorityMoved,
    Begun,
    Ended,
    LatchedStop,
    ModeMoved,
    News,
    Refused,
    Request,
    StopMoved,
)
from ..operating_mode import MotionKind
from ..outgoing import Outgoing, Send
from ..pendant.arguments import run_fault
from ..pendant.replies import outcome, verdict
from ..programs import run_messages as run
from ..programs.linking import Linked
from ..programs.printer import statement_lines
from ..programs.runner import Runner
from ..readiness import permission, stop_refusal
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..robot_view import RobotView
from .motion import ProgramMotion
from .reports import program_report, running_program, start_index
from .shelf import ProgramShelf
from .surroundings import Surroundings, answered

ToAll = Callable[[Message], list[Outgoing]]
"""Sends a message to every pendant of the cell."""


@dataclass(slots=True)
class _Run:
    """A program under way.

    Attributes:
        runner: what comes next.
        linked: the programs.
        by: who runs it.
        motion: its motions.
        lines: of each program, the line of each statement.
        whole: requests that end with the run.
        steps: requests that end with the step.
        answers: to questions of the runner, to be handed over in the next tick, so that a program
            that only asks does not hold up the server.
    """

    runner: Runner
    linked: Linked
    by: Holder
    motion: ProgramMotion
    lines: dict[str, tuple[int, ...]]
    whole: list[int] = field(default_factory=list)
    steps: list[int] = field(default_factory=list)
    answers: list[run.Event] = field(default_factory=list)


class ProgramDesk:
    """The program run of one cell.

    Attributes:
        breakpoints: of each program, the numbers of the statements to pause before, from 0.
        surroundings: signals and objects.
    """

    def __init__(
        self,
        cell: RobotCell,
        robot: RobotView,
        shelf: ProgramShelf,
        surroundings: Surroundings,
        to_all: ToAll,
    ) -> None:
        """Make a desk where nothing runs.

        Args:
            cell: the cell.
            robot: the mathematics of the robot.
            shelf: the programs.
            surroundings: signals and objects.
            to_all: sends reports.
        """
        self.breakpoints: dict[str, frozenset[int]] = {}
        self.surroundings = surroundings
        self._cell = cell
        self._robot = robot
        self._shelf = shelf
        self._to_all = to_all
        self._run: _Run | None = None
        self._loading: tuple[Holder, ProgramRun] | None = None

    # What pendants ask for.

    @property
    def is_under_way(self) -> bool:
        """Whether a program runs, waits, is paused or is being loaded."""
        return self._run is not None or self._loading is not None

    def start(self, by: Holder, message: ProgramRun, now: int) -> Refusal | list[Outgoing]:
        """Run a program or a step of it.

        Returns:
            Why it is refused, or what follows; the verdict is among it, or comes once the program
            is loaded.
        """
        refusal = permission(self._cell.authority, by.session, now) or run_fault(message)
        if refusal is not None:
            return refusal
        self._cell.authority.beat(by.session, now)
        if self._run is not None:
            return self._go_on(self._run, message, now)
        if self._loading is not None:
            return Refusal(VerdictCode.PROGRAM_RUNNING, "a program is being loaded")
        if message.run == RunKind.STEP_BACKWARD:
            text = "no program is under way; accepted: step backward after a step or a pause"
            return Refusal(VerdictCode.PROGRAM_NOT_RUNNING, text)
        refusal = self._cell.check(by.session, now, MotionKind.PROGRAM)
        if refusal is not None:
            return refusal
        self._loading = loading = (by, message)

        def loaded(linked: Linked | Refusal, at: int) -> list[Outgoing]:
            if self._loading is not loading:
                return [_verdict(by, message.request_id, Refusal(VerdictCode.PROGRAM_STOPPED))]
            self._loading = None
            return self._loaded(by, message, linked, at)

        return self._shelf.fetch_linked(message.program, loaded)

    def _loaded(
        self, by: Holder, message: ProgramRun, linked: Linked | Refusal, now: int
    ) -> list[Outgoing]:
        """Start a program that was loaded, where nothing has come in between."""
        start = linked if isinstance(linked, Refusal) else start_index(linked, message.line)
        refusal = self._cell.check(by.session, now, MotionKind.PROGRAM)
        if isinstance(linked, Refusal) or isinstance(start, Refusal) or refusal is not None:
            found = start if isinstance(start, Refusal) else refusal
            return [_verdict(by, message.request_id, found)]
        runner = Runner(linked)
        motion = ProgramMotion(self._cell, self._robot, by, message.request_id, message.speed)
        lines = {name: statement_lines(each) for name, each in linked.programs.items()}
        self._run = current = _Run(runner, linked, by, motion, lines)
        self._note_request(current, message)
        runner.handle(run.SetBreakpoints(self._places(linked)), now)
        step = message.run == RunKind.STEP_FORWARD
        first = run.Start(start, message.loops or None, step)
        return [_verdict(by, message.request_id), *self._handle(current, first, now)]

    def _go_on(self, current: _Run, message: ProgramRun, now: int) -> Refusal | list[Outgoing]:
        """Go on with the program that is paused, or take a step of it."""
        if message.program != current.linked.main or message.line:
            text = f"program {current.linked.main!r} is under way; accepted: line 0 of it"
            return Refusal(VerdictCode.PROGRAM_RUNNING, text)
        if current.runner.status.state is not run.RunState.PAUSED:
            return Refusal(VerdictCode.PROGRAM_RUNNING)
        refusal = current.motion.resume_fault(now)
        if refusal is not None:
            return refusal
        before, current.motion.speed = current.motion.speed, message.speed
        actions = current.runner.handle(_EVENTS[RunKind(message.run)], now)
        refused = next((each for each in actions if isinstance(each, run.Refused)), None)
        if refused is not None:
            current.motion.speed = before
            return refused.refusal
        self._note_request(current, message)
        done = _verdict(current.by, message.request_id)
        return [done, *self._perform(current, actions, now)]

    @staticmethod
    def _note_request(current: _Run, message: ProgramRun) -> None:
        requests = current.whole if message.run == RunKind.ALL else current.steps
        requests.append(message.request_id)

    def pause(self, by: Holder, now: int) -> Refusal | list[Outgoing]:
        """Pause the program, a motion on its path."""
        current = self._allowed(by, now)
        return current if isinstance(current, Refusal) else self._asked(current, run.Pause(), now)

    def resume(self, by: Holder, now: int) -> Refusal | list[Outgoing]:
        """Go on after a pause; a step that was paused stays a step."""
        current = self._allowed(by, now)
        if isinstance(current, Refusal):
            return current
        refusal = current.motion.resume_fault(now)
        if refusal is not None:
            return refusal
        event = run.StepForward() if current.steps else run.Resume()
        return self._asked(current, event, now)

    def program_stop(self, by: Holder, now: int) -> Refusal | list[Outgoing]:
        """End the program where it is; nothing of it goes on."""
        refusal = permission(self._cell.authority, by.session, now)
        if refusal is not None:
            return refusal
        self._loading = None
        return self.abandon(Refusal(VerdictCode.PROGRAM_STOPPED), now)

    def _allowed(self, by: Holder, now: int) -> _Run | Refusal:
        refusal = permission(self._cell.authority, by.session, now)
        if refusal is not None:
            return refusal
        return self._run or Refusal(VerdictCode.NOTHING_TO_CONTROL, "the program is being loaded")

    def _asked(self, current: _Run, event: run.Event, now: int) -> Refusal | list[Outgoing]:
        """Let the runner do what somebody wants, or say why not."""
        actions = current.runner.handle(event, now)
        for action in actions:
            if isinstance(action, run.Refused):
                return action.refusal
        return self._perform(current, actions, now)

    def set_breakpoints(self, program: str, places: frozenset[int], now: int) -> None:
        """Pause before these statements of a program from now on, also in the present run."""
        self.breakpoints[program] = places
        if not places:
            del self.breakpoints[program]
        if self._run is not None:
            self._run.runner.handle(run.SetBreakpoints(self._places(self._run.linked)), now)

    def _places(self, linked: Linked) -> frozenset[tuple[str, int]]:
        named = (name for name in linked.programs if name in self.breakpoints)
        return frozenset((name, index) for name in named for index in self.breakpoints[name])

    # What happens.

    def news(self, news: News, now: int) -> list[Outgoing]:
        """Take what became of a motion of the run, or what ends it from outside."""
        current = self._run
        if current is None:
            return []
        match news:
            case Begun() | Refused() | Ended():
                event = current.motion.news(news, now)
                return [] if event is None else self._handle(current, event, now)
            case StopMoved(stop=LatchedStop() as stop):
                return self.abandon(stop_refusal(stop), now)
            case ModeMoved(mode=mode):
                text = f"the mode changed to {mode.name.lower().replace('_', ' ')}"
                return self.abandon(Refusal(VerdictCode.MODE_CHANGED, text), now)
            case AuthorityMoved(change=change) if change.holder != current.by:
                return self.abandon(Refusal(VerdictCode.AUTHORITY_LOST), now)
        return []

    def tick(self, now: int) -> list[Outgoing]:
        """Look at the time, the enabling device, and how far the motion has come."""
        current = self._run
        if current is None:
            return []
        modes, controller = self._cell.modes, self._cell.mode
        runs = current.runner.status.state is run.RunState.RUNNING
        if runs and not current.motion.is_asked and modes.needs_enabling(controller):
            if not modes.is_enabled(current.by.session, now):
                return self.abandon(Refusal(VerdictCode.ENABLING_LOST), now)
        answers, current.answers = current.answers, []
        passed = current.motion.passed()
        events: list[run.Event] = [*answers, *([] if passed is None else [passed]), run.Tick()]
        out: list[Outgoing] = []
        for event in events:
            if self._run is current:
                out += self._handle(current, event, now)
        return out

    def abandon(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """End the run for a reason from outside; the robot is stopped, where it moves for it."""
        current = self._run
        if current is None:
            return []
        out = current.motion.end(refusal, now)
        actions = current.runner.handle(run.Stop(), now)
        return out + self._perform(current, actions, now, ended=refusal)

    def shut_down(self, now: int) -> list[Outgoing]:
        """End the run because the server is going down."""
        self._loading = None
        return self.abandon(Refusal(VerdictCode.SHUTTING_DOWN), now)

    # What the runner wants.

    def _handle(self, current: _Run, event: run.Event, now: int) -> list[Outgoing]:
        return self._perform(current, current.runner.handle(event, now), now)

    def _perform(
        self, current: _Run, actions: list[run.Action], now: int, ended: Refusal | None = None
    ) -> list[Outgoing]:
        """Do what the runner asks for, report, and close the requests that are answered by it."""
        out: list[Outgoing] = []
        for action in actions:
            match action:
                case run.RequestMotion(number, block):
                    lines = tuple(current.lines[move.program][move.index] for move in block.moves)
                    asked = current.motion.begin(number, block, lines, now)
                    if isinstance(asked, Refusal):
                        current.answers.append(run.Aborted(number, asked))
                    else:
                        out += asked
                case run.PauseMotion():
                    current.motion.pause(now)
                case run.ResumeMotion():
                    current.motion.resume(now)
                case run.QueryInput() | run.WriteOutput() | run.AttachObject() | run.DetachObject():
                    answer, done = answered(self.surroundings, action, now)
                    current.answers.append(answer)
                    out += done
                case run.Report(status):
                    out += self._report(current, status, ended)
        return out + self._close(current, ended, now)

    def _report(
        self, current: _Run, status: run.RunStatus, ended: Refusal | None
    ) -> list[Outgoing]:
        self._cell.program = running_program(current.linked.main, status)
        return self._to_all(program_report(current.linked.main, status, ended))

    def _close(self, current: _Run, ended: Refusal | None, now: int) -> list[Outgoing]:
        """Tell the outcome of requests that are answered by where the run is now."""
        status, motion = current.runner.status, current.motion
        over = status.state not in (run.RunState.RUNNING, run.RunState.PAUSED)
        stepped = status.pause in (run.PauseReason.STEP, run.PauseReason.BREAKPOINT)
        requests: list[int] = []
        if over or stepped:
            requests, current.steps = current.steps, []
        if over and self._run is current:
            requests += current.whole
            self._run = None
        refusal = ended or status.failure
        return [
            Send(
                current.by.session,
                outcome(
                    Ended(
                        Request(current.by.session, request_id),
                        refusal,
                        motion.plan_time,
                        motion.motion_time,
                    )
                ),
            )
            for request_id in requests
        ]


_EVENTS: dict[RunKind, run.Event] = {
    RunKind.ALL: run.Resume(),
    RunKind.STEP_FORWARD: run.StepForward(),
    RunKind.STEP_BACKWARD: run.StepBack(),
}


def _verdict(by: Holder, request_id: int, refusal: Refusal | None = None) -> Send:
    return Send(by.session, verdict(request_id, refusal))
