"""Velocities at points that state none, chosen when the leg before the point starts.

Owns the estimate: the slope at a point from the points around it where the next one is buffered
already, rest at the point where it is not. It is kept to what the joints can do, judged over the
buffered legs ahead, so that a choice made now does not become a dead end three points later. Pure
functions of legs and states; knows no buffer and no clock.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..error_codes import PointRefusal
from .legs import MotionLeg
from .polynomials import ends
from .segment import MotionSegment, connect

LOOKAHEAD = 16
"""Legs ahead that are looked at."""

_STEEPEST = 2.0
"""A slope at a point exceeds neither neighbour's slope more than this, lest it overshoots."""

_FUZZ = 1e-9
"""Arithmetic noise, relative to the longest way, that makes no leg impossible."""

Interval = tuple[float, float]


def begin(
    leg: MotionLeg,
    position: tuple[float, ...],
    velocity: tuple[float, ...],
    ahead: Sequence[MotionLeg],
) -> tuple[MotionSegment, tuple[float, ...]] | PointRefusal:
    """Return the motion of a leg that begins now, and the velocity (n,) with which it will end.

    Args:
        leg: the leg, of a duration more than 0, whose motion is still open.
        position: (n,) where it begins [rad or m].
        velocity: (n,) with which it begins […/s].
        ahead: the legs buffered behind it, `LOOKAHEAD` of them at most.
    """
    target = leg.end.velocity
    if target is None and not ahead and not any(velocity):
        # From rest to a single point: a leg that cannot end at rest there is not started.
        target = velocity
    if target is None:
        joints = range(len(velocity))
        target = tuple(_end_velocity(leg, velocity[joint], ahead, joint) for joint in joints)
    start = ends(position, velocity, None)
    end = ends(leg.end.position, target, leg.end.acceleration)
    segment = connect(leg.seconds, start, end, leg.bounds)
    if isinstance(segment, PointRefusal):
        return segment
    return segment, target


def can_rest(legs: Sequence[MotionLeg]) -> bool:
    """Return True if legs that begin at rest can end at rest at their last point.

    Where they cannot, that point is to be passed at speed, and more have to follow.
    """
    legs = [leg for leg in legs if leg.duration]
    joints = range(len(legs[0].bounds) if legs else 0)
    return all(_can_rest(legs, joint) for joint in joints)


def _can_rest(legs: Sequence[MotionLeg], joint: int) -> bool:
    allowed: Interval = (0.0, 0.0)
    for leg in reversed(legs):
        if leg.end.velocity is not None:
            allowed = (leg.end.velocity[joint], leg.end.velocity[joint])
        before = _before(leg, joint, allowed)
        if before is None:
            return False
        allowed = before
    return allowed[0] <= 0.0 <= allowed[1]


def _end_velocity(leg: MotionLeg, v0: float, ahead: Sequence[MotionLeg], joint: int) -> float:
    h, slope, bound = leg.seconds, leg.end.mean_velocity[joint], leg.bounds[joint]
    wish = 0.0
    if ahead:
        following = ahead[0]
        wish = _slope(slope, h, following.end.mean_velocity[joint], following.seconds)
    allowed = _reachable(v0, slope * h, h, bound.acceleration) or (v0, v0)
    for further in (_any(leg, joint, v0), _controllable(ahead, joint)):
        allowed = _overlap(allowed, further) or allowed
    return min(max(wish, allowed[0]), allowed[1])


def _slope(slope: float, h: float, next_slope: float, next_h: float) -> float:
    """Return the slope of the parabola through three points, 0 at a turning point."""
    if slope * next_slope <= 0:
        return 0.0
    central = (slope * next_h + next_slope * h) / (h + next_h)
    steepest = _STEEPEST * min(abs(slope), abs(next_slope))
    return math.copysign(min(abs(central), steepest), slope)


def _controllable(ahead: Sequence[MotionLeg], joint: int) -> Interval:
    """Return the velocities from which the legs ahead can all be covered, found from their end.

    Rest at the last point must stay possible where it can be: nothing may follow it. No legs ahead
    means rest now.
    """
    allowed: Interval = (0.0, 0.0)
    if len(ahead) == LOOKAHEAD:
        allowed = (-math.inf, math.inf)
    for leg in reversed(ahead):
        if leg.end.velocity is not None:
            allowed = (leg.end.velocity[joint], leg.end.velocity[joint])
        allowed = _before(leg, joint, allowed) or _any(leg, joint)
    return allowed


def _any(leg: MotionLeg, joint: int, other: float | None = None) -> Interval:
    """Return the velocities with which a leg can begin, or end.

    Args:
        other: velocity at the other end, None if that is free.
    """
    slope, bound = leg.end.mean_velocity[joint], leg.bounds[joint]
    reach, cap = bound.acceleration * leg.seconds / 2, bound.velocity
    least = _least(slope, reach, cap, cap if other is None else other)
    most = -_least(-slope, reach, cap, cap if other is None else -other)
    return least, most


def _least(slope: float, reach: float, cap: float, other: float) -> float:
    """Return the least velocity at one end of a leg of a mean velocity, the other end given.

    Without a speed limit it is the mean less what the acceleration makes up for in half the leg.
    Near the speed limit c the leg has to be at c for a while, and what both ends stay below it
    makes (c - v0)² + (c - v1)² = 2·a·h·(c - slope).
    """
    room = cap - slope
    if room > reach:
        return slope - reach
    return cap - math.sqrt(max(4 * reach * room - (cap - other) ** 2, 0.0))


def _before(leg: MotionLeg, joint: int, after: Interval) -> Interval | None:
    """Return the velocities from which a leg can end with one of an interval of velocities.

    The faster it begins, the slower it has to end: each extreme belongs to the opposite end.
    """
    slowest_end, fastest_end = _any(leg, joint)
    ends = _overlap(after, (slowest_end, fastest_end))
    if ends is None:
        return None
    h, a = leg.seconds, leg.bounds[joint].acceleration
    distance = leg.end.mean_velocity[joint] * h
    # Time reversed, the leg goes back from its end velocity, sign turned.
    from_slow = _reachable(-ends[0], -distance, h, a)
    from_fast = _reachable(-ends[1], -distance, h, a)
    if from_slow is None or from_fast is None:
        return None
    return _overlap((-from_fast[1], -from_slow[0]), _any(leg, joint))


def _reachable(v0: float, distance: float, h: float, a: float) -> Interval | None:
    """Return least and greatest end velocity of a distance covered in time `h` within ±a.

    The greatest comes from slowing down first and speeding up as late as possible.
    """
    most = a * h * h / 2
    beyond = distance - v0 * h
    if abs(beyond) > most + _FUZZ * (most + abs(distance)):
        return None
    beyond = min(max(beyond, -most), most)
    high = v0 - a * h + 2 * math.sqrt(a * (most + beyond))
    low = v0 + a * h - 2 * math.sqrt(a * (most - beyond))
    return low, high


def _overlap(one: Interval, other: Interval) -> Interval | None:
    common = max(one[0], other[0]), min(one[1], other[1])
    return common if common[0] <= common[1] else None
