"""Names, comments and numbers of a program: which there may be, and the errors of others.

A name follows the rule of documents, because programs are documents, and holds no quotation mark,
so the text form needs no escapes.
"""

from __future__ import annotations

import math
from functools import lru_cache

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
