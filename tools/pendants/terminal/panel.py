"""The terminal pendant as a pure core: keys, news and time go in, commands come out.

Owns what each key does in each situation, and that a key does nothing where the display is stale;
what news does is `panel_news`. Whether the robot may move is the server's decision; a refusal comes
back as a message. Knows no terminal, no socket and no clock: `now` is monotonic time in ns.
"""

from __future__ import annotations

from collections.abc import Mapping

from openpendant.simplemsg.pendant import OperatingMode

from . import commands as do
from .commands import JOINTS, Command
from .enabling_toggle import TIMEOUT_NS
from .keyboard import KEYBOARD, STOP_KEY, AxisKey, Intent, Meaning, Page
from .panel_news import PanelNews, Question
from .program_choice import ProgramChoice
from .prompts import Choice, Entered, Entry, Wanted
from .speed_ladder import speed_asked
from .step_size import NotASize
from .targets import NotATarget, read_target
from .words import MODES


class Panel(PanelNews):
    """One terminal pendant; its attributes are those of `PanelNews`."""

    def __init__(self, keyboard: Mapping[str, Meaning] = KEYBOARD) -> None:
        """Make a pendant without a connection.

        Args:
            keyboard: what each key means; a single character, or a name such as `f1` or `tab`.
        """
        super().__init__()
        self._keyboard = keyboard

    def key(self, key: str, now: int) -> list[Command]:
        """Take a key stroke.

        Args:
            key: a single character, or the name of a key.
            now: monotonic time [ns].

        Returns:
            What is to be done, in order; nothing that moves the robot on values that may be old.
        """
        if key == STOP_KEY:
            return self._stop(now)
        asked = self._asked(key, now)
        # Here and not at each key, so that no answer to a question gets round it.
        moves = any(isinstance(each, do.BeginsMotion) for each in asked)
        return [] if moves and not self.jog.is_fresh(now) else asked

    def _asked(self, key: str, now: int) -> list[Command]:
        """Return what a key but that of the stop asks for, fresh values or not."""
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
        """Let time pass: a step that waited for other keys leaves, enabling runs out."""
        asked: list[Command] = [*self.stop_key.tick(now), *self.jog.tick(now)]
        if self.enabling.has_run_out(now):
            asked += self._let_go()
            seconds = TIMEOUT_NS // 1_000_000_000
            self.messages.add(f"enabling (training) let go: no key for {seconds} s")
        return asked

    # Stop, enabling, pages.

    def _stop(self, now: int) -> list[Command]:
        self.jog.let_go()
        self.question = None
        return [*self.stop_key.struck(now), *self._let_go()]

    def _toggle_enabling(self, now: int) -> list[Command]:
        if self.enabling.is_on:
            return self._let_go()
        self.enabling.turn_on(now)
        return [do.Enable(True)]

    def _pause_or_resume(self, now: int) -> Command:
        if not self.cell.is_paused:
            return do.Pause()
        if not self.cell.is_stale(now):
            return do.Resume()
        # It may have gone on since: a needless pause does no harm, a dropped one might.
        self.messages.add("STALE: asked for a pause; nothing resumes on values that may be old")
        return do.Pause()

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
                return [self._pause_or_resume(now)]
            case Intent.PROGRAM_STOP:
                return [do.StopProgram()]
            case Intent.PROGRAM:
                self.question = ProgramChoice()
                return [do.ListPrograms()]
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

    # Questions.

    def _answer(self, question: Question, key: str) -> list[Command]:
        answer = question.struck(key)
        self.question = None
        match answer:
            case Choice() | Entry() | ProgramChoice():
                self.question = answer
            case Entered():
                return self._entered(answer)
            case _ if answer is not None and self.cell.is_connected:
                if isinstance(answer, do.OpenProgram | do.CreateProgram):
                    self._show(Page.PROGRAM)
                return [answer]
        return []

    def _entered(self, entered: Entered) -> list[Command]:
        try:
            if entered.wanted is Wanted.STEP:
                self.jog.step = self.jog.step.typed(entered.text)
                return []
            return [read_target(entered.text, self.cell)]
        except (NotASize, NotATarget) as error:
            self.messages.add(str(error))
            return []


def _mode_choice() -> Choice:
    options: dict[str, tuple[str, Command | Choice]] = {
        str(mode.value): (MODES[mode][0], do.SetMode(mode)) for mode in OperatingMode
    }
    return Choice("Mode?", options)
