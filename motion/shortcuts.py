"""Shortening a polyline without touching anything.

Owns the random shortcuts of R. Geraerts and M. Overmars, *Creating high-quality paths for motion
planning*, 2007: two places on the polyline are joined by a straight line where that is free. What
is free the caller says, so it knows no robot and no scene.
"""

from __future__ import annotations

import numpy as np

from .rrt_connect import EdgeFree
from .trajectory import Array

ATTEMPTS = 40

_LEAST_GAIN = 1e-3
"""A shortcut that saves less than this of its detour is not worth a check."""


def shorten(
    waypoints: Array,
    edge_free: EdgeFree,
    *,
    random: np.random.Generator,
    attempts: int = ATTEMPTS,
) -> Array:
    """Return a polyline with the same ends that is not longer.

    Args:
        waypoints: (w, n).
        edge_free: whether a straight line between two positions is free.
        random: where the places come from.
        attempts: shortcuts tried; the same again once they have all failed in a row.
    """
    points = _without_detours(waypoints, edge_free)
    for _ in range(attempts):
        if len(points) < 3:
            break
        points = _try_shortcut(points, edge_free, random)
    return points


def _without_detours(points: Array, edge_free: EdgeFree) -> Array:
    """Go from the start to the farthest waypoint that is in straight reach, and on from there."""
    kept = [0]
    while kept[-1] < len(points) - 1:
        here = kept[-1]
        farthest = len(points) - 1
        while farthest > here + 1 and not edge_free(points[here], points[farthest]):
            # Halving the distance costs a logarithm of the checks that every waypoint would.
            farthest = here + max(1, (farthest - here) // 2)
        kept.append(farthest)
    return points[kept]


def _try_shortcut(points: Array, edge_free: EdgeFree, random: np.random.Generator) -> Array:
    spans = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    knots = np.concatenate(([0.0], np.cumsum(spans)))
    first, second = np.sort(random.uniform(0.0, knots[-1], 2))
    before, after = (int(np.searchsorted(knots, s, side="right")) for s in (first, second))
    if before == after:
        return points
    here, there = (
        points[leg - 1] + (points[leg] - points[leg - 1]) * (s - knots[leg - 1]) / spans[leg - 1]
        for s, leg in ((first, before), (second, after))
    )
    saved = (second - first) - float(np.sqrt(((there - here) ** 2).sum()))
    if saved < _LEAST_GAIN * (second - first) or not edge_free(here, there):
        return points
    return np.vstack((points[:before], here, there, points[after:]))
