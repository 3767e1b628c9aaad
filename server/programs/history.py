"""Undo and redo of edits, as a value.

Owns how far back it goes. It holds what each edit changed in the JSON of the program and in the
numbers of its statements, not programs: so an undo parses and prints nothing, however large the
program is.
"""

from __future__ import annotations

from dataclasses import dataclass

from .errors import NothingToUndo
from .renumbering import Renumbering
from .splice import Splice

MOST_UNDO = 100
"""Edits that can be undone."""

MOST_UNDO_CHARACTERS = 2 << 20
"""Characters that they may hold together; the last edit can be undone whatever it holds."""


@dataclass(frozen=True, slots=True)
class Step:
    """One change of a program, which can be taken back.

    Attributes:
        splice: what it changes in the JSON.
        renumbering: where it leaves the statements; None where only comparing would tell.
    """

    splice: Splice
    renumbering: Renumbering | None = None

    @property
    def reversed(self) -> Step:
        """The way back."""
        back = None if self.renumbering is None else self.renumbering.reversed
        return Step(self.splice.reversed, back)


@dataclass(frozen=True, slots=True)
class History:
    """What was done to a program, and what was undone.

    Attributes:
        past: the edits, the oldest first.
        future: the edits that were undone, the last undone first.
    """

    past: tuple[Step, ...] = ()
    future: tuple[Step, ...] = ()

    def edited(self, step: Step) -> History:
        """Return the history after an edit; what was undone cannot be redone any more."""
        past = (*self.past, step)[-MOST_UNDO:]
        held = sum(each.splice.size for each in past)
        while len(past) > 1 and held > MOST_UNDO_CHARACTERS:
            held -= past[0].splice.size
            past = past[1:]
        return History(past)

    def undone(self) -> tuple[History, Step]:
        """Return the history before the last edit, and the way back there.

        Raises:
            NothingToUndo: there is none.
        """
        if not self.past:
            raise NothingToUndo("no edit is left to undo")
        *past, last = self.past
        return History(tuple(past), (last, *self.future)), last.reversed

    def redone(self) -> tuple[History, Step]:
        """Return the history after the edit that was undone last, and the way there.

        Raises:
            NothingToUndo: there is none, or an edit was made since.
        """
        if not self.future:
            raise NothingToUndo("no edit is left to redo")
        first, *future = self.future
        return History((*self.past, first), tuple(future)), first
