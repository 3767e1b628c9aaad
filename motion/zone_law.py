"""How one straight or curved leg gives way to the next within a zone.

Owns the one law of all zones. At a corner with a zone r the second leg begins before the first
ends: with a falling from r to 0 and b rising from 0 to r over a stretch 2r of the parameter,

    q(t) = first(end - a(t)) + second(b(t)) - corner,   a = r (1 - t)³ (1 + t),  b = r t³ (2 - t),

for t from 0 to 1. The rates of a and b by the parameter are -(1 - c) and c, with c = t² (3 - 2t):
what the first leg loses the second gains. Between two straight lines of directions d and d' the
slope is d + (d' - d) c, and the second derivative (d' - d) 3t (1 - t) / r, which is 0 at both ends:
neither slope nor curvature has a step where a zone begins and ends. A step in the curvature would
be one in the acceleration, between two set-points, of which no controller is told. As a Bézier
curve it has the control points -r and -r/2 on the first line, the corner, and r/2 and r on the
second; so it lies in the triangle that the corner cuts off. Where the way turns by θ it passes the
corner at (3r/8) sin(θ/2). Knows no path and no time.
"""

from __future__ import annotations

import numpy as np

from .trajectory import Array


def runs(t: Array, zone: float | Array) -> tuple[Array, Array]:
    """Return what is left of the first leg, and what is gone of the second, in a zone's unit."""
    return zone * (1.0 - t) ** 3 * (1.0 + t), zone * t**3 * (2.0 - t)


def rates(t: Array) -> tuple[Array, Array]:
    """Return how fast the first leg still runs and the second already does, by the parameter.

    They are the derivatives of what is left, with the sign turned, and of what is gone; their sum
    is 1.
    """
    return (1.0 - t) ** 2 * (1.0 + 2.0 * t), t**2 * (3.0 - 2.0 * t)


def turning(t: Array, zone: float | Array) -> Array:
    """Return the derivative of the second leg's rate by the parameter."""
    turned: Array = 3.0 * t * (1.0 - t) / zone
    return turned


def place_of_rate(rate: Array) -> Array:
    """Return the t, 0 to 1, at which the second leg has a rate, 0 to 1."""
    # With t = 1/2 + sin(φ), the rate t² (3 - 2t) is (1 + sin(3φ)) / 2.
    place: Array = 0.5 + np.sin(np.arcsin(2.0 * rate - 1.0) / 3.0)
    return place
