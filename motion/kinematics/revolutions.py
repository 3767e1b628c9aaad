"""Joint revolutions: the multiples of 2π that keep a joint inside its limits.

Owns the choice among joint positions that put the tool at the same place: the revolution nearest to
a seed, every revolution inside the limits, and the joint at fault where none fits. Values are
controller-side [rad or m]. Plain scalars, as this runs eight times in each closed-form solution.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ..errors import OutOfRange

if TYPE_CHECKING:
    from .serial import Kinematics

SNAP = 1e-8
"""Rounding noise [rad or m] of an answer that lies on a bound."""

_FULL_TURN = 2.0 * math.pi
_HALF_TURN = math.pi + SNAP

_Row: TypeAlias = tuple[float, float, float, bool]
"""Of one joint: least and greatest position, weight of its distance, True if it has revolutions."""

_Window: TypeAlias = tuple[float, float, float, float, float]
"""Of one joint: half the width, period, least and greatest position, weight."""


def revolutions_of(angle: float) -> int:
    """Return the full revolutions in an angle [rad]: 0 from -π up to, not including, π.

    The border is `SNAP` early, so that noise does not move a joint that stands at π.
    """
    return math.floor((angle + _HALF_TURN) / _FULL_TURN)


class JointRanges:
    """Limits and revolutions of one robot's joints.

    Attributes:
        middle: (n,) middles of the ranges [rad or m], read-only.
        unit: (n,) unit of a joint's position: 1 rad, or the arm's size [m] for a prismatic joint,
            so that both have the same weight; read-only.

    The distance of two joint positions is Σ (Δqᵢ / vᵢ)², with the greatest speeds vᵢ: a slow joint,
    as the big ones are, weighs more.
    """

    def __init__(self, kinematics: Kinematics) -> None:
        limits = kinematics.limits
        self._limits = limits
        self.middle = (kinematics.lower + kinematics.upper) / 2.0
        self.unit = np.where(limits.prismatic, kinematics.size, 1.0)
        self.middle.flags.writeable = self.unit.flags.writeable = False
        self._rows: tuple[_Row, ...] = tuple(
            zip(
                limits.lower,
                limits.upper,
                (1.0 / (velocity * velocity) for velocity in limits.velocity),
                kinematics.turning.tolist(),
                strict=True,
            )
        )
        self._middles = tuple(_middles(*row) for row in self._rows)
        self._windows = tuple(_window(*row) for row in self._rows)

    def around(self, seed: Sequence[float]) -> NearestRevolutions:
        """Return the object that finds the revolutions nearest to a (n,) seed inside the limits."""
        middles = [
            near if least <= near <= most else least if near < least else most
            for near, (least, most) in zip(seed, self._middles, strict=True)
        ]
        return NearestRevolutions(seed, middles, self._windows)

    def nearest(
        self, position: Sequence[float], seed: Sequence[float]
    ) -> tuple[float, list[float]] | None:
        """Return the revolution inside the limits next to a seed; see `NearestRevolutions.of`."""
        return self.around(seed).of(position)

    def in_revolutions(
        self, position: Sequence[float], turns: Sequence[int], seed: Sequence[float]
    ) -> tuple[float, list[float]] | None:
        """Return a position with the asked revolutions as `nearest` does; None if it is outside.

        Args:
            position: (n,) joint position [rad or m], each angle in any revolution.
            turns: (n,) each joint's revolution, as of `revolutions_of`; that of a joint without
                revolutions is not used.
            seed: (n,) from where the distance is measured.
        """
        wanted = self.with_revolutions(position, turns)
        fits = all(
            lower - SNAP <= value <= upper + SNAP
            for value, (lower, upper, _, _) in zip(wanted, self._rows, strict=True)
        )
        if not fits:
            return None
        inside = self.clamped(wanted)
        return self.distance(inside, seed), inside

    def clamped(self, position: Sequence[float]) -> list[float]:
        """Return a position with each joint that is outside its range on the nearest bound."""
        return [
            value if lower <= value <= upper else min(max(value, lower), upper)
            for value, lower, upper in zip(
                position, self._limits.lower, self._limits.upper, strict=True
            )
        ]

    def drawn_in(self, position: Sequence[float]) -> tuple[float, list[float]]:
        """Return a position moved into the limits, each angle by the revolution that needs least.

        Args:
            position: (n,) joint position, each angle in any revolution.

        Returns:
            The distance of the joints from their ranges, all together [rad or m], and the (n,)
            position inside.
        """
        outside = 0.0
        inside = []
        for value, (lower, upper, _, turning) in zip(position, self._rows, strict=True):
            if not lower <= value <= upper:
                if turning:
                    middle = (lower + upper) / 2.0
                    value = middle + math.remainder(value - middle, _FULL_TURN)
                drawn = min(max(value, lower), upper)
                outside += abs(value - drawn)
                value = drawn
            inside.append(value)
        return outside, inside

    def with_revolutions(self, position: Sequence[float], turns: Sequence[int]) -> list[float]:
        """Return a position with each revolute joint in the asked revolution, limits unchecked."""
        return [
            value + (turn - revolutions_of(value)) * _FULL_TURN if row[3] else value
            for value, turn, row in zip(position, turns, self._rows, strict=True)
        ]

    def distance(self, position: Sequence[float], seed: Sequence[float]) -> float:
        """Return the distance [s²] of two (n,) joint positions as they are."""
        return sum(
            row[2] * (value - near) ** 2
            for value, near, row in zip(position, seed, self._rows, strict=True)
        )

    def every(self, position: Sequence[float]) -> Iterator[tuple[float, ...]]:
        """Yield every revolution of a (n,) joint position [rad or m] inside the limits: (n,)."""
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
        """Return the joint that is farthest outside its range.

        Args:
            position: (n,) joint position.
            turns: the revolutions it must have; None to judge each joint in the revolution that
                comes nearest to its range.

        Returns:
            Its distance from the range [rad or m], and the refusal; None if all joints fit.
        """
        worst = None
        limits = self._limits
        if turns is not None:
            position = self.with_revolutions(position, turns)
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


class NearestRevolutions:
    """Revolutions nearest to one seed, for any joint position.

    Of the values that a joint may have, those nearest to the seed among their revolutions fill a
    window of 2π around the seed, shifted to lie inside the limits, or all of a range that is
    narrower. So one remainder finds the revolution, and shows where there is none.
    """

    def __init__(
        self, seed: Sequence[float], middles: Sequence[float], windows: Sequence[_Window]
    ) -> None:
        """Store the results of `JointRanges.around` for each of n joints.

        Args:
            seed: (n,) [rad or m].
            middles: (n,) middles of the windows [rad or m].
            windows: n half widths, periods, ranges and weights.
        """
        self._seed, self._middles, self._windows = seed, middles, windows

    def of(
        self, position: Sequence[float], within: float = math.inf
    ) -> tuple[float, list[float]] | None:
        """Return the revolution inside the limits nearest to the seed, with its distance from it.

        Args:
            position: (n,) joint position, each angle in any revolution.
            within: greatest distance of interest [s²].

        Returns:
            The distance [s²] and the (n,) position; None if a joint fits in no revolution, or the
            distance is greater.
        """
        distance = 0.0
        fitted = []
        # The lengths were compared with the seed's; comparing again would cost a tenth more.
        for value, near, middle, (half, period, lower, upper, weight) in zip(  # noqa: B905
            position, self._seed, self._middles, self._windows
        ):
            shift = math.remainder(value - middle, period)
            if not -half <= shift <= half:
                return None
            value = middle + shift
            difference = value - near
            distance += weight * difference * difference
            if distance > within:
                return None
            if not lower <= value <= upper:
                value = min(max(value, lower), upper)
            fitted.append(value)
        return distance, fitted


def _middles(lower: float, upper: float, _: float, turning: bool) -> tuple[float, float]:
    """Return the least and the greatest middle of a joint's window [rad or m]."""
    if turning and upper - lower >= 2.0 * (math.pi - SNAP):
        return lower - SNAP + math.pi, upper + SNAP - math.pi
    middle = (lower + upper) / 2.0
    return middle, middle


def _window(lower: float, upper: float, weight: float, turning: bool) -> _Window:
    """Return the part of a joint's window that is the same for every seed."""
    half = (upper - lower) / 2.0 + SNAP
    if not turning:
        return half, math.inf, lower, upper, weight
    return min(half, math.pi), _FULL_TURN, lower, upper, weight
