"""Program executor of a cell: run all, step, pause, resume, stop, at the request of pendants.

Owns the one run of a cell: who may ask for what, so that each request has one verdict, and the end
of a run, or of its loading, from outside. The run itself is `program_run`'s, the loading of a
program `program_loader`'s.

Owns the resume rule: a paused run continues as it was started. A request with other parameters is
refused with the present ones, because nobody would notice that a part of it was ignored. Owns also
the published state of a program that was requested and is still being loaded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import ProgramRun, ProgramState, RunKind
from openpendant.simplemsg.pendant.management.statements import MOST_PASSES
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.interlocks import broken_condition, check_interlocks, ending, permission
from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...control import Holder, MotionKind, speed_fault
from ...events.cell_events import (
    CellEvent,
    Interruption,
    MotionEvent,
    ProgramEnded,
    ProgramStarted,
    RunningProgram,
)
from ...events.effects import Effect, Send
from ...events.pending import Pending, Steps
from ...events.replies import verdict
from ...refusal import Refusal
from ..interpreter import run_events as run
from ..interpreter.run_events import Event, Resume, RunStatus, StepBack, StepForward
from ..language.linking import Linked
from ..library.kept_breakpoints import KeptBreakpoints, Places, RunPlaces
from ..library.program_loader import ProgramLoader, not_the_one_under_way
from .program_run import (
    ProgramExecution,
    ProgramMotion,
    RunEnvironment,
    noted,
    program_report,
    running_program,
    start_index,
)

GOING_ON: dict[RunKind, Event] = {
    RunKind.ALL: Resume(),
    RunKind.STEP_FORWARD: StepForward(),
    RunKind.STEP_BACKWARD: StepBack(),
}
"""Effect of each request on a paused run."""


def going_on_fault(
    message: ProgramRun, linked: Linked, loops: int, status: RunStatus
) -> Refusal | None:
    """Return the reason why a request does not continue a run.

    Args:
        loops: number of passes asked for; 0 for until it is stopped.
    """
    main, line = linked.main, status.stack[0].line if status.stack else 0
    if message.program != main:
        text = f"program {main!r} is under way; accepted: that, or another after a program stop"
        return Refusal(VerdictCode.PROGRAM_RUNNING, text)
    if message.line:
        text = (
            f"program {main!r} is under way in line {line}; accepted: line 0 to go on there,"
            f" or line {message.line} after a program stop"
        )
        return Refusal(VerdictCode.PROGRAM_RUNNING, text, value=message.line)
    running = linked.revisions[main]
    if message.revision not in (0, running):
        return not_the_one_under_way(message.program, message.revision, running)
    # A step is one statement, whatever the number of passes.
    if message.run == RunKind.ALL and message.loops != loops:
        text = (
            f"program {main!r} is under way {_often(loops)}; accepted: loops {loops} to go on,"
            f" or {message.loops} after a program stop"
        )
        return Refusal(VerdictCode.PROGRAM_RUNNING, text, value=message.loops, limit=loops)
    return None


def _often(loops: int) -> str:
    if not loops:
        return "until it is stopped"
    return "once" if loops == 1 else f"for {loops} loops"


def run_fault(message: ProgramRun) -> Refusal | None:
    """Return the fault of a request to run a program."""
    if message.run not in RunKind.__members__.values():
        text = f"run {message.run}; accepted: 1 all, 2 step forward, 3 step backward"
        return Refusal(VerdictCode.BAD_ARGUMENT, text)
    if not 0 <= message.loops <= MOST_PASSES:
        text = f"{message.loops} loops; accepted: 0 for until it is stopped, 1 to {MOST_PASSES}"
        return Refusal(VerdictCode.BAD_ARGUMENT, text)
    if message.revision < 0:
        text = f"revision {message.revision}; accepted: 0 for the newest, or from 1"
        return Refusal(VerdictCode.BAD_ARGUMENT, text)
    return speed_fault(message.speed)


@dataclass(frozen=True, slots=True, eq=False)
class Loading:
    """Request to run a program that is being loaded, without a verdict yet; each is separate."""

    by: Holder
    message: ProgramRun

    @property
    def shown(self) -> RunningProgram:
        """Published state of the program; it excludes any other motion."""
        return RunningProgram(self.message.program, ProgramState.NONE, 0, self.message.revision)

    def verdict(self, refusal: Refusal | None = None) -> Send:
        """Return the answer to the request."""
        return Send(self.by.session, verdict(self.message.request_id, refusal))


ToAll = Callable[[Message], list[Effect]]
"""Sends a message to every pendant of the cell."""


class ProgramExecutor:
    """Program run of one cell."""

    def __init__(
        self,
        cell: RobotCell,
        robot: RobotModel,
        loader: ProgramLoader,
        breakpoints: KeptBreakpoints,
        environment: RunEnvironment,
        to_all: ToAll,
        pending: Pending,
    ) -> None:
        self.environment = environment
        self._cell = cell
        self._robot = robot
        self._loader = loader
        self._breakpoints = breakpoints
        self._to_all = to_all
        self._pending = pending
        self._playing: ProgramExecution | None = None
        self._loading: Loading | None = None
        self._started: ProgramStarted | None = None

    @property
    def is_under_way(self) -> bool:
        """True while a program runs, waits, is paused or is being loaded."""
        return self._run is not None or self._loading is not None

    @property
    def _run(self) -> ProgramExecution | None:
        """Run that has not ended."""
        return None if self._playing is None or self._playing.is_over else self._playing

    def start(self, by: Holder, message: ProgramRun, now: int) -> Refusal | list[Effect]:
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
        refusal = check_interlocks(self._cell, by.session, now, MotionKind.PROGRAM)
        if refusal is not None:
            return refusal
        self._loading = asked = Loading(by, message)
        self._cell.show_program(asked.shown)
        steps = self._load(message.program, message.revision)
        return self._pending.run(steps, partial(self._loaded, asked), now)

    def _load(self, name: str, revision: int) -> Steps[tuple[Linked, RunPlaces] | Refusal]:
        """Load a program with its breakpoints; return them, or why it cannot run."""
        linked = yield from self._loader.linked(name, revision)
        if isinstance(linked, Refusal):
            return linked
        places = yield from self._breakpoints.of_run(linked)
        return places if isinstance(places, Refusal) else (linked, places)

    def _loaded(
        self, asked: Loading, found: tuple[Linked, RunPlaces] | Refusal, now: int
    ) -> list[Effect]:
        """Start a program that was loaded, where nothing has come in between."""
        if self._loading is not asked:
            return []  # the request was refused already
        by, message = asked.by, asked.message
        self._loading = None
        self._cell.show_program(None)
        if isinstance(found, Refusal):
            return [asked.verdict(found)]
        linked, places = found
        start = start_index(linked, message.line)
        if isinstance(start, Refusal):
            return [asked.verdict(start)]
        refusal = check_interlocks(self._cell, by.session, now, MotionKind.PROGRAM)
        if refusal is not None:
            return [asked.verdict(refusal)]
        motion = ProgramMotion(self._cell, self._robot, by, message.request_id, message.speed)
        report = partial(self._report, linked, by)
        self._playing = current = ProgramExecution(
            linked, by, motion, self.environment, report, message.loops
        )
        current.note_request(message)
        current.pause_before(places, now)
        step = message.run == RunKind.STEP_FORWARD
        first = run.Start(start, message.loops or None, step)
        motion.is_permitted = True  # as examined above, until this call returns
        out = [asked.verdict(), *current.handle(first, now)]
        motion.is_permitted = False
        dropped = self._breakpoints.take_dropped(linked.programs)
        if dropped and not current.is_over:
            out += self._to_all(noted(program_report(linked, current.runner.status, None), dropped))
        return out

    def _go_on(
        self, current: ProgramExecution, message: ProgramRun, now: int
    ) -> Refusal | list[Effect]:
        """Continue the paused program, or do a step of it."""
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
        refused = next((each for each in actions if isinstance(each, run.EventRefused)), None)
        if refused is not None:
            current.motion.speed = before
            return refused.refusal
        current.note_request(message)
        done = Send(current.by.session, verdict(message.request_id))
        return [done, *current.perform(actions, now)]

    def pause(self, by: Holder, now: int) -> Refusal | list[Effect]:
        """Pause the program, with its motion on its path."""
        current = self._allowed(by, now)
        return current if isinstance(current, Refusal) else self._asked(current, run.Pause(), now)

    def resume(self, by: Holder, now: int) -> Refusal | list[Effect]:
        """Continue after a pause; a step that was paused stays a step."""
        current = self._allowed(by, now)
        if isinstance(current, Refusal):
            return current
        refusal = current.motion.resume_fault(now)
        if refusal is not None:
            return refusal
        event = run.StepForward() if current.is_stepping else run.Resume()
        return self._asked(current, event, now)

    def program_stop(self, by: Holder, now: int) -> Refusal | list[Effect]:
        """End the program at its present statement; nothing of it continues."""
        refusal = permission(self._cell.authority, by.session, now)
        if refusal is not None:
            return refusal
        stopped = Refusal(VerdictCode.PROGRAM_STOPPED)
        return self.abandon(stopped, now) + self._cell.end(stopped, now)

    def respeed(self, by: Holder, now: int) -> list[Effect]:
        """Apply a speed override: at 0 a run pauses, and a loaded program does not start."""
        fault = self._cell.modes.override_fault()
        if fault is None:
            return []
        if self._loading is not None:
            return self.abandon(fault, now)
        paused = self.pause(by, now)
        # A paused program needs no second pause.
        return [] if isinstance(paused, Refusal) else paused

    def _allowed(self, by: Holder, now: int) -> ProgramExecution | Refusal:
        refusal = permission(self._cell.authority, by.session, now)
        if refusal is not None:
            return refusal
        text = "the program is being loaded; accepted: program stop"
        return self._run or Refusal(VerdictCode.NOTHING_TO_CONTROL, text)

    @staticmethod
    def _asked(current: ProgramExecution, event: run.Event, now: int) -> Refusal | list[Effect]:
        """Pass a request to the runner, or return its refusal."""
        actions = current.runner.handle(event, now)
        for action in actions:
            if isinstance(action, run.EventRefused):
                return action.refusal
        return current.perform(actions, now)

    def under_way(self, program: str) -> tuple[int, str] | None:
        """Return revision and JSON of a program of the present run; None if it is in none."""
        if self._run is None or program not in self._run.linked.programs:
            return None
        return self._run.linked.revisions[program], self._run.linked.sources[program]

    def is_in_run(self, program: str) -> bool:
        """Return True if a program is being loaded to run, or is part of the present run."""
        is_loading = self._loading is not None and self._loading.message.program == program
        return is_loading or self.under_way(program) is not None

    def breakpoint_fault(self, program: str, session: int, now: int) -> Refusal | None:
        """Return why a connection may not set breakpoints; a program in its run needs authority."""
        if not self.is_in_run(program):
            return None
        return permission(self._cell.authority, session, now)

    def set_breakpoints(self, program: str, places: Places, now: int) -> None:
        """Pause before these statements of a program from now on, in the present run."""
        if self._run is not None:
            self._run.pause_before({program: places}, now)

    def on_cell_event(self, event: CellEvent, now: int) -> list[Effect]:
        """Take the start or end of a motion of the run, or an event that ends the run."""
        current, by = self._run, self._by
        if isinstance(event, MotionEvent):
            return [] if current is None else current.on_cell_event(event, now)
        refusal = None if by is None else ending(event, by)
        if refusal is None or (isinstance(event, Interruption) and not self._goes_on):
            # A paused program moves only after a resume, and then every condition is checked again.
            return []
        return self.abandon(refusal, now)

    @property
    def _by(self) -> Holder | None:
        """Client that runs a program, or has one loaded for that."""
        asked = self._loading or self._run
        return None if asked is None else asked.by

    @property
    def _goes_on(self) -> bool:
        """True if a program continues by itself, or starts once it is loaded."""
        current = self._run
        is_running = current is not None and current.runner.status.state is run.RunState.RUNNING
        return is_running or self._loading is not None

    def tick(self, now: int) -> list[Effect]:
        """Continue the loading of a program, or advance the run by time, motion and waits."""
        out = self._pending.tick(now)
        by, current = self._by, self._run
        has_motion = current is not None and current.motion.is_asked
        if by is not None and self._goes_on and not has_motion:
            refusal = broken_condition(self._cell, by, now)
            if refusal is not None:
                return out + self.abandon(refusal, now)
        return out if current is None else out + current.tick(now)

    def abandon(self, refusal: Refusal, now: int) -> list[Effect]:
        """End the run or its loading for an outside reason; the robot stops, if it moves for it."""
        asked, current = self._loading, self._run
        if asked is not None:
            self._loading = None
            self._cell.show_program(None)
            return [asked.verdict(refusal)]
        return [] if current is None else current.end(refusal, now)

    def shut_down(self, now: int) -> list[Effect]:
        """End the run because the server is going down."""
        return self.abandon(Refusal(VerdictCode.SHUTTING_DOWN), now)

    def _report(
        self, linked: Linked, by: Holder, status: run.RunStatus, ended: Refusal | None, now: int
    ) -> list[Effect]:
        """Report the state of the run; its first and last report are its start and its end."""
        out: list[Effect] = []
        if self._started is None:
            self._started = ProgramStarted(linked.main, linked.revisions[linked.main], by)
            out += self._cell.announce(self._started, now)
        shown = running_program(linked, status)
        self._cell.show_program(shown)
        if shown is None:
            started, self._started = self._started, None
            out += self._cell.announce(ProgramEnded(started, ended or status.failure), now)
        return out + self._to_all(program_report(linked, status, ended))
