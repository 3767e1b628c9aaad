"""Changes of programs that are kept: each from the revision that it names, and undone on demand.

Owns the undo of each program's edits, and that a change is acknowledged after the store has it. In
here a program is a string of JSON, never parsed.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable

from openpendant.simplemsg.verdicts import VerdictCode

from ..outgoing import Outgoing
from ..programs.document import program_from_json
from ..programs.edits import DescribeProgram, Edit
from ..programs.errors import ProgramError
from ..programs.history import History, Step
from ..programs.program import OwnRobot
from ..programs.renumbering import Renumbering
from ..programs.splice import Splice
from ..programs.work import BodyEdited, Done, EditBody, HeadTaken, TakeHead
from ..refusal import Refusal
from ..store.documents import Document, DocumentKind, Heading
from ..store.questions import AskStore
from ..store.requests import Answer, Delete, Save
from . import operations as op
from .answers import conflict, renamed, saved
from .kept_breakpoints import KeptBreakpoints
from .operations import Asker
from .program_work import ProgramWork
from .shelf import ProgramShelf
from .taught_points import Standing
from .teacher import NotTaught, Teacher

MOST_HISTORIES = 50
"""Programs whose edits can be undone; the one that was edited longest ago is forgotten."""

_KIND = DocumentKind.PROGRAM

Change = op.EditProgram | op.UndoEdit | op.RedoEdit | op.RenameProgram
Teaching = op.RecordPoint | op.TouchUpPoint


class ProgramChanges:
    """The changes of one cell's programs."""

    def __init__(
        self,
        ask: AskStore,
        shelf: ProgramShelf,
        work: ProgramWork,
        breakpoints: KeptBreakpoints,
        teacher: Teacher,
        own: OwnRobot,
    ) -> None:
        """Begin with nothing to undo.

        Args:
            ask: asks the store.
            shelf: loads programs.
            work: edits them.
            breakpoints: follow the changes.
            teacher: teaches points.
            own: the robot that programs must be of to be edited.
        """
        self._ask = ask
        self._shelf = shelf
        self._work = work
        self._breakpoints = breakpoints
        self._teacher = teacher
        self._own = own
        self._histories: OrderedDict[str, tuple[int, History]] = OrderedDict()

    def save(
        self,
        name: str,
        body: str,
        history: History,
        expected: int,
        asker: Asker,
        renumbering: Renumbering | None = None,
    ) -> list[Outgoing]:
        """Save what a history leads to; the history is kept once the store has the program.

        Args:
            name: of the program.
            body: its JSON.
            history: what led to it.
            expected: the revision that the change was made from.
            asker: gets the answer, with the breakpoints as they are then.
            renumbering: where the change leaves the statements; None to find them by comparing.
        """

        def kept(found: Answer, now: int) -> list[Outgoing]:
            if not isinstance(found, Heading):
                return saved(found, asker)
            heading, revision = found, found.revision
            self._remember(name, revision, history)
            if renumbering is not None:
                self._breakpoints.move(name, expected, revision, renumbering)

            def followed(_: object, now: int) -> list[Outgoing]:
                return saved(heading, asker, **self._breakpoints.fields(name, revision))

            return self._breakpoints.follow(name, revision, body, followed, now)

        return self._ask(Save(_KIND, name, body, expected, asker.name), kept)

    def _history(self, name: str, revision: int) -> History:
        """Return what led to a revision, as far as that is known."""
        known, history = self._histories.get(name, (0, History()))
        return history if known == revision else History()

    def _remember(self, name: str, revision: int, history: History) -> None:
        self._histories[name] = (revision, history)
        self._histories.move_to_end(name)
        while len(self._histories) > MOST_HISTORIES:
            self._histories.popitem(last=False)

    def replace(self, asked: op.SaveProgram, body: str, asker: Asker) -> list[Outgoing]:
        """Save a program in the place of the one that is kept, so that this can be undone."""
        name, expected = asked.name, asked.expected_revision
        if self._histories.get(name, (0, None))[0] != expected or expected == 0:
            return self.save(name, body, History(), expected, asker)

        def loaded(found: Document | Refusal, now: int) -> list[Outgoing]:
            refusal = (
                found if isinstance(found, Refusal) else conflict(name, expected, found.heading)
            )
            if isinstance(found, Refusal) or refusal is not None:
                return asker.refuse(refusal or Refusal(VerdictCode.NOT_FOUND))
            history = self._history(name, expected).edited(Step(Splice(0, found.body, body)))
            return self.save(name, body, history, expected, asker)

        return self._shelf.load(name, loaded)

    def change(self, asked: Change, asker: Asker) -> list[Outgoing]:
        """Change a program that is kept, from the revision that the request names."""
        return self._of_kept(asked, asker, lambda body, at: self._changed(asked, body, asker, at))

    def teach(self, asked: Teaching, asker: Asker, now: int) -> list[Outgoing]:
        """Put a point of a program that is kept where the robot stands now, at the request.

        Until the program was read, it may stand elsewhere; then nobody would have meant that.
        """
        standing = self._teacher.standing(now)
        if isinstance(standing, Refusal):
            return asker.refuse(standing)
        return self._of_kept(
            asked, asker, lambda body, at: self._teach(asked, body, standing, asker, at)
        )

    def _of_kept(
        self, asked: Change | Teaching, asker: Asker, then: Callable[[str, int], list[Outgoing]]
    ) -> list[Outgoing]:
        """Load the revision that a request names; `then` takes its JSON and the time."""
        name, expected = asked.name, asked.expected_revision

        def loaded(found: Document | Refusal, now: int) -> list[Outgoing]:
            refusal = (
                found if isinstance(found, Refusal) else conflict(name, expected, found.heading)
            )
            if isinstance(found, Refusal) or refusal is not None:
                return asker.refuse(refusal or Refusal(VerdictCode.NOT_FOUND))
            body = found.body

            def followed(_: object, now: int) -> list[Outgoing]:
                try:
                    return then(body, now)
                except ProgramError as error:
                    return asker.refuse_program(error)

            return self._breakpoints.follow(name, expected, body, followed, now)

        return self._shelf.load(name, loaded)

    def _changed(self, asked: Change, body: str, asker: Asker, now: int) -> list[Outgoing]:
        match asked:
            case op.EditProgram(edit=edit):
                return self._edit(asked, body, edit, asker, now)
            case op.RenameProgram():
                return self._rename(asked, body, asker, now)
            case op.UndoEdit():
                return self._go(asked, body, History.undone, asker)
            case op.RedoEdit():
                return self._go(asked, body, History.redone, asker)

    def _go(
        self,
        asked: op.UndoEdit | op.RedoEdit,
        body: str,
        way: Callable[[History], tuple[History, Step]],
        asker: Asker,
    ) -> list[Outgoing]:
        """Go one edit back or forth; that is done on the JSON and needs no reading."""
        name, expected = asked.name, asked.expected_revision
        history, step = way(self._history(name, expected))
        after = step.splice.applied(body)
        return self.save(name, after, history, expected, asker, step.renumbering)

    def _edit(
        self,
        asked: op.EditProgram | Teaching,
        body: str,
        edit: Edit,
        asker: Asker,
        now: int,
    ) -> list[Outgoing]:
        name, expected = asked.name, asked.expected_revision

        def edited(done: Done, now: int) -> list[Outgoing]:
            assert isinstance(done, BodyEdited)
            history = self._history(name, expected).edited(Step(done.splice, done.renumbering))
            after = done.splice.applied(body)
            return self.save(name, after, history, expected, asker, done.renumbering)

        return self._work.have(EditBody(body, name, edit, self._own), edited, asker, now)

    def _teach(
        self, asked: Teaching, body: str, standing: Standing, asker: Asker, now: int
    ) -> list[Outgoing]:
        def taken(done: Done, now: int) -> list[Outgoing]:
            assert isinstance(done, HeadTaken)
            head = program_from_json(done.head)
            edit: Edit
            try:
                if isinstance(asked, op.RecordPoint):
                    edit = self._teacher.record(head, asked, standing)
                else:
                    edit = self._teacher.touch_up(head, asked, standing)
            except NotTaught as error:
                return asker.refuse(error.refusal)
            return self._edit(asked, body, edit, asker, now)

        point = asked.point if isinstance(asked, op.TouchUpPoint) else None
        return self._work.have(TakeHead(body, asked.name, point), taken, asker, now)

    def _rename(self, asked: op.RenameProgram, body: str, asker: Asker, now: int) -> list[Outgoing]:
        """Save under the new name, then delete the old one: a crash between loses nothing."""
        old, new, expected = asked.name, asked.new_name, asked.expected_revision

        def edited(done: Done, now: int) -> list[Outgoing]:
            assert isinstance(done, BodyEdited)
            return self._ask(Save(_KIND, new, done.splice.applied(body), 0, asker.name), copied)

        def copied(found: Answer, now: int) -> list[Outgoing]:
            if not isinstance(found, Heading):
                return saved(found, asker)
            copy = found

            def deleted(gone: Answer, now: int) -> list[Outgoing]:
                if isinstance(gone, Heading):
                    self._breakpoints.rename(old, new, copy.revision)
                return renamed(copy, gone, asker, **self._breakpoints.fields(new, copy.revision))

            return self._ask(Delete(_KIND, old, expected, asker.name), deleted)

        task = EditBody(body, old, DescribeProgram(name=new))
        return self._work.have(task, edited, asker, now)
