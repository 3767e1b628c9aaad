"""The open program of the terminal pendant, the requests that edit it, and findings of its dry run.

Owns the parsing of a loaded program and of a dry run's answer, and the JSON of each edit. The
server checks each edit; an edit names the revision that it was made from, so that two clients
cannot overwrite each other's. Findings name their program and revision, because those about another
revision are not valid for this one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import count
from typing import Any, Literal, TypeAlias, TypeVar

from openpendant.simplemsg.verdicts import VerdictCode

from .wording import in_screen_units

Way: TypeAlias = Literal["PTP", "LIN"]


class HistoryStep(Enum):
    """Edits without arguments: steps in the program's edit history."""

    UNDO = "programs.undo"
    REDO = "programs.redo"


@dataclass(frozen=True, slots=True)
class RecordHere:
    """Add a point at the robot's present position, and a move to it.

    Attributes:
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
        lines: the text of each statement.
        targets: the point that each statement moves to; empty for none.
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
            text: its canonical text, which ends with one line for each statement.
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


REACHABLE = ""
"""Stands where a refusal would, for what can be reached."""

_Key = TypeVar("_Key")


@dataclass(frozen=True, slots=True)
class DryRunFindings:
    """The findings of one dry run.

    Attributes:
        duration: of the program [s].
        is_endless: a loop of it never ends, so the duration is that of two passes.
        is_complete: every branch was run to its end.
        is_checked: every signal of it was checked against the controller's signals.
        is_refused: a move cannot be run, or a point cannot be reached.
        elsewhere: refusals in called programs, each with its place.
    """

    name: str
    revision: int
    duration: float
    is_endless: bool
    is_complete: bool
    is_checked: bool
    is_refused: bool
    elsewhere: tuple[str, ...]
    _lines: Mapping[int, str]
    _points: Mapping[str, str]

    @classmethod
    def read(cls, name: str, revision: int, answer: dict[str, Any]) -> DryRunFindings:
        """Read the answer to `programs.dry_run`."""
        steps: list[dict[str, Any]] = [
            *answer["moves"],
            *answer["scene"],
            *(step for step in answer["statements"] if not step["reachable"]),
        ]
        own = [step for step in steps if step["program"] == name]
        called = [step for step in steps if step["program"] != name and not step["reachable"]]
        return cls(
            name,
            revision,
            float(answer["duration"]),
            bool(answer["endless"]),
            bool(answer["complete"]),
            not answer["unchecked"],
            bool(answer["refused"]),
            tuple(f"{each['program']} line {each['line']}: {_refusal(each)}" for each in called),
            _worst((int(step["line"]), _refusal(step)) for step in own),
            _worst((str(point["point"]), _refusal(point)) for point in answer["points"]),
        )

    def refusal(self, line: int, point: str) -> str | None:
        """Return why a statement cannot run; `REACHABLE` if it can, None if that is not known.

        Args:
            line: of the statement in the program's text.
            point: target of its move; empty for none.
        """
        return self._lines.get(line) or self._points.get(point, self._lines.get(line))

    @property
    def summary(self) -> str:
        """The findings in one line."""
        passes = " for two passes of its endless loop" if self.is_endless else ""
        partly = "" if self.is_complete else ", not every branch was walked"
        partly += "" if self.is_checked else ", its signals are not known yet"
        if self.is_refused:
            return (
                f"dry run: REFUSED, {self.duration:.1f} s without what is refused{passes}{partly}"
            )
        return f"dry run: all reachable, {self.duration:.1f} s{passes}{partly}"


def _worst(verdicts: Iterable[tuple[_Key, str]]) -> dict[_Key, str]:
    """Return one verdict for each key; a refusal replaces an acceptance."""
    worst: dict[_Key, str] = {}
    for key, refusal in verdicts:
        worst[key] = worst.get(key) or refusal
    return worst


def _refusal(verdict: dict[str, Any]) -> str:
    """Return the refusal in degrees and millimetres; `REACHABLE` where there is none."""
    if verdict["reachable"]:
        return REACHABLE
    code = verdict["code"]
    name = VerdictCode(code).name if code in set(VerdictCode) else str(code)
    # The place, which a move's text begins with, is known from where it is shown.
    place = f"{verdict.get('program')}, line {verdict.get('line')}, point {verdict.get('point')}: "
    return f"{name}: {in_screen_units(verdict['text'].removeprefix(place))}"
