"""Trace of the tool's path, for a screen that draws it: thinned to a tolerance, and bounded.

Owns which points of the path are kept. A point is dropped while the straight line past it stays
within the tolerance. When the trace is full, every second point of its oldest half is dropped.

Most new points need no comparison with the dropped ones. The distance from a straight segment is
convex, so along the present segment it is greatest at one of the ends. At the common start it is 0.
Hence a dropped point is farther from the segment to a new point than from the present segment by at
most the distance of the present segment's end.
"""

from __future__ import annotations

import math

Point = tuple[float, ...]

TOLERANCE = 5e-4
"""Greatest distance of the path from the line through the kept points [m]."""

MOST_POINTS = 4_000


class ToolTrace:
    """Path of the tool since the trace was cleared.

    Attributes:
        points: (x, y, z) in base, in order [m].
    """

    def __init__(self, tolerance: float = TOLERANCE, most: int = MOST_POINTS) -> None:
        """Start without points."""
        self.points: list[Point] = []
        self._between: list[Point] = []
        self._off = 0.0  # the places between are at most so far from the last piece [m]
        self._tolerance = tolerance
        self._most = most

    def clear(self) -> None:
        """Drop all points."""
        self.points.clear()
        self._between.clear()
        self._off = 0.0

    def add(self, point: Point) -> None:
        """Add the next position of the tool."""
        points = self.points
        if not points:
            points.append(point)
            return
        if len(points) == 1 and math.dist(points[0], point) < self._tolerance:
            return
        if len(points) >= 2 and self._is_straight(points[-2], point):
            self._between.append(points[-1])
            points[-1] = point
            return
        self._between.clear()
        self._off = 0.0
        points.append(point)
        if len(points) > self._most:
            half = len(points) // 2
            points[:half] = points[:half:2]

    def _is_straight(self, begin: Point, end: Point) -> bool:
        """Return True if the places since the last kept point lie on the line to a new one."""
        if len(self._between) >= 50:
            return False
        last = self.points[-1]
        off = self._off + _distance(last, begin, end)
        if off > self._tolerance:
            # The sum is only a bound, so all are looked at before it is said that they do not.
            off = max([_distance(place, begin, end) for place in (*self._between, last)])
        if off > self._tolerance:
            return False
        self._off = off
        return True


def _distance(place: Point, begin: Point, end: Point) -> float:
    """Return how far a place is from a straight piece [m]."""
    # Written out, in a fifth of the time: up to fifty places for a point of each robot.
    x, y, z = begin
    dx, dy, dz = end[0] - x, end[1] - y, end[2] - z
    px, py, pz = place[0] - x, place[1] - y, place[2] - z
    square = dx * dx + dy * dy + dz * dz
    share = (px * dx + py * dy + pz * dz) / square if square else 0.0
    share = 0.0 if share < 0.0 else min(share, 1.0)
    return math.hypot(px - share * dx, py - share * dy, pz - share * dz)
