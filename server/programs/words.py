"""Names and comments in programs, and the checks that every number of a program passes.

A name follows the rule of documents, as programs are documents, and holds no quotation mark: so
the text form needs no escapes.
"""

from __future__ import annotations

import math
from functools import lru_cache

from ..store.documents import check_name as check_document_name
from ..store.errors import BadName
from .errors import BadValue, ProgramNameRefused

LONGEST_COMMENT = 200
"""Characters in a line of comment."""

MOST_COMMENT_LINES = 50
"""Lines of the comment of a program or of a point."""


COMMENT = "the comment"
"""What a comment is called in an error."""


def check_name(name: str, what: str, place: int = 0) -> None:
    """Refuse a name that cannot be shown on one line, or that looks like a path.

    Args:
        name: the name.
        what: whose name it is, for the error.
        place: which of several names of these it is, from 0.

    Raises:
        ProgramNameRefused: it cannot be a name.
    """
    try:
        _check_words(name)
    except BadName as error:
        raise ProgramNameRefused(f"the name of {what}", error.problem, place=place) from None
    if '"' in name:
        problem = 'holds a quotation mark; accepted: a name without "'
        raise ProgramNameRefused(f"the name of {what}", problem, place=place)


@lru_cache(maxsize=8_192)
def _check_words(name: str) -> None:
    """Check a name once; the moves of a program name each point many times."""
    check_document_name(name)


def check_comment_line(text: str, place: int = 0) -> None:
    """Refuse a line that would not come back as it was from a text file.

    Args:
        text: the line.
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
        value: the number.
        what: its name, for the error.
        lower: least number that is accepted.
        upper: greatest number that is accepted.
        unit: of all three, for the error.
        part: as in `BadValue`.
        place: likewise.

    Raises:
        BadValue: it is outside, or not a number.
    """
    if not (math.isfinite(value) and lower <= value <= upper):
        ending = f" {unit}" if unit else ""
        problem = f"is {value:g}{ending}; accepted: {lower:g} to {upper:g}{ending}"
        raise BadValue(what, problem, part=part, place=place)
