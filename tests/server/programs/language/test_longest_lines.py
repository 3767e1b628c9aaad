from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from rigs.data.program_samples import program

from openpendant.server.programs.language.lexer import LONGEST_LINE, LONGEST_NUMBER
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.printer import print_program
from openpendant.server.programs.language.program import DEEPEST_NESTING, Program
from openpendant.simplemsg.names import LONGEST_NAME
from openpendant.simplemsg.pendant.management.points import (
    MOST_JOINTS,
    MOST_TURNS,
    ArmConfiguration,
    PointPose,
    TeachPoint,
)
from openpendant.simplemsg.pendant.management.statements import (
    MOST_VIAS,
    End,
    Loop,
    Move,
    Speed,
    SpeedKind,
    Way,
)
from openpendant.simplemsg.pendant.management.words import LONGEST_COMMENT

LONG_NUMBER = 123456.78901234567
LONG_DIGITS = 0.00012345678901234567


def name(letter: str, number: int = 0) -> str:
    """The longest name, in quotation marks as it has a space."""
    return f"{number:3d}".replace(" ", "x") + " " + letter * (LONGEST_NAME - 4)


def deep(statement: Move, *points: TeachPoint) -> Program:
    """A program with a statement as far inside as it may be."""
    opened, closed = (Loop(),) * DEEPEST_NESTING, (End(),) * DEEPEST_NESTING
    return replace(program(""), points=points, statements=(*opened, statement, *closed))


def spline(letter: str) -> Program:
    points = [TeachPoint(name(letter, n), (0.0,) * 6) for n in range(MOST_VIAS + 1)]
    names = [point.name for point in points]
    speed = Speed(SpeedKind.TOOL, LONG_DIGITS)
    comment = letter * LONGEST_COMMENT
    vias = tuple(names[1:])
    move = Move(Way.SPLINE, names[0], vias, speed, dwell=LONG_DIGITS, comment=comment)
    return deep(move, *points)


def point(letter: str) -> Program:
    rotation = (0.5000000000000001, 0.49999999999999994, 0.5000000000000001, 0.4999999999999999)
    pose = PointPose((LONG_NUMBER,) * 3, rotation, name(letter, 1), name(letter, 2))
    arm = ArmConfiguration("front", "down", "no-flip", (-MOST_TURNS,) * MOST_JOINTS)
    axes = tuple(range(0, MOST_JOINTS, 2))
    numbers = (LONG_DIGITS, LONG_NUMBER) * (MOST_JOINTS // 2)
    found = TeachPoint(name(letter), numbers, pose, arm, letter * LONGEST_COMMENT)
    whole = replace(program(""), points=(found,), linear_axes=axes)
    return replace(whole, tool=name(letter, 3), frame=name(letter, 4))


def characters(found: Program) -> int:
    return max(map(len, print_program(found).split("\n")))


@pytest.mark.parametrize("letter", ["x", "ß", "点", "𝄞"])
@pytest.mark.parametrize("longest", [spline, point])
def test_the_longest_lines_of_a_program_read_back(
    longest: Callable[[str], Program], letter: str
) -> None:
    found = longest(letter)
    assert parse(print_program(found)) == found


def test_no_statement_has_a_line_that_the_parser_refuses() -> None:
    """The move through the most points, were all its numbers as long as any may be."""
    names = (MOST_VIAS + 1) * (LONGEST_NAME + 3)
    numbers = 3 * (LONGEST_NUMBER + len(" speed  mm/s"))
    words = len("move SPLINE via ") + 2 * DEEPEST_NESTING + LONGEST_COMMENT + len("  # ")
    assert characters(spline("x")) <= names + numbers + words <= LONGEST_LINE
