"""Core of the terminal pendant, without input or output: keys, events and time in, commands out.

Owns the state of the pendant, the effect of each event on it, the action of each key in each state,
that motion keys do nothing while the display is stale, and which program is shown as running: a
called program and another revision count as another program, or their lines would be marked in the
wrong text. The server decides if the robot may move; a refusal becomes a message. Knows no
terminal, socket or clock: `now` is monotonic time in ns.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

from openpendant.simplemsg.pendant import (
    ModeChanged,
    OperatingMode,
    ProgramReport,
    StopChanged,
    StopKind,
)

from ...console import one_line
from ..client import Hold, Refused
from . import commands as do
from . import wording
from .cell_lists import ChosenFrame, Listing, listing_of, lists_choice
from .cell_view import CellView
from .commands import JOINTS, CellList, Command
from .jog_pad import JogPad, NotASize, speed_asked
from .keyboard import KEYBOARD, STOP_KEYS, AxisKey, Intent, Meaning, Page
from .messages import Messages
from .prompts import (
    Choice,
    EnteredText,
    NotATarget,
    ProgramChoice,
    TextEntry,
    TextPurpose,
    creation,
    read_target,
)
from .stop_key import EMULATED_TIMEOUT_NS, TIMEOUT_NS, EnablingToggle, StopKey
from .taught_program import TaughtProgram
from .teaching import Teaching
from .wording import MODES, Remedies, in_screen_units

Question: TypeAlias = Choice | TextEntry | ProgramChoice | Listing

_MOST_LINES, _LONGEST_LINE = 200, 1_000
"""Of an answer of the server; more than that nobody reads on a display of four rows."""


class Panel:
    """One terminal pendant.

    Attributes:
        question: the question on the display; None for none.
        why: the lines of the last answer to why the robot does not move.
        scroll: first shown line of a long text.
        attach_command: what starts another pendant of this server.
        shows_keys: all keys stand on the screen, in the place of all that can wait.
        remedies: what to do about a refusal, by the keys of this pendant.
        gives_control: how control is given up here.
    """

    remedies: Remedies = wording.KEYBOARD_REMEDIES
    gives_control = "c gives it up"

    def __init__(self, keyboard: Mapping[str, Meaning] = KEYBOARD) -> None:
        """Make a pendant without a connection.

        Args:
            keyboard: meaning of each key; a key is one character, or a name such as `f1` or `tab`.
        """
        self._keyboard = keyboard
        self.cell = CellView()
        self.page = Page.JOINTS
        self.messages = Messages()
        self.stop_key = StopKey(self.cell, self.messages)
        self.jog = JogPad(self.cell, self.messages)
        self.teaching = Teaching(self.messages)
        self.enabling = EnablingToggle()
        self.question: Question | None = None
        self.why: tuple[str, ...] = ()
        self.scroll = 0
        self.attach_command = "openpendant pendant"
        self.shows_keys = False

    def greeted(self) -> list[Command]:
        """Take the hello reply of a server; return the pending stop, to be sent at once."""
        self.cell.greeted()
        return [*self.stop_key.linked()]

    def turned_away(self, reason: str) -> list[Command]:
        """Take a refused login; the connection stays until the pending stop is answered."""
        self.cell.turned_away(reason)
        self.question = None
        self.messages.add(f"no login: {reason}")
        return self._let_go("no login")

    def connected(self) -> list[Command]:
        """Take the event that the cell is connected, after `cell.connected`."""
        self.jog.check_frame()
        self.messages.add(f"connected to {self.cell.cell}, robot {self.cell.robot}")
        # Once more: a second stop does no harm.
        return [*self.stop_key.linked()]

    def lost(self, reason: str) -> None:
        """Take the end of the connection; release everything that is held."""
        self.cell.lost(reason)
        self.jog.let_go()
        self.enabling.turn_off("no link")
        self.controller_described(is_emulated=False)
        self.question = None
        self.teaching.walked(None)
        self.messages.add(f"no link: {reason}")

    def controller_described(self, *, is_emulated: bool) -> None:
        """Take whether the controller is known to be emulated; it is not until the server says so.

        There enabling (training) stays held for longer without a key.
        """
        self.enabling.timeout_ns = EMULATED_TIMEOUT_NS if is_emulated else TIMEOUT_NS

    def stop_changed(self, change: StopChanged) -> list[Command]:
        """Take the event of a stop; release what is held, as the server demands after a stop."""
        self.cell.stop_changed(change)
        if change.stop == StopKind.NONE:
            self.messages.add(f"stop reset by {change.client or 'the server'}")
            return []
        self.messages.add(f"stop by {change.client or 'the server'}: {change.reason}")
        self.stop_key.latched()
        return self._let_go("a stop")

    def mode_changed(self, change: ModeChanged) -> list[Command]:
        """Take the event of another mode; release what is held likewise."""
        known = change.mode in set(OperatingMode)
        name = MODES[OperatingMode(change.mode)][1] if known else f"{change.mode}"
        self.messages.add(f"mode {name} by {change.client or 'the controller'}")
        return self._let_go("another mode")

    def refused(self, refused: Refused) -> list[Command]:
        """Take a refused request, or an aborted motion, that was told as a message."""
        return []

    def why_told(self, answer: dict[str, Any], holds: Sequence[Hold]) -> None:
        """Take the server's answer why the robot does not move, and what it stands at."""
        self.explained(wording.why_lines(answer, holds, self.remedies))

    def not_enabled(self) -> list[Command]:
        """Take the refusal of the enabling device; show it as released."""
        if self.enabling.is_on:
            self.messages.add("enabling (training) was let go: v holds it anew")
        return self._let_go("the server does not take it as held")

    def opened(self, program: TaughtProgram) -> None:
        """Take a program that was loaded, or reloaded after an edit."""
        shown = self.teaching.program
        if shown is not None and shown != program and isinstance(self.question, Choice):
            # It was asked about the statements that were shown until now.
            self.question = None
        self.teaching.opened(program)

    def listed(self, names: Iterable[str]) -> None:
        """Take the names of all programs."""
        if isinstance(self.question, ProgramChoice):
            self.question = self.question.listed(names)

    def told_list(self, kind: CellList, answer: Mapping[str, Any]) -> None:
        """Take one of the cell's lists, as the server answered; show it if no question is open.

        Raises:
            KeyError, TypeError, ValueError: it is none.
        """
        listing = listing_of(kind, answer)
        if self.question is None:
            self.question = listing

    def not_there(self, name: str) -> None:
        """Take that the program to open does not exist; ask to create it if no question is open."""
        self.messages.add(f"there is no program {name}: create it? 1 does, any other key does not")
        if self.question is None:
            self.question = creation(name)

    def program_moved(self, report: ProgramReport) -> list[Command]:
        """Take the report of a running program; add a message if it runs another revision."""
        self.cell.program_moved(report)
        if report.text:
            self.messages.add(f"{report.program}: {in_screen_units(report.text)}")
        shown = self.teaching.program
        if shown is None or shown.name != report.program or report.revision <= shown.revision:
            return []
        if not self.cell.is_connected:
            return []
        return [do.ReloadProgram(shown.name)]

    def explained(self, lines: tuple[str, ...]) -> None:
        """Take the answer to why the robot does not move."""
        self.why = tuple(one_line(line, "?", _LONGEST_LINE) for line in lines[:_MOST_LINES])
        self._show(Page.WHY)

    def _let_go(self, why: str) -> list[Command]:
        """Release everything that is held."""
        self.jog.let_go()
        return [do.Enable(False)] if self.enabling.turn_off(why) else []

    def _show(self, page: Page) -> None:
        self.page, self.scroll = page, 0

    def key(self, key: str, now: int) -> list[Command]:
        """Take a key stroke."""
        if key in STOP_KEYS:
            return self._stop(STOP_KEYS[key], now)
        asked = self._asked(key, now)
        # Here and not at each key, so that no answer to a question gets round it.
        moves = any(isinstance(each, do.BeginsMotion) for each in asked)
        return [] if moves and not self.jog.is_fresh(now) else asked

    def _asked(self, key: str, now: int) -> list[Command]:
        """Return the commands of a key other than the stop key, with fresh or stale values."""
        self.enabling.key(now)
        if self.question is not None:
            return self._answer(self.question, key)
        meaning = self._keyboard.get(key)
        match meaning:
            case AxisKey():
                return self.jog.key(meaning, now)
            case Page():
                self._show(meaning)
                return []
            case Intent():
                return self._intent(meaning, now)
        if self._keyboard.get(key.lower()) is not None:
            self.messages.add(f"{key} does nothing: is Caps Lock on?")
        else:
            self.messages.add(f"no such key: {key}")
        return []

    def tick(self, now: int) -> list[Command]:
        """Advance the time: send a collected step, repeat a stop, release the enabling device."""
        asked: list[Command] = [*self.stop_key.tick(now), *self.jog.tick(now)]
        if self.enabling.has_run_out(now):
            why = f"no key for {self.enabling.timeout_ns // 1_000_000_000} s"
            asked += self._let_go(why)
            self.messages.add(f"enabling (training) let go: {why}")
        return asked

    def _stop(self, by: str, now: int) -> list[Command]:
        self.jog.let_go()
        self.question = None
        return [*self.stop_key.struck(by, now), *self._let_go(by)]

    def _toggle_enabling(self, now: int) -> list[Command]:
        if self.enabling.is_on:
            return self._let_go("v")
        self.enabling.turn_on(now)
        return [do.Enable(True)]

    def _pause_or_resume(self, now: int) -> Command:
        if not self.cell.is_paused:
            return do.PauseRobot()
        if not self.cell.is_stale(now):
            return do.ResumeRobot()
        # It may have gone on since: a needless pause does no harm, a dropped one might.
        self.messages.add("STALE: asked for a pause; nothing resumes on values that may be old")
        return do.PauseRobot()

    def _turn_page(self, by: int) -> None:
        pages = list(Page)
        self._show(pages[(pages.index(self.page) + by) % len(pages)])

    def _move_up_or_down(self, by: int) -> None:
        """Select another statement, or scroll a long text."""
        if self.page in (Page.MESSAGES, Page.WHY, Page.JOINTS):
            self.scroll = max(0, self.scroll + by)
        else:
            self.teaching.select(by)

    def _intent(self, intent: Intent, now: int) -> list[Command]:
        if self._stays_here(intent):
            return []
        if not self.cell.is_connected:
            self.messages.add(f"no link: {self.cell.absence}")
            return []
        match intent:
            case Intent.ENABLE:
                return self._toggle_enabling(now)
            case Intent.LET_GO:
                self.shows_keys = False
                return self._let_go("Esc")
            case Intent.RESET:
                return [do.UnlatchStop()]
            case Intent.CONTROL:
                return [do.GiveControl() if self.cell.in_control else do.TakeControl()]
            case Intent.UNDO_JOG:
                return [do.UndoJog()]
            case Intent.WHY:
                return [do.AskWhy()]
            case Intent.SLOWER | Intent.FASTER | Intent.CAP_DOWN | Intent.CAP_UP:
                state = self.cell.state
                return [] if state is None else [speed_asked(intent, state)]
            case Intent.PAUSE:
                return [self._pause_or_resume(now)]
            case Intent.PROGRAM_STOP:
                return [do.StopProgram()]
            case Intent.PROGRAM:
                self.question = ProgramChoice()
                return [do.AskPrograms()]
        return self._ask_or_do(
            self.teaching.asked(intent, "PTP" if self.jog.frame == JOINTS else "LIN")
        )

    def _ask_or_do(self, wanted: Choice | Command | None) -> list[Command]:
        """Show a question on the display, or return the command."""
        if isinstance(wanted, Choice):
            self.question = wanted
            return []
        return [] if wanted is None else [wanted]

    def _stays_here(self, intent: Intent) -> bool:
        """Carry out a key that affects only this pendant; return True if it was one."""
        match intent:
            case Intent.NEXT_PAGE | Intent.LAST_PAGE:
                self._turn_page(1 if intent is Intent.NEXT_PAGE else -1)
            case Intent.UP | Intent.DOWN:
                self._move_up_or_down(1 if intent is Intent.DOWN else -1)
            case Intent.NEXT_FRAME | Intent.LAST_FRAME:
                self.jog.turn_frame(1 if intent is Intent.NEXT_FRAME else -1)
            case Intent.JOG_KIND:
                self.jog.toggle_kind()
            case Intent.STEP_DOWN | Intent.STEP_UP:
                self.jog.step = self.jog.step.changed(1 if intent is Intent.STEP_UP else -1)
            case Intent.STEP_TYPED:
                self.question = TextEntry(TextPurpose.STEP)
            case Intent.TARGET:
                self.question = TextEntry(TextPurpose.TARGET)
            case Intent.MODE:
                self.question = _mode_choice()
            case Intent.LISTS:
                self.question = lists_choice()
            case Intent.ALL_KEYS:
                self.shows_keys = not self.shows_keys
            case Intent.HOME:
                home, zero = ("home", do.GoHome("home")), ("zero", do.GoHome("zero"))
                self.question = Choice("Move all joints to", {"1": home, "2": zero})
            case Intent.TAKE_OVER:
                self.question = Choice("Take over?", {"1": ("yes", do.TakeControl(force=True))})
            case _:
                return False
        return True

    def _answer(self, question: Question, key: str) -> list[Command]:
        answer = question.struck(key)
        self.question = None
        match answer:
            case Choice() | TextEntry() | ProgramChoice() | Listing():
                self.question = answer
            case ChosenFrame(name=name):
                self.jog.choose_frame(name)
            case EnteredText():
                return self._entered(answer)
            case _ if answer is not None and self.cell.is_connected:
                if isinstance(answer, do.OpenProgram | do.MakeProgram):
                    self._show(Page.PROGRAM)
                return [answer]
        return []

    def _entered(self, entered: EnteredText) -> list[Command]:
        try:
            if entered.wanted is TextPurpose.STEP:
                self.jog.step = self.jog.step.typed(entered.text)
                return []
            if entered.wanted is TextPurpose.RECORDING:
                return [do.RecordMotion(entered.text)] if entered.text else []
            return [read_target(entered.text, self.cell)]
        except (NotASize, NotATarget) as error:
            self.messages.add(str(error))
            return []


def _mode_choice() -> Choice:
    options: dict[str, tuple[str, Command | Choice]] = {
        str(mode.value): (MODES[mode][0], do.ChangeMode(mode)) for mode in OperatingMode
    }
    return Choice("Mode?", options)


def _is_open(panel: Panel) -> bool:
    """Return True if the run is in the open program, in the shown revision."""
    place, program = panel.cell.program_place, panel.teaching.program
    if place is None or program is None:
        return False
    return (place.name, place.revision) == (program.name, program.revision)


def open_state(panel: Panel) -> str:
    """Return the state of the open program; empty while it does not run."""
    return wording.program_state(panel.cell) if _is_open(panel) else ""


def running_statement(panel: Panel) -> int | None:
    """Return the running statement, from 0; None if it is none of the open program."""
    place, program = panel.cell.program_place, panel.teaching.program
    if place is None or program is None or not _is_open(panel):
        return None
    return program.index_of(place.line)


def other_program(panel: Panel) -> str:
    """Return the name of a running program other than the open one; empty for none.

    The revision follows where the open program has the same name.
    """
    place, program = panel.cell.program_place, panel.teaching.program
    if place is None or _is_open(panel):
        return ""
    is_namesake = program is not None and program.name == place.name
    return f"{place.name} r{place.revision}" if is_namesake else place.name


def other_line(panel: Panel) -> str:
    """Return that program with its state and line; empty for none."""
    name, place = other_program(panel), panel.cell.program_place
    if not name or place is None:
        return ""
    where = f"line {place.line}" if place.line else ""
    told = (name, wording.program_state(panel.cell), where)
    return f"under way: {', '.join(part for part in told if part)}"
