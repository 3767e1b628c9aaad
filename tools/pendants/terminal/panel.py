"""The terminal pendant as a pure core: keys, news and time go in, commands come out.

Owns what each key does in each situation, and that a key does nothing where the display is stale.
Whether the robot may move is the server's decision; a refusal comes back as a message. Knows no
terminal, no socket and no clock: `now` is monotonic time in ns.
"""

from __future__ import annotations

from collections.abc import Mapping

from openpendant.simplemsg.pendant import (
    Activity,
    ModeChanged,
    OperatingMode,
    ProgramState,
    StopChanged,
    StopKind,
)

from . import commands as do
from .cell_view import CellView
from .commands import JOINTS, Command
from .enabling_toggle import TIMEOUT_NS, EnablingToggle
from .jog_pad import JogPad
from .keyboard import KEYBOARD, STOP_KEY, AxisKey, Intent, Meaning, Page
from .messages import Messages
from .prompts import Choice, Entry, Question, Wanted
from .speed_ladder import speed_asked
from .step_size import NotASize
from .targets import NotATarget, read_target
from .taught_program import TaughtProgram
from .teaching import Teaching
from .words import MODES

STOP_REASON = "space bar"


class Panel:
    """One terminal pendant.

    Attributes:
        cell: what is known of the cell.
        page: the page that is shown.
        jog: the jog keys.
        enabling: the enabling device (training).
        question: what the display asks; None for nothing.
        teaching: the open program.
        messages: what was said.
        why: why the robot does not move, line by line, as it was when it was asked.
        scroll: first line of a long text that is shown.
    """

    def __init__(self, keyboard: Mapping[str, Meaning] = KEYBOARD) -> None:
        """Make a pendant without a connection.

        Args:
            keyboard: what each key means; a single character, or a name such as `f1` or `tab`.
        """
        self.cell = CellView()
        self.page = Page.JOINTS
        self.messages = Messages()
        self.jog = JogPad(self.cell, self.messages)
        self.teaching = Teaching(self.messages)
        self.enabling = EnablingToggle()
        self.question: Question | None = None
        self.why: tuple[str, ...] = ()
        self.scroll = 0
        self._keyboard = keyboard
        self._stop_is_owed = False

    # What comes in.

    def key(self, key: str, now: int) -> list[Command]:
        """Take a key stroke.

        Args:
            key: a single character, or the name of a key.
            now: monotonic time [ns].

        Returns:
            What is to be done, in order.
        """
        if key == STOP_KEY:
            return self._stop()
        self.enabling.key(now)
        if self.question is not None:
            return self._answer(self.question, key, now)
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
        """Let time pass: a step that waited for other keys leaves, enabling runs out."""
        asked = self.jog.tick(now)
        if self.enabling.has_run_out(now):
            asked += self._let_go()
            seconds = TIMEOUT_NS // 1_000_000_000
            self.messages.add(f"enabling (training) let go: no key for {seconds} s")
        return asked

    def connected(self) -> list[Command]:
        """Take note that the cell is connected, after `cell.connected`."""
        self.jog.check_frame()
        self.messages.add(f"connected to {self.cell.cell}, robot {self.cell.robot}")
        owed, self._stop_is_owed = self._stop_is_owed, False
        return [do.SoftwareStop(f"{STOP_REASON}, pressed without a link")] if owed else []

    def lost(self, reason: str) -> None:
        """Take note that the connection ended: nothing that was held is held any more."""
        self.cell.lost(reason)
        self.jog.let_go()
        self.enabling.turn_off()
        self.question = None
        self.teaching.walked(None)
        self.messages.add(f"no link: {reason}")

    def stop_changed(self, change: StopChanged) -> list[Command]:
        """Take the news of a stop; what is held is let go, as the server wants to see."""
        self.cell.stop_changed(change)
        if change.stop == StopKind.NONE:
            self.messages.add(f"stop reset by {change.client or 'the server'}")
            return []
        self.messages.add(f"stop by {change.client or 'the server'}: {change.reason}")
        return self._let_go()

    def mode_changed(self, change: ModeChanged) -> list[Command]:
        """Take the news of another mode; what is held is let go likewise."""
        known = change.mode in set(OperatingMode)
        name = MODES[OperatingMode(change.mode)][1] if known else f"{change.mode}"
        self.messages.add(f"mode {name} by {change.client or 'the controller'}")
        return self._let_go()

    def not_enabled(self) -> list[Command]:
        """The server does not take the enabling device as held: so it is not shown as held."""
        if self.enabling.is_on:
            self.messages.add("enabling (training) was let go: v holds it anew")
        return self._let_go()

    def opened(self, program: TaughtProgram) -> None:
        """Take a program that was loaded, or loaded anew after an edit."""
        self.teaching.opened(program)

    def explained(self, lines: tuple[str, ...]) -> None:
        """Take the answer to why the robot does not move."""
        self.why = lines
        self._show(Page.WHY)

    # Stop, enabling, pages.

    def _stop(self) -> list[Command]:
        self.jog.let_go()
        self.question = None
        if not self.cell.is_connected:
            self._stop_is_owed = True
            self.messages.add("NO LINK: the stop leaves once linked; use the hardware button")
            self.enabling.turn_off()
            return []
        return [do.SoftwareStop(STOP_REASON), *self._let_go()]

    def _let_go(self) -> list[Command]:
        """Let everything go that is held."""
        self.jog.let_go()
        return [do.Enable(False)] if self.enabling.turn_off() else []

    def _toggle_enabling(self, now: int) -> list[Command]:
        if self.enabling.is_on:
            return self._let_go()
        self.enabling.turn_on(now)
        return [do.Enable(True)]

    def _show(self, page: Page) -> None:
        self.page, self.scroll = page, 0

    def _turn_page(self, by: int) -> None:
        pages = list(Page)
        self._show(pages[(pages.index(self.page) + by) % len(pages)])

    def _move_up_or_down(self, by: int) -> None:
        """Select another statement, or read on in a long text."""
        if self.page in (Page.MESSAGES, Page.WHY, Page.JOINTS):
            self.scroll = max(0, self.scroll + by)
        else:
            self.teaching.select(by)

    # Everything else that a key may ask for.

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
                return self._let_go()
            case Intent.RESET:
                return [do.ResetStop()]
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
                return [do.Resume() if self._is_paused else do.Pause()]
            case Intent.PROGRAM_STOP:
                return [do.StopProgram()]
        return self._ask_or_do(
            self.teaching.asked(intent, "PTP" if self.jog.frame == JOINTS else "LIN")
        )

    def _ask_or_do(self, wanted: Choice | Command | None) -> list[Command]:
        """Put a question on the display, or return the command to be done."""
        if isinstance(wanted, Choice):
            self.question = wanted
            return []
        return [] if wanted is None else [wanted]

    def _stays_here(self, intent: Intent) -> bool:
        """Do what concerns nobody but this pendant; tell whether that is all."""
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
                self.question = Entry(Wanted.STEP)
            case Intent.TARGET:
                self.question = Entry(Wanted.TARGET)
            case Intent.PROGRAM:
                self.question = Entry(Wanted.PROGRAM)
            case Intent.MODE:
                self.question = _mode_choice()
            case Intent.HOME:
                home, zero = ("home", do.GoHome("home")), ("zero", do.GoHome("zero"))
                self.question = Choice("Move all joints to", {"1": home, "2": zero})
            case Intent.TAKE_OVER:
                self.question = Choice("Take over?", {"1": ("yes", do.TakeControl(force=True))})
            case _:
                return False
        return True

    @property
    def _is_paused(self) -> bool:
        state = self.cell.state
        if state is None:
            return False
        program = (ProgramState.PAUSED, ProgramState.AT_BREAKPOINT, ProgramState.STEPPED)
        paused = (Activity.PAUSED, Activity.PAUSING)
        return state.activity in paused or state.program_state in program

    # Questions.

    def _answer(self, question: Question, key: str, now: int) -> list[Command]:
        if isinstance(question, Choice):
            self.question = None
            if not self.cell.is_connected or key not in question.options:
                return []
            return self._ask_or_do(question.options[key][1])
        if key == "escape":
            self.question = None
            return []
        if key != "enter":
            self.question = question.typed(key)
            return []
        self.question = None
        return self._entered(question.wanted, question.text, now)

    def _entered(self, wanted: Wanted, text: str, now: int) -> list[Command]:
        try:
            match wanted:
                case Wanted.STEP:
                    self.jog.step = self.jog.step.typed(text)
                    return []
                case Wanted.TARGET:
                    target = read_target(text, self.cell.joints)
                    return [target] if self.jog.is_fresh(now) else []
        except (NotASize, NotATarget) as error:
            self.messages.add(str(error))
            return []
        if not text or not self.cell.is_connected:
            return []
        self._show(Page.PROGRAM)
        return [do.OpenProgram(text)]


def _mode_choice() -> Choice:
    options: dict[str, tuple[str, Command | Choice]] = {
        str(mode.value): (MODES[mode][0], do.SetMode(mode)) for mode in OperatingMode
    }
    return Choice("Mode?", options)
