"""Edit history of a program: undo and redo, as a value.

Owns its length, and the difference between two texts, found, applied and reversed as one stretch
that is replaced by another (`Splice`). The history holds the changes of each edit to the JSON of
the program and to the numbers of its statements, not programs. So an undo parses and prints
nothing, however large the program is, and all of this may be done on an event loop.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..language.program_errors import NothingToUndo
from .renumbering import Renumbering


@dataclass(frozen=True, slots=True)
class Splice:
    """Replacement of one stretch of a text by another.

    Attributes:
        start: characters before it, the same in both texts.
        removed: the stretch in the first text.
        inserted: the stretch in the second text.
    """

    start: int
    removed: str
    inserted: str

    @property
    def size(self) -> int:
        """Number of characters that it holds."""
        return len(self.removed) + len(self.inserted)

    @property
    def reversed(self) -> Splice:
        """Splice from the second text to the first."""
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
    """Return the greatest count up to `most` that a condition allows which holds for all less."""
    known, limit = 0, most
    while known < limit:
        count = (known + limit + 1) // 2
        if holds(count):
            known = count
        else:
            limit = count - 1
    return known


MOST_UNDO = 100
"""Greatest number of edits that can be undone."""

MOST_UNDO_CHARACTERS = 2 << 20
"""Characters that they may hold together; the last edit can be undone whatever its size."""


@dataclass(frozen=True, slots=True)
class EditStep:
    """Change of a program, which can be reversed.

    Attributes:
        splice: its change of the JSON.
        renumbering: its change of the statements' numbers; None if only comparing can find it.
    """

    splice: Splice
    renumbering: Renumbering | None = None

    @property
    def reversed(self) -> EditStep:
        """Reverse change."""
        back = None if self.renumbering is None else self.renumbering.reversed
        return EditStep(self.splice.reversed, back)


@dataclass(frozen=True, slots=True)
class History:
    """Edits of a program that were made, and those that were undone.

    Attributes:
        past: the edits, the oldest first.
        future: the edits that were undone, the last undone first.
    """

    past: tuple[EditStep, ...] = ()
    future: tuple[EditStep, ...] = ()

    def edited(self, step: EditStep) -> History:
        """Return the history after an edit; edits undone before it cannot be redone any more."""
        past = (*self.past, step)[-MOST_UNDO:]
        held = sum(each.splice.size for each in past)
        while len(past) > 1 and held > MOST_UNDO_CHARACTERS:
            held -= past[0].splice.size
            past = past[1:]
        return History(past)

    def undone(self) -> tuple[History, EditStep]:
        """Return the history before the last edit, and the change that leads back.

        Raises:
            NothingToUndo: there is none.
        """
        if not self.past:
            raise NothingToUndo("no edit is left to undo")
        *past, last = self.past
        return History(tuple(past), (last, *self.future)), last.reversed

    def redone(self) -> tuple[History, EditStep]:
        """Return the history after the edit that was undone last, and the change that leads there.

        Raises:
            NothingToUndo: there is none, or an edit was made since.
        """
        if not self.future:
            raise NothingToUndo("no edit is left to redo")
        first, *future = self.future
        return History((*self.past, first), tuple(future)), first
