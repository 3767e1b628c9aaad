"""Questions on the display: a choice of digits, or a short typed text.

Owns what each key does to a question; the choice of a program is `program_choice`. The space bar
never comes here: it stops the robot. Pasted text does not come here either.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum

from .commands import Command

LONGEST_TEXT = 64


class Wanted(Enum):
    """What a typed text is for; the value asks for it."""

    STEP = "Step: 2mm or 1.5deg"
    TARGET = "Go to: x=300;a=180"


@dataclass(frozen=True, slots=True)
class Choice:
    """A question that a digit answers; any other key is a no.

    Attributes:
        title: the question.
        options: by digit, what is shown and what follows: a command, or another question.
    """

    title: str
    options: Mapping[str, tuple[str, Command | Choice]]

    def struck(self, key: str) -> Command | Choice | None:
        """Return what a key chooses; None for a no."""
        return self.options[key][1] if key in self.options else None


@dataclass(frozen=True, slots=True)
class Entered:
    """A text that was typed to its end.

    Attributes:
        wanted: what for.
        text: the text.
    """

    wanted: Wanted
    text: str


@dataclass(frozen=True, slots=True)
class Entry:
    """A text that is being typed.

    Attributes:
        wanted: what for.
        text: so far.
    """

    wanted: Wanted
    text: str = ""

    def struck(self, key: str) -> Entry | Entered | None:
        """Return what a key makes of it; None where it is given up."""
        if key == "escape":
            return None
        if key == "enter":
            return Entered(self.wanted, self.text)
        if key == "backspace":
            return replace(self, text=self.text[:-1])
        if len(key) == 1 and key.isprintable() and len(self.text) < LONGEST_TEXT:
            return replace(self, text=self.text + key)
        return self
