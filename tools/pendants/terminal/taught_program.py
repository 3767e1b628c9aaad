"""The open program of the terminal pendant, and the requests that edit it.

Owns the parsing of a loaded program and the JSON of each edit. The server checks each edit; an edit
names the revision that it was made from, so that two clients cannot overwrite each other's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import count
from typing import Any, Literal, TypeAlias

Way: TypeAlias = Literal["PTP", "LIN"]


class HistoryStep(Enum):
    """Edits without arguments: steps in the program's edit history."""

    UNDO = "programs.undo"
    REDO = "programs.redo"


@dataclass(frozen=True, slots=True)
class RecordHere:
    """Add a point at the robot's present position, and a move to it.

    Attributes:
        way: kind of motion to the point.
        at: the statement to insert the move before, from 0; None to append it.
    """

    way: Way
    at: int | None = None


@dataclass(frozen=True, slots=True)
class TouchUpHere:
    """Move the point of a statement to the robot's present position."""

    statement: int


@dataclass(frozen=True, slots=True)
class DeleteStatement:
    """Remove a statement."""

    statement: int


ProgramEdit: TypeAlias = RecordHere | TouchUpHere | DeleteStatement | HistoryStep


@dataclass(frozen=True, slots=True)
class TaughtProgram:
    """A program that was loaded.

    Attributes:
        name: its name.
        revision: the loaded revision.
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
        """Parse both forms of one program from the server's answers.

        Args:
            revision: of both forms.
            text: its canonical text, which ends with one line for each statement.
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
        """Return the first unused point name: P1, P2 and so on."""
        return next(name for n in count(1) if (name := f"P{n}") not in self.points)

    def request(self, edit: ProgramEdit) -> dict[str, Any]:
        """Return the management request of an edit."""
        base = {"name": self.name, "expected_revision": self.revision}
        match edit:
            case RecordHere(way=way, at=at):
                point = self.fresh_point()
                move = {"statement": "move", "way": way, "point": point}
                return {"op": "programs.record", **base, "point": point, "move": move, "at": at}
            case TouchUpHere(statement=index):
                return {"op": "programs.touch_up", **base, "point": self.targets[index]}
            case DeleteStatement(statement=index):
                removal = {"edit": "delete", "first": index, "count": 1}
                return {"op": "programs.edit", **base, "edit": removal}
            case HistoryStep():
                return {"op": edit.value, **base}
