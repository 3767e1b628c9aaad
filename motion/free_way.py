"""Whether a straight joint move is free beyond doubt, told from a few distances.

Owns the proof that is cheap enough for the server's event loop. It has no false yes, and a no says
only that more must be looked at: that is `path_check`'s business.

By the bound of `CollisionModel.sweep`, two bodies that are d apart at one place are at least
d - sweep · |Δ| apart wherever each moving joint of the model is no farther from there than its Δ.
So one look in the middle of a straight move proves every pair that is farther apart than what half
of the move can take away, for all places between the samples too. Of the others each half is looked
at in the same way, and so on: most pairs need one look, those that are near some more. The last
look at all pairs is kept, as it proves many a move beside the one that it was made for.

How long that may take is counted in distances, not measured, so that the same questions have the
same answers on every machine and when a journal is run again.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .collision import CollisionModel
from .pose import Array
from .scene import Mesh

MARGIN = 1e-3
"""Bodies that stay at least this far apart are free beyond doubt [m].

A thousand times what the distances are wrong by, and no more than a joint limit's own tolerance
would take: what comes nearer is for the finer look.
"""

MOST = 384
"""How many distances are computed at most, a look counting as eight more; each takes 1 to 2 µs."""

_LOOK = 8  # distances: as long as placing all bodies takes, on an arm of six joints


class FreeWay:
    """Proves straight moves free, of one robot in one scene; for one thread."""

    def __init__(self, collision: CollisionModel) -> None:
        """Make one that has looked nowhere yet.

        Args:
            collision: robot and scene. Where that holds a mesh nothing is sure, since a distance
                from a mesh takes the longer the more triangles it has.
        """
        self._collision = collision
        self._pairs = range(len(collision.pairs))
        self._has_mesh = any(isinstance(each.shape, Mesh) for each in collision.scene.objects)
        # What a joint's unit of travel makes the moving joints of the model travel, at most.
        self._gain = np.abs(collision.model_rates(np.eye(collision.kinematics.dof)))
        self._seen_at: list[float] | None = None
        self._use: list[float] = []

    def is_sure(
        self, start: Sequence[float] | Array, goal: Sequence[float] | Array, *, most: int = MOST
    ) -> bool:
        """Return whether nothing comes nearer than `MARGIN` on a straight move, beyond doubt.

        Args:
            start: (n,) controller-side, within the limits [rad or m]; not checked, for speed.
            goal: (n,) likewise.
            most: how many distances may be computed, a look counting as eight more.
        """
        if not self._pairs:
            return True
        if self._has_mesh:
            return False
        return self._is_near_last_look(start, goal) or self._is_sure_by_looks(start, goal, most)

    def _is_near_last_look(
        self, start: Sequence[float] | Array, goal: Sequence[float] | Array
    ) -> bool:
        """Return whether the last look at all pairs proves a move.

        In plain numbers, since this is what most short moves wait for.
        """
        if self._seen_at is None:
            return False
        used = 0.0
        for begin, end, seen, use in zip(start, goal, self._seen_at, self._use, strict=True):
            # As far as the joint is from there at the farther end. Not by `max`, which may pass
            # over what is not a number.
            used += (abs(0.5 * (begin + end) - seen) + 0.5 * abs(end - begin)) * use
        return used < 1.0

    def _keep(self, place: Array, spare: Array) -> None:
        """Keep a look at all pairs.

        Args:
            place: (n,) where it was made.
            spare: (p,) by how much each pair is farther apart than `MARGIN`, above 0 [m].
        """
        self._seen_at = place.tolist()
        # For each pair the sum over the joints is at least its own approach as a share of `spare`.
        uses = (self._collision.sweep / spare[:, np.newaxis]).max(axis=0)
        self._use = (uses @ self._gain).tolist()

    def _is_sure_by_looks(
        self, start: Sequence[float] | Array, goal: Sequence[float] | Array, most: int
    ) -> bool:
        collision = self._collision
        begin = np.array(start)
        way = np.array(goal) - begin
        # How far the bodies of each pair can come nearer on all of the move.
        approach = collision.sweep.dot(np.abs(collision.model_rates(way))).tolist()
        left = most
        # Middle and half length of each stretch, as shares of the move, and the pairs it is about.
        stretches: list[tuple[float, float, Sequence[int]]] = [(0.5, 0.5, self._pairs)]
        while stretches:
            middle, half, pairs = stretches.pop()
            left -= len(pairs) + _LOOK
            if left < 0:
                return False
            place = begin + middle * way
            distances = collision.clearances_of(pairs, place)
            near = []
            for pair, distance in zip(pairs, distances, strict=True):
                # Written so that a distance that is not a number proves nothing.
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
