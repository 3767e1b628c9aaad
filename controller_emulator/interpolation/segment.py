"""Motion between two points: functions of time for all joints, and whether they stay in bounds.

Owns the choice of interpolation. Joints are interpolated alike wherever their bounds allow: by one
rule that is linear in the states at both ends, with the same weights for all joints. Where the
sender's joints move along q(t) = q₀ + c s(t), such a rule gives q₀ + c S(t) with S in place of s:
another time, the same path. So the robot leaves the sender's path only by what the path bends
within the segment. Joints that each follow a rule of their own would leave it sideways.

The quintic of all joints is taken where it stays inside the bounds. Else the accelerations step:
first as stated with one step at one time for all joints, where the sender changes its acceleration
along a bent path between two points and the quintic would swing beyond the bounds on either side of
the step; else the cubic; else constant accelerations with one switch at one time for all. Where
none of these is in bounds each joint takes its motion of least peak acceleration; so a pair of
points is turned down only if *no* motion between them could keep the bounds. Knows no buffers and
no clock: times are seconds from the start of the segment.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..error_codes import PointRefusal, ViolationKind, violation
from .polynomials import Bounds, Piece, Pieces, SegmentEnd, cubic, cubics, quintics

_EARLIEST = 0.02
"""Share of the duration; a step nearer than this to either end counts as rounding."""

_TRIED = 4
"""Places tried for a step on either side of the best one known."""

_CLOSER = 3
"""How often they are tried, each time between the neighbours of the best."""


def stepped(
    h: float, starts: list[SegmentEnd], ends: list[SegmentEnd], bounds: tuple[Bounds, ...]
) -> tuple[Pieces, ...] | None:
    """Return accelerations that change evenly but for one step, at one time for all joints.

    They begin and end as stated. That is what a sender does which between two points of a bent path
    changes the acceleration along it: its joints' accelerations step at that time, and change
    slowly before and after, because the path bends. The time is that of the least acceleration,
    where that is none beyond those stated, of the least change besides the step. None where
    accelerations are open, and out of bounds.
    """
    gains = []
    for start, end, bound in zip(starts, ends, bounds, strict=True):
        gain = _gain(h, start, end, bound.acceleration)
        if gain is None:
            return None
        gains.append(gain)
    switch = h * _gentlest_share(h, gains)
    joints = []
    for start, end, bound in zip(starts, ends, bounds, strict=True):
        middle = _at_step(h, start, end, switch)
        first = cubic(switch, start, middle, bound)
        second = cubic(h - switch, middle, end, bound)
        if first is None or second is None:
            return None
        joints.append(((0.0, first), (switch, second)))
    return tuple(joints)


class _Gain(NamedTuple):
    """Gain of one joint over a segment, in units of its acceleration limit.

    Attributes:
        velocity: gained over that at the start [s].
        way: gained over an even motion with that velocity [s²].
    """

    before: float
    after: float
    velocity: float
    way: float


def _gain(h: float, start: SegmentEnd, end: SegmentEnd, limit: float) -> _Gain | None:
    if start.acceleration is None or end.acceleration is None:
        return None
    return _Gain(
        start.acceleration / limit,
        end.acceleration / limit,
        (end.velocity - start.velocity) / limit,
        (end.position - start.position - start.velocity * h) / limit,
    )


def _gentlest_share(h: float, gains: list[_Gain]) -> float:
    """Return the share of the duration after which a step needs the least acceleration."""
    share, apart = 0.5, (0.5 - _EARLIEST) / _TRIED
    for _ in range(_CLOSER):
        tried = [share + place * apart for place in range(-_TRIED, _TRIED + 1)]
        near = [x for x in tried if _EARLIEST <= x <= 1 - _EARLIEST]
        share = min(near, key=lambda share: _sharpness(h, share * h, gains))
        apart /= _TRIED
    return share


def _sharpness(h: float, switch: float, gains: list[_Gain]) -> tuple[float, float]:
    """Return the greatest acceleration, and the greatest change of one besides the step.

    Accelerations that stay as stated for t before the step, and for u after it, lack a velocity r
    and a way w. They make up for both if they change by (6 w - 4 u r) / t h before it and by
    (6 w - (2 t + 6 u) r) / u h after it.
    """
    t, u = switch, h - switch
    early, late = t * (t / 2 + u), u * u / 2
    to_step, from_step = 1 / (t * h), 1 / (u * h)
    most = change = 0.0
    for before, after, velocity, way in gains:
        r = velocity - before * t - after * u
        w = 6 * (way - before * early - after * late)
        first, second = (w - 4 * u * r) * to_step, (w - (2 * t + 6 * u) * r) * from_step
        most = max(most, abs(before), abs(after), abs(before + first), abs(after - second))
        change = max(change, abs(first), abs(second))
    return most, change


def _at_step(h: float, start: SegmentEnd, end: SegmentEnd, switch: float) -> SegmentEnd:
    """Return where a joint is at the step, and how fast."""
    gain = _gain(h, start, end, 1.0)
    assert gain is not None
    t, u = switch, h - switch
    r = gain.velocity - gain.before * t - gain.after * u
    w = gain.way - gain.before * t * (t / 2 + u) - gain.after * u * u / 2
    rate = (6 * w - 4 * u * r) / (t * t * h)
    way = start.velocity * t + t * t * (gain.before / 2 + rate * t / 6)
    return SegmentEnd(start.position + way, start.velocity + t * (gain.before + rate * t / 2))


Phase = tuple[float, float]
"""Duration of a constant acceleration [s], and the acceleration [rad/s² or m/s²]."""

_FUZZ = 1e-9
"""Arithmetic noise in a position [rad or m], or relative in a comparison of equals."""

_EDGE = 1e-6
"""Arithmetic noise, relative to an acceleration limit, of motions that go exactly to it."""

_HALVINGS = 8
"""Steps towards the least acceleration with which all joints can switch together."""


class Excess(NamedTuple):
    """Limit that the motion of a joint would break, and the value beyond it."""

    kind: ViolationKind
    value: float
    limit: float


def switched(
    h: float, starts: list[SegmentEnd], ends: list[SegmentEnd], bounds: tuple[Bounds, ...]
) -> tuple[Pieces, ...] | None:
    """Return two accelerations for each joint, with one switch for all; None if out of bounds.

    That is what a sender did which runs a path as fast as the joints allow and between two points
    changes the acceleration along the path: it changed for all joints at that time.
    """
    switch = _common_switch(h, starts, ends, bounds)
    if switch is None:
        return None
    joints = []
    for start, end, bound in zip(starts, ends, bounds, strict=True):
        mean, gain = _mean_and_gain(h, start, end)
        phases = [(switch, mean + gain / switch), (h - switch, mean - gain / (h - switch))]
        pieces = _pieces(start, phases, bound)
        if isinstance(pieces, Excess):
            return None
        joints.append(pieces)
    return tuple(joints)


def _mean_and_gain(h: float, start: SegmentEnd, end: SegmentEnd) -> tuple[float, float]:
    """Return the mean acceleration m, and the velocity D gained over it at any one switch.

    A switch at τ needs the accelerations m + D/τ before and m - D/(h - τ) after it: together they
    cover the distance whatever τ is.
    """
    mean = (end.velocity - start.velocity) / h
    return mean, 2 * (end.position - start.position) / h - start.velocity - end.velocity


def _common_switch(
    h: float, starts: list[SegmentEnd], ends: list[SegmentEnd], bounds: tuple[Bounds, ...]
) -> float | None:
    """Return when all joints can switch, with little more than their smooth acceleration.

    Bounds are widened from that acceleration to the greatest one by halving.
    """
    joints = list(zip(starts, ends, bounds, strict=True))
    switch = _switch_within(h, joints, 0.0)
    if switch is not None:
        return switch
    switch = _switch_within(h, joints, 1.0)
    refused, granted = 0.0, 1.0
    for _ in range(_HALVINGS if switch is not None else 0):
        share = (refused + granted) / 2
        gentler = _switch_within(h, joints, share)
        if gentler is None:
            refused = share
        else:
            granted, switch = share, gentler
    return switch


def _switch_within(
    h: float, joints: list[tuple[SegmentEnd, SegmentEnd, Bounds]], share: float
) -> float | None:
    """Return the middle of the times at which all joints can switch, None if there is none.

    Args:
        share: how much is used of what the greatest acceleration is beyond the smooth one, 0 to 1.
    """
    earliest, latest = 0.0, h
    for start, end, bound in joints:
        mean, gain = _mean_and_gain(h, start, end)
        most = bound.smooth_acceleration + share * (bound.acceleration - bound.smooth_acceleration)
        most *= 1 + _EDGE
        side = math.copysign(1.0, gain)
        before, after = most - side * mean, most + side * mean
        if min(before, after) <= 0:
            return None
        earliest = max(earliest, abs(gain) / before)
        latest = min(latest, h - abs(gain) / after)
        # The speed at the switch, |v0 + D + m τ|, is at most the bound.
        for sign in (1.0, -1.0):
            room, rate = bound.velocity - sign * (start.velocity + gain), sign * mean
            if rate > 0:
                latest = min(latest, room / rate)
            elif rate < 0:
                earliest = max(earliest, room / rate)
            elif room < 0:
                return None
    middle = (earliest + latest) / 2
    return middle if earliest <= latest and 0 < middle < h else None


def gentlest(h: float, start: SegmentEnd, end: SegmentEnd, bound: Bounds) -> Pieces | Excess:
    """Return the motion of least peak acceleration, or what it would break.

    It accelerates one way, then the other, holding a speed in between where a cap is reached. A
    joint that is not asked to turn round keeps its direction if its acceleration allows, because
    a point at the end of the range may not be overshot on the way to it.
    """
    distance = end.position - start.position
    signs = (start.velocity, end.velocity, distance)
    one_way = min(signs) >= 0 or max(signs) <= 0
    for cap_at_rest in (True, False) if one_way else (False,):
        phases = _phases(h, distance, start.velocity, end.velocity, bound.velocity, cap_at_rest)
        peak = max(abs(acceleration) for _, acceleration in phases)
        if peak <= bound.acceleration * (1 + _EDGE):
            break
    else:
        return Excess(ViolationKind.VELOCITY_STEP, peak, bound.acceleration)
    return _pieces(start, phases, bound)


def _pieces(start: SegmentEnd, phases: list[Phase], bound: Bounds) -> Pieces | Excess:
    """Return the motion of constant accelerations, or where it turns round outside the range."""
    pieces: list[Piece] = []
    time, position, velocity = 0.0, start.position, start.velocity
    for span, acceleration in phases:
        pieces.append((time, (position, velocity, acceleration / 2, 0.0, 0.0, 0.0)))
        after = velocity + acceleration * span
        if velocity * after < 0:
            turn = position - velocity * velocity / (2 * acceleration)
            excess = _outside(turn, bound)
            if excess:
                return excess
        position += span * (velocity + after) / 2
        excess = _outside(position, bound)
        if excess:
            return excess
        time, velocity = time + span, after
    return tuple(pieces)


def _outside(position: float, bound: Bounds) -> Excess | None:
    for limit, beyond in (
        (bound.lower, bound.lower - position),
        (bound.upper, position - bound.upper),
    ):
        if beyond > _FUZZ:
            return Excess(ViolationKind.RANGE, position, limit)
    return None


def _phases(
    h: float, distance: float, v0: float, v1: float, cap: float, cap_at_rest: bool
) -> list[Phase]:
    """Return up to three phases that cover a distance in time `h`.

    With m the mean acceleration and δ the distance beyond that of uniform acceleration, equal and
    opposite accelerations ±a meet both ends when a² - (4|δ|/h²)·a - m² = 0.
    """
    mean = (v1 - v0) / h
    beyond = distance - (v0 + v1) * h / 2
    share = 2 * abs(beyond) / (h * h)
    a = share + math.hypot(share, mean)
    if a <= abs(mean) * (1 + _FUZZ):
        return [(h, mean)]
    sign = math.copysign(1.0, beyond)
    first = h * (1 + sign * mean / a) / 2
    peak = v0 + sign * a * first
    limit = sign * cap
    if cap_at_rest and max(sign * v0, sign * v1, sign * distance) <= 0:
        limit = 0.0
    if sign * peak <= sign * limit:
        return [(first, sign * a), (h - first, -sign * a)]
    room = abs(limit * h - distance)
    if not room:
        return [(h, math.inf)]
    a = ((limit - v0) ** 2 + (limit - v1) ** 2) / (2 * room)
    if not a:
        return [(h, 0.0)]
    up, down = abs(limit - v0) / a, abs(limit - v1) / a
    return [
        (up, math.copysign(a, limit - v0)),
        (max(h - up - down, 0.0), 0.0),
        (down, math.copysign(a, v1 - limit)),
    ]


State = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""Position [rad or m], velocity […/s], acceleration […/s²] of all joints."""


class MotionSegment(NamedTuple):
    """The motion of all joints between two points.

    Attributes:
        duration: [s], more than 0.
        joints: the pieces of each joint, in order of time.
    """

    duration: float
    joints: tuple[Pieces, ...]

    def sample(self, time: float) -> State:
        """Return position, velocity and acceleration `time` seconds after the start."""
        position, velocity, acceleration = [], [], []
        for pieces in self.joints:
            index = len(pieces) - 1
            while index and time < pieces[index][0]:
                index -= 1
            start, (c0, c1, c2, c3, c4, c5) = pieces[index]
            t = time - start
            position.append(c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))))
            velocity.append(c1 + t * (2 * c2 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5))))
            acceleration.append(2 * c2 + t * (6 * c3 + t * (12 * c4 + t * 20 * c5)))
        return tuple(position), tuple(velocity), tuple(acceleration)


def connect(
    duration: float, starts: list[SegmentEnd], ends: list[SegmentEnd], bounds: tuple[Bounds, ...]
) -> MotionSegment | PointRefusal:
    """Return the motion from one state of all joints to another, within bounds.

    Or else the refusal with the first joint for which no motion keeps its bounds.
    """
    alike = (
        quintics(duration, starts, ends, bounds)
        or stepped(duration, starts, ends, bounds)
        or cubics(duration, starts, ends, bounds)
        or switched(duration, starts, ends, bounds)
    )
    if alike:
        return MotionSegment(duration, alike)
    joints = []
    for index, (start, end, bound) in enumerate(zip(starts, ends, bounds, strict=True)):
        pieces = gentlest(duration, start, end, bound)
        if isinstance(pieces, Excess):
            return violation(pieces.kind, index, pieces.value, pieces.limit)
        joints.append(pieces)
    return MotionSegment(duration, tuple(joints))
