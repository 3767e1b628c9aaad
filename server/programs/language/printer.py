"""Printer of the canonical text: the one layout that every pendant shows and every file has.

Owns order, indentation and blank lines. `parse(print_program(program)) == program` for every
program: numbers keep every bit, comments stay.

Owns the reference to a statement in a sentence: its line of the canonical text and its own words.
Requests number statements from 0 and people count lines from 1; a reference with both line and
words cannot be misread.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from openpendant.simplemsg.pendant.management.program_values import TeachPoint
from openpendant.simplemsg.pendant.management.statements import Comment, Statement

from .grammar import point_lines, statement_text
from .lexer import MOST_BYTES, named
from .parser import FORMAT
from .program import Program, depths
from .program_errors import ProgramTooLarge, excerpt

_INDENT = "  "
_LINES_OF_FORMAT_AND_PROGRAM = 2


def print_program(program: Program) -> str:
    """Return the canonical text, with a line feed at its end.

    Raises:
        ProgramTooLarge: the text would be larger than the parser takes.
    """
    text = "\n".join([*_head(program), *_body(program)]) + "\n"
    size = len(text.encode())
    if size > MOST_BYTES:
        raise ProgramTooLarge(f"bytes in the text of {program.name}", size, MOST_BYTES)
    return text


def statement_lines(program: Program) -> tuple[int, ...]:
    """Return the line of each statement in the canonical text, from 1."""
    # Counted, not printed: a run that starts needs the lines, and no text.
    comment = program.comment.count("\n") + 1 if program.comment else 0
    first = _LINES_OF_FORMAT_AND_PROGRAM + comment + 1
    if program.points:
        first += 1 + sum(map(_count_lines, program.points))
    if program.statements:
        first += 1
    return tuple(range(first, first + len(program.statements)))


def _count_lines(point: TeachPoint) -> int:
    """Return the number of lines that a point has, without writing its numbers."""
    comment = point.comment.count("\n") + 1 if "\n" in point.comment else 0
    return comment + 2 + (point.pose is not None) + (point.configuration is not None)


def _head(program: Program) -> list[str]:
    """Return all lines before the first statement."""
    lines = _header(program)
    if program.points:
        lines.append("")
    for point in program.points:
        lines += point_lines(point, program.linear_axes)
    if program.statements:
        lines.append("")
    return lines


def _header(program: Program) -> list[str]:
    """Return all lines before the first point."""
    lines = [FORMAT]
    if program.comment:
        lines += [f"# {line}".rstrip() for line in program.comment.split("\n")]
    axes = "".join(f" {axis + 1}" for axis in program.linear_axes)
    linear = f" linear{axes}" if axes else ""
    lines.append(
        f'program "{program.name}" robot {named(program.robot)}{linear}'
        f" tool {named(program.tool)} frame {named(program.frame)}"
    )
    return lines


def _body(program: Program) -> list[str]:
    statements = program.statements
    return [
        f"{_INDENT * depth}{statement_text(statement)}"
        for depth, statement in zip(depths(statements), statements, strict=True)
    ]


MOST_NAMED = 5
"""Greatest number of statements that one sentence names."""


def in_words(statement: Statement) -> str:
    """Return a statement's own words, quoted, as far as they fit."""
    return excerpt(statement_text(statement))


def place_of(program: Program, index: int) -> str:
    """Return where a statement of a program is: `line 9, 'move PTP c'`; the number is from 0."""
    return f"line {statement_lines(program)[index]}, {in_words(program.statements[index])}"


def places_of(program: Program, indexes: Sequence[int]) -> str:
    """Return the places of some statements; of many, the first and the number of the others."""
    named = " and ".join(place_of(program, index) for index in indexes[:MOST_NAMED])
    more = len(indexes) - MOST_NAMED
    return f"{named} and {more} more" if more > 0 else named


def first_line(program: Program) -> int:
    """Return the line of the first statement, or the one it would have, from 1."""
    return statement_lines(replace(program, statements=(Comment(),)))[0]


def last_of(program: Program) -> str:
    """Return number and place of the last statement of a program."""
    last = len(program.statements) - 1
    if last < 0:
        return "the program has none"
    return f"{last} is {place_of(program, last)}"
