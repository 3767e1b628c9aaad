"""Program library: programs as pendants list, load, edit and save them.

Owns that every change is made from the revision that it names and acknowledged after the store has
it, and the undo of each program's edits. Each request is answered once, through its `ReplyTo`,
after what it needs was read or printed elsewhere: here a program is a string of JSON, never parsed.

Owns also the uploads of programs too long for one frame: the order of their parts and the bound on
waiting text; one program for each connection.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from functools import partial
from typing import cast

from openpendant.simplemsg.pendant.management import programs as op
from openpendant.simplemsg.pendant.management.program_values import BadValue
from openpendant.simplemsg.pendant.management.programs import SaveProgram

from ...events.effects import Effect
from ...events.management_requests import ReplyTo, handles
from ...events.pending import AskStore
from ...refusal import Refusal
from ...store.documents import Document, DocumentKind, Heading
from ...store.requests import Answer, Delete, ListHeadings, ListHistory
from ...store.store_errors import StoreError
from ..editing.edit_history import History
from ..editing.program_tasks import (
    BodyPrinted,
    Done,
    PrintBody,
    ReadSource,
    SourceRead,
    check_to_be_kept,
)
from ..language.lexer import MOST_BYTES
from ..language.program import OwnRobot, Program
from ..language.program_errors import ProgramTooLarge
from ..language.program_json import MOST_JSON_BYTES, program_to_json
from .kept_breakpoints import KeptBreakpoints, KeptFields
from .program_changes import ProgramChanges, saved
from .program_loader import ProgramLoader, ProgramWork


@dataclass(slots=True)
class _Upload:
    """Upload in progress, with the parts received so far."""

    name: str
    parts: int
    bodies: list[str] = field(default_factory=list)
    characters: int = 0


class Uploads:
    """Uploads of all connections."""

    def __init__(self) -> None:
        self._under_way: dict[int, _Upload] = {}

    def forget(self, session: int) -> None:
        """Drop the parts that a connection has sent."""
        self._under_way.pop(session, None)

    def add(self, session: int, asked: SaveProgram) -> str | None:
        """Add a part; return the whole text after the last.

        Raises:
            BadValue: another part is due.
            ProgramTooLarge: the whole would be too long.
        """
        upload = self._under_way.pop(session, None)
        if asked.part == 1:
            upload = _Upload(asked.name, asked.parts)
        due = 1 if upload is None else len(upload.bodies) + 1
        fits = upload is not None and (upload.name, upload.parts) == (asked.name, asked.parts)
        if upload is None or not fits or asked.part != due or asked.part > asked.parts:
            text = f"is {asked.part} of {asked.parts} of {asked.name!r}; accepted: from 1 on, each"
            raise BadValue("the part", f"{text} in its turn")
        upload.bodies.append(asked.body)
        upload.characters += len(asked.body)
        most = MOST_BYTES if asked.format == "text" else MOST_JSON_BYTES
        if upload.characters > most:
            raise ProgramTooLarge("characters of a program", upload.characters, most)
        if asked.part == asked.parts:
            return "".join(upload.bodies)
        self._under_way[session] = upload
        return None


CHUNK = 15_000
"""Greatest number of characters of a program in one answer: escaped, in UTF-8, they fit a frame."""

MOST_LISTED = 150
"""Greatest number of programs in one answer."""

MOST_PRINTED = 4
"""Number of texts kept for pendants that load them part by part."""

_KIND = DocumentKind.PROGRAM


class ProgramLibrary:
    """Programs of one cell."""

    def __init__(
        self,
        ask: AskStore,
        loader: ProgramLoader,
        work: ProgramWork,
        breakpoints: KeptBreakpoints,
        own: OwnRobot,
        changes: ProgramChanges,
    ) -> None:
        self._ask = ask
        self._loader = loader
        self._work = work
        self._breakpoints = breakpoints
        self._own = own
        self._changes = changes
        self._uploads = Uploads()
        self._printed: OrderedDict[tuple[str, int], str] = OrderedDict()

    def closed(self, session: int) -> None:
        """Drop the unfinished uploads of a connection that ended."""
        self._uploads.forget(session)

    @handles(op.ListPrograms)
    def _list(
        self, asked: op.ListPrograms, reply: ReplyTo[op.ProgramHeadings], now: int
    ) -> list[Effect]:
        return self._ask(ListHeadings(_KIND), lambda found, _: _listed(found, reply, asked.first))

    @handles(op.ProgramHistory)
    def _history(
        self, asked: op.ProgramHistory, reply: ReplyTo[op.ProgramHeadings], now: int
    ) -> list[Effect]:
        return self._ask(ListHistory(_KIND, asked.name), lambda found, _: _listed(found, reply, 0))

    @handles(op.LoadProgram)
    def _load(
        self, asked: op.LoadProgram, reply_to: ReplyTo[op.ProgramText], now: int
    ) -> list[Effect]:
        def loaded(found: Document | Refusal, now: int) -> list[Effect]:
            if isinstance(found, Refusal):
                return reply_to.refuse(found)
            document = found
            if asked.revision is not None:
                return self._show(document, asked, reply_to, now)
            revision = document.heading.revision
            places = self._breakpoints.places(asked.name, revision, document.body)
            show = partial(self._show, document, asked, reply_to)
            return self._work.run(places, lambda _, at: show(at), now)

        return self._loader.load(asked.name, loaded, asked.revision)

    def _show(
        self, document: Document, asked: op.LoadProgram, reply_to: ReplyTo[op.ProgramText], now: int
    ) -> list[Effect]:
        """Answer with a part of a program as it was asked for, with its breakpoints."""
        heading = document.heading

        def show(text: str) -> list[Effect]:
            about = self._breakpoints.fields(asked.name, heading.revision)
            return _part_of(text, heading, asked, reply_to, about)

        def printed(done: Done, now: int) -> list[Effect]:
            assert isinstance(done, BodyPrinted)
            self._printed[heading.name, heading.revision] = done.text
            while len(self._printed) > MOST_PRINTED:
                self._printed.popitem(last=False)
            return show(done.text)

        if asked.format == "json":
            return show(document.body)
        text = self._printed.get((heading.name, heading.revision))
        if text is not None:
            return show(text)
        return self._work.have(PrintBody(document.body, asked.name), printed, reply_to, now)

    @handles(op.CheckProgram)
    def _check(
        self, asked: op.CheckProgram, reply_to: ReplyTo[op.CheckedProgram], now: int
    ) -> list[Effect]:
        def read(done: Done, now: int) -> list[Effect]:
            assert isinstance(done, SourceRead)
            head = check_to_be_kept(done, self._own)
            return reply_to.answer(
                {
                    "name": head.name,
                    "points": done.points,
                    "statements": done.statements,
                    "first_line": done.first_line,
                }
            )

        return self._work.have(ReadSource(asked.body, asked.format, "program"), read, reply_to, now)

    @handles(op.CreateProgram)
    def _create(
        self, asked: op.CreateProgram, reply: ReplyTo[op.SavedProgram], now: int
    ) -> list[Effect]:
        axes = tuple(i for i, linear in enumerate(self._own.limits.prismatic) if linear)
        program = Program(asked.name, self._own.name, axes, asked.tool, asked.frame)
        return self._changes.save(asked.name, program_to_json(program), History(), 0, reply)

    @handles(op.DeleteProgram)
    def _delete(
        self, asked: op.DeleteProgram, reply: ReplyTo[op.SavedProgram], now: int
    ) -> list[Effect]:
        def deleted(found: Answer, now: int) -> list[Effect]:
            if isinstance(found, Heading):
                self._breakpoints.forget(asked.name)
            return saved(found, reply)

        expected = asked.expected_revision
        delete = Delete(_KIND, asked.name, expected, reply.name, reply.session)
        return self._ask(delete, deleted)

    @handles(op.SaveProgram)
    def _save(
        self, asked: op.SaveProgram, reply_to: ReplyTo[op.ProgramSaved], now: int
    ) -> list[Effect]:
        body = self._uploads.add(reply_to.session, asked)
        if body is None:
            return reply_to.answer({"part": asked.part, "parts": asked.parts})

        def read(done: Done, now: int) -> list[Effect]:
            assert isinstance(done, SourceRead)
            check_to_be_kept(done, self._own, asked.name)
            # The last part of a program is answered like any other change.
            reply = cast(ReplyTo[op.SavedProgram], reply_to)
            return self._changes.replace(asked, done.body, reply, now)

        return self._work.have(ReadSource(body, asked.format, asked.name), read, reply_to, now)


def _part_of(
    text: str,
    heading: Heading,
    asked: op.LoadProgram,
    reply: ReplyTo[op.ProgramText],
    about: KeptFields,
) -> list[Effect]:
    """Answer with a part of a program's text or JSON."""
    end = asked.offset + CHUNK
    return reply.answer(
        {
            "name": asked.name,
            "revision": heading.revision,
            "saved_by": heading.saved_by,
            "saved_at": heading.saved_at,
            "format": asked.format,
            "body": text[asked.offset : end],
            "next": end if end < len(text) else None,
            **about,
        }
    )


def _listed(found: Answer, reply: ReplyTo[op.ProgramHeadings], first: int) -> list[Effect]:
    """Answer with some of the headings, from one on."""
    if isinstance(found, StoreError):
        return reply.refuse(found.refusal())
    assert isinstance(found, tuple)
    headings = [each for each in found if isinstance(each, Heading)]
    end = first + MOST_LISTED
    shown: list[op.ProgramHeading] = [
        {
            "name": each.name,
            "revision": each.revision,
            "size": each.size,
            "saved_by": each.saved_by,
            "saved_at": each.saved_at,
            "deleted": each.deleted,
        }
        for each in headings[first:end]
    ]
    return reply.answer({"programs": shown, "next": end if end < len(headings) else None})
