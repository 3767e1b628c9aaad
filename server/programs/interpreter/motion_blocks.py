"""Motion blocks: the moves of a program that run without a stop, as the planner gets them.

Owns the end of a block: at every move without a zone or with a dwell, before a condition or any
statement that takes time, and where the next move is in another space (joints or tool), because no
zone joins those. Owns the reasons why a run ends, and a dry run refuses, at a statement that leads
nowhere. Knows no planner.

Owns the conditions of a step back along the executed moves: along a move whose start is known, and
not over a statement with an effect, because an output or an object does not go back with the robot.
A move that started after an effect leads away from it, so the way back along it crosses nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from openpendant.simplemsg.pendant.management.program_values import TeachPoint
from openpendant.simplemsg.pendant.management.statements import (
    IfFlag,
    Move,
    Speed,
    SpeedKind,
    Statement,
    Way,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from ..language.grammar import statement_text
from .control_flow import ControlFlow, Position

MOST_MOVES_IN_BLOCK = 100
"""Greatest number of moves in a block; a stop after them keeps the planner's answer quick."""

MOST_INSTANT_STATEMENTS = 10_000
"""Greatest number of statements without motion or wait in a row; more count as an endless loop."""

MOST_INSTANT_AT_ONCE = 300
"""Greatest number of these passed in one tick; a run passes the others in later ticks."""

APPROACH = Speed(SpeedKind.FRACTION, 0.1)
"""Greatest speed of the approach to the first point of a run."""


@dataclass(frozen=True, slots=True)
class BlockMove:
    """Move with its points.

    Attributes:
        move: the statement; its zone is 0 where the motion stops.
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
        approach: True if it is the slow way to the first point of a run, to be announced.
    """

    moves: tuple[BlockMove, ...]
    approach: bool = False


@dataclass(frozen=True, slots=True)
class Gathered:
    """Block, and the position of the run after it.

    Attributes:
        positions: before each move.
        behind: after the last move.
    """

    block: MotionBlock
    positions: tuple[Position, ...]
    behind: Position


class Gatherer:
    """Look-ahead for the moves that belong together."""

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
        """Return the block that starts with the move at a position.

        It ends where the look-ahead has passed `MOST_INSTANT_AT_ONCE` statements, all of its moves
        together: what is looked at in one go is bounded, whatever stands between the moves.

        Args:
            stops_at: True if the run must stand before a position, as at a breakpoint.
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
        """Return the next move within so many statements, and how many are left."""
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
    """Return the path back along a move, from its target to its start."""
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
    """Return True if one tool centre point leads through all points; joints alone fit any."""
    return len({move.target.pose.tool for move in moves if move.target.pose is not None}) < 2


def _same_space(move: Move, following: Move) -> bool:
    if Way.SPLINE in (move.way, following.way):
        return False
    return (move.way is Way.PTP) == (following.way is Way.PTP)


def flag_not_read(statement: Statement) -> Refusal:
    """Return the refusal of a condition on a flag that no input was read into."""
    text = f"{statement_text(statement)!r} asks for a flag that was not read"
    return Refusal(VerdictCode.FLAG_NOT_READ, text)


def going_round() -> Refusal:
    """Return the refusal of a run that passes statements for ever while none takes time."""
    text = f"{MOST_INSTANT_STATEMENTS} statements in a row without motion, wait or input"
    return Refusal(VerdictCode.PROGRAM_STUCK, text, limit=MOST_INSTANT_STATEMENTS)


MOST_STEPS_BACK = 1_000
"""Greatest number of executed moves that are kept."""


@dataclass(frozen=True, slots=True)
class _Executed:
    """Move that was executed.

    Attributes:
        effect: the last effect since the move before; empty for none.
    """

    move: BlockMove
    position: Position
    effect: str


class ExecutedMoves:
    """Last moves of a run, in order, and the effects since the last of them."""

    def __init__(self) -> None:
        self._moves: deque[_Executed] = deque(maxlen=MOST_STEPS_BACK)
        self._effect = ""

    def note_effect(self, text: str) -> None:
        """Record that a statement had an effect that no motion undoes."""
        self._effect = text

    def note(self, gathered: Gathered) -> None:
        """Record the moves of a block that was executed."""
        for move, position in zip(gathered.block.moves, gathered.positions, strict=True):
            self._moves.append(_Executed(move, position, self._effect))
            self._effect = ""

    def way_back(self) -> Gathered | Refusal:
        """Return the path back along the last move, or the reason why there is none."""
        code = VerdictCode.STEP_BACK_REFUSED
        if self._effect:
            text = f"{self._effect!r} was executed where the robot stands, and is not undone"
            return Refusal(code, text)
        if len(self._moves) < 2:
            return Refusal(code, "no executed move is known whose beginning is a point")
        last, before = self._moves[-1], self._moves[-2]
        block = reverse_of(last.move, before.move.target)
        return Gathered(block, (last.position,), last.position)

    def forget_last(self) -> None:
        """Remove the last move, along which the robot went back."""
        self._effect = self._moves.pop().effect
