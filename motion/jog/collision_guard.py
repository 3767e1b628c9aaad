"""Collision guard of a jog: slows from a distance of 20 mm between bodies, leaves 5 mm at rest.

Owns those distances, and which pairs of bodies count: only those that come nearer. So a pair that
touches never holds a motion that parts it, and a pair that stays 8 mm apart slows nothing. Both
jogs ask about the place where they could next stand still, so everything before it was asked about
already.

Every tick asks, but not about every pair. By the bound of `CollisionModel.sweep`, a pair that was
d apart before the moving joints went by Δ is at least d - sweep · |Δ| apart now. So every pair that
was farther apart than 100 mm at the last check of all pairs is still beyond 40 mm as long as

    Σ over the joints of |Δ| · max over these pairs of sweep / (d - 40 mm)  <  1

since for each of the pairs the sum is at least its own sweep · |Δ| / (d - 40 mm). Until then only
the distances of the other pairs are computed, at about 1 µs each; then all pairs are checked again.
By the same bound `clear_distance` gives the length along a straight line on which nothing has to be
checked.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ..pose import Array
from ..scene.collision import TOUCHING, CollisionModel
from .jog_commands import JogCause, JogSlowdown

SLOW = 0.020
"""Bodies nearer than this slow a jog [m]."""

CLEAR = 0.005
"""Bodies are at least this far apart when a jog has stopped for them [m]."""

NEAR = 0.040
"""While all bodies are farther apart than this, no distance is reported [m]."""

CLOSING = 0.25
"""Greatest closing speed of two bodies at `SLOW`; nearer, it falls with the root of the rest [m/s].

That is an even deceleration to rest at `CLEAR`. A body that slides along another is hardly slowed.
"""

Distances: TypeAlias = Mapping[int, float]
"""Distances [m] by the index of the pair; a pair that is not among them is beyond `NEAR`."""

_WATCHED = 0.100  # m: pairs nearer than this at a check of all pairs are computed every time
_BETWEEN = 0.001  # m: how far a distance may dip between two places that were checked
_PROBE = 0.1  # rad or m: how far ahead a contact without depth is tested for parting
_UNSEEN = 0.8  # of the path computed by the rates at its start, which change along it
_SAME = 1e-12  # m
_STEP = 1e-3  # rad or m: step of central differences
_TOUCH = 1e-3  # m: nearer pairs count alike


class Closing(NamedTuple):
    """Upper bounds of how fast bodies come nearer along a direction.

    Attributes:
        rates: of each moving joint of the model, without sign [rad/s or m/s].
        pairs: closing speed of each pair [m/s].
    """

    rates: list[float]
    pairs: list[float]


class CollisionGuard:
    """Collision guard of one robot in one scene."""

    def __init__(self, collision: CollisionModel) -> None:
        self._collision = collision
        self._pairs = collision.pairs
        self._watched: list[int] = []
        self._seen_at: list[float] | None = None
        self._use: list[float] = []
        self._used = 0.0
        self._last: Distances = {}

    def look(self, position: Sequence[float]) -> Distances | None:
        """Return the distances of all pairs that may be near; None if no pair is within `NEAR`."""
        if not self._pairs:
            return None
        place = np.array(position)
        if self._far_are_far(place):
            if not self._watched:
                return None
            found = self._collision.clearances_of(self._watched, place)
            self._last = dict(zip(self._watched, found, strict=True))
        else:
            self._look_at_all(place)
        return self._last if min(self._last.values(), default=math.inf) <= NEAR else None

    def closing(self, rates: Sequence[float]) -> Closing:
        """Return upper bounds of how fast bodies come nearer at (n,) joint rates [rad/s or m/s]."""
        moving = np.abs(self._collision.model_rates(np.array(rates)))
        return Closing(moving.tolist(), (self._collision.sweep @ moving).tolist())

    def clear_distance(self, closing: Closing) -> float:
        """Return how far from the place last checked all pairs stay beyond `SLOW`.

        In units of the path parameter by which `closing` has the rates, forwards and backwards. A
        pair that is d apart there is at least d - s · closing apart after s; for pairs that are not
        watched the sum of the module docstring is below 1 until they come to `NEAR`.
        """
        if not self._pairs:
            return math.inf
        used = sum([use * rate for use, rate in zip(self._use, closing.rates, strict=True)])
        # What is left of the sum of the module docstring bounds the far pairs, all of them at once.
        way = (1.0 - self._used) / used if used > 0.0 else math.inf
        for pair, distance in self._last.items():
            rate = closing.pairs[pair]
            if rate > 0.0:
                way = min(way, (distance - SLOW) / rate)
        return way

    def _far_are_far(self, place: Array) -> bool:
        """Return True if every pair that is not watched is proven to be beyond `NEAR`."""
        seen_at = self._seen_at
        if seen_at is None:
            return False
        used = 0.0
        joints = self._collision.model_positions(place).tolist()
        for joint, seen, use in zip(joints, seen_at, self._use, strict=True):
            # Runs for every joint in every tick; a call of `abs` would take 20 ns more.
            used += (joint - seen if joint > seen else seen - joint) * use
        self._used = used
        return used < 1.0

    def _look_at_all(self, place: Array) -> None:
        distances = self._collision.clearances(place)
        far = distances > _WATCHED
        self._watched = np.flatnonzero(~far).tolist()
        self._seen_at = self._collision.model_positions(place).tolist()
        left = distances[far] - NEAR
        # One number a joint instead of one a pair: the greatest over the far pairs is at least each
        # pair's own, so the sum errs on the side of checking all pairs too early.
        uses = self._collision.sweep[far] / left[:, np.newaxis]
        self._use = uses.max(axis=0, initial=0.0).tolist()
        self._used = 0.0
        self._last = {pair: float(distances[pair]) for pair in self._watched}

    def nearing(
        self,
        before: Distances | None,
        after: Distances | None,
        way: tuple[Sequence[float], Sequence[float]],
        time: float,
    ) -> tuple[float, JogCause] | None:
        """Judge a motion by the distances at its start and at its end.

        Args:
            before: distances of `look` at the start.
            after: distances of `look` at the end.
            way: (n,) position and (n,) direction of the motion; used only where bodies touch
                without depth at both ends.
            time: that the motion takes [s].

        Returns:
            The share of its speed that two approaching bodies allow, 0 where it has to stop, and
            the two; None if they allow all of it.
        """
        if after is None:
            return None
        least, worst = 1.0, -1
        for pair, distance in after.items():
            if distance >= SLOW:
                continue
            start = math.inf if before is None else before.get(pair, math.inf)
            if start == math.inf:
                # The pair was beyond `NEAR` and has no number; the worst case is that it came
                # straight on.
                start = max(NEAR, distance + time * CLOSING)
            # Only what comes nearer counts, and of bodies that touch alike at both ends what
            # presses them together.
            if not distance < start - _SAME and not self._presses(pair, start, distance, way):
                continue
            # `_BETWEEN` is kept in reserve: the distance is known at both ends of the motion only.
            left = min(max((distance - CLEAR - _BETWEEN) / (SLOW - CLEAR - _BETWEEN), 0.0), 1.0)
            closing = max(start - distance, _SAME) / time
            share = math.sqrt(left) * CLOSING / closing
            if share < least:
                least, worst = share, pair
        if worst < 0:
            return None
        return least, JogCause(JogSlowdown.COLLISION, after[worst], CLEAR, pair=self._pairs[worst])

    def _presses(
        self, pair: int, start: float, distance: float, way: tuple[Sequence[float], Sequence[float]]
    ) -> bool:
        """Return True if bodies that touch equally at both ends do not part farther on.

        A contact without depth (meshes have no inside) reads the same before and after, whether the
        motion presses or parts. So the distance is computed once more, `_PROBE` ahead.
        """
        if distance > TOUCHING or start > TOUCHING or abs(distance - start) > _SAME:
            return False
        position, rate = way
        greatest = max((abs(value) for value in rate), default=0.0)
        gain = _PROBE / greatest if greatest > 0.0 else 0.0
        ahead = [value + gain * each for value, each in zip(position, rate, strict=True)]
        return self._collision.clearances_of((pair,), np.array(ahead))[0] <= distance

    def unseen_distance(self, distances: Distances, rate: Sequence[float]) -> float:
        """Return how far a motion can go before bodies beyond `SLOW` may meet and part again.

        From d to `CLEAR` and back to a distance that is noticed, two bodies must move by twice
        d - `CLEAR` relative to each other, and sweep · |rate| bounds how fast they do.

        Args:
            distances: distances of `look` at the place of the motion.
            rate: (n,) derivative of the joints by the path parameter [rad or m].
        """
        rates = np.abs(self._collision.model_rates(np.array(rate)))
        way = math.inf
        for pair, distance in distances.items():
            moved = float(self._collision.sweep[pair] @ rates)
            if moved > 0.0:
                way = min(way, _UNSEEN * 2.0 * (distance - CLEAR) / moved)
        return way

    def in_contact(self, distances: Distances | None) -> bool:
        """Return True if a pair of these distances is nearer than a jog may come to rest."""
        return distances is not None and min(distances.values()) < CLEAR

    def nearest(self, position: Sequence[float]) -> JogCause | None:
        """Return the nearest two bodies as a cause; None where all are beyond `NEAR`."""
        found = self.look(position)
        if found is None:
            return None
        pair = min(found, key=found.__getitem__)
        return JogCause(JogSlowdown.COLLISION, found[pair], CLEAR, pair=self._pairs[pair])

    def separating_direction(self, position: Sequence[float]) -> list[float] | None:
        """Return the joint direction along which the near pairs part, greatest element ±1.

        The gradient of -Σ 1/d over the pairs below `SLOW`, so the nearest pairs count most, by
        central differences. None if no joint changes their distances.
        """
        place = np.array(position, dtype=np.float64)
        here = self.look(position) or {}
        near = [pair for pair, distance in here.items() if distance < SLOW]
        if not near:
            return None
        weights = 1.0 / np.maximum([here[pair] for pair in near], _TOUCH) ** 2
        gradient = np.zeros(len(place))
        for joint in range(len(place)):
            for sign in (1.0, -1.0):
                moved = place.copy()
                moved[joint] += sign * _STEP
                clear = self._collision.clearances_of(near, moved)
                gradient[joint] += sign * float(weights @ np.array(clear))
        greatest = float(np.abs(gradient).max())
        if greatest <= _SAME:
            return None
        way: list[float] = (gradient / greatest).tolist()
        return way
