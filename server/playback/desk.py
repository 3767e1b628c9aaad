"""Running programs as pendants ask for it: all, step by step, paused, resumed, stopped.

Owns the one run of a cell: who may ask for what, so that each request has one verdict, and what
ends a run from outside. What a run does until then is the business of `playing`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import ProgramRun, RunKind
from openpendant.simplemsg.verdicts import VerdictCode

from ..authority import Holder
from ..news import Begun, Ended, Interrupted, News, ProgramBegan, ProgramEnded, Refused
from ..operating_mode import MotionKind
from ..outgoing import Outgoing, Send
from ..pendant.arguments import run_fault
from ..pendant.replies import verdict
from ..programs import run_messages as run
from ..programs.linking import Linked
from ..readiness import permission
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..robot_view import RobotView
from .going_on import GOING_ON, going_on_fault
from .kept_breakpoints import KeptBreakpoints, Places, RunPlaces
from .loading import Loading
from .motion import ProgramMotion
from .playing import Playing
from .reports import noted, program_report, running_program, start_index
from .run_endings import broken_condition, ending
from .shelf import ProgramShelf
from .surroundings import Surroundings

ToAll = Callable[[Message], list[Outgoing]]
"""Sends a message to every pendant of the cell."""


class ProgramDesk:
    """The program run of one cell.

    Attributes:
        surroundings: signals and objects.
    """

    def __init__(
        self,
        cell: RobotCell,
        robot: RobotView,
        shelf: ProgramShelf,
        breakpoints: KeptBreakpoints,
        surroundings: Surroundings,
        to_all: ToAll,
    ) -> None:
        """Make a desk where nothing runs.

        Args:
            cell: the cell.
            robot: the mathematics of the robot.
            shelf: the programs.
            breakpoints: those of the programs.
            surroundings: signals and objects.
            to_all: sends reports.
        """
        self.surroundings = surroundings
        self._cell = cell
        self._robot = robot
        self._shelf = shelf
        self._breakpoints = breakpoints
        self._to_all = to_all
        self._playing: Playing | None = None
        self._loading: Loading | None = None
        self._begun: ProgramBegan | None = None

    # What pendants ask for.

    @property
    def is_under_way(self) -> bool:
        """Whether a program runs, waits, is paused or is being loaded."""
        return self._run is not None or self._loading is not None

    @property
    def _run(self) -> Playing | None:
        """The run that is not over."""
        return None if self._playing is None or self._playing.is_over else self._playing

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
            loading = self._loading.message.program
            text = f"program {loading!r} is being loaded; accepted: another after a program stop"
            return Refusal(VerdictCode.PROGRAM_RUNNING, text)
        if message.run == RunKind.STEP_BACKWARD:
            text = (
                "no program is under way; accepted: step backward after a step,"
                " or while it is paused between two statements"
            )
            return Refusal(VerdictCode.PROGRAM_NOT_RUNNING, text)
        refusal = self._cell.check(by.session, now, MotionKind.PROGRAM)
        if refusal is not None:
            return refusal
        self._loading = asked = Loading(by, message)
        self._cell.program = asked.shown
        then = partial(self._breakpoints.of_run, then=partial(self._loaded, asked))
        return self._shelf.fetch_linked(message.program, then, message.revision)

    def _loaded(
        self, asked: Loading, linked: Linked | Refusal, places: RunPlaces, now: int
    ) -> list[Outgoing]:
        """Start a program that was loaded, where nothing has come in between."""
        if self._loading is not asked:
            return []  # whoever asked was refused already
        by, message = asked.by, asked.message
        self._loading = self._cell.program = None
        start = linked if isinstance(linked, Refusal) else start_index(linked, message.line)
        refusal = self._cell.check(by.session, now, MotionKind.PROGRAM)
        if isinstance(linked, Refusal) or isinstance(start, Refusal) or refusal is not None:
            found = start if isinstance(start, Refusal) else refusal
            return [asked.verdict(found)]
        motion = ProgramMotion(self._cell, self._robot, by, message.request_id, message.speed)
        report = partial(self._report, linked, by)
        self._playing = current = Playing(
            linked, by, motion, self.surroundings, report, message.loops
        )
        current.note_request(message)
        current.pause_before(places, now)
        step = message.run == RunKind.STEP_FORWARD
        first = run.Start(start, message.loops or None, step)
        out = [asked.verdict(), *current.handle(first, now)]
        dropped = self._breakpoints.take_dropped(linked.programs)
        if dropped and not current.is_over:
            out += self._to_all(noted(program_report(linked, current.runner.status, None), dropped))
        return out

    def _go_on(self, current: Playing, message: ProgramRun, now: int) -> Refusal | list[Outgoing]:
        """Go on with the program that is paused, or take a step of it."""
        status = current.runner.status
        refusal = going_on_fault(message, current.linked, current.loops, status)
        if refusal is not None:
            return refusal
        if status.state is not run.RunState.PAUSED:
            return Refusal(VerdictCode.PROGRAM_RUNNING)
        refusal = current.motion.resume_fault(now)
        if refusal is not None:
            return refusal
        before, current.motion.speed = current.motion.speed, message.speed
        actions = current.runner.handle(GOING_ON[RunKind(message.run)], now)
        refused = next((each for each in actions if isinstance(each, run.Refused)), None)
        if refused is not None:
            current.motion.speed = before
            return refused.refusal
        current.note_request(message)
        done = Send(current.by.session, verdict(message.request_id))
        return [done, *current.perform(actions, now)]

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
        event = run.StepForward() if current.is_stepping else run.Resume()
        return self._asked(current, event, now)

    def program_stop(self, by: Holder, now: int) -> Refusal | list[Outgoing]:
        """End the program where it is; nothing of it goes on."""
        refusal = permission(self._cell.authority, by.session, now)
        if refusal is not None:
            return refusal
        stopped = Refusal(VerdictCode.PROGRAM_STOPPED)
        return self.abandon(stopped, now) + self._cell.end(stopped, now)

    def respeed(self, by: Holder, now: int) -> list[Outgoing]:
        """Follow a new speed override: at 0 a run pauses, and what is loaded does not begin."""
        fault = self._cell.modes.override_fault()
        if fault is None:
            return []
        if self._loading is not None:
            return self.abandon(fault, now)
        paused = self.pause(by, now)
        # A program that is paused already has nothing to be paused.
        return [] if isinstance(paused, Refusal) else paused

    def _allowed(self, by: Holder, now: int) -> Playing | Refusal:
        refusal = permission(self._cell.authority, by.session, now)
        if refusal is not None:
            return refusal
        text = "the program is being loaded; accepted: program stop"
        return self._run or Refusal(VerdictCode.NOTHING_TO_CONTROL, text)

    @staticmethod
    def _asked(current: Playing, event: run.Event, now: int) -> Refusal | list[Outgoing]:
        """Let the runner do what somebody wants, or say why not."""
        actions = current.runner.handle(event, now)
        for action in actions:
            if isinstance(action, run.Refused):
                return action.refusal
        return current.perform(actions, now)

    def under_way(self, program: str) -> tuple[int, str] | None:
        """Return revision and JSON of a program of the present run; None where it is in none."""
        if self._run is None or program not in self._run.linked.programs:
            return None
        return self._run.linked.revisions[program], self._run.linked.sources[program]

    def breakpoint_fault(self, program: str, session: int, now: int) -> Refusal | None:
        """Return why a connection may not set breakpoints: of what is under way, as to pause it."""
        is_loading = self._loading is not None and self._loading.message.program == program
        if not is_loading and self.under_way(program) is None:
            return None
        return permission(self._cell.authority, session, now)

    def set_breakpoints(self, program: str, places: Places, now: int) -> None:
        """Pause before these statements of a program from now on, in the present run."""
        if self._run is not None:
            self._run.pause_before({program: places}, now)

    # What happens.

    def news(self, news: News, now: int) -> list[Outgoing]:
        """Take what became of a motion of the run, or what ends it from outside."""
        current, by = self._run, self._by
        if isinstance(news, Begun | Refused | Ended):
            return [] if current is None else current.news(news, now)
        refusal = None if by is None else ending(news, by)
        if refusal is None or (isinstance(news, Interrupted) and not self._goes_on):
            # What is paused moves only when somebody resumes it, and then all is asked anew.
            return []
        return self.abandon(refusal, now)

    @property
    def _by(self) -> Holder | None:
        """Who runs a program, or has one loaded for that."""
        asked = self._loading or self._run
        return None if asked is None else asked.by

    @property
    def _goes_on(self) -> bool:
        """Whether a program goes on by itself, or begins once it is loaded."""
        current = self._run
        is_running = current is not None and current.runner.status.state is run.RunState.RUNNING
        return is_running or self._loading is not None

    def tick(self, now: int) -> list[Outgoing]:
        """Read on in what is loaded; look at the time, the motion, and what a wait depends on."""
        out = self._shelf.tick(now)
        by, current = self._by, self._run
        has_motion = current is not None and current.motion.is_asked
        if by is not None and self._goes_on and not has_motion:
            refusal = broken_condition(self._cell, by, now)
            if refusal is not None:
                return out + self.abandon(refusal, now)
        return out if current is None else out + current.tick(now)

    def abandon(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """End what runs or is loaded for a reason from outside; the robot stops, if it moves so."""
        asked, current = self._loading, self._run
        if asked is not None:
            self._loading = self._cell.program = None
            return [asked.verdict(refusal)]
        return [] if current is None else current.end(refusal, now)

    def shut_down(self, now: int) -> list[Outgoing]:
        """End the run because the server is going down."""
        return self.abandon(Refusal(VerdictCode.SHUTTING_DOWN), now)

    def _report(
        self, linked: Linked, by: Holder, status: run.RunStatus, ended: Refusal | None, now: int
    ) -> list[Outgoing]:
        """Tell where the run is; its first and its last report are its begin and its end."""
        out: list[Outgoing] = []
        if self._begun is None:
            self._begun = ProgramBegan(linked.main, linked.revisions[linked.main], by)
            out += self._cell.announce(self._begun, now)
        self._cell.program = running_program(linked, status)
        if self._cell.program is None:
            begun, self._begun = self._begun, None
            out += self._cell.announce(ProgramEnded(begun, ended or status.failure), now)
        return out + self._to_all(program_report(linked, status, ended))
