"""Moves that are run without a stop, as the planner gets them.

Owns where such a block ends: at every move without a zone or with a dwell, before a condition or
anything else that takes time, and where the next move is of another space (joints or tool), as no
zone joins those. Knows no planner.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from .control_flow import ControlFlow, Position
from .points import TeachPoint
from .statements import IfFlag, Move, Speed, SpeedKind, Way

MOST_MOVES_IN_BLOCK = 100
"""Moves that are planned at once; a stop behind them keeps the planner's answer quick."""

MOST_INSTANT_STATEMENTS = 10_000
"""Statements without motion or wait in a row; more of them go round for ever."""

MOST_INSTANT_AT_ONCE = 300
"""Of these, those that are passed in one go; a run passes the others at the ticks behind it."""

APPROACH = Speed(SpeedKind.FRACTION, 0.1)
"""Fastest way to the first point of a run."""


@dataclass(frozen=True, slots=True)
class BlockMove:
    """One move with its points.

    Attributes:
        program: name of the program that it is in.
        index: number of its statement, from 0.
        move: the statement; its zone is 0 where the motion stops.
        target: the point that it goes to.
        via: the points in between.
    """

    program: str
    index: int
    move: Move
    target: TeachPoint
    via: tuple[TeachPoint, ...] = ()


@dataclass(frozen=True, slots=True)
class MotionBlock:
    """Moves that join by zones; the robot stands at the end of the last.

    Attributes:
        moves: at least one.
        approach: whether it is the slow way to the first point of a run, to be announced.
    """

    moves: tuple[BlockMove, ...]
    approach: bool = False


@dataclass(frozen=True, slots=True)
class Gathered:
    """A block, and where the run is behind it.

    Attributes:
        block: the moves.
        positions: before each move.
        behind: after the last move.
    """

    block: MotionBlock
    positions: tuple[Position, ...]
    behind: Position


class Gatherer:
    """Looks ahead for the moves that belong together."""

    def __init__(self, flow: ControlFlow) -> None:
        self._flow = flow

    def approach(self, position: Position) -> Gathered:
        """Return the joint motion to where the move at a position ends."""
        found = self._block_move(position)
        speed = found.move.speed
        if speed.kind is SpeedKind.TOOL or speed.value > APPROACH.value:
            speed = APPROACH
        move = replace(found.move, way=Way.PTP, via=(), speed=speed, zone=0.0)
        block = MotionBlock((replace(found, move=move, via=()),), approach=True)
        return Gathered(block, (position,), self._flow.behind(position))

    def block(self, position: Position, stops_at: Callable[[Position], bool]) -> Gathered:
        """Return the block that begins with the move at a position.

        It ends where the look-ahead has passed `MOST_INSTANT_AT_ONCE` statements, all of its moves
        together: what is looked at in one go is bounded, whatever stands between the moves.

        Args:
            position: before a move.
            stops_at: whether the run must stand before a position, as at a breakpoint.
        """
        moves, positions = [self._block_move(position)], [position]
        behind, left = self._flow.behind(position), MOST_INSTANT_AT_ONCE
        while moves[-1].move.zone and len(moves) < MOST_MOVES_IN_BLOCK:
            following, left = self._next_move(behind, stops_at, left)
            if following is None:
                break
            found = self._block_move(following)
            if not _same_space(moves[-1].move, found.move) or not _same_tool([*moves, found]):
                break
            moves.append(found)
            positions.append(following)
            behind = self._flow.behind(following)
        moves[-1] = replace(moves[-1], move=replace(moves[-1].move, zone=0.0))
        return Gathered(MotionBlock(tuple(moves)), tuple(positions), behind)

    def _next_move(
        self, position: Position, stops_at: Callable[[Position], bool], most: int
    ) -> tuple[Position | None, int]:
        """Look for a move behind up to so many statements; return how many are left, too."""
        for left in range(most, -1, -1):
            if not position or stops_at(position):
                break
            statement = self._flow.statement(position)
            if isinstance(statement, Move):
                return position, left
            if not self._flow.is_instant(statement) or isinstance(statement, IfFlag):
                break
            position = self._flow.behind(position)
        return None, 0

    def _block_move(self, position: Position) -> BlockMove:
        level, move = position[-1], self._flow.statement(position)
        if not isinstance(move, Move):
            raise AssertionError("a block begins with a move")
        points = self._flow.linked.programs[level.program].point_by_name
        via = tuple(points[name] for name in move.via)
        return BlockMove(level.program, level.index, move, points[move.point], via)


def reverse_of(executed: BlockMove, back_to: TeachPoint) -> MotionBlock:
    """Return the way back along a move, from its target to where it began."""
    move = replace(
        executed.move,
        point=back_to.name,
        via=tuple(reversed(executed.move.via)),
        zone=0.0,
        dwell=0.0,
    )
    way = replace(executed, move=move, target=back_to, via=tuple(reversed(executed.via)))
    return MotionBlock((way,))


def _same_tool(moves: Sequence[BlockMove]) -> bool:
    """Tell whether one tool centre point leads through all points; joints alone go with any."""
    return len({move.target.pose.tool for move in moves if move.target.pose is not None}) < 2


def _same_space(move: Move, following: Move) -> bool:
    if Way.SPLINE in (move.way, following.way):
        return False
    return (move.way is Way.PTP) == (following.way is Way.PTP)
