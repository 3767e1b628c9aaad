"""Programs as pendants list, load, edit and save them.

Owns that every change is made from the revision that it names and acknowledged after the store has
it, and the undo of each program's edits. Each request is answered once, through its `Asker`.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace

from openpendant.motion.limits import JointLimits
from openpendant.simplemsg.verdicts import VerdictCode

from ..outgoing import Outgoing
from ..programs.document import program_from_json, program_to_json
from ..programs.editing import DescribeProgram
from ..programs.errors import BadValue, ProgramError
from ..programs.history import MOST_UNDO, History
from ..programs.parser import parse_source
from ..programs.printer import print_program, statement_lines
from ..programs.program import Program, check_robot
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..robot_view import RobotView
from ..store.documents import DocumentKind, Heading
from ..store.questions import AskStore
from ..store.requests import Answer, Delete, ListHeadings, ListHistory, Save
from . import operations as op
from .answers import conflict, listed, renamed, saved
from .operations import Asker
from .shelf import ProgramShelf, StoredProgram
from .teacher import NotTaught, Teacher
from .uploads import Uploads

CHUNK = 15_000
"""Characters of a program in one answer: escaped and in UTF-8 they still fit a frame."""

MOST_HISTORIES = 50
"""Programs whose edits can be undone; the one that was edited longest ago is forgotten."""

_KIND = DocumentKind.PROGRAM

Change = Callable[[History], History]


class ProgramLibrary:
    """The programs of one cell."""

    def __init__(
        self,
        ask: AskStore,
        shelf: ProgramShelf,
        cell: RobotCell,
        robot: RobotView,
        robot_name: str,
    ) -> None:
        """Make a library.

        Args:
            ask: asks the store.
            shelf: loads programs.
            cell: knows where the robot stands.
            robot: its mathematics.
            robot_name: its name.
        """
        self._ask = ask
        self._shelf = shelf
        self._cell = cell
        self._teacher = Teacher(cell, robot, robot_name)
        self._robot_name = robot_name
        self._histories: OrderedDict[str, tuple[int, History]] = OrderedDict()
        self._uploads = Uploads()

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
                return self._check(asked, asker)
            case op.CreateProgram(name=name, frame=frame, tool=tool):
                axes = tuple(i for i, linear in enumerate(self._limits.prismatic) if linear)
                program = Program(name, self._robot_name, axes, tool, frame)
                return self._save(History(program), 0, asker)
            case op.SaveProgram():
                return self._save_whole(asked, asker)
            case op.DeleteProgram(name=name, expected_revision=revision):
                gone = Delete(_KIND, name, revision, asker.name)
                return self._ask(gone, lambda found, _: saved(found, asker))
            case op.RenameProgram():
                return self._rename(asked, asker)
        return self._edit(asked, asker, now)

    # Loading.

    def _load(self, asked: op.LoadProgram, asker: Asker) -> list[Outgoing]:
        def loaded(found: StoredProgram | Refusal, now: int) -> list[Outgoing]:
            if isinstance(found, Refusal):
                return asker.refuse(found)
            program = found.program
            text = print_program(program) if asked.format == "text" else program_to_json(program)
            end = asked.offset + CHUNK
            return asker.answer(
                name=asked.name,
                revision=found.revision,
                saved_by=found.saved_by,
                saved_at=found.saved_at,
                format=asked.format,
                body=text[asked.offset : end],
                next=end if end < len(text) else None,
            )

        return self._shelf.fetch(asked.name, loaded, asked.revision)

    def _check(self, asked: op.CheckProgram, asker: Asker) -> list[Outgoing]:
        program = _read(asked.body, asked.format, "program")
        check_robot(program, self._robot_name, self._limits)
        return asker.answer(
            name=program.name,
            points=len(program.points),
            statements=len(program.statements),
            first_line=min(statement_lines(program), default=0),
        )

    # Saving.

    def _save_whole(self, asked: op.SaveProgram, asker: Asker) -> list[Outgoing]:
        body = self._uploads.add(asker.session, asked)
        if body is None:
            return asker.answer(part=asked.part, parts=asked.parts)
        program = _read(body, asked.format, asked.name)
        if program.name != asked.name:
            text = f"is {program.name!r}; accepted: {asked.name!r}, as the request says"
            raise BadValue("the program's name", text)
        check_robot(program, self._robot_name, self._limits)
        revision, kept = self._histories.get(asked.name, (0, History(program)))
        is_ours = revision == asked.expected_revision and revision != 0
        history = _followed(kept, program) if is_ours else History(program)
        return self._save(history, asked.expected_revision, asker)

    def _save(self, history: History, expected: int, asker: Asker) -> list[Outgoing]:
        """Save what a history leads to; the history is kept once the store has the program."""
        program = history.present
        request = Save(_KIND, program.name, program_to_json(program), expected, asker.name)

        def kept(found: Answer, now: int) -> list[Outgoing]:
            if isinstance(found, Heading):
                self._remember(program.name, found.revision, history)
            return saved(found, asker)

        return self._ask(request, kept)

    def _remember(self, name: str, revision: int, history: History) -> None:
        self._histories[name] = (revision, history)
        self._histories.move_to_end(name)
        while len(self._histories) > MOST_HISTORIES:
            self._histories.popitem(last=False)

    def _rename(self, asked: op.RenameProgram, asker: Asker) -> list[Outgoing]:
        """Save under the new name, then delete the old one: a crash between loses nothing."""
        old, expected = asked.name, asked.expected_revision

        def loaded(found: StoredProgram | Refusal, now: int) -> list[Outgoing]:
            refusal = found if isinstance(found, Refusal) else conflict(old, expected, found)
            if isinstance(found, Refusal) or refusal is not None:
                return asker.refuse(refusal or Refusal(VerdictCode.NOT_FOUND))
            program = replace(found.program, name=asked.new_name)
            request = Save(_KIND, program.name, program_to_json(program), 0, asker.name)
            return self._ask(request, copied)

        def copied(found: Answer, now: int) -> list[Outgoing]:
            if not isinstance(found, Heading):
                return saved(found, asker)
            request = Delete(_KIND, old, expected, asker.name)
            return self._ask(request, lambda gone, _: renamed(found, gone, asker))

        return self._shelf.fetch(old, _guarded(loaded, asker))

    # Editing.

    def _edit(self, asked: op.Operation, asker: Asker, now: int) -> list[Outgoing]:
        match asked:
            case op.EditProgram(edit=DescribeProgram(name=str())):
                raise BadValue("the edit", "names the program; accepted: programs.rename for that")
            case op.EditProgram(edit=edit):
                return self._change(asked, asker, lambda history: history.edited(edit))
            case op.UndoEdit():
                return self._change(asked, asker, History.undone)
            case op.RedoEdit():
                return self._change(asked, asker, History.redone)
            case op.RecordPoint():
                return self._change(
                    asked, asker, lambda each: self._teacher.record(each, asked, now)
                )
            case op.TouchUpPoint():
                return self._change(
                    asked, asker, lambda each: self._teacher.touch_up(each, asked, now)
                )
        raise AssertionError(f"{asked.op} is not of this library")

    def _change(
        self,
        asked: op.EditProgram | op.UndoEdit | op.RedoEdit | op.RecordPoint | op.TouchUpPoint,
        asker: Asker,
        change: Change,
    ) -> list[Outgoing]:
        """Change a program that is kept, from the revision that the request names."""
        name, expected = asked.name, asked.expected_revision

        def loaded(found: StoredProgram | Refusal, now: int) -> list[Outgoing]:
            if isinstance(found, Refusal):
                return asker.refuse(found)
            refusal = conflict(name, expected, found)
            if refusal is not None:
                return asker.refuse(refusal)
            revision, history = self._histories.get(name, (0, History(found.program)))
            if revision != expected:
                history = History(found.program)
            try:
                return self._save(change(history), expected, asker)
            except NotTaught as error:
                return asker.refuse(error.refusal)

        return self._shelf.fetch(name, _guarded(loaded, asker))


ThenProgram = Callable[[StoredProgram | Refusal, int], list[Outgoing]]


def _guarded(then: ThenProgram, asker: Asker) -> ThenProgram:
    """Return the same, with what is wrong with a program told to whoever asked."""

    def guarded(found: StoredProgram | Refusal, now: int) -> list[Outgoing]:
        try:
            return then(found, now)
        except ProgramError as error:
            return asker.refuse_program(error)

    return guarded


def _read(body: str, form: str, file: str) -> Program:
    return program_from_json(body, file) if form == "json" else parse_source(body, file).program


def _followed(history: History, program: Program) -> History:
    """Return the history after a program was put in the place of another as a whole."""
    return History(program, (*history.past, history.present)[-MOST_UNDO:])
