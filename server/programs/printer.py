"""From a program to its canonical text: the one layout that every pendant shows and every file has.

Owns order, indentation and blank lines. `parse(print_program(program)) == program` for every
program: numbers keep every bit, comments stay.
"""

from __future__ import annotations

from .blocks import depths
from .errors import ProgramTooLarge
from .names_in_text import named
from .parser import FORMAT
from .point_clauses import count_point_lines, point_lines
from .program import Program
from .statement_clauses import statement_text
from .tokens import MOST_BYTES

_INDENT = "  "


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
    first = len(_header(program)) + 1
    if program.points:
        first += 1 + sum(map(count_point_lines, program.points))
    if program.statements:
        first += 1
    return tuple(range(first, first + len(program.statements)))


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
