"""How a statement is named in a sentence: by its line of the canonical text and its own words.

Owns that wording. Requests number statements from 0 and people count lines from 1; a sentence that
names both line and words can be misread by neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from .errors import excerpt
from .printer import statement_lines
from .program import Program
from .statement_clauses import statement_text
from .statements import Comment, Statement

MOST_NAMED = 5
"""Statements that one sentence names."""


def in_words(statement: Statement) -> str:
    """Return a statement's own words, quoted, as far as they fit."""
    return excerpt(statement_text(statement))


def place_of(program: Program, index: int) -> str:
    """Return where a statement of a program is: `line 9, 'move PTP c'`; the number is from 0."""
    return f"line {statement_lines(program)[index]}, {in_words(program.statements[index])}"


def places_of(program: Program, indexes: Sequence[int]) -> str:
    """Return where some statements are; of many, the first and how many more."""
    named = " and ".join(place_of(program, index) for index in indexes[:MOST_NAMED])
    more = len(indexes) - MOST_NAMED
    return f"{named} and {more} more" if more > 0 else named


def first_line(program: Program) -> int:
    """Return the line that the first statement has, or would have where there is none, from 1."""
    return statement_lines(replace(program, statements=(Comment(),)))[0]


def last_of(program: Program) -> str:
    """Return how far the statements of a program go, by number and place."""
    last = len(program.statements) - 1
    if last < 0:
        return "the program has none"
    return f"{last} is {place_of(program, last)}"
