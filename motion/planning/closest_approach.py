"""Closest approach: where on a sampled motion an object of the scene and another body are nearest.

Links of the arm among each other are left out: two that turn about one axis keep a small distance
all along, which would hide how near the arm comes to what stands around it.

Owns the search among the samples. By the bound of `CollisionModel.sweep` no pair of bodies can come
nearer, between two samples, than its distance at one of them less what the joints can move it from
there. So a stretch of samples is looked at only while some pair could be nearer on it than the
nearest found, the most promising first. The effort is counted in looks, so that the same motion has
the same answer on every machine; where a distance hardly changes all along, the looks end the
search, and the answer is the least of what was seen.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..pose import Array
from ..scene.collision import CollisionModel

RESOLUTION = 1e-4
"""A stretch that could only be nearer by less is not looked at [m]."""

MOST_LOOKS = 256
"""Greatest number of samples whose distances are computed."""

_MOST_AT_ONCE = 4_000_000
"""Numbers in the table of how far each pair moves, a row a sample: 32 MB."""


@dataclass(frozen=True, slots=True)
class ClosestApproach:
    """The nearest two bodies of a motion.

    Attributes:
        sample: number of the sample.
        distance: between them there [m], negative by their overlap.
    """

    sample: int
    distance: float
    first: str
    second: str


def closest_approach(collision: CollisionModel, positions: Array) -> ClosestApproach | None:
    """Return where an object and another body come nearest; None where the scene has no object.

    Args:
        positions: (m, n) the samples in their order, controller side [rad or m]; one or more.
    """
    objects = frozenset(collision.scene.names)
    pairs = [at for at, pair in enumerate(collision.pairs) if not objects.isdisjoint(pair)]
    if not pairs:
        return None
    # Every so many samples only, where the table of all would be too large.
    stride = -(-len(positions) * len(pairs) // _MOST_AT_ONCE)
    kept = np.append(np.arange(0, len(positions) - 1, stride), len(positions) - 1)
    sample, pair, distance = _Search(collision, pairs, positions[kept]).nearest()
    return ClosestApproach(int(kept[sample]), distance, *collision.pairs[pair])


class _Search:
    """Search of one motion among some pairs."""

    def __init__(self, collision: CollisionModel, pairs: Sequence[int], positions: Array) -> None:
        self._collision = collision
        self._pairs = pairs
        self._positions = positions
        travel = np.abs(np.diff(collision.model_positions(positions), axis=0))
        # Row k: greatest relative motion of each pair's bodies up to sample k.
        moved = np.cumsum(travel @ collision.sweep[pairs].T, axis=0)
        self._moved = np.vstack((np.zeros((1, len(pairs))), moved))
        self._best: tuple[float, int, int] = (np.inf, 0, 0)  # distance, sample, pair

    def nearest(self) -> tuple[int, int, float]:
        """Return sample, pair and distance."""
        last = len(self._positions) - 1
        # Least distance that is possible on a stretch, its first and its last sample.
        stretches = [(-np.inf, 0, last)]
        for _ in range(MOST_LOOKS):
            if not stretches or stretches[0][0] > self._best[0] - RESOLUTION:
                break
            _, first, last = heapq.heappop(stretches)
            middle = (first + last) // 2
            distances = self._look(middle)
            for begin, end in ((first, middle - 1), (middle + 1, last)):
                if begin <= end:
                    bound = self._bound(distances, middle, begin, end)
                    heapq.heappush(stretches, (bound, begin, end))
        distance, sample, pair = self._best
        return sample, pair, distance

    def _look(self, sample: int) -> Array:
        place = self._positions[sample]
        distances = np.array(self._collision.clearances_of(self._pairs, place))
        nearest = int(np.argmin(distances))
        self._best = min(self._best, (float(distances[nearest]), sample, self._pairs[nearest]))
        return distances

    def _bound(self, distances: Array, middle: int, begin: int, end: int) -> float:
        """Return the least distance possible on a stretch beside the sample that was looked at."""
        far = begin if begin < middle else end
        moved = np.abs(self._moved[far] - self._moved[middle])
        return float((distances - moved).min())
