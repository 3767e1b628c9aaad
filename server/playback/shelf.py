"""Programs as a cell gets them from the store: one as JSON, or one with all that it calls.

Owns the loading, the size of a run, and the rule that a program on this cell is of this robot. What
is to run is read piece by piece, some at each tick. Saves nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

from openpendant.motion.limits import JointLimits

from ..outgoing import Outgoing
from ..programs.errors import ProgramError, ProgramTooLarge
from ..programs.linking import MOST_PARTS, MOST_PROGRAMS, Linked, link
from ..programs.program import Program, check_robot
from ..programs.unpacking import Unpacking
from ..programs.work import BodyUnpacked, Done, ProgramRefused, UnpackBody
from ..refusal import Refusal
from ..store.documents import Document, DocumentKind
from ..store.errors import NotFound, StoreError
from ..store.questions import AskStore
from ..store.requests import Answer, Load
from .answers import not_the_kept_one
from .program_work import ProgramWork

ThenDocument: TypeAlias = Callable[[Document | Refusal, int], list[Outgoing]]
ThenLinked: TypeAlias = Callable[[Linked | Refusal, int], list[Outgoing]]


@dataclass(slots=True)
class _Gathering:
    """A program to run on its way here, with all that it calls.

    Attributes:
        main: its name.
        then: gets the programs.
        revision: the only one of the main program that is accepted; 0 for the newest.
        wanted: names that are not here yet, the one under way first.
        programs: those that are here.
        sources: the JSON of each.
        revisions: the one of each.
        parts: points and statements of all of them.
    """

    main: str
    then: ThenLinked
    revision: int
    wanted: deque[str]
    programs: dict[str, Program] = field(default_factory=dict)
    sources: dict[str, str] = field(default_factory=dict)
    revisions: dict[str, int] = field(default_factory=dict)
    parts: int = 0


class ProgramShelf:
    """The programs of one cell."""

    def __init__(self, ask: AskStore, work: ProgramWork, robot: str, limits: JointLimits) -> None:
        """Make a shelf.

        Args:
            ask: asks the store.
            work: cuts programs into pieces.
            robot: name of the robot.
            limits: its joints.
        """
        self._ask = ask
        self._work = work
        self._robot = robot
        self._limits = limits
        self._reading: deque[tuple[_Gathering, Unpacking]] = deque()

    def load(self, name: str, then: ThenDocument, revision: int | None = None) -> list[Outgoing]:
        """Load a program as it is kept; `then` gets it, or why there is none."""

        def loaded(answer: Answer, now: int) -> list[Outgoing]:
            if isinstance(answer, StoreError):
                return then(answer.refusal(), now)
            assert isinstance(answer, Document)
            return then(answer, now)

        return self._ask(Load(DocumentKind.PROGRAM, name, revision), loaded)

    def fetch_linked(self, name: str, then: ThenLinked, revision: int = 0) -> list[Outgoing]:
        """Load a program with all that it calls; `then` gets them, or why they cannot run here.

        Args:
            name: of the program.
            then: gets the programs.
            revision: the only one of that program that is accepted; 0 for the newest. What it calls
                is always the newest.
        """
        return self._fetch_next(_Gathering(name, then, revision, deque([name])))

    def tick(self, now: int) -> list[Outgoing]:
        """Read on in a program that is to run."""
        return self._read_on(now) if self._reading else []

    def _fetch_next(self, gathering: _Gathering) -> list[Outgoing]:
        return self.load(gathering.wanted[0], partial(self._loaded, gathering))

    def _loaded(self, gathering: _Gathering, found: Document | Refusal, now: int) -> list[Outgoing]:
        name = gathering.wanted[0]
        if isinstance(found, Refusal):
            # A call of what is not there is told by `link`, which knows the place of the call.
            if name == gathering.main or found.code is not NotFound.code:
                return gathering.then(found, now)
            return self._go_on(gathering, now)
        if name == gathering.main and gathering.revision not in (0, found.heading.revision):
            return gathering.then(not_the_kept_one(gathering.revision, found.heading), now)
        gathering.sources[name], gathering.revisions[name] = found.body, found.heading.revision
        task = UnpackBody(found.body, name)
        return self._work.ask(task, partial(self._unpacked, gathering), now)

    def _unpacked(
        self, gathering: _Gathering, done: Done | ProgramRefused, now: int
    ) -> list[Outgoing]:
        if isinstance(done, ProgramRefused):
            return gathering.then(done.refusal, now)
        assert isinstance(done, BodyUnpacked)
        gathering.parts += done.parts
        if gathering.parts > MOST_PARTS:
            what = "points and statements in the programs of one run"
            return gathering.then(ProgramTooLarge(what, gathering.parts, MOST_PARTS).refusal, now)
        known = {*gathering.programs, *gathering.wanted}
        gathering.wanted += (called for called in done.calls if called not in known)
        self._reading.append((gathering, Unpacking(done)))
        return self._read_on(now) if len(self._reading) == 1 else []

    def _read_on(self, now: int) -> list[Outgoing]:
        gathering, unpacking = self._reading[0]
        program = unpacking.step()
        if program is None:
            return []
        self._reading.popleft()
        gathering.programs[gathering.wanted[0]] = program
        return self._go_on(gathering, now)

    def _go_on(self, gathering: _Gathering, now: int) -> list[Outgoing]:
        """Fetch the next program that is called, or be done."""
        gathering.wanted.popleft()
        if gathering.wanted and len(gathering.programs) <= MOST_PROGRAMS:
            return self._fetch_next(gathering)
        return gathering.then(self._linked(gathering), now)

    def _linked(self, gathering: _Gathering) -> Linked | Refusal:
        program = gathering.programs[gathering.main]
        # A program that is kept under another name than its own runs under its own.
        revisions = gathering.revisions | {program.name: gathering.revisions[gathering.main]}
        try:
            check_robot(program, self._robot, self._limits)
            return link(program, gathering.programs.get, gathering.sources, revisions)
        except ProgramError as error:
            return error.refusal
