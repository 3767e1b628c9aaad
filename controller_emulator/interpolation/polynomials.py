"""Motion of a joint within a segment as polynomials: the same kind for all joints, or none.

Owns the pieces, ends and bounds of a joint's motion, the quintic and the cubic between two ends,
and the test that they are in bounds. Times are seconds from the start of the segment. Knows nothing
of what is done where a polynomial is out of bounds.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise, repeat
from typing import NamedTuple

Coefficients = tuple[float, float, float, float, float, float]
"""Position as c0 + c1·t + … + c5·t⁵, t counted from the start of the piece."""

Piece = tuple[float, Coefficients]
"""Start of a piece within its segment [s], and its polynomial."""

Pieces = tuple[Piece, ...]
"""The motion of one joint, in order of time."""


@dataclass(slots=True)
class Bounds:
    """Bounds of one joint within one segment; all include their rounding allowances.

    Never changed, but not frozen, as that takes four times as long to make, for every joint of
    every point.

    Attributes:
        lower: least position [rad or m].
        upper: greatest position [rad or m].
        velocity: greatest speed [rad/s or m/s].
        acceleration: greatest acceleration [rad/s² or m/s²].
        smooth_acceleration: a polynomial is taken up to this acceleration, beyond it a motion that
            switches between accelerations [rad/s² or m/s²].
    """

    lower: float
    upper: float
    velocity: float
    acceleration: float
    smooth_acceleration: float


class SegmentEnd(NamedTuple):
    """State of one joint at one end of a segment.

    Attributes:
        position: [rad or m].
        velocity: [rad/s or m/s].
        acceleration: [rad/s² or m/s²], None where the sender left it open.
    """

    position: float
    velocity: float
    acceleration: float | None = None


def ends(
    position: Sequence[float],
    velocity: Sequence[float],
    acceleration: Sequence[float] | None,
) -> list[SegmentEnd]:
    """Return the state of each joint at one end of a segment.

    Args:
        position: (n,) [rad or m].
        velocity: (n,) […/s].
        acceleration: (n,) […/s²], None where the sender left it open.
    """
    stated: Iterable[float | None] = repeat(None) if acceleration is None else acceleration
    return list(map(_new_end, zip(position, velocity, stated, strict=False)))


_new_end = partial(tuple.__new__, SegmentEnd)
"""Makes an `SegmentEnd` of a tuple in half the time that a call of the class takes."""


_HALVINGS = 5
"""Number of halvings in the test of bounds; each makes its result four times closer."""


def _is_within(
    bound: Bounds,
    positions: Sequence[float],
    velocities: Sequence[float],
    accelerations: Sequence[float],
) -> bool:
    """Return True if a polynomial, given by the Bézier control values of each, is in bounds.

    One that is thrown away costs more than smoothness: what takes its place knows less of the
    sender's path where that bends.
    """
    speed, sharp = bound.velocity, bound.smooth_acceleration
    return (
        _keeps(positions, bound.lower, bound.upper)
        and _keeps(velocities, -speed, speed)
        and _keeps(accelerations, -sharp, sharp)
    )


def _keeps(values: Sequence[float], low: float, high: float, halvings: int = _HALVINGS) -> bool:
    """Return True if a polynomial, given by its Bézier control values, safely keeps a range.

    The control values enclose it, and the first and the last lie on it. Where others are out of the
    range, those of both halves are closer to it.
    """
    if low <= min(values) and max(values) <= high:
        return True
    if not halvings or not (low <= values[0] <= high and low <= values[-1] <= high):
        return False
    first, second = _halves(values)
    return _keeps(first, low, high, halvings - 1) and _keeps(second, low, high, halvings - 1)


def _halves(values: Sequence[float]) -> tuple[list[float], list[float]]:
    """Return the control values of both halves of a polynomial, by de Casteljau's rule."""
    first, second = [values[0]], [values[-1]]
    while len(values) > 1:
        values = [(a + b) / 2 for a, b in pairwise(values)]
        first.append(values[0])
        second.append(values[-1])
    return first, second[::-1]


def quintics(
    h: float, starts: Sequence[SegmentEnd], ends: Sequence[SegmentEnd], bounds: Sequence[Bounds]
) -> tuple[Pieces, ...] | None:
    """Return the quintic of each joint through two states, None unless all are safely in bounds.

    None, too, where an acceleration is open: the states do not determine a quintic then.
    """
    if not _are_quintics_within(h, starts, ends, bounds):
        return None
    over3, over4, over5 = 2 * h**3, 2 * h**4, 2 * h**5
    joints = []
    for (p0, v0, a0), (p1, v1, a1) in zip(starts, ends, strict=True):
        assert a0 is not None
        assert a1 is not None
        distance, triple = p1 - p0, 3 * a0
        c3 = (20 * distance - (8 * v1 + 12 * v0) * h - (triple - a1) * h * h) / over3
        c4 = (-30 * distance + (14 * v1 + 16 * v0) * h + (triple - 2 * a1) * h * h) / over4
        c5 = (12 * distance - 6 * (v1 + v0) * h - (a0 - a1) * h * h) / over5
        joints.append(((0.0, (p0, v0, a0 / 2, c3, c4, c5)),))
    return tuple(joints)


def _are_quintics_within(
    h: float, starts: Sequence[SegmentEnd], ends: Sequence[SegmentEnd], bounds: Sequence[Bounds]
) -> bool:
    """Return True if the states determine a quintic for each joint, and all are in bounds."""
    square, part = h * h, 0.4 * h
    for (p0, v0, a0), (p1, v1, a1), bound in zip(starts, ends, bounds, strict=True):
        if a0 is None or a1 is None:
            return False
        # Bézier control values between those of the ends: position b, velocity w, acceleration r.
        b1, b2 = p0 + h * v0 / 5, p0 + part * v0 + square * a0 / 20
        b3, b4 = p1 - part * v1 + square * a1 / 20, p1 - h * v1 / 5
        w1, w2, w3 = v0 + h * a0 / 4, 5 * (b3 - b2) / h, v1 - h * a1 / 4
        r1, r2 = 4 * (w2 - w1) / h, 4 * (w3 - w2) / h
        low, high = bound.lower, bound.upper
        speed, sharp = bound.velocity, bound.smooth_acceleration
        # The first test of `_is_within`, without its tuples: it settles most cases.
        is_enclosed = (
            low <= p0 <= high
            and low <= b1 <= high
            and low <= b2 <= high
            and low <= b3 <= high
            and low <= b4 <= high
            and low <= p1 <= high
            and -speed <= v0 <= speed
            and -speed <= w1 <= speed
            and -speed <= w2 <= speed
            and -speed <= w3 <= speed
            and -speed <= v1 <= speed
            and -sharp <= a0 <= sharp
            and -sharp <= r1 <= sharp
            and -sharp <= r2 <= sharp
            and -sharp <= a1 <= sharp
        )
        if not is_enclosed and not _is_within(
            bound, (p0, b1, b2, b3, b4, p1), (v0, w1, w2, w3, v1), (a0, r1, r2, a1)
        ):
            return False
    return True


def cubics(
    h: float, starts: Sequence[SegmentEnd], ends: Sequence[SegmentEnd], bounds: Sequence[Bounds]
) -> tuple[Pieces, ...] | None:
    """Return the `cubic` of each joint, None unless all are safely in bounds."""
    joints = []
    for start, end, bound in zip(starts, ends, bounds, strict=True):
        coefficients = cubic(h, start, end, bound)
        if coefficients is None:
            return None
        joints.append(((0.0, coefficients),))
    return tuple(joints)


def cubic(h: float, start: SegmentEnd, end: SegmentEnd, bound: Bounds) -> Coefficients | None:
    """Return the cubic through two positions and velocities, None unless safely in bounds."""
    p0, v0, _ = start
    p1, v1, _ = end
    distance = p1 - p0
    middle = 3 * distance / h - v0 - v1
    if not _is_within(
        bound,
        (p0, p0 + h * v0 / 3, p1 - h * v1 / 3, p1),
        (v0, middle, v1),
        (2 * (middle - v0) / h, 2 * (v1 - middle) / h),
    ):
        return None
    return p0, v0, (middle - v0) / h, ((v0 + v1) * h - 2 * distance) / h**3, 0.0, 0.0
