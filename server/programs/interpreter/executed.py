"""Executed moves of a run, as far as it may step back along them.

Owns the conditions of a step back: along a move whose start is known, and not over a statement with
an effect, because an output or an object does not go back with the robot. A move that started after
an effect leads away from it, so the way back along that move crosses nothing.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from .control_flow import Position
from .motion_blocks import BlockMove, Gathered, reverse_of

MOST_STEPS_BACK = 1_000
"""Greatest number of executed moves that are kept."""


@dataclass(frozen=True, slots=True)
class _Executed:
    """Move that was executed.

    Attributes:
        position: before it.
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
