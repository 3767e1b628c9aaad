"""Questions on the display: a choice by digit, a short typed text, or a stored program.

Owns the effect of each key on a question. A program's name with a space is selected and never
typed: the space bar stops the robot.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum

from .commands import Command, MakeProgram, OpenProgram

LONGEST_TEXT = 64


class TextPurpose(Enum):
    """Purpose of a typed text; the value is the prompt."""

    STEP = "Step: 2mm or 1.5deg"
    TARGET = "Go to: x=300;a=180"


@dataclass(frozen=True, slots=True)
class Choice:
    """A question that a digit answers; any other key means no.

    Attributes:
        title: the question.
        options: by digit, the shown text and the result: a command, or another question.
    """

    title: str
    options: Mapping[str, tuple[str, Command | Choice]]

    def struck(self, key: str) -> Command | Choice | None:
        """Return the result of a key; None for no."""
        return self.options[key][1] if key in self.options else None


@dataclass(frozen=True, slots=True)
class EnteredText:
    """A text that was completed with Enter.

    Attributes:
        wanted: its purpose.
        text: the text.
    """

    wanted: TextPurpose
    text: str


@dataclass(frozen=True, slots=True)
class TextEntry:
    """A text that is being typed.

    Attributes:
        wanted: its purpose.
        text: the text so far.
    """

    wanted: TextPurpose
    text: str = ""

    def struck(self, key: str) -> TextEntry | EnteredText | None:
        """Return what a key makes of it; None where it is given up."""
        if key == "escape":
            return None
        if key == "enter":
            return EnteredText(self.wanted, self.text)
        if key == "backspace":
            return replace(self, text=self.text[:-1])
        if len(key) == 1 and key.isprintable() and len(self.text) < LONGEST_TEXT:
            return replace(self, text=self.text + key)
        return self


@dataclass(frozen=True, slots=True)
class ProgramChoice:
    """A choice among the stored programs, and a new program with the typed name.

    Attributes:
        names: all programs; None until the server's answer.
        text: the typed text.
        selected: the offer that Enter takes, from 0.
    """

    names: tuple[str, ...] | None = None
    text: str = ""
    selected: int = 0

    def listed(self, names: Iterable[str]) -> ProgramChoice:
        """Return this choice with the programs of the server's answer."""
        return replace(self, names=tuple(names), selected=0)

    @property
    def matches(self) -> tuple[str, ...]:
        """The programs whose name contains the typed text, ignoring spaces and case."""
        typed = self.text.lower()
        found = [name for name in self.names or () if typed in name.lower().replace(" ", "")]
        rank = {self.text: 0}
        return tuple(
            sorted(found, key=lambda name: (rank.get(name, 1), not name.lower().startswith(typed)))
        )

    @property
    def new(self) -> str:
        """The typed name if no program has it; else empty."""
        return "" if self.names is None or self.text in self.names else self.text

    @property
    def offers(self) -> tuple[str, ...]:
        """The offers that Enter can take: the matches, then the new name."""
        return (*self.matches, *([self.new] if self.new else []))

    def struck(self, key: str) -> ProgramChoice | Choice | OpenProgram | None:
        """Return what a key makes of it; None where it is given up."""
        if key == "escape":
            return None
        if key == "enter":
            return self._taken()
        if key in ("up", "down"):
            last = max(0, len(self.offers) - 1)
            by = 1 if key == "down" else -1
            return replace(self, selected=max(0, min(self.selected + by, last)))
        if key == "backspace":
            return replace(self, text=self.text[:-1], selected=0)
        if len(key) == 1 and key.isprintable() and len(self.text) < LONGEST_TEXT:
            return replace(self, text=self.text + key, selected=0)
        return self

    def _taken(self) -> Choice | OpenProgram | None:
        offers = self.offers
        if self.selected < len(self.matches):
            return OpenProgram(offers[self.selected])
        if offers:
            return creation(self.new)
        # Before the list is here, the server tells whether there is such a program.
        return OpenProgram(self.text) if self.text else None


def creation(name: str) -> Choice:
    """Return the question to confirm a new program."""
    return Choice(f"Create {name}?", {"1": ("yes", MakeProgram(name))})
