"""Undo and redo of edits, as a value.

Owns how far back it goes. A history holds whole programs, which share what the edits left alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from .editing import Edit, apply
from .errors import NothingToUndo
from .program import Program

MOST_UNDO = 100
"""Edits that can be undone."""


@dataclass(frozen=True, slots=True)
class History:
    """A program with the programs before and after it.

    Attributes:
        present: the program as it is.
        past: as it was before each edit, the oldest first.
        future: as it was before each undo, the last undone first.
    """

    present: Program
    past: tuple[Program, ...] = ()
    future: tuple[Program, ...] = ()

    def edited(self, edit: Edit) -> History:
        """Return the history after an edit; what was undone cannot be redone any more.

        Raises:
            ProgramError: the edit is refused.
        """
        past = (*self.past, self.present)[-MOST_UNDO:]
        return History(apply(self.present, edit), past)

    def undone(self) -> History:
        """Return the history before the last edit.

        Raises:
            NothingToUndo: there is none.
        """
        if not self.past:
            raise NothingToUndo("no edit is left to undo")
        *past, present = self.past
        return replace(self, present=present, past=tuple(past), future=(self.present, *self.future))

    def redone(self) -> History:
        """Return the history after the edit that was undone last.

        Raises:
            NothingToUndo: there is none, or an edit was made since.
        """
        if not self.future:
            raise NothingToUndo("no edit is left to redo")
        present, *future = self.future
        return replace(self, present=present, past=(*self.past, self.present), future=tuple(future))
