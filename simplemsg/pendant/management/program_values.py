"""Values of a program: its names, comments, numbers and teach points, and the errors of others.

Owns the fields of a point and the accepted values of all. A name follows the rule of documents,
because programs are documents, and holds no quotation mark, so the text form needs no escapes. The
joints of a point are controller-side [rad or m]. Knows no mathematics of poses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, Literal, TypeAlias

from ...names import name_fault
from ...verdicts import VerdictCode


class ProgramError(ValueError):
    """Base of all errors of programs; the text is one sentence with its numbers."""

    code: VerdictCode = VerdictCode.PROGRAM_INVALID


class BadValue(ProgramError):
    """A value that a point or a statement cannot have.

    Attributes:
        part: the part of its owner that has the value, as whoever reads a text marks it.
        place: which of several values of that part, from 0.
    """

    def __init__(self, what: str, problem: str, *, part: str = "", place: int = 0) -> None:
        """Take the fault; `part` is `what` by default."""
        super().__init__(f"{what} {problem}")
        self.what, self.problem = what, problem
        self.part, self.place = part or what, place


class ProgramNameRefused(BadValue):
    """A name that a program, a point or an object cannot have."""

    code = VerdictCode.BAD_NAME


LONGEST_COMMENT = 200
"""Greatest number of characters in a line of comment."""

MOST_COMMENT_LINES = 50
"""Greatest number of lines of the comment of a program or of a point."""


COMMENT = "the comment"
"""Name of a comment in an error."""


def check_name(name: str, what: str, place: int = 0) -> None:
    """Refuse a name that cannot be shown on one line, or that looks like a path.

    Args:
        what: whose name it is, for the error.
        place: which of several names of these it is, from 0.

    Raises:
        ProgramNameRefused: it cannot be a name.
    """
    problem = _problem(name)
    if problem:
        raise ProgramNameRefused(f"the name of {what}", problem, place=place)


@lru_cache(maxsize=8_192)
def _problem(name: str) -> str:
    """Return what is wrong with a name, once for each: moves name each point many times."""
    fault = name_fault(name)
    if fault is not None:
        return fault.problem
    return 'holds a quotation mark; accepted: a name without "' if '"' in name else ""


def check_comment_line(text: str, place: int = 0) -> None:
    """Refuse a line that would not come back unchanged from a text file.

    Args:
        place: which line of a comment it is, from 0.

    Raises:
        BadValue: it is too long, not trimmed, or has a character that cannot be shown on one line.
    """
    if len(text) > LONGEST_COMMENT:
        problem = f"has {len(text)} characters; accepted: up to {LONGEST_COMMENT}"
        raise BadValue(COMMENT, problem, place=place)
    if not text.isprintable():
        bad = next(character for character in text if not character.isprintable())
        problem = f"holds U+{ord(bad):04X}; accepted: printable characters"
        raise BadValue(COMMENT, problem, place=place)
    if text != text.strip():
        problem = "begins or ends with a space; accepted: a comment without"
        raise BadValue(COMMENT, problem, place=place)


def check_comment(text: str) -> None:
    """As `check_comment_line`, for the lines of a comment."""
    lines = text.split("\n")
    if len(lines) > MOST_COMMENT_LINES:
        problem = f"has {len(lines)} lines; accepted: up to {MOST_COMMENT_LINES}"
        raise BadValue(COMMENT, problem, place=MOST_COMMENT_LINES)
    for place, line in enumerate(lines):
        check_comment_line(line, place)


def check_number(
    value: float,
    what: str,
    lower: float,
    upper: float,
    unit: str = "",
    *,
    part: str = "",
    place: int = 0,
) -> None:
    """Refuse a number outside a range; both bounds are legal.

    Args:
        unit: of all three, for the error.
        part: as in `BadValue`.

    Raises:
        BadValue: it is outside, or not a number.
    """
    if not (math.isfinite(value) and lower <= value <= upper):
        ending = f" {unit}" if unit else ""
        problem = f"is {value:g}{ending}; accepted: {lower:g} to {upper:g}{ending}"
        raise BadValue(what, problem, part=part, place=place)


JointVector: TypeAlias = tuple[float, ...]

MOST_JOINTS = 16
"""Joints of a point."""

MOST_TURNS = 100
"""Greatest number of revolutions of a joint, either way."""

_LARGEST_VALUE = 1e6
_UNIT_TOLERANCE = 1e-6


class Value:
    """A part of a program; its JSON has exactly its fields, of exactly their types."""

    __slots__ = ()
    __pydantic_config__: ClassVar[Mapping[str, Any]] = {"extra": "forbid", "strict": True}


@dataclass(frozen=True, slots=True)
class ArmConfiguration(Value):
    """Which of the ways to reach its pose a point takes; the words of `motion.configuration`.

    Attributes:
        shoulder: where the wrist is, seen from axis 1.
        elbow: where the elbow is, seen from the line between shoulder and wrist.
        wrist: the sign of the wrist's middle joint.
        turns: full turns of each joint; None where they are not said.
    """

    shoulder: Literal["front", "back"]
    elbow: Literal["up", "down"]
    wrist: Literal["no-flip", "flip"]
    turns: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        for place, turn in enumerate(self.turns or ()):
            check_number(turn, "a number of turns", -MOST_TURNS, MOST_TURNS, place=place)


@dataclass(frozen=True, slots=True)
class PointPose(Value):
    """Where the tool is.

    Attributes:
        position: (3,) of the tool's centre point in the frame [m].
        quaternion: (4,) x, y, z, w; its length is 1 to 1e-6.
        frame: the frame's name.
        tool: the tool's name.
    """

    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    frame: str
    tool: str

    def __post_init__(self) -> None:
        for place, value in enumerate(self.position):
            what = "a coordinate"
            check_number(value, what, -_LARGEST_VALUE, _LARGEST_VALUE, "m", place=place)
        for place, value in enumerate(self.quaternion):
            check_number(value, "an element of the quaternion", -1.1, 1.1, place=place)
        length = math.hypot(*self.quaternion)
        if abs(length - 1.0) > _UNIT_TOLERANCE:
            accepted = f"1 to within {_UNIT_TOLERANCE:g}, in the order x, y, z, w"
            problem = f"has length {length:.9g}; accepted: {accepted}"
            raise BadValue("the quaternion", problem, part="an element of the quaternion")
        check_name(self.frame, "the frame")
        check_name(self.tool, "the tool")


@dataclass(frozen=True, slots=True)
class TeachPoint(Value):
    """One taught point.

    Attributes:
        name: unique in its program.
        joints: (n,) controller side [rad or m].
        pose: where that put the tool; None where nobody measured it.
        configuration: which of the ways to reach the pose; None where the robot has no such words.
        comment: lines of text; empty for none.
    """

    name: str
    joints: JointVector
    pose: PointPose | None = None
    configuration: ArmConfiguration | None = None
    comment: str = ""

    def __post_init__(self) -> None:
        check_name(self.name, "the point")
        if not 1 <= len(self.joints) <= MOST_JOINTS:
            problem = f"are {len(self.joints)}; accepted: 1 to {MOST_JOINTS}"
            raise BadValue("joints", problem, place=MOST_JOINTS)
        for number, value in enumerate(self.joints, start=1):
            what = f"joint {number} of point {self.name}"
            check_number(
                *(value, what, -_LARGEST_VALUE, _LARGEST_VALUE), part="joints", place=number - 1
            )
        turns = None if self.configuration is None else self.configuration.turns
        if turns is not None and len(turns) != len(self.joints):
            problem = f"are {len(turns)}; accepted: {len(self.joints)}, as joints"
            place = min(len(turns) - 1, len(self.joints))
            raise BadValue("turns", problem, part="a number of turns", place=place)
        check_comment(self.comment)
