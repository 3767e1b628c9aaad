"""Programs as a cell gets them from the store: one by one, or one with all that it calls.

Owns the loading and the rule that a program on this cell is of this robot. Saves nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from openpendant.motion.limits import JointLimits

from ..outgoing import Outgoing
from ..programs.document import program_from_json
from ..programs.errors import ProgramError
from ..programs.linking import MOST_PROGRAMS, Linked, link
from ..programs.program import Program, check_robot
from ..refusal import Refusal
from ..store.documents import Document, DocumentKind
from ..store.errors import NotFound, StoreError
from ..store.questions import AskStore
from ..store.requests import Answer, Load


@dataclass(frozen=True, slots=True)
class StoredProgram:
    """A program as it is kept.

    Attributes:
        program: the program.
        revision: of its document.
        saved_by: who saved it.
        saved_at: when, wall-clock time as text.
    """

    program: Program
    revision: int
    saved_by: str
    saved_at: str


ThenProgram: TypeAlias = Callable[[StoredProgram | Refusal, int], list[Outgoing]]
ThenLinked: TypeAlias = Callable[[Linked | Refusal, int], list[Outgoing]]


class ProgramShelf:
    """The programs of one cell."""

    def __init__(self, ask: AskStore, robot: str, limits: JointLimits) -> None:
        """Make a shelf.

        Args:
            ask: asks the store.
            robot: name of the robot.
            limits: its joints.
        """
        self._ask = ask
        self._robot = robot
        self._limits = limits

    def fetch(self, name: str, then: ThenProgram, revision: int | None = None) -> list[Outgoing]:
        """Load a program; `then` gets it, or why there is none."""

        def loaded(answer: Answer, now: int) -> list[Outgoing]:
            return then(_read(name, answer), now)

        return self._ask(Load(DocumentKind.PROGRAM, name, revision), loaded)

    def fetch_linked(self, name: str, then: ThenLinked) -> list[Outgoing]:
        """Load a program with all that it calls; `then` gets them, or why they cannot run here."""
        return self._fetch_next(name, [name], {}, then)

    def _fetch_next(
        self, main: str, wanted: list[str], found: dict[str, Program], then: ThenLinked
    ) -> list[Outgoing]:
        name, *rest = wanted
        return self.fetch(name, partial(self._add, main, name, rest, found, then))

    def _add(
        self,
        main: str,
        name: str,
        wanted: list[str],
        found: dict[str, Program],
        then: ThenLinked,
        stored: StoredProgram | Refusal,
        now: int,
    ) -> list[Outgoing]:
        """Take a program that was loaded; go on with those that it calls, or be done."""
        if isinstance(stored, Refusal):
            # A call of what is not there is told by `link`, which knows the place of the call.
            if name == main or stored.code is not NotFound.code:
                return then(stored, now)
        else:
            found[name] = stored.program
            calls = [called for _, called in stored.program.calls]
            known = {*found, *wanted}
            wanted = [*wanted, *(each for each in dict.fromkeys(calls) if each not in known)]
        if wanted and len(found) <= MOST_PROGRAMS:
            return self._fetch_next(main, wanted, found, then)
        return then(self._linked(found[main], found), now)

    def _linked(self, program: Program, found: dict[str, Program]) -> Linked | Refusal:
        try:
            check_robot(program, self._robot, self._limits)
            return link(program, found.get)
        except ProgramError as error:
            return error.refusal


def _read(name: str, answer: Answer) -> StoredProgram | Refusal:
    match answer:
        case StoreError():
            return answer.refusal()
        case Document(heading=heading, body=body):
            try:
                program = program_from_json(body, name)
            except ProgramError as error:
                return error.refusal
            return StoredProgram(program, heading.revision, heading.saved_by, heading.saved_at)
    raise AssertionError("a load is answered by a document")
