"""The choice of a program: the list of the store, narrowed by typing, one of it selected.

Owns what each key does to the choice. A name with a space is chosen and never typed: the space bar
stops the robot.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from .commands import CreateProgram, OpenProgram
from .prompts import LONGEST_TEXT, Choice


@dataclass(frozen=True, slots=True)
class ProgramChoice:
    """A choice among the programs of the store, and a new one of the typed name.

    Attributes:
        names: all programs; None until the server has told them.
        text: what was typed.
        selected: the offer that Enter takes, from 0.
    """

    names: tuple[str, ...] | None = None
    text: str = ""
    selected: int = 0

    def listed(self, names: Iterable[str]) -> ProgramChoice:
        """Return it with the programs that the server told."""
        return replace(self, names=tuple(names), selected=0)

    @property
    def matches(self) -> tuple[str, ...]:
        """The programs with the typed text in their name, spaces and capitals apart."""
        typed = self.text.lower()
        found = [name for name in self.names or () if typed in name.lower().replace(" ", "")]
        rank = {self.text: 0}
        return tuple(
            sorted(found, key=lambda name: (rank.get(name, 1), not name.lower().startswith(typed)))
        )

    @property
    def new(self) -> str:
        """The typed name where no program has it; empty for none."""
        return "" if self.names is None or self.text in self.names else self.text

    @property
    def offers(self) -> tuple[str, ...]:
        """What Enter may take: the matches, then the new name."""
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
    """Return the question that comes before a new program."""
    return Choice(f"Create {name}?", {"1": ("yes", CreateProgram(name))})
