"""Questions on the display: a choice of digits, or a short typed text.

Owns what each key does to a question. The space bar never comes here: it stops the robot. Pasted
text does not come here either.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import TypeAlias

from .commands import Command

LONGEST_TEXT = 64


class Wanted(Enum):
    """What a typed text is for; the value asks for it."""

    PROGRAM = "Program name"
    STEP = "Step: 2mm or 1.5deg"
    TARGET = "Go to: axis=value"


@dataclass(frozen=True, slots=True)
class Choice:
    """A question that a digit answers; any other key is a no.

    Attributes:
        title: the question.
        options: by digit, what is shown and what follows: a command, or another question.
    """

    title: str
    options: Mapping[str, tuple[str, Command | Choice]]


@dataclass(frozen=True, slots=True)
class Entry:
    """A text that is being typed.

    Attributes:
        wanted: what for.
        text: so far.
    """

    wanted: Wanted
    text: str = ""

    def typed(self, key: str) -> Entry:
        """Return it after a key that belongs to the text; other keys change nothing."""
        if key == "backspace":
            return replace(self, text=self.text[:-1])
        if len(key) == 1 and key.isprintable() and len(self.text) < LONGEST_TEXT:
            return replace(self, text=self.text + key)
        return self


Question: TypeAlias = Choice | Entry
