"""RRT-Connect: two trees that grow towards each other until they meet.

Owns the search of J. Kuffner and S. LaValle, *RRT-Connect: an efficient approach to single-query
path planning*, 2000, on plain vectors. The caller says what is free, so it knows no robot and no
scene; the same seed gives the same path, as no clock is read here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from .trajectory import Array

STEP = 0.5
"""Greatest length of an edge [rad or m]."""

ITERATIONS = 20_000

EdgeFree: TypeAlias = Callable[[Array, Array], bool]
"""Whether the straight line between two positions is free, the first being known to be."""

_FIRST_CAPACITY = 256


@dataclass(frozen=True, slots=True)
class Search:
    """What a search gave: the (w, n) waypoints, None if it found none, and its iterations."""

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
) -> Search:
    """Search a polyline from start to goal.

    Args:
        start: (n,) free.
        goal: (n,) free.
        lower: (n,) least position of the box that is searched.
        upper: (n,) greatest position.
        edge_free: whether a straight line is free.
        random: where the samples come from.
        step: greatest length of an edge.
        iterations: samples drawn at most.
        proceed: called with the number of each iteration; the search ends where it returns False.
    """
    if edge_free(start, goal):
        return Search(np.array([start, goal]), 0)
    from_start, from_goal = _Tree(start), _Tree(goal)
    growing, other = from_start, from_goal
    for iteration in range(1, iterations + 1):
        if not proceed(iteration):
            return Search(None, iteration)
        node = _extend(growing, random.uniform(lower, upper), step, edge_free)
        if node is not None:
            target = growing.positions[node]
            met = _connect(other, target, step, edge_free)
            if met is not None:
                ends = {id(growing): node, id(other): met}
                there = list(from_start.branch(ends[id(from_start)]))[::-1]
                back = list(from_goal.branch(ends[id(from_goal)]))
                # Both branches end where the trees met.
                return Search(np.array(there + back[1:]), iteration)
        growing, other = other, growing
    return Search(None, iterations)


class _Tree:
    """Positions, each with the place of its parent; the root is its own."""

    def __init__(self, root: Array) -> None:
        self.positions = np.empty((_FIRST_CAPACITY, len(root)))
        self.positions[0] = root
        self.parents = [0]

    def nearest(self, target: Array) -> int:
        """Return the place of the node nearest to a (n,) position [rad or m]."""
        gaps = self.positions[: len(self.parents)] - target
        return int(np.einsum("ij,ij->i", gaps, gaps).argmin())

    def add(self, position: Array, parent: int) -> int:
        """Add a node and return its place."""
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
