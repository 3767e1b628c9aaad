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


def check_name(name: str, what: str) -> None:
    """Refuse a name that cannot be shown on one line, or that looks like a path.

    Args:
        name: the name.
        what: whose name it is, for the error.

    Raises:
        ProgramNameRefused: it cannot be a name.
    """
    try:
        _check_words(name)
    except BadName as error:
        raise ProgramNameRefused(f"the name of {what}", error.problem) from None
    if '"' in name:
        problem = 'holds a quotation mark; accepted: a name without "'
        raise ProgramNameRefused(f"the name of {what}", problem)


@lru_cache(maxsize=8_192)
def _check_words(name: str) -> None:
    """Check a name once; the moves of a program name each point many times."""
    check_document_name(name)


def check_comment_line(text: str, what: str = "the comment") -> None:
    """Refuse a line that would not come back as it was from a text file.

    Raises:
        BadValue: it is too long, not trimmed, or has a character that cannot be shown on one line.
    """
    if len(text) > LONGEST_COMMENT:
        raise BadValue(what, f"has {len(text)} characters; accepted: up to {LONGEST_COMMENT}")
    if not text.isprintable():
        bad = next(character for character in text if not character.isprintable())
        raise BadValue(what, f"holds U+{ord(bad):04X}; accepted: printable characters")
    if text != text.strip():
        raise BadValue(what, "begins or ends with a space; accepted: a comment without")


def check_comment(text: str, what: str = "the comment") -> None:
    """As `check_comment_line`, for the lines of a comment."""
    lines = text.split("\n")
    if len(lines) > MOST_COMMENT_LINES:
        raise BadValue(what, f"has {len(lines)} lines; accepted: up to {MOST_COMMENT_LINES}")
    for line in lines:
        check_comment_line(line, what)


def check_number(value: float, what: str, lower: float, upper: float, unit: str = "") -> None:
    """Refuse a number outside a range; both bounds are legal.

    Raises:
        BadValue: it is outside, or not a number.
    """
    if not (math.isfinite(value) and lower <= value <= upper):
        ending = f" {unit}" if unit else ""
        raise BadValue(what, f"is {value:g}{ending}; accepted: {lower:g} to {upper:g}{ending}")
