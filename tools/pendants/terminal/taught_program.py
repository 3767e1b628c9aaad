"""The open program as the terminal pendant knows it, and the requests that change it.

Owns the reading of a loaded program and the JSON of each edit. Whether an edit is right is the
server's to say; each names the revision that it was made from, so that no two apps overwrite each
other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import count
from typing import Any, Literal, TypeAlias

Way: TypeAlias = Literal["PTP", "LIN"]


class Change(Enum):
    """Edits that need nothing but the program."""

    UNDO = "programs.undo"
    REDO = "programs.redo"


@dataclass(frozen=True, slots=True)
class RecordPoint:
    """Add a point where the robot stands, and a move to it.

    Attributes:
        way: how to move there.
        at: the statement to put the move before, from 0; None to append it.
    """

    way: Way
    at: int | None = None


@dataclass(frozen=True, slots=True)
class TouchUp:
    """Put the point of a statement where the robot stands now."""

    statement: int


@dataclass(frozen=True, slots=True)
class DeleteStatement:
    """Remove a statement."""

    statement: int


ProgramEdit: TypeAlias = RecordPoint | TouchUp | DeleteStatement | Change


@dataclass(frozen=True, slots=True)
class TaughtProgram:
    """A program that was loaded.

    Attributes:
        name: its name.
        revision: the one that was loaded.
        lines: the text of each statement.
        targets: the point that each statement moves to; empty for none.
        points: names of all points.
        first_line: line of the first statement in the program's text, from 1.
    """

    name: str
    revision: int
    lines: tuple[str, ...] = ()
    targets: tuple[str, ...] = ()
    points: tuple[str, ...] = ()
    first_line: int = 1

    @classmethod
    def read(cls, revision: int, text: str, document: dict[str, Any]) -> TaughtProgram:
        """Read both forms of one program, as the server tells them.

        Args:
            revision: of both.
            text: its canonical text: one line for each statement, at its end.
            document: its JSON object.
        """
        statements: Sequence[dict[str, Any]] = document["statements"]
        lines = text.splitlines()
        first = len(lines) - len(statements)
        return cls(
            document["name"],
            revision,
            tuple(lines[first:]),
            tuple(str(each.get("point", "")) for each in statements),
            tuple(str(each["name"]) for each in document["points"]),
            first + 1,
        )

    def index_of(self, line: int) -> int | None:
        """Return the number of the statement on a line of the text, from 0."""
        index = line - self.first_line
        return index if 0 <= index < len(self.lines) else None

    def line_of(self, statement: int) -> int:
        """Return the line of a statement in the program's text."""
        return self.first_line + statement

    def fresh_point(self) -> str:
        """Return a name that no point has: P1, P2 and so on."""
        return next(name for n in count(1) if (name := f"P{n}") not in self.points)

    def request(self, edit: ProgramEdit) -> dict[str, Any]:
        """Return the management request of an edit."""
        base = {"name": self.name, "expected_revision": self.revision}
        match edit:
            case RecordPoint(way=way, at=at):
                point = self.fresh_point()
                move = {"statement": "move", "way": way, "point": point}
                return {"op": "programs.record", **base, "point": point, "move": move, "at": at}
            case TouchUp(statement=index):
                return {"op": "programs.touch_up", **base, "point": self.targets[index]}
            case DeleteStatement(statement=index):
                removal = {"edit": "delete", "first": index, "count": 1}
                return {"op": "programs.edit", **base, "edit": removal}
            case Change():
                return {"op": edit.value, **base}
