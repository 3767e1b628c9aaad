"""Undo path: the path of the last jog, kept so that it can be followed back.

Owns what is kept: joint positions thinned so that the straight pieces between them are nowhere
farther from a set-point than a tolerance. Set-points are collected and thinned by the block (the
algorithm of Ramer, Douglas and Peucker), so recording one costs next to nothing. When there are too
many, the tolerance doubles and the rest is thinned again, so memory is bounded and the error is
stated. Knows no motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from ..errors import BadArgument
from ..pose import Array

Position: TypeAlias = tuple[float, ...]

TOLERANCE = 1e-3
"""Greatest distance of a joint from what is kept [rad, or arm's lengths], until it must double."""

MOST_POINTS = 512

BLOCK = 64
"""Set-points that are thinned together; the last of each block is kept."""


class UndoPath:
    """Path of one jog.

    Attributes:
        tolerance: greatest distance of a set-point from what is kept, in units of each joint.
    """

    def __init__(
        self, start: Sequence[float], units: Sequence[float], tolerance: float = TOLERANCE
    ) -> None:
        """Start a path.

        Args:
            start: (n,) where the robot stands [rad or m].
            units: (n,) unit of each joint's travel, as `JogModel.unit`.
            tolerance: in those units.

        Raises:
            BadArgument: the tolerance is not more than 0.
        """
        if not tolerance > 0.0:
            raise BadArgument("tolerance", tolerance, "more than 0")
        self.tolerance = tolerance
        self._units = np.array(units)
        self._kept: list[Position] = [tuple(start)]
        self._pending: list[Position] = []

    def add(self, position: Sequence[float]) -> None:
        """Record a set-point."""
        place = tuple(position)
        if place == (self._pending[-1] if self._pending else self._kept[-1]):
            return
        self._pending.append(place)
        # Thinned by the block, so that most ticks only append: thinning takes time that grows with
        # it.
        if len(self._pending) >= BLOCK:
            self._kept = self.waypoints()
            self._pending = []
            if len(self._kept) > MOST_POINTS:
                self._coarsen()

    def waypoints(self) -> list[Position]:
        """Return the path from its start to its end; a single point where nothing moved."""
        return self._kept[:-1] + self._thinned([self._kept[-1], *self._pending], self.tolerance)

    def way_back(self) -> list[Position]:
        """Return the path from its end to its start."""
        return self.waypoints()[::-1]

    def _coarsen(self) -> None:
        # The second thinning is of points that deviate by the first already: errors add up.
        kept = self._thinned(self._kept, self.tolerance)
        self.tolerance *= 2.0
        self._kept = kept if len(kept) <= MOST_POINTS // 2 else self._every_second(kept)

    def _every_second(self, kept: list[Position]) -> list[Position]:
        """Drop every second point of a path that no tolerance shortens; note the deviation."""
        thinned = [*kept[:-1:2], kept[-1]]
        triples = zip(kept[::2], kept[1::2], kept[2::2], strict=False)
        self.tolerance += max(float(self._distances(np.array(each))[0]) for each in triples)
        return thinned

    def _thinned(self, way: list[Position], tolerance: float) -> list[Position]:
        """Return the first and last point, and the points needed between them.

        A stretch is one straight piece where all its points are within the tolerance of it;
        otherwise it is split at the point that is farthest.
        """
        points = np.array(way)
        kept = {0, len(way) - 1}
        stretches = [(0, len(way) - 1)]
        while stretches:
            first, last = stretches.pop()
            if last - first < 2:
                continue
            distances = self._distances(points[first : last + 1])
            farthest = int(distances.argmax())
            if distances[farthest] > tolerance:
                middle = first + 1 + farthest
                kept.add(middle)
                stretches += [(first, middle), (middle, last)]
        return [way[index] for index in sorted(kept)]

    def _distances(self, stretch: Array) -> Array:
        """Return how far each inner point of an (m, n) stretch is from its straight piece, (m-2,).

        It is the greatest distance of a joint from the nearest place of the piece.
        """
        ways = (stretch[1:] - stretch[0]) / self._units
        line = ways[-1]
        square = float(line @ line)
        if square:
            shares = np.minimum(np.maximum(ways[:-1] @ line / square, 0.0), 1.0)
        else:
            shares = np.zeros(len(ways) - 1)
        distances: Array = np.abs(ways[:-1] - shares[:, np.newaxis] * line).max(axis=1)
        return distances
