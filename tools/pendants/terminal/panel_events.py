"""Events of the terminal pendant's core: connections, stops, modes, programs.

Owns the state of the pendant and the effect of each event on it. `panel` owns the keys.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

from openpendant.simplemsg.pendant import (
    ModeChanged,
    OperatingMode,
    ProgramReport,
    StopChanged,
    StopKind,
)

from . import commands as do
from .cell_view import CellView
from .commands import Command
from .enabling_toggle import EnablingToggle
from .jog_pad import JogPad
from .keyboard import Page
from .messages import Messages
from .prompts import Choice, ProgramChoice, TextEntry, creation
from .stop_key import StopKey
from .taught_program import TaughtProgram
from .teaching import Teaching
from .wording import MODES, in_screen_units

Question: TypeAlias = Choice | TextEntry | ProgramChoice


class PanelState:
    """The state of one terminal pendant, with a method for each event.

    Attributes:
        cell: the view of the cell.
        page: the page that is shown.
        stop_key: the stop key with the pending stop.
        jog: the jog keys.
        enabling: the enabling device (training).
        question: the question on the display; None for none.
        teaching: the open program.
        messages: the messages to the user.
        why: the lines of the last answer to why the robot does not move.
        scroll: first shown line of a long text.
    """

    def __init__(self) -> None:
        """Make a pendant without a connection."""
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

    def greeted(self) -> list[Command]:
        """Take the hello reply of a server; return the pending stop, to be sent at once."""
        self.cell.greeted()
        return [*self.stop_key.linked()]

    def turned_away(self, reason: str) -> list[Command]:
        """Take a refused login; the connection stays until the pending stop is answered."""
        self.cell.turned_away(reason)
        self.question = None
        self.messages.add(f"no login: {reason}")
        return self._let_go()

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
        self.enabling.turn_off()
        self.question = None
        self.teaching.walked(None)
        self.messages.add(f"no link: {reason}")

    def stop_changed(self, change: StopChanged) -> list[Command]:
        """Take the event of a stop; release what is held, as the server demands after a stop."""
        self.cell.stop_changed(change)
        if change.stop == StopKind.NONE:
            self.messages.add(f"stop reset by {change.client or 'the server'}")
            return []
        self.messages.add(f"stop by {change.client or 'the server'}: {change.reason}")
        self.stop_key.latched()
        return self._let_go()

    def mode_changed(self, change: ModeChanged) -> list[Command]:
        """Take the event of another mode; release what is held likewise."""
        known = change.mode in set(OperatingMode)
        name = MODES[OperatingMode(change.mode)][1] if known else f"{change.mode}"
        self.messages.add(f"mode {name} by {change.client or 'the controller'}")
        return self._let_go()

    def not_enabled(self) -> list[Command]:
        """Take the refusal of the enabling device; show it as released."""
        if self.enabling.is_on:
            self.messages.add("enabling (training) was let go: v holds it anew")
        return self._let_go()

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

    def not_there(self, name: str) -> None:
        """Take that the program to open does not exist; ask to create it if no question is open.

        Args:
            name: of the program.
        """
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
        self.why = lines
        self._show(Page.WHY)

    def _let_go(self) -> list[Command]:
        """Release everything that is held."""
        self.jog.let_go()
        return [do.Enable(False)] if self.enabling.turn_off() else []

    def _show(self, page: Page) -> None:
        self.page, self.scroll = page, 0
