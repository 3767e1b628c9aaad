"""The difference between two texts as one stretch that is replaced by another.

Owns how it is found, made and taken back. Nothing is parsed for that, so it may be done on an event
loop.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Splice:
    """One stretch of a text in the place of another.

    Attributes:
        start: characters before it, the same in both texts.
        removed: what stands there in the first text.
        inserted: what stands there in the second.
    """

    start: int
    removed: str
    inserted: str

    @property
    def size(self) -> int:
        """Characters that it holds."""
        return len(self.removed) + len(self.inserted)

    @property
    def reversed(self) -> Splice:
        """The way from the second text to the first."""
        return Splice(self.start, self.inserted, self.removed)

    def applied(self, text: str) -> str:
        """Return the second text; `text` is the first."""
        return text[: self.start] + self.inserted + text[self.start + len(self.removed) :]


def splice_between(first: str, second: str) -> Splice:
    """Return the shortest splice that leads from one text to another."""
    most = min(len(first), len(second))
    start = _most(most, lambda count: first[:count] == second[:count])
    tail = _most(
        most - start,
        lambda count: first[len(first) - count :] == second[len(second) - count :],
    )
    return Splice(start, first[start : len(first) - tail], second[start : len(second) - tail])


def _most(most: int, holds: Callable[[int], bool]) -> int:
    """Return the greatest count up to `most` for which something holds that holds for all less."""
    known, limit = 0, most
    while known < limit:
        count = (known + limit + 1) // 2
        if holds(count):
            known = count
        else:
            limit = count - 1
    return known
