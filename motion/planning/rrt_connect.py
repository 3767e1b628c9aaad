"""RRT-Connect: two trees that grow towards each other until they meet, and shortcuts of the result.

Owns the search of J. Kuffner and S. LaValle, *RRT-Connect: an efficient approach to single-query
path planning*, 2000, and the random shortcuts of R. Geraerts and M. Overmars, *Creating
high-quality paths for motion planning*, 2007: two places on the polyline are joined by a straight
line where that is free. Both work on plain vectors. The caller tests for contacts, so they know no
robot and no scene; the same seed gives the same path, as no clock is read here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ..pose import Array

BUILT_IN = "BuiltInRRTConnect"
"""Name of this search, which needs no OMPL and keeps its name where OMPL is installed."""

STEP = 0.5
"""Greatest length of an edge [rad or m]."""

ITERATIONS = 20_000

EdgeFree: TypeAlias = Callable[[Array, Array], bool]
"""Returns True if the straight line between two positions is free; the first is known to be."""

_FIRST_CAPACITY = 256


@dataclass(frozen=True, slots=True)
class TreeSearch:
    """Result of a search: the (w, n) waypoints, None if it found none, and its iterations."""

    waypoints: Array | None
    iterations: int


def rrt_connect(
    start: Array,
    goal: Array,
    lower: Array,
    upper: Array,
    edge_free: EdgeFree,
    *,
    random: np.random.Generator,
    step: float = STEP,
    iterations: int = ITERATIONS,
    proceed: Callable[[int], bool] = lambda iteration: True,
) -> TreeSearch:
    """Search a polyline from start to goal.

    Args:
        start: (n,) free.
        goal: (n,) free.
        lower: (n,) least position of the box that is searched.
        upper: (n,) greatest position.
        edge_free: returns True if a straight line is free.
        step: greatest length of an edge.
        iterations: greatest number of samples.
        proceed: called with the number of each iteration; the search ends where it returns False.
    """
    if edge_free(start, goal):
        return TreeSearch(np.array([start, goal]), 0)
    from_start, from_goal = _Tree(start), _Tree(goal)
    growing, other = from_start, from_goal
    for iteration in range(1, iterations + 1):
        if not proceed(iteration):
            return TreeSearch(None, iteration)
        node = _extend(growing, random.uniform(lower, upper), step, edge_free)
        if node is not None:
            target = growing.positions[node]
            met = _connect(other, target, step, edge_free)
            if met is not None:
                ends = {id(growing): node, id(other): met}
                there = list(from_start.branch(ends[id(from_start)]))[::-1]
                back = list(from_goal.branch(ends[id(from_goal)]))
                # Both branches end where the trees met.
                return TreeSearch(np.array(there + back[1:]), iteration)
        growing, other = other, growing
    return TreeSearch(None, iterations)


class _Tree:
    """Positions, each with the index of its parent; the root is its own."""

    def __init__(self, root: Array) -> None:
        self.positions = np.empty((_FIRST_CAPACITY, len(root)))
        self.positions[0] = root
        self.parents = [0]

    def nearest(self, target: Array) -> int:
        """Return the index of the node nearest to a (n,) position [rad or m]."""
        gaps = self.positions[: len(self.parents)] - target
        return int(np.einsum("ij,ij->i", gaps, gaps).argmin())

    def add(self, position: Array, parent: int) -> int:
        """Add a node and return its index."""
        place = len(self.parents)
        if place == len(self.positions):
            self.positions = np.vstack((self.positions, np.empty_like(self.positions)))
        self.positions[place] = position
        self.parents.append(parent)
        return place

    def branch(self, place: int) -> Iterator[Array]:
        """Yield the positions from a node to the root."""
        while place:
            yield self.positions[place]
            place = self.parents[place]
        yield self.positions[0]


def _extend(tree: _Tree, target: Array, step: float, edge_free: EdgeFree) -> int | None:
    """Grow a tree by one edge towards a position; return the new node, None if blocked."""
    near = tree.nearest(target)
    origin = tree.positions[near]
    gap = target - origin
    length = float(np.sqrt(gap @ gap))
    if length == 0.0:
        return None
    reached = target if length <= step else origin + gap * (step / length)
    return tree.add(reached, near) if edge_free(origin, reached) else None


def _connect(tree: _Tree, target: Array, step: float, edge_free: EdgeFree) -> int | None:
    """Grow a tree until it reaches a position; return the node there, None if blocked."""
    place = tree.nearest(target)
    while True:
        origin = tree.positions[place]
        gap = target - origin
        length = float(np.sqrt(gap @ gap))
        reached = target if length <= step else origin + gap * (step / length)
        if not edge_free(origin, reached):
            return None
        place = tree.add(reached, place)
        if reached is target:
            return place


ATTEMPTS = 40

_LEAST_GAIN = 1e-3
"""Least share of its detour that a shortcut must save to be worth a check."""


def shorten(
    waypoints: Array, edge_free: EdgeFree, *, random: np.random.Generator, attempts: int = ATTEMPTS
) -> Array:
    """Return a polyline with the same ends that is not longer.

    Args:
        waypoints: (w, n).
        edge_free: returns True if a straight line between two positions is free.
        attempts: shortcuts tried; the same number again after that many failed in a row.
    """
    points = _without_detours(waypoints, edge_free)
    for _ in range(attempts):
        if len(points) < 3:
            break
        points = _try_shortcut(points, edge_free, random)
    return points


def _without_detours(points: Array, edge_free: EdgeFree) -> Array:
    """Return the polyline of the farthest waypoints in straight reach, from the start on."""
    kept = [0]
    while kept[-1] < len(points) - 1:
        here = kept[-1]
        farthest = len(points) - 1
        while farthest > here + 1 and not edge_free(points[here], points[farthest]):
            # Bisection needs a logarithm of the checks that all waypoints would.
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
