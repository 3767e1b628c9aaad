"""How far a curve swings, where its turning points have no formula.

Owns the search for them. Knows no path but by its values and slopes.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from .trajectory import Array

_SAMPLES = 256
_BISECTIONS = 50


class Curve(Protocol):
    """A curve in joint space."""

    def evaluate(self, s: Array, order: int = 0) -> Array:
        """Return the (m, n) position (order 0) or slope (1) at s: (m,)."""


def sampled_extent(curve: Curve, begin: float, end: float) -> tuple[Array, Array]:
    """Return the least and greatest position of each joint between two places, each (n,).

    Turning points are bisected between 256 samples. Two of one joint within a 256th of the way
    would be missed, and between them the joint hardly moves.
    """
    s = np.linspace(begin, end, _SAMPLES + 1)
    values, slopes = curve.evaluate(s), curve.evaluate(s, 1)
    rows, joints = np.nonzero(slopes[:-1] * slopes[1:] < 0.0)
    if len(rows):
        low, high, sign = s[rows], s[rows + 1], np.sign(slopes[rows, joints])
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2.0
            before = curve.evaluate(middle, 1)[np.arange(len(joints)), joints] * sign > 0.0
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        values = np.concatenate((values, curve.evaluate(low)))
    return values.min(axis=0), values.max(axis=0)
