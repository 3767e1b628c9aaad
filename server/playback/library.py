"""Programs as pendants list, load, edit and save them.

Owns that every change is made from the revision that it names and acknowledged after the store has
it, and the undo of each program's edits. Each request is answered once, through its `Asker`, after
what it needs was read or printed elsewhere: in here a program is a string of JSON, never parsed.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

from openpendant.motion.limits import JointLimits

from ..outgoing import Outgoing
from ..programs.document import program_to_json
from ..programs.edits import DescribeProgram
from ..programs.errors import BadValue, ProgramError
from ..programs.history import History
from ..programs.keeping import check_to_be_kept
from ..programs.program import OwnRobot, Program
from ..programs.work import (
    BodyPrinted,
    Done,
    PrintBody,
    ReadSource,
    SourceRead,
)
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..robot_view import RobotView
from ..store.documents import Document, DocumentKind, Heading
from ..store.questions import AskStore
from ..store.requests import Answer, Delete, ListHeadings, ListHistory
from . import operations as op
from .answers import listed, saved
from .changes import ProgramChanges
from .kept_breakpoints import KeptBreakpoints
from .operations import Asker
from .program_work import ProgramWork
from .shelf import ProgramShelf
from .teacher import Teacher
from .uploads import Uploads

CHUNK = 15_000
"""Characters of a program in one answer: escaped and in UTF-8 they still fit a frame."""

MOST_PRINTED = 4
"""Texts that are kept for pendants that ask for them part by part."""

_KIND = DocumentKind.PROGRAM


class ProgramLibrary:
    """The programs of one cell."""

    def __init__(
        self,
        ask: AskStore,
        shelf: ProgramShelf,
        work: ProgramWork,
        breakpoints: KeptBreakpoints,
        cell: RobotCell,
        robot: RobotView,
        robot_name: str,
    ) -> None:
        """Make a library.

        Args:
            ask: asks the store.
            shelf: loads programs.
            work: reads, prints and edits them.
            breakpoints: those of the programs.
            cell: knows where the robot stands.
            robot: its mathematics.
            robot_name: its name.
        """
        self._ask = ask
        self._shelf = shelf
        self._work = work
        self._breakpoints = breakpoints
        self._cell = cell
        self._robot_name = robot_name
        teacher = Teacher(cell, robot, robot_name)
        own = OwnRobot(robot_name, cell.limits)
        self._changes = ProgramChanges(ask, shelf, work, breakpoints, teacher, own)
        self._uploads = Uploads()
        self._printed: OrderedDict[tuple[str, int], str] = OrderedDict()

    @property
    def _limits(self) -> JointLimits:
        return self._cell.limits

    def closed(self, session: int) -> None:
        """Forget what a connection that ended had begun to save."""
        self._uploads.forget(session)

    def handle(self, asked: op.Operation, asker: Asker, now: int) -> list[Outgoing]:
        """Carry out a request, or have it carried out; the answer may come later."""
        try:
            return self._handle(asked, asker, now)
        except ProgramError as error:
            return asker.refuse_program(error)

    def _handle(self, asked: op.Operation, asker: Asker, now: int) -> list[Outgoing]:
        match asked:
            case op.ListPrograms(first=first):
                request = ListHeadings(_KIND)
                return self._ask(request, lambda found, _: listed(found, asker, first))
            case op.ProgramHistory(name=name):
                return self._ask(ListHistory(_KIND, name), lambda found, _: listed(found, asker, 0))
            case op.LoadProgram():
                return self._load(asked, asker)
            case op.CheckProgram():
                return self._check(asked, asker, now)
            case op.CreateProgram(name=name, frame=frame, tool=tool):
                axes = tuple(i for i, linear in enumerate(self._limits.prismatic) if linear)
                program = Program(name, self._robot_name, axes, tool, frame)
                return self._changes.save(name, program_to_json(program), History(), 0, asker)
            case op.SaveProgram():
                return self._save_whole(asked, asker, now)
            case op.DeleteProgram(name=name, expected_revision=revision):
                return self._delete(name, revision, asker)
            case op.EditProgram(edit=DescribeProgram(name=str())):
                raise BadValue("the edit", "names the program; accepted: programs.rename for that")
            case op.EditProgram() | op.UndoEdit() | op.RedoEdit() | op.RenameProgram():
                return self._changes.change(asked, asker)
            case op.RecordPoint() | op.TouchUpPoint():
                return self._changes.teach(asked, asker, now)
        raise AssertionError(f"{asked.op} is not of this library")

    # Loading.

    def _load(self, asked: op.LoadProgram, asker: Asker) -> list[Outgoing]:
        def loaded(found: Document | Refusal, now: int) -> list[Outgoing]:
            if isinstance(found, Refusal):
                return asker.refuse(found)
            document = found
            if asked.revision is not None:
                return self._show(document, asked, asker, now)
            return self._breakpoints.follow(
                asked.name,
                document.heading.revision,
                document.body,
                lambda _, at: self._show(document, asked, asker, at),
                now,
            )

        return self._shelf.load(asked.name, loaded, asked.revision)

    def _show(
        self, document: Document, asked: op.LoadProgram, asker: Asker, now: int
    ) -> list[Outgoing]:
        """Answer with a part of a program as it was asked for, with its breakpoints."""
        heading = document.heading

        def show(text: str) -> list[Outgoing]:
            about = self._breakpoints.fields(asked.name, heading.revision)
            return _part_of(text, heading, asked, asker, about)

        def printed(done: Done, now: int) -> list[Outgoing]:
            assert isinstance(done, BodyPrinted)
            self._keep_printed(heading, done.text)
            return show(done.text)

        if asked.format == "json":
            return show(document.body)
        text = self._printed.get((heading.name, heading.revision))
        if text is not None:
            return show(text)
        return self._work.have(PrintBody(document.body, asked.name), printed, asker, now)

    def _keep_printed(self, heading: Heading, text: str) -> None:
        self._printed[heading.name, heading.revision] = text
        while len(self._printed) > MOST_PRINTED:
            self._printed.popitem(last=False)

    def _check(self, asked: op.CheckProgram, asker: Asker, now: int) -> list[Outgoing]:
        def read(done: Done, now: int) -> list[Outgoing]:
            assert isinstance(done, SourceRead)
            head = check_to_be_kept(done, self._own)
            return asker.answer(
                name=head.name,
                points=done.points,
                statements=done.statements,
                first_line=done.first_line,
            )

        return self._work.have(ReadSource(asked.body, asked.format, "program"), read, asker, now)

    @property
    def _own(self) -> OwnRobot:
        return OwnRobot(self._robot_name, self._limits)

    def _delete(self, name: str, revision: int, asker: Asker) -> list[Outgoing]:
        def deleted(found: Answer, now: int) -> list[Outgoing]:
            if isinstance(found, Heading):
                self._breakpoints.forget(name)
            return saved(found, asker)

        return self._ask(Delete(_KIND, name, revision, asker.name), deleted)

    # Saving.

    def _save_whole(self, asked: op.SaveProgram, asker: Asker, now: int) -> list[Outgoing]:
        body = self._uploads.add(asker.session, asked)
        if body is None:
            return asker.answer(part=asked.part, parts=asked.parts)

        def read(done: Done, now: int) -> list[Outgoing]:
            assert isinstance(done, SourceRead)
            check_to_be_kept(done, self._own, asked.name)
            return self._changes.replace(asked, done.body, asker)

        return self._work.have(ReadSource(body, asked.format, asked.name), read, asker, now)


def _part_of(
    text: str, heading: Heading, asked: op.LoadProgram, asker: Asker, about: dict[str, Any]
) -> list[Outgoing]:
    """Answer with a part of a program's text or JSON."""
    end = asked.offset + CHUNK
    return asker.answer(
        name=asked.name,
        revision=heading.revision,
        saved_by=heading.saved_by,
        saved_at=heading.saved_at,
        format=asked.format,
        body=text[asked.offset : end],
        next=end if end < len(text) else None,
        **about,
    )
