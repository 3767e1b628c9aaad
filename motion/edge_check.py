"""Whether straight lines in joint space look free: the quick check that searches rely on.

Owns which positions of a line are looked at, and in what order. It may overlook a contact between
them; what may not is `path_check`.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from .collision import CollisionModel
from .trajectory import Array


class EdgeChecker:
    """Looks whether positions and lines are free, at one resolution and with one margin."""

    def __init__(self, collision: CollisionModel, resolution: float, margin: float) -> None:
        self.resolution = resolution
        self._collision = collision
        self._margin = margin

    def position_free(self, position: Array) -> bool:
        """Return whether nothing touches at a (n,) controller-side position [rad or m]."""
        return not self._collision.any_collides(position[np.newaxis], self._margin)

    def free(self, start: Array, end: Array) -> bool:
        """Return whether nothing touches on a line between (n,) positions, the start being free."""
        gap = end - start
        count = max(1, math.ceil(float(np.abs(gap).max()) / self.resolution))
        return not self._collision.any_collides(start + _fractions(count) * gap, self._margin)


@lru_cache(maxsize=512)
def _fractions(count: int) -> Array:
    """Return (count, 1) the fractions 1/count to 1, each far from those before: trouble shows soon.

    The order is van der Corput's: that of the numbers whose binary digits are read backwards.
    """
    digits = max(1, (count - 1).bit_length())
    places = [int(f"{number:0{digits}b}"[::-1], 2) for number in range(1 << digits)]
    order = count - np.array([place for place in places if place < count])
    fractions: Array = (order / count)[:, np.newaxis]
    fractions.flags.writeable = False
    return fractions
