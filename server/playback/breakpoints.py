"""Breakpoints as pendants set them: only before statements that the program has.

Owns that check, made against the program as the store has it now. What a breakpoint does to a run
is the runner's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from openpendant.simplemsg.verdicts import VerdictCode

from ..outgoing import Outgoing
from ..programs.work import Done, ReadSource, SourceRead
from ..refusal import Refusal
from ..store.documents import Document
from .operations import Asker, SetBreakpoints
from .program_work import ProgramWork
from .shelf import ProgramShelf

SetPlaces = Callable[[str, frozenset[int], int], None]
"""Takes a program, the numbers of the statements to pause before, and the time [ns]."""


@dataclass(frozen=True, slots=True)
class Breakpoints:
    """The breakpoints of one cell's programs.

    Attributes:
        shelf: loads a program.
        work: reads it.
        set_places: takes what is set.
    """

    shelf: ProgramShelf
    work: ProgramWork
    set_places: SetPlaces

    def ask(self, asked: SetBreakpoints, asker: Asker, now: int) -> list[Outgoing]:
        """Set the breakpoints of a program in the place of those it had; answer, maybe later."""
        name = asked.name
        places = frozenset(asked.statements)

        def read(done: Done, now: int) -> list[Outgoing]:
            assert isinstance(done, SourceRead)
            refusal = _fault(name, places, done.statements)
            return self._set(name, places, asker, now) if refusal is None else asker.refuse(refusal)

        def loaded(found: Document | Refusal, now: int) -> list[Outgoing]:
            if isinstance(found, Refusal):
                return asker.refuse(found)
            return self.work.have(ReadSource(found.body, "json", name), read, asker, now)

        if not places:
            # Those of a program that is gone must go too.
            return self._set(name, places, asker, now)
        return self.shelf.load(name, loaded)

    def _set(self, name: str, places: frozenset[int], asker: Asker, now: int) -> list[Outgoing]:
        self.set_places(name, places, now)
        return asker.answer(name=name, statements=sorted(places))


def _fault(name: str, places: frozenset[int], statements: int) -> Refusal | None:
    """Return which statement a program of so many does not have."""
    last = statements - 1
    beyond = min((place for place in places if place > last), default=None)
    if beyond is None:
        return None
    accepted = f"0 to {last}" if statements else "none"
    text = f"statement {beyond} of {name!r}, which has {statements}; accepted: {accepted}"
    return Refusal(VerdictCode.BAD_ARGUMENT, text, value=beyond, limit=last)
