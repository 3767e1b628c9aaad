"""Motion between two points: one function of time per joint, and whether it stays in bounds.

Owns the mathematics of interpolation. The smooth polynomial through both ends is taken where it
stays inside the bounds, else the motion of least peak acceleration; so a pair of points is turned
down only if *no* motion between them could keep the bounds. Knows no buffers and no clock: times
are seconds from the start of the segment.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from .faults import Refusal, ViolationKind, violation

Coefficients = tuple[float, float, float, float, float, float]
"""Position as c0 + c1·t + … + c5·t⁵, t counted from the start of the piece."""

Piece = tuple[float, Coefficients]
"""Start of a piece within its segment [s], and its polynomial."""

State = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""Position [rad or m], velocity […/s], acceleration […/s²] of all joints."""

_FUZZ = 1e-9
"""Arithmetic noise in a position [rad or m], or relative in a comparison of equals."""

_EDGE = 1e-6
"""Arithmetic noise, relative to an acceleration limit, of motions that go exactly to it."""


class Bounds(NamedTuple):
    """What one joint may do within one segment; all four include their rounding allowances.

    Attributes:
        lower: least position [rad or m].
        upper: greatest position [rad or m].
        velocity: greatest speed [rad/s or m/s].
        acceleration: greatest acceleration [rad/s² or m/s²].
        smooth_acceleration: the smooth polynomial is taken up to this acceleration, beyond it the
            motion of least peak acceleration [rad/s² or m/s²].
    """

    lower: float
    upper: float
    velocity: float
    acceleration: float
    smooth_acceleration: float


class End(NamedTuple):
    """State of one joint at one end of a segment.

    Attributes:
        position: [rad or m].
        velocity: [rad/s or m/s].
        acceleration: [rad/s² or m/s²], None where the sender left it open.
    """

    position: float
    velocity: float
    acceleration: float | None = None


class Segment(NamedTuple):
    """The motion of all joints between two points.

    Attributes:
        duration: [s], more than 0.
        joints: the pieces of each joint, in order of time.
    """

    duration: float
    joints: tuple[tuple[Piece, ...], ...]

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
    duration: float, starts: list[End], ends: list[End], bounds: tuple[Bounds, ...]
) -> Segment | Refusal:
    """Return the motion from one state of all joints to another, within bounds.

    Args:
        duration: [s], more than 0.
        starts: state of each joint at the start.
        ends: state of each joint at the end.
        bounds: bounds of each joint.

    Returns:
        The segment, or the refusal with the first joint for which no motion keeps its bounds.
    """
    joints = []
    for index, (start, end, bound) in enumerate(zip(starts, ends, bounds, strict=True)):
        pieces = _smooth(duration, start, end, bound) or _gentlest(duration, start, end, bound)
        if isinstance(pieces, _Excess):
            return violation(pieces.kind, index, pieces.value, pieces.limit)
        joints.append(pieces)
    return Segment(duration, tuple(joints))


class _Excess(NamedTuple):
    kind: ViolationKind
    value: float
    limit: float


def _smooth(h: float, start: End, end: End, bound: Bounds) -> tuple[Piece, ...] | None:
    """Return the quintic, or the cubic where an acceleration is open, if it is safely in bounds.

    "Safely": the Bézier control values enclose the polynomial, so they are compared, not its
    extremes. A polynomial thrown away for that costs nothing but smoothness.
    """
    p0, v0, a0 = start
    p1, v1, a1 = end
    distance = p1 - p0
    if a0 is None or a1 is None:
        middle = 3 * distance / h - v0 - v1
        positions: tuple[float, ...] = (p0, p0 + h * v0 / 3, p1 - h * v1 / 3, p1)
        velocities: tuple[float, ...] = (v0, middle, v1)
        accelerations: tuple[float, ...] = (2 * (middle - v0) / h, 2 * (v1 - middle) / h)
        c2 = (middle - v0) / h
        c3 = ((v0 + v1) * h - 2 * distance) / h**3
        coefficients = (p0, v0, c2, c3, 0.0, 0.0)
    else:
        b2 = p0 + 0.4 * h * v0 + h * h * a0 / 20
        b3 = p1 - 0.4 * h * v1 + h * h * a1 / 20
        w1, w2, w3 = v0 + h * a0 / 4, 5 * (b3 - b2) / h, v1 - h * a1 / 4
        positions = (p0, p0 + h * v0 / 5, b2, b3, p1 - h * v1 / 5, p1)
        velocities = (v0, w1, w2, w3, v1)
        accelerations = (a0, 4 * (w2 - w1) / h, 4 * (w3 - w2) / h, a1)
        c3 = (20 * distance - (8 * v1 + 12 * v0) * h - (3 * a0 - a1) * h * h) / (2 * h**3)
        c4 = (-30 * distance + (14 * v1 + 16 * v0) * h + (3 * a0 - 2 * a1) * h * h) / (2 * h**4)
        c5 = (12 * distance - 6 * (v1 + v0) * h - (a0 - a1) * h * h) / (2 * h**5)
        coefficients = (p0, v0, a0 / 2, c3, c4, c5)
    if (
        bound.lower <= min(positions)
        and max(positions) <= bound.upper
        and max(map(abs, velocities)) <= bound.velocity
        and max(map(abs, accelerations)) <= bound.smooth_acceleration
    ):
        return ((0.0, coefficients),)
    return None


def _gentlest(h: float, start: End, end: End, bound: Bounds) -> tuple[Piece, ...] | _Excess:
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
        return _Excess(ViolationKind.VELOCITY_STEP, peak, bound.acceleration)
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
        time, velocity = time + span, after
    return tuple(pieces)


def _outside(position: float, bound: Bounds) -> _Excess | None:
    for limit, beyond in (
        (bound.lower, bound.lower - position),
        (bound.upper, position - bound.upper),
    ):
        if beyond > _FUZZ:
            return _Excess(ViolationKind.RANGE, position, limit)
    return None


def _phases(
    h: float, distance: float, v0: float, v1: float, cap: float, cap_at_rest: bool
) -> list[tuple[float, float]]:
    """Return (duration, acceleration) of up to three phases that cover a distance in time `h`.

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
