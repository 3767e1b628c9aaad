"""Clearance proof of a straight joint move: certain from a few distances, or left undecided.

Owns the proof that is cheap enough for the server's event loop. It never says yes wrongly; a no
means only that a closer check is needed, which is `path_check`'s.

By the bound of `CollisionModel.sweep`, two bodies that are d apart at one place are at least
d - sweep · |Δ| apart wherever each moving joint of the model is no farther from there than its Δ.
So one check in the middle of a straight move proves every pair that is farther apart than half of
the move can close, for all places between the samples too. For the other pairs each half is checked
in the same way, and so on: most pairs need one distance, those that are near some more. The last
check of all pairs is kept, as it proves many a move near the one that it was made for.

The effort is counted in distances, not measured in time, so that the same questions have the same
answers on every machine and when a journal is run again.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..pose import Array
from .collision import CollisionModel
from .scene import Mesh

MARGIN = 1e-3
"""Least distance of bodies that are proven clear [m].

It is a thousand times the error of the distances, and no more than a joint limit's own tolerance
would take. What comes nearer needs the finer check.
"""

MOST = 384
"""Greatest number of distances computed, a check counting as eight more; each takes 1 to 2 µs."""

_LOOK = 8  # distances: the time that placing all bodies takes, on an arm of six joints


class ClearPath:
    """Clearance proofs for straight moves of one robot in one scene; for one thread."""

    def __init__(self, collision: CollisionModel) -> None:
        """Build one without any check made yet.

        In a scene with a mesh nothing is proven, since the time for a distance from a mesh grows
        with its number of triangles.
        """
        self._collision = collision
        self._pairs = range(len(collision.pairs))
        self._has_mesh = any(isinstance(each.shape, Mesh) for each in collision.scene.objects)
        # Travel of each moving joint of the model per unit of travel of each driven joint.
        self._gain = np.abs(collision.model_rates(np.eye(collision.kinematics.dof)))
        self._seen_at: list[float] | None = None
        self._use: list[float] = []

    def is_sure(
        self, start: Sequence[float] | Array, goal: Sequence[float] | Array, *, most: int = MOST
    ) -> bool:
        """Return True if nothing comes nearer than `MARGIN` on a straight move, proven.

        Args:
            start: (n,) controller-side, within the limits [rad or m]; not checked, for speed.
            goal: (n,) likewise.
            most: greatest number of distances computed, a check counting as eight more.
        """
        if not self._pairs:
            return True
        if self._has_mesh:
            return False
        return self._is_near_last_look(start, goal) or self._is_sure_by_looks(start, goal, most)

    def _is_near_last_look(
        self, start: Sequence[float] | Array, goal: Sequence[float] | Array
    ) -> bool:
        """Return True if the last check of all pairs proves a move.

        In plain numbers, since this path serves most short moves.
        """
        if self._seen_at is None:
            return False
        used = 0.0
        for begin, end, seen, use in zip(start, goal, self._seen_at, self._use, strict=True):
            # Distance of the joint's farther end from the place of that check. Not by `max`, which
            # may pass over a NaN.
            used += (abs(0.5 * (begin + end) - seen) + 0.5 * abs(end - begin)) * use
        return used < 1.0

    def _keep(self, place: Array, spare: Array) -> None:
        """Keep a check of all pairs: (n,) place, (p,) excess of distances over `MARGIN` [m]."""
        self._seen_at = place.tolist()
        # For each pair the sum over the joints is at least its own approach as a share of its
        # `spare`.
        uses = (self._collision.sweep / spare[:, np.newaxis]).max(axis=0)
        self._use = (uses @ self._gain).tolist()

    def _is_sure_by_looks(
        self, start: Sequence[float] | Array, goal: Sequence[float] | Array, most: int
    ) -> bool:
        collision = self._collision
        begin = np.array(start)
        way = np.array(goal) - begin
        # Upper bound of how much nearer the bodies of each pair come on the whole move.
        approach = collision.sweep.dot(np.abs(collision.model_rates(way))).tolist()
        left = most
        # Middle and half length of each stretch, as shares of the move, and the pairs it is about.
        stretches: list[tuple[float, float, Sequence[int]]] = [(0.5, 0.5, self._pairs)]
        while stretches:
            middle, half, pairs = stretches.pop()
            # Counted before anything is computed, so that the work stays within `most`.
            left -= len(pairs) + _LOOK
            if left < 0:
                return False
            place = begin + middle * way
            distances = collision.clearances_of(pairs, place)
            near = []
            for pair, distance in zip(pairs, distances, strict=True):
                # Both comparisons with `not`: a NaN proves nothing.
                if not distance > MARGIN:
                    return False
                if not distance - MARGIN > half * approach[pair]:
                    near.append(pair)
            if pairs is self._pairs:
                self._keep(place, np.array(distances) - MARGIN)
            if near:
                half *= 0.5
                stretches += (middle - half, half, near), (middle + half, half, near)
        return True
