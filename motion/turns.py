"""Full turns of joints, and which of them fit between a joint's limits.

Owns the choice among joint positions that put the tool at the same place: the turn nearest to a
seed, every turn inside the limits, and which joint is to blame where none fits. Values are
controller-side [rad or m]. Plain scalars, as this runs eight times in each closed-form solution.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from .errors import OutOfRange

if TYPE_CHECKING:
    from .kinematics import Kinematics

SNAP = 1e-8
"""Rounding noise [rad or m] of an answer that lies on a bound."""

_FULL_TURN = 2.0 * math.pi


def turns_of(angle: float) -> int:
    """Return the full turns in an angle [rad]: 0 from -π up to, not including, π.

    The border is `SNAP` early, so that noise does not move a joint that stands at half a turn.
    """
    return math.floor((angle + math.pi + SNAP) / _FULL_TURN)


class JointRanges:
    """The limits and turns of one robot's joints.

    Attributes:
        middle: (n,) middles of the ranges [rad or m], read-only.
        unit: (n,) what a joint's position is measured in: 1 rad, or the arm's size [m] for a
            prismatic joint, so that one weighs like the other; read-only.

    The distance of two joint positions is Σ (Δqᵢ / vᵢ)², with the greatest speeds vᵢ: a joint that
    is slow, as the big ones are, weighs more.
    """

    def __init__(self, kinematics: Kinematics) -> None:
        limits = kinematics.limits
        self._limits = limits
        self.middle = (kinematics.lower + kinematics.upper) / 2.0
        self.unit = np.where(limits.prismatic, kinematics.size, 1.0)
        self.middle.flags.writeable = self.unit.flags.writeable = False
        self._rows = tuple(
            zip(
                limits.lower,
                limits.upper,
                (1.0 / (velocity * velocity) for velocity in limits.velocity),
                kinematics.turning.tolist(),
                strict=True,
            )
        )

    def nearest(
        self, position: Sequence[float], seed: Sequence[float], within: float = math.inf
    ) -> tuple[float, list[float]] | None:
        """Return the turn inside the limits nearest to a seed, with its distance from the seed.

        Args:
            position: (n,) joint position, each angle in any turn.
            seed: (n,) joint position.
            within: greatest distance of interest [s²].

        Returns:
            The distance [s²] and the (n,) position; None if a joint fits in no turn, or the
            distance is greater.
        """
        distance = 0.0
        fitted = []
        for value, near, (lower, upper, weight, turning) in zip(
            position, seed, self._rows, strict=True
        ):
            if turning:
                value = near + math.remainder(value - near, _FULL_TURN)
            if not lower <= value <= upper:
                inside = _moved_inside(value, lower, upper, turning)
                if inside is None:
                    return None
                value = inside
            difference = value - near
            distance += weight * difference * difference
            if distance > within:
                return None
            fitted.append(value)
        return distance, fitted

    def in_turns(
        self, position: Sequence[float], turns: Sequence[int], seed: Sequence[float]
    ) -> tuple[float, list[float]] | None:
        """Return a position with the asked turns as `nearest` does; None if it is outside."""
        wanted = self.with_turns(position, turns)
        fits = all(
            lower - SNAP <= value <= upper + SNAP
            for value, (lower, upper, _, _) in zip(wanted, self._rows, strict=True)
        )
        if not fits:
            return None
        inside = [
            min(max(value, lower), upper)
            for value, (lower, upper, _, _) in zip(wanted, self._rows, strict=True)
        ]
        return self.distance(inside, seed), inside

    def with_turns(self, position: Sequence[float], turns: Sequence[int]) -> list[float]:
        """Return a position with each turning joint in the asked turn, whatever the limits."""
        return [
            value + (turn - turns_of(value)) * _FULL_TURN if row[3] else value
            for value, turn, row in zip(position, turns, self._rows, strict=True)
        ]

    def distance(self, position: Sequence[float], seed: Sequence[float]) -> float:
        """Return the distance [s²] of two (n,) joint positions as they are."""
        return sum(
            row[2] * (value - near) ** 2
            for value, near, row in zip(position, seed, self._rows, strict=True)
        )

    def every(self, position: Sequence[float]) -> Iterator[tuple[float, ...]]:
        """Yield every turn of a joint position inside the limits, each (n,)."""
        choices = []
        for value, (lower, upper, _, turning) in zip(position, self._rows, strict=True):
            turns = [value]
            if turning:
                first = math.ceil((lower - SNAP - value) / _FULL_TURN)
                last = math.floor((upper + SNAP - value) / _FULL_TURN)
                turns = [value + turn * _FULL_TURN for turn in range(first, last + 1)]
            choices.append(
                [
                    min(max(turn, lower), upper)
                    for turn in turns
                    if lower - SNAP <= turn <= upper + SNAP
                ]
            )
        return itertools.product(*choices)

    def blame(
        self, position: Sequence[float], turns: Sequence[int] | None = None
    ) -> tuple[float, OutOfRange] | None:
        """Find the joint that is farthest outside its range.

        Args:
            position: (n,) joint position.
            turns: the turns it must have; None to judge each joint in the turn that comes nearest
                to its range.

        Returns:
            How far outside it is [rad or m], and the refusal; None if all joints fit.
        """
        worst = None
        limits = self._limits
        if turns is not None:
            position = self.with_turns(position, turns)
        for index, (value, (lower, upper, _, turning)) in enumerate(
            zip(position, self._rows, strict=True)
        ):
            if turning and turns is None:
                middle = (lower + upper) / 2.0
                value = middle + math.remainder(value - middle, _FULL_TURN)
            excess = max(lower - value, value - upper)
            if excess > (SNAP if worst is None else worst[0]):
                name, unit = limits.names[index], limits.unit(index)
                worst = excess, OutOfRange(name, float(value), lower, upper, unit, index)
        return worst


def _moved_inside(value: float, lower: float, upper: float, turning: bool) -> float | None:
    if turning:
        outside = max(value - upper, lower - value) - SNAP
        turns = math.ceil(max(outside, 0.0) / _FULL_TURN) * _FULL_TURN
        value = value - turns if value > upper else value + turns
    if lower - SNAP <= value <= upper + SNAP:
        return min(max(value, lower), upper)
    return None
