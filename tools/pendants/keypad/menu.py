"""Menu of the keypad: second meanings of the jog keys, and the pages that they lead to.

Owns what each key asks for there, the selection in its lists, the questions before something moves
in automatic, and that a motion in the manual modes goes on only while its key is held. The server
decides whether the robot may move.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from itertools import count
from typing import Any

from openpendant.simplemsg.pendant import Activity, OperatingMode, RunKind

from ..panel import commands as do
from ..panel.cell_view import CellView
from ..panel.commands import JOINTS, CellList, Command
from ..panel.jog_pad import JogPad
from ..panel.messages import Messages
from ..panel.taught_program import RecordHere
from ..panel.teaching import Teaching
from .keys import MenuKey

CLOSES_NS = 10_000_000_000
"""The menu closes so long after its last key [ns]."""

ASKS_NS = 500_000_000
"""The recording under way is asked about so often while it is shown [ns]."""

NAMED = "keypad-"
"""Recordings and programs that are made here have this name and the next free number."""

Movable = do.UndoJog | do.GoHome | do.RunProgram | do.PlayBack | do.ResumeRobot


class MenuView(Enum):
    """What the display shows while the menu is open."""

    KEYS = "keys"
    RECORDINGS = "recordings"
    RECORD = "record"
    PROGRAMS = "programs"
    QUESTION = "question"
    MOTION = "motion"
    PAGE = "page"


@dataclass(frozen=True, slots=True)
class KeyQuestion:
    """A question that keys of the menu answer; any other one means no."""

    rows: tuple[str, ...]
    answers: Mapping[MenuKey, Command]


@dataclass(slots=True)
class HeldMotion:
    """A motion that goes on while its key is held.

    Attributes:
        key: number of the key.
        duration: of the whole motion [s]; None where it is not known.
        elapsed: of it so far, at the speed that it is driven [s].
    """

    key: int
    title: str
    duration: float | None = None
    elapsed: float = 0.0
    is_over: bool = False


@dataclass(frozen=True, slots=True)
class RecordingShown:
    """The recording that is being made, as it was told last."""

    name: str
    duration: float = 0.0
    samples: int = 0


@dataclass(slots=True)
class Menu:
    """The menu of one keypad.

    Attributes:
        view: what is shown; None while the menu is closed.
        recordings: name and length of each [s], those that were made here first, the newest on top.
        programs: names of the stored programs.
        selected: the entry of the shown list, from 0.
        under_way: the recording that is being made.
        turns_page: pages that the display is to go on by; the panel takes them.
        turns_row: rows of the page likewise.
        shows_program: the page of the program is to be shown; the panel takes that, too.
    """

    cell: CellView
    jog: JogPad
    teaching: Teaching
    messages: Messages
    view: MenuView | None = None
    recordings: tuple[tuple[str, float | None], ...] | None = None
    programs: tuple[str, ...] | None = None
    selected: int = 0
    under_way: RecordingShown | None = None
    question: KeyQuestion | None = None
    motion: HeldMotion | None = None
    turns_page: int = 0
    turns_row: int = 0
    shows_program: bool = False
    _last_key: int = 0
    _asked: int = 0
    _ticked: int = 0

    @property
    def is_open(self) -> bool:
        """True while the keys have their second meaning."""
        return self.view is not None

    def open(self, now: int) -> None:
        """Open the menu [ns]; while a recording is made, with that."""
        self._last_key = now
        self.view = MenuView.RECORD if self.under_way else MenuView.KEYS

    def close(self) -> None:
        """Close the menu."""
        self.view = self.question = None

    def listed(self, answer: Mapping[str, Any]) -> None:
        """Take the server's list of recordings.

        Raises:
            KeyError, TypeError, ValueError: it is none.
        """
        told = answer["recording"]
        self.under_way = (
            None
            if told is None
            else RecordingShown(str(told["name"]), float(told["duration"]), int(told["samples"]))
        )
        found = [_entry(each) for each in answer["recordings"]]
        self.recordings = tuple(sorted(found, key=lambda each: _rank(each[0])))
        self._select(0)
        if self.view is MenuView.RECORD and self.under_way is None:
            self.view = MenuView.RECORDINGS
        elif self.view is MenuView.RECORDINGS and self.under_way is not None:
            self.view = MenuView.RECORD

    def programs_listed(self, names: Iterable[str]) -> None:
        """Take the names of the stored programs."""
        self.programs = tuple(sorted(names, key=_rank))
        self._select(0)

    def tick(self, now: int, keys_down: int) -> list[Command]:
        """Advance the time; ask for what is shown, and close where nobody is there [ns].

        Args:
            keys_down: mask of the keys that are down.
        """
        self._follow_motion(now)
        if keys_down:
            self._last_key = now
        if self.is_open and self.motion is None and now - self._last_key >= CLOSES_NS:
            self.close()
        if self.view is MenuView.RECORD and now - self._asked >= ASKS_NS:
            self._asked = now
            return [do.AskList(CellList.RECORDINGS)]
        return []

    def _follow_motion(self, now: int) -> None:
        motion, state = self.motion, self.cell.state
        if motion is not None and state is not None and state.activity == Activity.MOVING:
            motion.elapsed += (now - self._ticked) / 1e9 * state.override
        self._ticked = now

    def key(self, meaning: MenuKey, key: int, now: int) -> list[Command]:
        """Take a key [ns]; return what it asks for."""
        self._last_key = now
        if self.question is not None:
            return self._answer(meaning)
        match meaning:
            case MenuKey.RECORD:
                return self._record()
            case MenuKey.PLAY:
                return self._play(key, now)
            case MenuKey.UP | MenuKey.DOWN:
                return self._move(1 if meaning is MenuKey.DOWN else -1)
            case MenuKey.TEACH:
                return self._teach()
            case MenuKey.UNDO:
                return self._hold(do.UndoJog(), HeldMotion(key, "UNDO"), meaning, now)
            case MenuKey.HOME:
                return self._hold(do.GoHome("home"), HeldMotion(key, "HOME"), meaning, now)
            case MenuKey.RUN:
                return self._run(key, now)
            case MenuKey.PAGE:
                self.turns_page += 1
                self.view = MenuView.PAGE
                return []
            case MenuKey.CONTROL:
                return [do.GiveControl() if self.cell.in_control else do.TakeControl()]
            case MenuKey.PAUSE:
                if not self.cell.is_paused:
                    return [do.PauseRobot()]
                return self._hold(do.ResumeRobot(), HeldMotion(key, "RESUME"), meaning, now)
            case MenuKey.T1_T2:
                return self._change_mode()

    def let_go(self) -> list[Command]:
        """Take that no key is held any more; return what ends the motion of one."""
        motion, self.motion = self.motion, None
        if motion is None:
            return []
        if self.view is MenuView.MOTION:
            self.view = MenuView.KEYS
        return [] if motion.is_over else [do.LetGoMotion()]

    def released(self, key: int) -> list[Command]:
        """Take that a key was let go."""
        return self.let_go() if self.motion is not None and self.motion.key == key else []

    def motion_over(self) -> None:
        """Take that the motion of the held key is over, however it ended."""
        if self.motion is not None:
            self.motion.is_over = True

    def _answer(self, meaning: MenuKey) -> list[Command]:
        question, self.question = self.question, None
        self.view = MenuView.KEYS
        assert question is not None
        answer = question.answers.get(meaning)
        return [] if answer is None else [answer]

    def _ask(self, question: KeyQuestion) -> list[Command]:
        self.question, self.view = question, MenuView.QUESTION
        return []

    def _change_mode(self) -> list[Command]:
        match self.cell.mode:
            case OperatingMode.MANUAL_REDUCED:
                return [do.ChangeMode(OperatingMode.MANUAL_HIGH)]
            case OperatingMode.MANUAL_HIGH:
                answers = {
                    MenuKey.T1_T2: do.ChangeMode(OperatingMode.AUTOMATIC),
                    MenuKey.UP: do.ChangeMode(OperatingMode.MANUAL_REDUCED),
                }
                rows = ("Mode is T2", "T1/T2 again: AUTO", "UP: T1", "other key: T2")
                return self._ask(KeyQuestion(rows, answers))
        return [do.ChangeMode(OperatingMode.MANUAL_REDUCED)]

    def _hold(
        self, command: Movable, motion: HeldMotion, meaning: MenuKey, now: int
    ) -> list[Command]:
        """Return what begins a motion: at once and while held, in automatic after a question."""
        if not self.jog.is_fresh(now):
            return []
        if self.cell.mode is OperatingMode.AUTOMATIC:
            rows = (
                motion.title,
                "AUTO: it moves alone",
                f"{meaning.value} again: yes",
                "other key: no",
            )
            return self._ask(KeyQuestion(rows, {meaning: command}))
        self.motion, self.view = motion, MenuView.MOTION
        return [do.HoldMotion(command)]

    def _record(self) -> list[Command]:
        ask = do.AskList(CellList.RECORDINGS)
        if self.under_way is not None:
            if self.view is MenuView.RECORD:
                return [do.EndRecording()]
            self.view = MenuView.RECORD
            return [ask]
        if self.view is not MenuView.RECORDINGS or self.recordings is None:
            self.view, self.selected = MenuView.RECORDINGS, 0
            return [ask]
        return [do.RecordMotion(_next_name(name for name, _ in self.recordings))]

    def _play(self, key: int, now: int) -> list[Command]:
        if self.under_way is not None:
            self.messages.add("a recording is being made: REC ends it")
            self.view = MenuView.RECORD
            return []
        if self.view is not MenuView.RECORDINGS or not self.recordings:
            self.view, self.selected = MenuView.RECORDINGS, 0
            return [do.AskList(CellList.RECORDINGS)]
        name, duration = self.recordings[self.selected]
        motion = HeldMotion(key, f"PLAY {name}", duration)
        return self._hold(do.PlayBack(name), motion, MenuKey.PLAY, now)

    def _move(self, by: int) -> list[Command]:
        if self.view in (MenuView.RECORDINGS, MenuView.PROGRAMS):
            self._select(by)
        else:
            self.view = MenuView.PAGE
            self.teaching.select(by)
            self.turns_row += by
        return []

    def _select(self, by: int) -> None:
        shown = self.programs if self.view is MenuView.PROGRAMS else self.recordings
        self.selected = max(0, min(self.selected + by, len(shown or ()) - 1))

    def _run(self, key: int, now: int) -> list[Command]:
        program = self.teaching.program
        if self.view is MenuView.PROGRAMS and self.programs:
            self.view, self.shows_program = MenuView.PAGE, True
            return [do.OpenProgram(self.programs[self.selected])]
        if program is None:
            return self._ask_programs()
        run = do.RunProgram(program.name, program.revision, RunKind.ALL)
        return self._hold(run, HeldMotion(key, f"RUN {program.name}"), MenuKey.RUN, now)

    def _teach(self) -> list[Command]:
        """Add a point to the open program; make one where none is open."""
        if self.view is MenuView.PROGRAMS and self.programs is not None:
            self.view, self.shows_program = MenuView.PAGE, True
            return [do.MakeProgram(_next_name(self.programs))]
        if self.teaching.program is None:
            return self._ask_programs()
        self.view, self.shows_program = MenuView.PAGE, True
        return [do.ApplyEdit(RecordHere("PTP" if self.jog.frame == JOINTS else "LIN"))]

    def _ask_programs(self) -> list[Command]:
        self.view, self.selected = MenuView.PROGRAMS, 0
        return [do.AskPrograms()]


def _entry(told: Mapping[str, Any]) -> tuple[str, float | None]:
    duration = told.get("duration")
    return str(told["name"]), None if duration is None else float(duration)


def _number(name: str) -> int:
    """Return the number of what was made here; 0 for anything else."""
    digits = name.removeprefix(NAMED)
    return int(digits) if name.startswith(NAMED) and digits.isdecimal() else 0


def _rank(name: str) -> tuple[int, str]:
    return -_number(name), name


def _next_name(taken: Iterable[str]) -> str:
    names = set(taken)
    return next(name for number in count(1) if (name := f"{NAMED}{number}") not in names)
