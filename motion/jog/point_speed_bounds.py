"""Bounds of tool and elbow speed in a joint jog: at the end of a tick, and in a stop after it.

Owns the rule that keeps a joint jog below a speed limit of points although the arm changes its
shape. A stop scales a velocity by λ, from 1 to 0, and has then covered the share p = 1 - λ² of its
length. With S(p) the speed of a point there for the whole velocity, the point has the speed

    λ S(p),   λ = √(1 - p)

Its greatest value must be within the limit, so that a stop never needs more deceleration than the
joints have: a stretching arm gets faster by itself. S is computed where the stop begins and at two
places of it, and is the parabola through these three elsewhere. Of random stops of all robots that
move no joint by more than `_LONG`, none was faster than this with what `_MISSED` adds. In a longer
stop S may rise and fall more than once; it is computed every `_CLOSE`. The same is done without the
joints whose range ends first, which may have lowered the speed. Knows no tick and no target.

Valid for any stop of any robot; for an arm on a straight line `line_speed_bounds` proves the same
from fewer speeds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import NoAssembly
from ..pose import Array
from .jog_commands import JogCause, JogSlowdown
from .jog_model import JogModel

RESERVE = 0.998
"""Share of the speed limit of a point; the rest is for what its speed changes within a tick."""

_REASONS = (JogSlowdown.TOOL_SPEED, JogSlowdown.ELBOW_SPEED)
_BETWEEN = (0.25, 0.65)  # of the length of a stop
_LOOKED_AT = (0.08, 0.16, 0.25, 0.35, 0.5, 0.65, 0.8)
_MISSED = 1.25  # factor on the rise of a speed: more than the parabola ever missed
_LONG, _CLOSE = 1.0, 0.25  # rad, or share of the arm's length: along a stop
_UNSEEN = 1.02  # factor on speeds found in steps: more than is missed in between
_SLOW = 0.6  # of the limit: slower at the start and late in the stop, it stays below


def _weights(share: float) -> tuple[float, ...]:
    """Return the weights of S at the three places in λ S(share): Lagrange polynomials times λ."""
    places = (0.0, *_BETWEEN)
    return tuple(
        math.sqrt(1.0 - share)
        * math.prod((share - other) / (place - other) for other in places if other != place)
        for place in places
    )


_WEIGHTS = tuple(map(_weights, _LOOKED_AT))


class StopOutlook(NamedTuple):
    """Stop in the least time after a tick.

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


def point_excess(model: JogModel, stop: StopOutlook, limit: float) -> tuple[float, JogCause | None]:
    """Return the greatest speed of a point as a share of the allowed one, and its cause.

    Args:
        model: the robot.
        stop: the stop after the tick that is judged.
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


def _greatest_in_stop(model: JogModel, stop: StopOutlook, allowed: float) -> tuple[float, float]:
    """Return the greatest speeds of both points from the end of the tick to rest."""
    velocity, here, there, _ = stop
    rates = np.array(velocity)
    begin = model.arm.point_speeds(here, rates)
    # One joint alone moves every point on a circle about its axis, at a constant speed.
    if model.arm.rigid and _is_single(velocity):
        return begin
    ways = zip(here, there, model.unit, strict=True)
    longest = max([abs(end - start) / unit for start, end, unit in ways])
    # Beyond it the parabola through three places may miss a second rise of the speed.
    if longest > _LONG:
        return _greatest_in_long_stop(model, stop, rates, begin, longest)
    first, last = _BETWEEN
    later = _on_the_way(model, stop, last, rates, begin)
    slow = _SLOW * allowed
    # The usual case at low speed: one computation of S less.
    if begin[0] < slow and begin[1] < slow and later[0] < slow and later[1] < slow:
        return begin
    between = _on_the_way(model, stop, first, rates, begin)
    return (
        _greatest(begin[0], between[0], later[0]),
        _greatest(begin[1], between[1], later[1]),
    )


def _greatest_in_long_stop(
    model: JogModel, stop: StopOutlook, rates: Array, begin: tuple[float, float], longest: float
) -> tuple[float, float]:
    """Return the greatest speeds of both points, computed at steps of a stop."""
    greatest = begin
    count = math.ceil(longest / _CLOSE)
    for step in range(1, count):
        speeds = _on_the_way(model, stop, step / count, rates, begin)
        share = _UNSEEN * math.sqrt(1.0 - step / count)
        greatest = max(greatest[0], share * speeds[0]), max(greatest[1], share * speeds[1])
    return greatest


def _greatest(begin: float, between: float, later: float) -> float:
    """Return the greatest λ S of a point from its S at the three places."""
    most = max([a * begin + b * between + c * later for a, b, c in _WEIGHTS])
    # The error of the parabola grows with the rise that it finds, so the rise is enlarged.
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
    """Return True if exactly one joint moves."""
    return velocity.count(0.0) == len(velocity) - 1


def _without_ending(model: JogModel, stop: StopOutlook) -> list[list[float]]:
    """Return the velocity without the joints whose range ends before a stop would.

    These joints brake earlier, and what they took from the speed of a point is then missing. The
    speed is convex in their velocities, so it is greatest with all or without some of them.
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
    # All of them together and each alone: which of them stops first depends on the ticks.
    groups = [ending] if len(ending) == 1 else [ending, *([joint] for joint in ending)]
    return [
        [0.0 if joint in group else each for joint, each in enumerate(velocity)] for group in groups
    ]


def _on_the_way(
    model: JogModel, stop: StopOutlook, share: float, rates: Array, otherwise: tuple[float, float]
) -> tuple[float, float]:
    """Return S of both points, or `otherwise` where a platform has no pose."""
    ways = zip(stop.here, stop.there, strict=True)
    place = [start + share * (end - start) for start, end in ways]
    try:
        return model.arm.point_speeds(place, rates)
    except NoAssembly:
        # No pose there means that the stop is cut short by the posture limit; that limit is judged
        # separately.
        return otherwise
