"""How fast tool and elbow get by a joint velocity: at the end of a tick, and in a stop after it.

Owns the rule that keeps a joint jog within a speed of points although the arm changes its shape. A
stop scales a velocity by λ, from 1 to 0, and has then gone the share p = 1 - λ² of its way. With
S(p) the speed of a point there, for the whole velocity, the point has the speed

    λ S(p),   λ = √(1 - p)

The greatest of it must be within the limit, so a stop never has to be harder than the joints can: a
stretching arm gets faster by itself. S is worked out where the stop begins and at two places of its
way, and is the parabola through these three elsewhere; of random stops of all robots that turn no
joint by more than `_LONG` none got faster than that says with what `_MISSED` adds. On a longer one
S may rise and fall more than once, and is worked out every `_CLOSE` of it. Likewise without the
joints whose range ends first, which may have taken from the speed. Knows no tick and no target.

For any stop of any robot; of an arm on a straight line `line_speeds` proves the same from less.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import NoAssembly
from ..pose import Array
from .model import JogModel
from .reasons import JogCause, JogReason

RESERVE = 0.998
"""Of the limit of a point, for what its speed changes within a tick."""

_REASONS = (JogReason.TOOL_SPEED, JogReason.ELBOW_SPEED)
_BETWEEN = (0.25, 0.65)  # of the way of a stop
_LOOKED_AT = (0.08, 0.16, 0.25, 0.35, 0.5, 0.65, 0.8)
_MISSED = 1.25  # times what a stop adds to a speed: more than the parabola ever missed of it
_LONG, _CLOSE = 1.0, 0.25  # rad, or share of the arm's length: of the way of a stop
_UNSEEN = 1.02  # times what is found so: more than is missed between
_SLOW = 0.6  # of the limit, at first and at last: it does not get beyond the limit between


def _weights(share: float) -> tuple[float, ...]:
    """Return what λ S(share) is of S at the three places (Lagrange's polynomials times λ)."""
    places = (0.0, *_BETWEEN)
    return tuple(
        math.sqrt(1.0 - share)
        * math.prod((share - other) / (place - other) for other in places if other != place)
        for place in places
    )


_WEIGHTS = tuple(map(_weights, _LOOKED_AT))


class StopAhead(NamedTuple):
    """A stop in the least time after a tick.

    Attributes:
        velocity: (n,) at the end of the tick [rad/s or m/s].
        here: (n,) where the tick ends [rad or m].
        there: (n,) where the stop ends [rad or m].
        time: `stop_time` of the velocity [s].
    """

    velocity: list[float]
    here: list[float]
    there: list[float]
    time: float


def point_excess(model: JogModel, stop: StopAhead, limit: float) -> tuple[float, JogCause | None]:
    """Return how much faster than allowed a point gets, 1 being just allowed, and which.

    Args:
        model: the robot.
        stop: after the tick that is judged.
        limit: greatest speed of tool centre point and elbow [m/s].
    """
    worst = 0.0
    found: JogCause | None = None
    allowed = RESERVE * limit
    greatest = _greatest_in_stop(model, stop, allowed)
    for others in _without_ending(model, stop):
        tool, elbow = model.arm.point_speeds(stop.here, others)
        greatest = max(greatest[0], tool), max(greatest[1], elbow)
    for reason, speed in zip(_REASONS, greatest, strict=True):
        if speed > worst * allowed:
            worst = speed / allowed
            found = JogCause(reason, speed, limit)
    return worst, found


def _greatest_in_stop(model: JogModel, stop: StopAhead, allowed: float) -> tuple[float, float]:
    """Return the greatest speeds of both points from the end of the tick to rest."""
    velocity, here, there, _ = stop
    rates = np.array(velocity)
    begin = model.arm.point_speeds(here, rates)
    # One joint alone leads every point on a circle about its axis, always as fast.
    if model.arm.rigid and _is_single(velocity):
        return begin
    ways = zip(here, there, model.unit, strict=True)
    longest = max([abs(end - start) / unit for start, end, unit in ways])
    if longest > _LONG:
        return _greatest_in_long_stop(model, stop, rates, begin, longest)
    first, last = _BETWEEN
    later = _on_the_way(model, stop, last, rates, begin)
    slow = _SLOW * allowed
    if begin[0] < slow and begin[1] < slow and later[0] < slow and later[1] < slow:
        return begin
    between = _on_the_way(model, stop, first, rates, begin)
    return (
        _greatest(begin[0], between[0], later[0]),
        _greatest(begin[1], between[1], later[1]),
    )


def _greatest_in_long_stop(
    model: JogModel, stop: StopAhead, rates: Array, begin: tuple[float, float], longest: float
) -> tuple[float, float]:
    """Return the greatest speeds of both points, looked at in steps of a stop."""
    greatest = begin
    count = math.ceil(longest / _CLOSE)
    for step in range(1, count):
        speeds = _on_the_way(model, stop, step / count, rates, begin)
        share = _UNSEEN * math.sqrt(1.0 - step / count)
        greatest = max(greatest[0], share * speeds[0]), max(greatest[1], share * speeds[1])
    return greatest


def _greatest(begin: float, between: float, later: float) -> float:
    """Return the greatest λ S of a point by its S at the three places."""
    most = max([a * begin + b * between + c * later for a, b, c in _WEIGHTS])
    return begin + _MISSED * (most - begin) if most > begin else begin


def stop_time(model: JogModel, velocity: Sequence[float]) -> float:
    """Return the least time [s] in which all joints can stop together from a (n,) velocity."""
    time = 0.0
    for each, acceleration in zip(velocity, model.limits.acceleration, strict=True):
        needed = (each if each > 0.0 else -each) / acceleration
        if needed > time:
            time = needed
    return time


def _is_single(velocity: list[float]) -> bool:
    """Return whether just one joint moves."""
    return velocity.count(0.0) == len(velocity) - 1


def _without_ending(model: JogModel, stop: StopAhead) -> list[list[float]]:
    """Return the velocity without the joints whose range ends before a stop would.

    They brake by themselves, and what they took from the speed of a point is then missing. The
    speed is convex in theirs, so it is greatest with or without them.
    """
    ending = []
    velocity, time = stop.velocity, stop.time
    joints = zip(velocity, stop.here, model.lower, model.upper, model.margin, strict=True)
    for joint, (each, here, lower, upper, margin) in enumerate(joints):
        if each > 0.0:
            ends = upper - here < each * time + margin
        else:
            ends = each < 0.0 and here - lower < margin - each * time
        if ends:
            ending.append(joint)
    if not ending or _is_single(velocity):
        return []
    groups = [ending] if len(ending) == 1 else [ending, *([joint] for joint in ending)]
    return [
        [0.0 if joint in group else each for joint, each in enumerate(velocity)] for group in groups
    ]


def _on_the_way(
    model: JogModel, stop: StopAhead, share: float, rates: Array, otherwise: tuple[float, float]
) -> tuple[float, float]:
    """Return S of both points; what it is otherwise, where a platform cannot stand there."""
    ways = zip(stop.here, stop.there, strict=True)
    place = [start + share * (end - start) for start, end in ways]
    try:
        return model.arm.point_speeds(place, rates)
    except NoAssembly:
        return otherwise
