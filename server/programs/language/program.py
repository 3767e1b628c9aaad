"""The program as a value: points, statements and blocks that fit each other.

Owns what holds of a whole program: unique points of one robot, moves to points that exist, blocks
that close, bounded size. A value that exists is valid. Knows no revision, no text and no store.

Owns the rule of blocks (loops and conditions): each is closed by an end of its own, an else belongs
to a condition and comes once, and they nest to a bounded depth. Without recursion, so that a block
of any depth can be refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg.pendant.management.program_values import (
    MOST_JOINTS,
    BadValue,
    TeachPoint,
    check_comment,
    check_name,
)
from openpendant.simplemsg.pendant.management.programs import MOST_STATEMENTS
from openpendant.simplemsg.pendant.management.statements import (
    Call,
    Else,
    End,
    IfFlag,
    IfInput,
    Loop,
    Move,
    Statement,
)

from .program_errors import BadBlocks, PointExists, PointUnknown, ProgramTooLarge, WrongRobot

DEEPEST_NESTING = 32
"""Greatest depth of nested blocks."""


@dataclass(frozen=True, slots=True)
class Block:
    """Loop or condition; the numbers are of statements, from 0.

    Attributes:
        opened: of its loop or if.
        closed: of its end.
        other: of its else; None without one.
        depth: blocks around it.
    """

    opened: int
    closed: int
    other: int | None
    depth: int


@dataclass(frozen=True, slots=True)
class Blocks:
    """All blocks of a program.

    Attributes:
        at: the block of each statement that opens, divides or closes one.
    """

    at: dict[int, Block]

    def around(self, index: int) -> tuple[Block, ...]:
        """Return the blocks that a statement is inside of, the outermost first."""
        found = {block for block in self.at.values() if block.opened < index <= block.closed}
        return tuple(sorted(found, key=lambda block: block.opened))


def blocks_of(statements: Sequence[Statement]) -> Blocks:
    """Return the blocks of statements.

    Raises:
        BadBlocks: an end or else belongs to nothing, a block is not closed, or is too deep.
    """
    at: dict[int, Block] = {}
    others: dict[int, int] = {}
    opened: list[int] = []
    for index, statement in enumerate(statements):
        match statement:
            case Move():
                pass  # Most statements are, and a long program is asked for its blocks in one go.
            case Loop() | IfInput() | IfFlag():
                if len(opened) == DEEPEST_NESTING:
                    problem = f"the block is number {DEEPEST_NESTING + 1} inside of each other"
                    raise BadBlocks(index, f"{problem}; accepted: up to {DEEPEST_NESTING}")
                opened.append(index)
            case Else():
                if not opened or isinstance(statements[opened[-1]], Loop):
                    raise BadBlocks(index, "else belongs to no if; accepted: else inside an if")
                if opened[-1] in others:
                    raise BadBlocks(index, "the if has an else already; accepted: one")
                others[opened[-1]] = index
            case End():
                if not opened:
                    raise BadBlocks(index, "end closes nothing; accepted: one end for each block")
                first = opened.pop()
                block = Block(first, index, others.get(first), len(opened))
                at[block.opened] = at[block.closed] = block
                if block.other is not None:
                    at[block.other] = block
    if opened:
        raise BadBlocks(opened[-1], "the block is not closed; accepted: an end for it")
    return Blocks(at)


def depths(statements: Sequence[Statement]) -> list[int]:
    """Return the indentation of each statement of a program: the number of blocks around it."""
    result, depth = [], 0
    for before, statement in pairwise((None, *statements)):
        if isinstance(before, Loop | IfInput | IfFlag | Else):
            depth += 1
        if isinstance(statement, Else | End):
            depth -= 1
        result.append(depth)
    return result


MOST_POINTS = 2_000
"""Points of one program."""


@dataclass(frozen=True)
class Program:
    """One program.

    Attributes:
        name: its name, also that of its document.
        linear_axes: indexes of the robot's joints that are measured in metres, ascending.
        tool: name of the tool of points taught from now on.
        frame: name of the frame of points taught from now on.
        comment: lines about the whole program; empty for none.
    """

    name: str
    robot: str
    linear_axes: tuple[int, ...] = ()
    tool: str = "flange"
    frame: str = "base"
    points: tuple[TeachPoint, ...] = ()
    statements: tuple[Statement, ...] = ()
    comment: str = ""

    def __post_init__(self) -> None:
        check_name(self.name, "the program")
        check_name(self.robot, "the robot")
        check_name(self.tool, "the tool")
        check_name(self.frame, "the frame")
        check_comment(self.comment)
        self._check_axes()
        _check_count(len(self.points), "points", MOST_POINTS)
        _check_count(len(self.statements), "statements", MOST_STATEMENTS)
        self._check_points()
        self._check_statements()

    def _check_axes(self) -> None:
        axes, before = self.linear_axes, -1
        for place, axis in enumerate(axes):
            if not before < axis < MOST_JOINTS:
                accepted = f"numbers up to {MOST_JOINTS}, each once, ascending"
                problem = f"are {list(axes)!r}; accepted: {accepted}"
                raise BadValue("the linear axes", problem, place=place)
            before = axis

    def _check_points(self) -> None:
        if len(self.point_by_name) != len(self.points):
            names = [point.name for point in self.points]
            raise PointExists(next(name for name in names if names.count(name) > 1))
        first = len(self.points[0].joints) if self.points else 0
        for point in self.points:
            count = len(point.joints)
            if count != first:
                text = f"has {count} joints; accepted: {first}, as the first point"
                raise BadValue(f"point {point.name}", text)

    def _check_statements(self) -> None:
        known = self.point_by_name
        for index, statement in enumerate(self.statements):
            if isinstance(statement, Move) and (statement.via or statement.point not in known):
                for place, name in enumerate(statement.points):
                    if name not in known:
                        raise PointUnknown(name, tuple(known), index, place)
        _ = self.blocks  # raises where one does not close

    @cached_property
    def blocks(self) -> Blocks:
        """The loops and conditions."""
        return blocks_of(self.statements)

    @cached_property
    def point_by_name(self) -> dict[str, TeachPoint]:
        """The points by their names."""
        return {point.name: point for point in self.points}

    @cached_property
    def calls(self) -> tuple[tuple[int, str], ...]:
        """The statements that call a program, each with the program's name."""
        return tuple(
            (index, statement.program)
            for index, statement in enumerate(self.statements)
            if isinstance(statement, Call)
        )

    def point(self, name: str) -> TeachPoint:
        """Return a point.

        Raises:
            PointUnknown: there is none of this name.
        """
        found = self.point_by_name.get(name)
        if found is None:
            raise PointUnknown(name, tuple(self.point_by_name))
        return found

    def uses_of(self, name: str) -> tuple[int, ...]:
        """Return the numbers of the statements that move to or through a point, from 0."""
        return tuple(
            index
            for index, statement in enumerate(self.statements)
            if isinstance(statement, Move) and name in statement.points
        )


class OwnRobot(NamedTuple):
    """The robot of a cell, as far as a program can be of it or not."""

    name: str
    limits: JointLimits


def check_robot(program: Program, robot: str, limits: JointLimits) -> None:
    """Refuse a program of another robot; ranges are checked point by point, not here.

    Raises:
        WrongRobot: the name, the number of joints or the linear axes differ.
    """
    what = f"program {program.name!r} was taught on {program.robot!r}"
    if program.robot != robot:
        raise WrongRobot(f"{what}; accepted here: programs of {robot!r}")
    count, dof = len(program.points[0].joints) if program.points else 0, len(limits.prismatic)
    if program.points and count != dof:
        raise WrongRobot(f"{what} with {count} joints; accepted here: {dof} joints")
    linear = tuple(index for index, prismatic in enumerate(limits.prismatic) if prismatic)
    if program.linear_axes != linear:
        raise WrongRobot(
            f"{what} with {_axes(program.linear_axes)}; accepted here: {_axes(linear)}"
        )


def _axes(axes: Sequence[int]) -> str:
    numbers = ", ".join(str(axis + 1) for axis in axes)
    return f"linear axes {numbers}" if axes else "no linear axes"


def _check_count(count: int, what: str, limit: int) -> None:
    if count > limit:
        raise ProgramTooLarge(what, count, limit)
