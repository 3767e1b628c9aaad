"""Named positions of one cell: those of its robot's file and its own, found by name.

Owns which name means which joints, the revision of the cell's document, and what of it is in force:
a change counts once the store has acknowledged it. The one place where a name becomes a position is
`position_named`. Joint vectors are controller side, (n,) [rad or m].
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from typing import TypeAlias

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import MotionError, shortened
from openpendant.simplemsg.pendant.management.positions import MOST_POSITIONS
from openpendant.simplemsg.verdicts import VerdictCode

from ..events.effects import Effect
from ..events.pending import Pending
from ..planning.jobs import JointVector
from ..refusal import Refusal, refusal_of
from ..store.documents import Document, DocumentKind, Heading
from ..store.requests import Answer, Load, Save
from ..store.store_errors import NotFound, StoreError
from .position_document import (
    BadPositions,
    position_name_fault,
    positions_from_json,
    positions_to_json,
)

_KIND = DocumentKind.POSITIONS
_SHOWN = 6  # names in a refusal
_LONGEST = 48  # characters of a name that is none, in a refusal

Told: TypeAlias = Callable[[int | Refusal, int], list[Effect]]
"""Takes the new revision of the document, or why it was not changed, and the time."""


class PositionBook:
    """The named positions of a cell.

    Attributes:
        of_robot: those of the robot's file, which nobody changes here.
        of_cell: those that users named, by name; the robot's own go before one of the same name,
            which another robot in the cell may have brought.
        revision: of the document; 0 where there is none yet.
        problem: why the document of the store is not in force; None where it is.
    """

    def __init__(
        self,
        cell: str,
        of_robot: Mapping[str, JointVector],
        limits: JointLimits,
        pending: Pending,
        *,
        is_stored: bool = True,
    ) -> None:
        """Make a book of the robot's own positions; `read_once` has the others read.

        Args:
            is_stored: whether there is a store to ask.
        """
        self.of_robot = of_robot
        self.of_cell: Mapping[str, JointVector] = {}
        self.revision = 0
        self.problem: Refusal | None = None
        self._cell = cell
        self._limits = limits
        self._pending = pending
        self._busy = ""
        self._is_stored, self._is_asked = is_stored, False

    def position_named(self, name: str) -> JointVector | Refusal:
        """Return the joints at a named position, or why the robot may not stand there."""
        found = self.of_robot.get(name) or self.of_cell.get(name)
        if found is None:
            return self.being_read or self._unknown(name, (*self.of_robot, *self.of_cell))
        return self.limit_fault(found) or found

    def limit_fault(self, joints: JointVector) -> Refusal | None:
        """Return which limit of the robot a position breaks; None where it keeps all."""
        try:
            self._limits.check_position(joints)
        except MotionError as error:
            return refusal_of(error)
        return None

    def _unknown(self, name: str, known: tuple[str, ...]) -> Refusal:
        close = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
        shown = ", ".join(known[:_SHOWN]) + (", ..." if len(known) > _SHOWN else "")
        hint = f"the nearest is {close[0]!r}" if close else f"known: {shown or 'none'}"
        text = f"no position is called {shortened(name, _LONGEST)}; {hint}"
        return Refusal(VerdictCode.UNKNOWN_POSITION, text)

    # The document.

    @property
    def being_read(self) -> Refusal | None:
        """Why nobody can say yet which positions there are; None once the store has answered."""
        return Refusal(VerdictCode.STORE_BUSY, self._busy) if self._busy == _READING else None

    def read_once(self) -> list[Effect]:
        """Have the document of the cell read, where nobody has asked for that yet.

        It is read when the first pendant comes that knows of such positions, or somebody names one:
        a conversation of version 2 is the same, to the last question to the store, as before.
        """
        return [] if self._is_asked or not self._is_stored else self.load()

    def load(self) -> list[Effect]:
        """Have the document of the cell read."""
        self._busy, self._is_asked = _READING, True
        return self._pending.ask(Load(_KIND, self._cell), self._loaded)

    def _loaded(self, answer: Answer, now: int) -> list[Effect]:
        self._busy = ""
        if isinstance(answer, Document):
            self.revision = answer.heading.revision
            self.problem = self._take(answer.body)
        elif isinstance(answer, StoreError) and not isinstance(answer, NotFound):
            self.problem = answer.refusal()
        return []

    def _take(self, body: str) -> Refusal | None:
        """Put the positions of a document in force, or return why they are none of this robot."""
        try:
            found = positions_from_json(body)
        except BadPositions as error:
            return Refusal(VerdictCode.BAD_DOCUMENT, str(error))
        for name, joints in found.items():
            if len(joints) != self._limits.dof:
                text = f"{name!r} has {len(joints)} joints; the robot has {self._limits.dof}"
                return Refusal(VerdictCode.WRONG_JOINT_COUNT, text, value=len(joints))
        self.of_cell = found
        return None

    def saved_as(self, name: str, joints: JointVector) -> Mapping[str, JointVector] | Refusal:
        """Return the cell's positions with one more, or moved; or why they cannot be."""
        fault = self._name_fault(name)
        if fault is not None:
            return fault
        if name not in self.of_cell and len(self.of_cell) >= MOST_POSITIONS:
            text = f"{len(self.of_cell)} positions are kept; accepted: up to {MOST_POSITIONS}"
            count = float(len(self.of_cell) + 1)
            return Refusal(VerdictCode.TOO_LARGE, text, value=count, limit=float(MOST_POSITIONS))
        return {**self.of_cell, name: joints}

    def renamed(self, name: str, new_name: str) -> Mapping[str, JointVector] | Refusal:
        """Return the cell's positions with another name for one; or why they cannot be."""
        fault = self._not_of_cell(name) or self._name_fault(new_name)
        if fault is None and new_name != name and new_name in self.of_cell:
            text = f"new_name: {new_name!r} is there already; accepted: another name"
            fault = Refusal(VerdictCode.NAME_TAKEN, text)
        if fault is not None:
            return fault
        return {new_name if each == name else each: at for each, at in self.of_cell.items()}

    def without(self, name: str) -> Mapping[str, JointVector] | Refusal:
        """Return the cell's positions without one; or why they cannot be."""
        fault = self._not_of_cell(name)
        if fault is not None:
            return fault
        return {each: at for each, at in self.of_cell.items() if each != name}

    def _name_fault(self, name: str) -> Refusal | None:
        problem = position_name_fault(name)
        if problem is None and name in self.of_robot:
            problem = f"{name!r} is of the robot's file; accepted: another name"
        if problem is None:
            return None
        return Refusal(VerdictCode.BAD_ARGUMENT, f"name: {problem}")

    def _not_of_cell(self, name: str) -> Refusal | None:
        if name in self.of_cell:
            return None
        if name in self.of_robot:
            text = f"{name!r} is of the robot's file; accepted: a position of this cell"
            return Refusal(VerdictCode.BAD_ARGUMENT, text)
        return self._unknown(name, tuple(self.of_cell))

    def conflict(self, expected: int) -> Refusal | None:
        """Return why a change does not fit the kept revision; names both revisions."""
        if self._busy:
            return Refusal(VerdictCode.STORE_BUSY, f"not changed while {self._busy}")
        if expected == self.revision:
            return None
        text = f"positions: the change was made from revision {expected}, kept is {self.revision}"
        code = VerdictCode.REVISION_CONFLICT
        return Refusal(code, text, value=self.revision, limit=expected)

    def keep(
        self, positions: Mapping[str, JointVector], author: str, session: int, told: Told
    ) -> list[Effect]:
        """Have the store keep other positions of the cell; in force once it has them.

        Args:
            session: connection of the author.
            told: called with the new revision, or why they were not saved.
        """
        self._busy = _SAVING

        def saved(answer: Answer, now: int) -> list[Effect]:
            self._busy = ""
            if isinstance(answer, Heading):
                self.of_cell, self.revision, self.problem = positions, answer.revision, None
                return told(answer.revision, now)
            if isinstance(answer, StoreError):
                return told(answer.refusal(), now)
            text = f"the store answered with a {type(answer).__name__}"
            return told(Refusal(VerdictCode.STORE_FAILED, text), now)

        body = positions_to_json(positions)
        save = Save(_KIND, self._cell, body, self.revision, author, session)
        return self._pending.ask(save, saved)


_READING = "what is kept as positions is being read"
_SAVING = "a change of the positions is being saved"
