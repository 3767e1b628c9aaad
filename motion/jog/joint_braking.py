"""Braking of a joint jog: speeds from which it still stops inside ranges and below speed limits.

Owns two rules. Range: from speed v a joint comes to rest within B(v) = v²/2a + v T/2, where T is
the longest tick. Braking by a·dt a tick, B falls in each tick by at least the distance covered, as
B(v) - B(w) - (v + w) dt/2 = a dt T/2 for w = v - a dt. So while the rest of the range is at least
B, it stays so, and the position, a trapezoid from tick to tick, never passes the end. Within its
margin a joint slows by the same rule, with the lesser deceleration that spreads the stop from its
jog speed over the margin.

Speed of points: a joint jog keeps below the speed limit of tool and elbow although the arm changes
its shape. A stop scales a velocity by λ, from 1 to 0, and has then covered the share p = 1 - λ² of
its length. With S(p) the speed of a point there for the whole velocity, the point has the speed

    λ S(p),   λ = √(1 - p)

Its greatest value must be within the limit, so that a stop never needs more deceleration than the
joints have: a stretching arm gets faster by itself. S is computed where the stop begins and at two
places of it, and is the parabola through these three elsewhere. Of random stops of all robots that
move no joint by more than `_LONG`, none was faster than this with what `_MISSED` adds. In a longer
stop S may rise and fall more than once; it is computed every `_CLOSE`. The same is done without the
joints whose range ends first, which may have lowered the speed. Valid for any stop of any robot;
for an arm on a straight line `line_speed_bounds` proves the same from fewer speeds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ..errors import NoAssembly
from ..pose import Array
from .jog_commands import LONGEST_STEP, JogCause, JogSlowdown
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


Bound: TypeAlias = tuple[float, float, float]
"""The least and greatest velocity of a joint at the end of a tick, and its greatest change."""

ROUNDING = 1.0 + 1e-6
"""Factor on what an acceleration gives, so that rounding adds no further tick to a stop."""

_EVEN = 0.95  # of the acceleration limit: what a stop before the end of a range takes
_STILL = 1e-4  # of the jog speed: slower is creeping towards the end of a range


class JointLimitBraking:
    """Ends of the joint ranges, for joints that are asked for certain speeds at most."""

    def __init__(self, model: JogModel, speeds: Sequence[float]) -> None:
        """Compute where the ends begin to matter, for (n,) greatest speeds [rad/s or m/s]."""
        self._model = model
        self._speeds = speeds
        joints = zip(speeds, model.limits.acceleration, model.margin, strict=True)
        self._clear = [_clear(speed, _EVEN * limit, margin) for speed, limit, margin in joints]
        self._low = [end + way for end, way in zip(model.lower, self._clear, strict=True)]
        self._high = [end - way for end, way in zip(model.upper, self._clear, strict=True)]
        self._dt = 0.0
        self._free: list[Bound] = []

    def bounds(
        self, dt: float, position: Sequence[float], velocity: Sequence[float]
    ) -> list[Bound]:
        """Return the velocities after a tick from which each joint still rests inside its range."""
        model = self._model
        if dt != self._dt:
            gains = [limit * ROUNDING * dt for limit in model.limits.acceleration]
            self._dt, self._free = dt, [(-math.inf, math.inf, gain) for gain in gains]
        bounds = self._free
        joints = zip(position, velocity, self._speeds, self._low, self._high, strict=True)
        for joint, (place, now, speed, low, high) in enumerate(joints):
            # The usual case costs four comparisons a joint: nothing is computed away from the ends.
            if low < place < high and -speed <= now <= speed:
                continue
            if bounds is self._free:
                bounds = self._free.copy()
            bounds[joint] = self._bound(joint, place, now)
        return bounds

    def free_distance(self, position: Sequence[float], velocity: Sequence[float]) -> float:
        """Return how long joints can keep a velocity and none is bound by an end [s].

        In that time no joint enters the margin of the end that it approaches, nor would it in a
        stop, except for what it moves in two ticks. This holds for every share of the velocity, as
        long as the joints have gone no farther. 0 where a joint is beyond a limit, or too slow to
        tell.
        """
        model, way = self._model, math.inf
        stop = stop_time(model, velocity)
        for joint, (place, each) in enumerate(zip(position, velocity, strict=True)):
            if not model.limits.lower[joint] <= place <= model.limits.upper[joint]:
                return 0.0
            if each == 0.0:
                continue
            speed = abs(each)
            even = self._even(joint)
            if not even:
                return 0.0
            bound = speed * (0.5 * speed / even + 1.5 * LONGEST_STEP)
            needed = max(min(self._clear[joint], bound), model.margin[joint] + speed * stop)
            left = model.upper[joint] - place if each > 0.0 else place - model.lower[joint]
            way = min(way, (left - needed) / speed)
        return way

    def _bound(self, joint: int, place: float, now: float) -> Bound:
        """Return the bound of one joint that is near an end, or faster than asked."""
        model, speed = self._model, self._speeds[joint]
        up, down = model.upper[joint] - place, place - model.lower[joint]
        margin, even = model.margin[joint], _EVEN * model.limits.acceleration[joint]
        clear = _clear(max(speed, now, -now), even, margin)
        least, most, gain = self._free[joint]
        if up <= clear or down <= clear:
            even = self._even(joint)
            # Near the end v T/2 dominates the stop, so each tick covers a share of the distance
            # left and none reaches the end: a joint slower than this stops where it is.
            still = _STILL * speed
            if up <= clear:
                most = _stoppable(up, now, even, self._dt)
                most = 0.0 if most < still else most
            if down <= clear:
                least = -_stoppable(down, -now, even, self._dt)
                least = 0.0 if least > -still else least
        return least, most, gain

    def _even(self, joint: int) -> float:
        """Return the deceleration at which a joint slows before the end of its range."""
        model, speed = self._model, self._speeds[joint]
        # From the jog speed to rest within the margin, so that slow jogs brake gently.
        spread = speed * speed / (2.0 * model.margin[joint])
        return min(_EVEN * model.limits.acceleration[joint], spread)


def _clear(speed: float, even: float, margin: float) -> float:
    """Return how far from its ends a joint may do all that it is asked for.

    The path of an even stop from the greatest speed and two longest ticks more.
    """
    fastest = speed + even * 2.0 * LONGEST_STEP
    return max(margin, fastest * fastest / (2.0 * even))


def _stoppable(left: float, speed: float, deceleration: float, dt: float) -> float:
    """Return the greatest speed after a tick from which a joint can rest within a distance.

    The positive root of w²/2a + w (T + dt)/2 + v dt/2 - left, see the module docstring.
    """
    linear = 0.5 * deceleration * (LONGEST_STEP + dt)
    root = linear * linear + 2.0 * deceleration * (left - 0.5 * speed * dt)
    # Also 0 where `left` is NaN or used up by the tick: at its end a joint gets no speed towards
    # it.
    return math.sqrt(root) - linear if root > linear * linear else 0.0
