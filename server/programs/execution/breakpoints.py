"""Breakpoint requests of pendants: only before statements that the program has.

Owns that check, against the program as the store has it now. Changing those of a program in its run
needs the motion authority, as the operation declares; what has to be loaded first is judged again
before it is set. `kept_breakpoints` keeps them, and the runner pauses at them.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg.pendant.management.programs import BreakpointsSet, SetBreakpoints
from openpendant.simplemsg.verdicts import VerdictCode

from ...events.effects import Effect
from ...events.management_requests import ReplyTo, handles
from ...refusal import Refusal
from ...store.documents import Document
from ..editing.edit_history import Renumbering
from ..editing.program_tasks import CompareBodies, Done, ReadSource, SourceRead
from ..language.program import OwnRobot, check_robot
from ..language.program_json import program_from_json
from ..library.kept_breakpoints import KeptBreakpoints, Places
from ..library.program_loader import ProgramLoader, ProgramWork
from .program_executor import ProgramExecutor


@dataclass(frozen=True, slots=True)
class Breakpoints:
    """Requests for breakpoints of one cell."""

    loader: ProgramLoader
    work: ProgramWork
    kept: KeptBreakpoints
    executor: ProgramExecutor
    own: OwnRobot

    @handles(SetBreakpoints)
    def ask(
        self, asked: SetBreakpoints, reply_to: ReplyTo[BreakpointsSet], now: int
    ) -> list[Effect]:
        """Replace the breakpoints of a program; the answer may come later."""
        name = asked.name
        places = frozenset(asked.statements)
        if not places:
            # The breakpoints of a deleted program must be removable, too.
            self.kept.forget(name)
            self.executor.set_breakpoints(name, places, now)
            return reply_to.answer({"name": name, "statements": []})

        def loaded(found: Document | Refusal, now: int) -> list[Effect]:
            if isinstance(found, Refusal):
                return reply_to.refuse(found)
            document = found

            def read(done: Done, now: int) -> list[Effect]:
                assert isinstance(done, SourceRead)
                check_robot(program_from_json(done.head), self.own.name, self.own.limits)
                refusal = _fault(name, places, done)
                if refusal is not None:
                    return reply_to.refuse(refusal)
                return self._set(document, places, reply_to, now)

            return self.work.have(ReadSource(document.body, "json", name), read, reply_to, now)

        return self.loader.load(name, loaded)

    def _set(
        self, document: Document, places: Places, reply_to: ReplyTo[BreakpointsSet], now: int
    ) -> list[Effect]:
        """Set them for later runs, and in the revision of the present run."""
        name, revision = document.heading.name, document.heading.revision
        refusal = self.executor.breakpoint_fault(name, reply_to.session, now)
        if refusal is not None:
            return reply_to.refuse(refusal)
        under_way = self.executor.under_way(name)
        if under_way is None or under_way[0] == revision:
            self.kept.put(name, revision, places)
            self.executor.set_breakpoints(name, places, now)
            return reply_to.answer(
                {"name": name, "revision": revision, "statements": sorted(places)}
            )
        running, source = under_way

        def compared(done: Done, now: int) -> list[Effect]:
            assert isinstance(done, Renumbering)
            still = self.executor.under_way(name)
            refusal = self.executor.breakpoint_fault(name, reply_to.session, now)
            if still is None or still[0] != running or refusal is not None:
                return self._set(document, places, reply_to, now)
            self.kept.put(name, revision, places)
            self.executor.set_breakpoints(name, done.places(places), now)
            later = [each for each in sorted(places) if done.place(each) is None]
            reply: BreakpointsSet = {
                "name": name,
                "revision": revision,
                "statements": sorted(places),
            }
            if later:
                reply["next_run"] = later
            return reply_to.answer(reply)

        return self.work.have(CompareBodies(document.body, name, source), compared, reply_to, now)


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
