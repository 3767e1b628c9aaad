"""Changes of kept programs: each from the revision that it names, and undone on demand.

Owns the undo of each program's edits, and that a change is acknowledged after the store has it.
Here a program is a string of JSON, never parsed.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import TypeAlias

from openpendant.simplemsg.pendant.management import programs as op
from openpendant.simplemsg.verdicts import VerdictCode

from ...events.effects import Effect
from ...events.pending import AskStore
from ...events.reply_to import ReplyTo
from ...refusal import Refusal
from ...store.documents import Document, DocumentKind, Heading
from ...store.requests import Answer, Delete, Save
from ..editing.edit_history import EditStep, History, Renumbering, Splice
from ..editing.edits import DescribeProgram, Edit
from ..editing.program_tasks import BodyEdited, Done, EditBody, HeadTaken, TakeHead
from ..language.program import OwnRobot
from ..language.program_errors import BadValue, ProgramError
from ..language.program_json import program_from_json
from .kept_breakpoints import KeptBreakpoints
from .point_teaching import NotTaught, PointTeaching, Standing
from .program_loader import ProgramLoader, ProgramWork
from .program_replies import conflict, renamed, saved

MOST_HISTORIES = 50
"""Greatest number of programs with an undo history; the one edited longest ago is dropped."""

_KIND = DocumentKind.PROGRAM

Change = op.EditProgram | op.UndoEdit | op.RedoEdit | op.RenameProgram
Teaching = op.RecordPoint | op.TouchUpPoint
_Reply: TypeAlias = ReplyTo[op.SavedProgram]


class ProgramChanges:
    """Changes of one cell's programs."""

    def __init__(
        self,
        ask: AskStore,
        program_loader: ProgramLoader,
        work: ProgramWork,
        breakpoints: KeptBreakpoints,
        point_teaching: PointTeaching,
        own: OwnRobot,
    ) -> None:
        self._ask = ask
        self._shelf = program_loader
        self._work = work
        self._breakpoints = breakpoints
        self._teacher = point_teaching
        self._own = own
        self._histories: OrderedDict[str, tuple[int, History]] = OrderedDict()

    def save(
        self,
        name: str,
        body: str,
        history: History,
        expected: int,
        reply_to: _Reply,
        renumbering: Renumbering | None = None,
    ) -> list[Effect]:
        """Save the result of a history; the history is kept once the store has acknowledged it.

        Args:
            expected: the revision that the change was made from.
            reply_to: gets the answer, with the breakpoints as they are then.
            renumbering: where the change leaves the statements; None to find them by comparing.
        """

        def kept(found: Answer, now: int) -> list[Effect]:
            if not isinstance(found, Heading):
                return saved(found, reply_to)
            heading, revision = found, found.revision
            self._remember(name, revision, history)
            if renumbering is not None:
                self._breakpoints.move(name, expected, revision, renumbering)

            def followed(_: object, now: int) -> list[Effect]:
                return saved(heading, reply_to, self._breakpoints.fields(name, revision))

            return self._breakpoints.follow(name, revision, body, followed, now)

        return self._ask(Save(_KIND, name, body, expected, reply_to.name), kept)

    def _history(self, name: str, revision: int) -> History:
        """Return the history of a revision, as far as it is known."""
        known, history = self._histories.get(name, (0, History()))
        return history if known == revision else History()

    def _remember(self, name: str, revision: int, history: History) -> None:
        self._histories[name] = (revision, history)
        self._histories.move_to_end(name)
        while len(self._histories) > MOST_HISTORIES:
            self._histories.popitem(last=False)

    def replace(self, asked: op.SaveProgram, body: str, reply_to: _Reply) -> list[Effect]:
        """Save a program in the place of the one that is kept, so that this can be undone."""
        name, expected = asked.name, asked.expected_revision
        if self._histories.get(name, (0, None))[0] != expected or expected == 0:
            return self.save(name, body, History(), expected, reply_to)

        def loaded(found: Document | Refusal, now: int) -> list[Effect]:
            refusal = (
                found if isinstance(found, Refusal) else conflict(name, expected, found.heading)
            )
            if isinstance(found, Refusal) or refusal is not None:
                return reply_to.refuse(refusal or Refusal(VerdictCode.NOT_FOUND))
            history = self._history(name, expected).edited(EditStep(Splice(0, found.body, body)))
            return self.save(name, body, history, expected, reply_to)

        return self._shelf.load(name, loaded)

    def edit(self, asked: op.EditProgram, edit: Edit, reply: _Reply) -> list[Effect]:
        """Edit a program.

        Raises:
            BadValue: the edit names the program.
        """
        if isinstance(edit, DescribeProgram) and edit.name is not None:
            raise BadValue("the edit", "names the program; accepted: programs.rename for that")
        return self._of_kept(
            asked, reply, lambda body, at: self._edit(asked, body, edit, reply, at)
        )

    def rename(self, asked: op.RenameProgram, reply: _Reply) -> list[Effect]:
        """Give a program another name."""
        return self._of_kept(asked, reply, lambda body, at: self._rename(asked, body, reply, at))

    def undo(self, asked: op.UndoEdit, reply: _Reply) -> list[Effect]:
        """Undo the last edit."""
        return self._of_kept(
            asked, reply, lambda body, at: self._go(asked, body, History.undone, reply)
        )

    def redo(self, asked: op.RedoEdit, reply: _Reply) -> list[Effect]:
        """Redo the edit that was undone last."""
        return self._of_kept(
            asked, reply, lambda body, at: self._go(asked, body, History.redone, reply)
        )

    def teach(self, asked: Teaching, reply_to: _Reply, now: int) -> list[Effect]:
        """Teach a point of a stored program at the robot's position at the time of the request.

        The position is taken now: while the program is being loaded, the robot may move away.
        """
        standing = self._teacher.standing(now)
        if isinstance(standing, Refusal):
            return reply_to.refuse(standing)
        return self._of_kept(
            asked, reply_to, lambda body, at: self._teach(asked, body, standing, reply_to, at)
        )

    def _of_kept(
        self,
        asked: Change | Teaching,
        reply_to: _Reply,
        then: Callable[[str, int], list[Effect]],
    ) -> list[Effect]:
        """Load the revision that a request names; `then` takes its JSON and the time."""
        name, expected = asked.name, asked.expected_revision

        def loaded(found: Document | Refusal, now: int) -> list[Effect]:
            refusal = (
                found if isinstance(found, Refusal) else conflict(name, expected, found.heading)
            )
            if isinstance(found, Refusal) or refusal is not None:
                return reply_to.refuse(refusal or Refusal(VerdictCode.NOT_FOUND))
            body = found.body

            def followed(_: object, now: int) -> list[Effect]:
                try:
                    return then(body, now)
                except ProgramError as error:
                    return reply_to.refuse_program(error)

            return self._breakpoints.follow(name, expected, body, followed, now)

        return self._shelf.load(name, loaded)

    def _go(
        self,
        asked: op.UndoEdit | op.RedoEdit,
        body: str,
        way: Callable[[History], tuple[History, EditStep]],
        reply_to: _Reply,
    ) -> list[Effect]:
        """Undo or redo one edit; this works on the JSON and needs no parsing."""
        name, expected = asked.name, asked.expected_revision
        history, step = way(self._history(name, expected))
        after = step.splice.applied(body)
        return self.save(name, after, history, expected, reply_to, step.renumbering)

    def _edit(
        self,
        asked: op.EditProgram | Teaching,
        body: str,
        edit: Edit,
        reply_to: _Reply,
        now: int,
    ) -> list[Effect]:
        name, expected = asked.name, asked.expected_revision

        def edited(done: Done, now: int) -> list[Effect]:
            assert isinstance(done, BodyEdited)
            history = self._history(name, expected).edited(EditStep(done.splice, done.renumbering))
            after = done.splice.applied(body)
            return self.save(name, after, history, expected, reply_to, done.renumbering)

        return self._work.have(EditBody(body, name, edit, self._own), edited, reply_to, now)

    def _teach(
        self,
        asked: Teaching,
        body: str,
        standing: Standing,
        reply_to: _Reply,
        now: int,
    ) -> list[Effect]:
        def taken(done: Done, now: int) -> list[Effect]:
            assert isinstance(done, HeadTaken)
            head = program_from_json(done.head)
            edit: Edit
            try:
                if isinstance(asked, op.RecordPoint):
                    edit = self._teacher.record(head, asked, standing)
                else:
                    edit = self._teacher.touch_up(head, asked, standing)
            except NotTaught as error:
                return reply_to.refuse(error.refusal)
            return self._edit(asked, body, edit, reply_to, now)

        point = asked.point if isinstance(asked, op.TouchUpPoint) else None
        return self._work.have(TakeHead(body, asked.name, point), taken, reply_to, now)

    def _rename(
        self, asked: op.RenameProgram, body: str, reply_to: _Reply, now: int
    ) -> list[Effect]:
        """Save under the new name, then delete the old one: a crash between loses nothing."""
        old, new, expected = asked.name, asked.new_name, asked.expected_revision

        def edited(done: Done, now: int) -> list[Effect]:
            assert isinstance(done, BodyEdited)
            return self._ask(Save(_KIND, new, done.splice.applied(body), 0, reply_to.name), copied)

        def copied(found: Answer, now: int) -> list[Effect]:
            if not isinstance(found, Heading):
                return saved(found, reply_to)
            copy = found

            def deleted(gone: Answer, now: int) -> list[Effect]:
                if isinstance(gone, Heading):
                    self._breakpoints.rename(old, new, copy.revision)
                return renamed(copy, gone, reply_to, self._breakpoints.fields(new, copy.revision))

            return self._ask(Delete(_KIND, old, expected, reply_to.name), deleted)

        task = EditBody(body, old, DescribeProgram(name=new))
        return self._work.have(task, edited, reply_to, now)
