"""The moves that a run has executed, as far as it may step back along them.

Owns when a step back is possible: along a move whose beginning is known, and over nothing that had
an effect, because an output or an object does not go back with the robot.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .control_flow import Position
from .motion_blocks import BlockMove, Gathered, reverse_of

MOST_STEPS_BACK = 1_000
"""Executed moves that are remembered."""


@dataclass(frozen=True, slots=True)
class _Executed:
    """A move that was executed; `effects`: what happened between the one before it and this."""

    move: BlockMove
    position: Position
    effects: str


class ExecutedMoves:
    """The last moves of a run, in order."""

    def __init__(self) -> None:
        self._moves: deque[_Executed] = deque(maxlen=MOST_STEPS_BACK)
        self._effects = ""

    def note_effect(self, text: str) -> None:
        """Remember that a statement had an effect that no motion undoes."""
        self._effects = text

    def note(self, gathered: Gathered) -> None:
        """Remember the moves of a block that was executed."""
        for move, position in zip(gathered.block.moves, gathered.positions, strict=True):
            self._moves.append(_Executed(move, position, self._effects))
            self._effects = ""

    def way_back(self) -> Gathered | Refusal:
        """Return the way back along the last move, or why there is none."""
        code = VerdictCode.STEP_BACK_REFUSED
        if self._effects:
            return Refusal(code, f"{self._effects!r} was executed since and is not undone")
        if len(self._moves) < 2:
            return Refusal(code, "no executed move is known whose beginning is a point")
        last, before = self._moves[-1], self._moves[-2]
        if last.effects:
            return Refusal(code, f"{last.effects!r} was executed before the move and is not undone")
        block = reverse_of(last.move, before.move.target)
        return Gathered(block, (last.position,), last.position)

    def forget_last(self) -> None:
        """The robot went back along the last move."""
        self._moves.pop()
