"""Polynomials between two states of motion: the same kind for all joints, or none.

Owns the quintic and the cubic, and the test that they are in bounds. Knows nothing of what is done
where they are not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

from .joint_motion import Bounds, Coefficients, End, Pieces

_HALVINGS = 5
"""How often a polynomial is halved to tell whether it is in bounds; each time four times closer."""


class Polynomial(NamedTuple):
    """A polynomial of one joint, with the Bézier control values of its derivatives."""

    coefficients: Coefficients
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    accelerations: tuple[float, ...]

    def is_within(self, bound: Bounds) -> bool:
        """Tell whether the polynomial is safely in bounds.

        One that is thrown away costs more than smoothness: what takes its place knows less of the
        sender's path where that bends.
        """
        speed, sharp = bound.velocity, bound.smooth_acceleration
        return (
            _keeps(self.positions, bound.lower, bound.upper)
            and _keeps(self.velocities, -speed, speed)
            and _keeps(self.accelerations, -sharp, sharp)
        )


def _keeps(values: Sequence[float], low: float, high: float, halvings: int = _HALVINGS) -> bool:
    """Tell whether a polynomial, given by its Bézier control values, safely keeps a range.

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


def polynomials(
    between: Callable[[float, End, End], Polynomial | None],
    h: float,
    starts: list[End],
    ends: list[End],
    bounds: tuple[Bounds, ...],
) -> tuple[Pieces, ...] | None:
    """Return one kind of polynomial for all joints, None unless all are safely in bounds.

    Args:
        between: makes the polynomial of one joint, None where its ends do not determine one.
        h: duration [s].
        starts: state of each joint at the start.
        ends: state of each joint at the end.
        bounds: bounds of each joint.
    """
    joints = []
    for start, end, bound in zip(starts, ends, bounds, strict=True):
        polynomial = between(h, start, end)
        if polynomial is None or not polynomial.is_within(bound):
            return None
        joints.append(((0.0, polynomial.coefficients),))
    return tuple(joints)


def quintic(h: float, start: End, end: End) -> Polynomial | None:
    """Return the quintic through two states, None where an acceleration is open."""
    p0, v0, a0 = start
    p1, v1, a1 = end
    if a0 is None or a1 is None:
        return None
    distance = p1 - p0
    b2 = p0 + 0.4 * h * v0 + h * h * a0 / 20
    b3 = p1 - 0.4 * h * v1 + h * h * a1 / 20
    w1, w2, w3 = v0 + h * a0 / 4, 5 * (b3 - b2) / h, v1 - h * a1 / 4
    c3 = (20 * distance - (8 * v1 + 12 * v0) * h - (3 * a0 - a1) * h * h) / (2 * h**3)
    c4 = (-30 * distance + (14 * v1 + 16 * v0) * h + (3 * a0 - 2 * a1) * h * h) / (2 * h**4)
    c5 = (12 * distance - 6 * (v1 + v0) * h - (a0 - a1) * h * h) / (2 * h**5)
    return Polynomial(
        (p0, v0, a0 / 2, c3, c4, c5),
        (p0, p0 + h * v0 / 5, b2, b3, p1 - h * v1 / 5, p1),
        (v0, w1, w2, w3, v1),
        (a0, 4 * (w2 - w1) / h, 4 * (w3 - w2) / h, a1),
    )


def cubic(h: float, start: End, end: End) -> Polynomial:
    """Return the cubic through two positions and velocities."""
    p0, v0, _ = start
    p1, v1, _ = end
    distance = p1 - p0
    middle = 3 * distance / h - v0 - v1
    return Polynomial(
        (p0, v0, (middle - v0) / h, ((v0 + v1) * h - 2 * distance) / h**3, 0.0, 0.0),
        (p0, p0 + h * v0 / 3, p1 - h * v1 / 3, p1),
        (v0, middle, v1),
        (2 * (middle - v0) / h, 2 * (v1 - middle) / h),
    )
