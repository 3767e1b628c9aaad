"""Program loader: stored programs as a cell needs them, without holding up the event loop.

Owns where a task on a program is done: a small one at once, any other in the planning process,
because an event loop serves every robot of the server. Its answer is an event with a time.

Owns the loading of one program, or of one linked with every program it calls, the size of a run,
and the rule that a program on this cell is of this robot. A program for a run is read piece by
piece, some at each tick. Saves nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeAlias, TypeVar

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg.pendant.management.program_values import ProgramError
from openpendant.simplemsg.verdicts import VerdictCode

from ...events.effects import Effect
from ...events.management_requests import ReplyTo
from ...events.pending import AskStore, Pending, Steps, Turn
from ...planning.jobs import ProgramJob
from ...refusal import Refusal
from ...store.documents import Document, DocumentKind, Heading
from ...store.requests import Answer, Load
from ...store.store_errors import NotFound, StoreError
from ..editing.program_tasks import (
    MOST_JSON_AT_ONCE,
    PACK,
    BodyUnpacked,
    Done,
    ProgramRefused,
    Task,
    TaskResult,
    UnpackBody,
    Unpacking,
    perform,
    unpacked,
)
from ..language.linking import MOST_PARTS, MOST_PROGRAMS, Linked, link
from ..language.program import Program, check_robot
from ..language.program_errors import ProgramTooLarge, program_refusal
from ..language.program_json import program_from_json

MOST_WAITING = 16
"""Greatest number of tasks of one cell that wait for the planning process."""

_T = TypeVar("_T")


class ProgramWork:
    """Tasks of one cell."""

    def __init__(self, new_job_id: Callable[[], int], pending: Pending) -> None:
        self._new_job_id = new_job_id
        self._pending = pending
        self._waiting = 0

    def done(self, task: Task) -> Steps[TaskResult]:
        """Carry out a task, at once where it is small; return its result."""
        if task.is_small:
            return perform(task)
        if self._waiting >= MOST_WAITING:
            text = f"{self._waiting} programs are being read or written; at most that many"
            busy = Refusal(VerdictCode.STORE_BUSY, text, value=MOST_WAITING, limit=MOST_WAITING)
            return ProgramRefused(busy)
        self._waiting += 1
        planned = yield ProgramJob(self._new_job_id(), task)
        self._waiting -= 1
        result = planned.result
        if isinstance(result, TaskResult):
            return result
        refusal = result if isinstance(result, Refusal) else Refusal(VerdictCode.PLANNER_FAILED)
        return ProgramRefused(refusal)

    def run(
        self, steps: Steps[_T], then: Callable[[_T, int], list[Effect]], now: int
    ) -> list[Effect]:
        """Start work of several steps; `then` gets what it returns."""
        return self._pending.run(steps, then, now)

    def have(
        self,
        task: Task,
        then: Callable[[Done, int], list[Effect]],
        reply_to: ReplyTo[Any],
        now: int,
    ) -> list[Effect]:
        """Carry out a task; refuse the request if the program is at fault."""

        def done(result: TaskResult, now: int) -> list[Effect]:
            if isinstance(result, ProgramRefused):
                return reply_to.refuse_work(result)
            try:
                return then(result, now)
            except ProgramError as error:
                return reply_to.refuse_program(error)

        return self._pending.run(self.done(task), done, now)


ThenDocument: TypeAlias = Callable[[Document | Refusal, int], list[Effect]]


@dataclass(slots=True)
class _Gathering:
    """A program that is being loaded for a run, with all that it calls.

    Attributes:
        wanted: names of the programs that are still missing, the one being loaded first.
    """

    main: str
    wanted: deque[str]
    programs: dict[str, Program] = field(default_factory=dict)
    sources: dict[str, str] = field(default_factory=dict)
    revisions: dict[str, int] = field(default_factory=dict)
    parts: int = 0


class ProgramLoader:
    """Loader of one cell's programs."""

    def __init__(self, ask: AskStore, work: ProgramWork, robot: str, limits: JointLimits) -> None:
        self._ask = ask
        self._work = work
        self._robot = robot
        self._limits = limits

    def load(self, name: str, then: ThenDocument, revision: int | None = None) -> list[Effect]:
        """Load a stored program; `then` gets it, or why there is none."""

        def loaded(answer: Answer, now: int) -> list[Effect]:
            return then(_document(answer), now)

        return self._ask(Load(DocumentKind.PROGRAM, name, revision), loaded)

    def document(self, name: str, revision: int | None = None) -> Steps[Document | Refusal]:
        """Load a stored program; return it, or why there is none."""
        return _document((yield Load(DocumentKind.PROGRAM, name, revision)))

    def linked(self, name: str, revision: int = 0) -> Steps[Linked | Refusal]:
        """Load a program with all that it calls; return them, or why they cannot run here.

        Args:
            revision: the only one of that program that is accepted; 0 for the newest. What it calls
                is always the newest.
        """
        gathering = _Gathering(name, deque([name]))
        while gathering.wanted and len(gathering.programs) <= MOST_PROGRAMS:
            called = gathering.wanted[0]
            found = _document((yield Load(DocumentKind.PROGRAM, called)))
            if isinstance(found, Document):
                kept = found.heading.revision
                if called == name and revision not in (0, kept):
                    return not_the_kept_one(revision, found.heading)
                gathering.sources[called], gathering.revisions[called] = found.body, kept
                refusal = yield from self._read(gathering, found.body, called)
                if refusal is not None:
                    return refusal
            # `link` reports a call of a missing program, because it knows the place of the call.
            elif called == name or found.code is not NotFound.code:
                return found
            gathering.wanted.popleft()
        return self._link(gathering)

    def _read(self, gathering: _Gathering, body: str, name: str) -> Steps[Refusal | None]:
        """Read a program into what is gathered; return why that cannot be."""
        whole: Program | None = None
        pieces: BodyUnpacked | None = None
        if len(body) <= MOST_JSON_AT_ONCE:
            try:
                whole = program_from_json(body, name)
            except ProgramError as error:
                return program_refusal(error)
            parts = len(whole.points) + len(whole.statements)
            calls = tuple(dict.fromkeys(called for _, called in whole.calls))
            if parts >= PACK:
                pieces = unpacked(whole)
        else:
            done = yield from self._work.done(UnpackBody(body, name))
            if isinstance(done, ProgramRefused):
                return done.refusal
            assert isinstance(done, BodyUnpacked)
            pieces, parts, calls = done, done.parts, done.calls
        gathering.parts += parts
        if gathering.parts > MOST_PARTS:
            what = "points and statements in the programs of one run"
            return program_refusal(ProgramTooLarge(what, gathering.parts, MOST_PARTS))
        known = {*gathering.programs, *gathering.wanted}
        gathering.wanted += (called for called in calls if called not in known)
        yield Turn.FIRST
        if pieces is not None:
            whole = yield from _put_together(pieces)
        assert whole is not None
        gathering.programs[name] = whole
        return None

    def _link(self, gathering: _Gathering) -> Linked | Refusal:
        program = gathering.programs[gathering.main]
        # A program stored under another name than its own runs under its own.
        revisions = gathering.revisions | {program.name: gathering.revisions[gathering.main]}
        try:
            check_robot(program, self._robot, self._limits)
            return link(program, gathering.programs.get, gathering.sources, revisions)
        except ProgramError as error:
            return program_refusal(error)


def _document(answer: Answer) -> Document | Refusal:
    if isinstance(answer, StoreError):
        return answer.refusal()
    assert isinstance(answer, Document)
    return answer


def _put_together(pieces: BodyUnpacked) -> Steps[Program]:
    unpacking = Unpacking(pieces)
    while (program := unpacking.step()) is None:
        yield Turn.NEXT
    return program


def not_the_kept_one(asked: int, kept: Heading) -> Refusal:
    """Return the refusal to run a revision in the place of which another is kept."""
    text = (
        f"revision {asked} was asked for, revision {kept.revision} is kept:"
        f" program {kept.name!r} was saved by {kept.saved_by!r} at {kept.saved_at}"
    )
    return _other_revision(text, kept.revision, asked)


def not_the_one_under_way(program: str, asked: int, running: int) -> Refusal:
    """Return the refusal to continue with another revision than the run started with."""
    text = (
        f"revision {asked} was asked for, revision {running} of program {program!r} is under way;"
        f" accepted: {running}, or {asked} after a program stop"
    )
    return _other_revision(text, running, asked)


def _other_revision(text: str, found: int, asked: int) -> Refusal:
    code = VerdictCode.REVISION_CONFLICT
    return Refusal(code, text, value=float(found), limit=float(asked))
