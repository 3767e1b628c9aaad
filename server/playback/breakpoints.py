"""Breakpoints as pendants set them: only before statements that the program has.

Owns that check, made against the program as the store has it now, and that whoever changes those of
a program under way has the motion authority. Where they are kept is `kept_breakpoints`' business,
what one does to a run the runner's.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg.verdicts import VerdictCode

from ..outgoing import Outgoing
from ..programs.document import program_from_json
from ..programs.program import OwnRobot, check_robot
from ..programs.renumbering import Renumbering
from ..programs.work import CompareBodies, Done, ReadSource, SourceRead
from ..refusal import Refusal
from ..store.documents import Document
from .desk import ProgramDesk
from .kept_breakpoints import KeptBreakpoints, Places
from .operations import Asker, SetBreakpoints
from .program_work import ProgramWork
from .shelf import ProgramShelf


@dataclass(frozen=True, slots=True)
class Breakpoints:
    """The requests for breakpoints of one cell.

    Attributes:
        shelf: loads a program.
        work: reads it.
        kept: takes what is set.
        desk: runs programs.
        own: the robot that programs must be of.
    """

    shelf: ProgramShelf
    work: ProgramWork
    kept: KeptBreakpoints
    desk: ProgramDesk
    own: OwnRobot

    def ask(self, asked: SetBreakpoints, asker: Asker, now: int) -> list[Outgoing]:
        """Set the breakpoints of a program in the place of those it had; answer, maybe later."""
        name = asked.name
        places = frozenset(asked.statements)
        refusal = self.desk.breakpoint_fault(name, asker.session, now)
        if refusal is not None:
            return asker.refuse(refusal)
        if not places:
            # Those of a program that is gone must go too.
            self.kept.forget(name)
            self.desk.set_breakpoints(name, places, now)
            return asker.answer(name=name, statements=[])

        def loaded(found: Document | Refusal, now: int) -> list[Outgoing]:
            if isinstance(found, Refusal):
                return asker.refuse(found)
            document = found

            def read(done: Done, now: int) -> list[Outgoing]:
                assert isinstance(done, SourceRead)
                check_robot(program_from_json(done.head), self.own.name, self.own.limits)
                refusal = _fault(name, places, done)
                if refusal is not None:
                    return asker.refuse(refusal)
                return self._set(document, places, asker, now)

            return self.work.have(ReadSource(document.body, "json", name), read, asker, now)

        return self.shelf.load(name, loaded)

    def _set(self, document: Document, places: Places, asker: Asker, now: int) -> list[Outgoing]:
        """Set them for the runs to come, and in the revision that is under way."""
        name, revision = document.heading.name, document.heading.revision
        refusal = self.desk.breakpoint_fault(name, asker.session, now)
        if refusal is not None:
            return asker.refuse(refusal)
        under_way = self.desk.under_way(name)
        if under_way is None or under_way[0] == revision:
            self.kept.put(name, revision, places)
            self.desk.set_breakpoints(name, places, now)
            return asker.answer(name=name, revision=revision, statements=sorted(places))
        running, source = under_way

        def compared(done: Done, now: int) -> list[Outgoing]:
            assert isinstance(done, Renumbering)
            still = self.desk.under_way(name)
            refusal = self.desk.breakpoint_fault(name, asker.session, now)
            if still is None or still[0] != running or refusal is not None:
                return self._set(document, places, asker, now)
            self.kept.put(name, revision, places)
            self.desk.set_breakpoints(name, done.places(places), now)
            later = [each for each in sorted(places) if done.place(each) is None]
            about = {"next_run": later} if later else {}
            return asker.answer(name=name, revision=revision, statements=sorted(places), **about)

        return self.work.have(CompareBodies(document.body, name, source), compared, asker, now)


def _fault(name: str, places: Places, read: SourceRead) -> Refusal | None:
    """Return which statement a program of so many does not have."""
    last = read.statements - 1
    beyond = min((place for place in places if place > last), default=None)
    if beyond is None:
        return None
    line = read.first_line + last
    accepted = f"0 to {last}, which is line {line}" if read.statements else "none"
    text = (
        f"statement {beyond} of {name!r}, counted from 0; it has {read.statements};"
        f" accepted: {accepted}"
    )
    return Refusal(VerdictCode.BAD_ARGUMENT, text, value=beyond, limit=last)
