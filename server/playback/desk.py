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
from ..news import (
    AuthorityMoved,
    Begun,
    Ended,
    LatchedStop,
    ModeMoved,
    News,
    Refused,
    StopMoved,
)
from ..operating_mode import MotionKind
from ..outgoing import Outgoing, Send
from ..pendant.arguments import run_fault
from ..pendant.replies import verdict
from ..programs import run_messages as run
from ..programs.linking import Linked
from ..readiness import permission, stop_refusal
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..robot_view import RobotView
from .going_on import going_on_fault
from .kept_breakpoints import KeptBreakpoints, Places, RunPlaces
from .motion import ProgramMotion
from .playing import Playing
from .reports import noted, program_report, running_program, start_index
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
        self._loading: tuple[Holder, ProgramRun] | None = None

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
            return Refusal(VerdictCode.PROGRAM_RUNNING, "a program is being loaded")
        if message.run == RunKind.STEP_BACKWARD:
            text = (
                "no program is under way; accepted: step backward after a step,"
                " or while it is paused between two statements"
            )
            return Refusal(VerdictCode.PROGRAM_NOT_RUNNING, text)
        refusal = self._cell.check(by.session, now, MotionKind.PROGRAM)
        if refusal is not None:
            return refusal
        self._loading = loading = (by, message)

        def loaded(linked: Linked | Refusal, places: RunPlaces, at: int) -> list[Outgoing]:
            if self._loading is not loading:
                return [_verdict(by, message.request_id, Refusal(VerdictCode.PROGRAM_STOPPED))]
            self._loading = None
            return self._loaded(by, message, linked, places, at)

        then = partial(self._breakpoints.of_run, then=loaded)
        return self._shelf.fetch_linked(message.program, then, message.revision)

    def _loaded(
        self,
        by: Holder,
        message: ProgramRun,
        linked: Linked | Refusal,
        places: RunPlaces,
        now: int,
    ) -> list[Outgoing]:
        """Start a program that was loaded, where nothing has come in between."""
        start = linked if isinstance(linked, Refusal) else start_index(linked, message.line)
        refusal = self._cell.check(by.session, now, MotionKind.PROGRAM)
        if isinstance(linked, Refusal) or isinstance(start, Refusal) or refusal is not None:
            found = start if isinstance(start, Refusal) else refusal
            return [_verdict(by, message.request_id, found)]
        motion = ProgramMotion(self._cell, self._robot, by, message.request_id, message.speed)
        report = partial(self._report, linked)
        self._playing = current = Playing(
            linked, by, motion, self.surroundings, report, message.loops
        )
        current.note_request(message)
        current.pause_before(places, now)
        step = message.run == RunKind.STEP_FORWARD
        first = run.Start(start, message.loops or None, step)
        out = [_verdict(by, message.request_id), *current.handle(first, now)]
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
        actions = current.runner.handle(_EVENTS[RunKind(message.run)], now)
        refused = next((each for each in actions if isinstance(each, run.Refused)), None)
        if refused is not None:
            current.motion.speed = before
            return refused.refusal
        current.note_request(message)
        done = _verdict(current.by, message.request_id)
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
        self._loading = None
        return self.abandon(Refusal(VerdictCode.PROGRAM_STOPPED), now)

    def _allowed(self, by: Holder, now: int) -> Playing | Refusal:
        refusal = permission(self._cell.authority, by.session, now)
        if refusal is not None:
            return refusal
        return self._run or Refusal(VerdictCode.NOTHING_TO_CONTROL, "the program is being loaded")

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
        is_loading = self._loading is not None and self._loading[1].program == program
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
        current = self._run
        if current is None:
            return []
        match news:
            case Begun() | Refused() | Ended():
                return current.news(news, now)
            case StopMoved(stop=LatchedStop() as stop):
                return self.abandon(stop_refusal(stop), now)
            case ModeMoved(mode=mode):
                text = f"the mode changed to {mode.name.lower().replace('_', ' ')}"
                return self.abandon(Refusal(VerdictCode.MODE_CHANGED, text), now)
            case AuthorityMoved(change=change) if change.holder != current.by:
                return self.abandon(Refusal(VerdictCode.AUTHORITY_LOST), now)
        return []

    def tick(self, now: int) -> list[Outgoing]:
        """Read on in what is loaded; look at the time, the enabling device and the motion."""
        loaded = self._shelf.tick(now)
        current = self._run
        if current is None:
            return loaded
        modes, controller = self._cell.modes, self._cell.mode
        runs = current.runner.status.state is run.RunState.RUNNING
        if runs and not current.motion.is_asked and modes.needs_enabling(controller):
            if not modes.is_enabled(current.by.session, now):
                return loaded + self.abandon(Refusal(VerdictCode.ENABLING_LOST), now)
        return loaded + current.tick(now)

    def abandon(self, refusal: Refusal, now: int) -> list[Outgoing]:
        """End the run for a reason from outside; the robot is stopped, where it moves for it."""
        current = self._run
        return [] if current is None else current.end(refusal, now)

    def shut_down(self, now: int) -> list[Outgoing]:
        """End the run because the server is going down."""
        self._loading = None
        return self.abandon(Refusal(VerdictCode.SHUTTING_DOWN), now)

    def _report(
        self, linked: Linked, status: run.RunStatus, ended: Refusal | None
    ) -> list[Outgoing]:
        self._cell.program = running_program(linked, status)
        return self._to_all(program_report(linked, status, ended))


_EVENTS: dict[RunKind, run.Event] = {
    RunKind.ALL: run.Resume(),
    RunKind.STEP_FORWARD: run.StepForward(),
    RunKind.STEP_BACKWARD: run.StepBack(),
}


def _verdict(by: Holder, request_id: int, refusal: Refusal | None = None) -> Send:
    return Send(by.session, verdict(request_id, refusal))
