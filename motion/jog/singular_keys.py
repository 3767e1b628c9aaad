"""Which keys of joints lead out of a singularity, found by trying them.

Owns the trial. The fastest way out moves several joints a little each, and a key moves one: where
an arm stands at two singularities at once, the key that leads out of one leaves it at the other.
So a key is named if a stretch of its joint ends where the arm stands free; else the keys of two or
three joints are, which are to be held together. Asked at rest: it costs up to a millisecond.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from .model import JogModel
from .nearness import HALT_CONDITION, SLOW_CONDITION

FREE_CONDITION = HALT_CONDITION - 0.2 * (HALT_CONDITION - SLOW_CONDITION)
"""Condition number below which an arm counts as free: a fifth of the margin is left."""

_STRETCH = 0.6  # rad, or half the arm's size: how far a joint is thought to move
_MOST_KEYS = 3
_LOST = 1e-3  # of the greatest gain: a direction with less counts as lost, however much less


def is_way_out(model: JogModel, position: Sequence[float], rates: Sequence[float]) -> bool:
    """Return whether a stretch of a joint jog ends where an arm stands free.

    Args:
        model: the robot.
        position: (n,) where it stands.
        rates: (n,) of the jog, -1 to 1.
    """
    return model.arm.condition(_stretched(model, position, rates)) < FREE_CONDITION


def keys_out(model: JogModel, position: Sequence[float]) -> tuple[float, ...] | None:
    """Return the joint jog of the fewest keys that leads out; None where three do not.

    Each key is the one that, with those before it, gives back most of the lost directions.

    Args:
        model: the robot.
        position: (n,) where it stands.

    Returns:
        (n,) rates; 0, 1 or -1 each.
    """
    rates = (0.0,) * model.dof
    for _ in range(_MOST_KEYS):
        trials = [
            (model.arm.gains(_stretched(model, position, each)), each)
            for each in _with_another(rates)
        ]
        gains, rates = max(trials, key=lambda trial: _freedom(trial[0]))
        if gains[0] < FREE_CONDITION * gains[-1]:
            return rates
    return None


def _with_another(rates: tuple[float, ...]) -> Iterator[tuple[float, ...]]:
    """Yield a joint jog with each of the joints that it does not move, either way."""
    for joint, rate in enumerate(rates):
        if rate == 0.0:
            for sign in (1.0, -1.0):
                yield (*rates[:joint], sign, *rates[joint + 1 :])


def _stretched(model: JogModel, position: Sequence[float], rates: Sequence[float]) -> list[float]:
    """Return where a stretch of a joint jog ends; a joint that comes to its limit rests there."""
    end = list(position)
    for joint, rate in enumerate(rates):
        if rate:
            limit = model.upper[joint] if rate > 0.0 else model.lower[joint]
            room = abs(limit - position[joint]) if (limit - position[joint]) * rate > 0.0 else 0.0
            end[joint] += rate * min(_STRETCH * model.unit[joint], room)
    return end


def _freedom(gains: Sequence[float]) -> float:
    """Return the logarithm of the volume that the gains span, lost directions counted alike."""
    return sum(math.log(max(gain / gains[0], _LOST)) for gain in gains)
