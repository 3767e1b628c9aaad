"""How near bodies come along a jog: slow from 20 mm, still 5 mm apart at rest.

Owns those distances, and which pairs count: only those that come nearer. So a pair that touches
never holds a motion that takes it apart, and a pair that stays 8 mm apart slows nobody. Both jogs
ask about the place where they could next stand still, so what is in between was asked about before.

Every tick asks, but not about every pair. By the bound of `CollisionModel.sweep`, a pair that was
d apart before the moving joints went by Δ is at least d - sweep · |Δ| apart now. Of pairs that were
farther apart than 100 mm at the last look at all, that leaves each beyond 40 mm as long as

    Σ over the joints of |Δ| · max over these pairs of sweep / (d - 40 mm)  <  1

since for each of the pairs the sum is at least its own sweep · |Δ| / (d - 40 mm). Until then only
the distances of the others are computed, a microsecond each; then all are looked at anew. By the
same bound `clear_way` says how far along a straight line nothing need be asked.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from ..collision import TOUCHING, CollisionModel
from ..pose import Array
from .reasons import JogCause, JogReason

SLOW = 0.020
"""Bodies nearer than this slow a jog [m]."""

CLEAR = 0.005
"""Bodies are at least this far apart when a jog has stopped for them [m]."""

NEAR = 0.040
"""While all bodies are farther apart than this, nothing is told of them [m]."""

CLOSING = 0.25
"""How fast bodies may come nearer at `SLOW`; from there on less, by the root of what is left [m/s].

So an even deceleration brings them to rest. What slides along a body is hardly slowed by it.
"""

Distances: TypeAlias = Mapping[int, float]
"""Distances [m] by the index of the pair; a pair that is not among them is beyond `NEAR`."""

_WATCHED = 0.100  # m: pairs nearer than this at a look at all are then computed at every place
_BETWEEN = 0.001  # m, that a distance may dip between two places that were looked at
_PROBE = 0.1  # rad or m: how far ahead it is looked for a way out of a contact without depth
_UNSEEN = 0.8  # of the way by the rates at its start, for what these change on it
_SAME = 1e-12  # m
_STEP = 1e-3  # rad or m, of differences
_TOUCH = 1e-3  # m: nearer pairs count alike


class Closing(NamedTuple):
    """How fast bodies come nearer along a direction, at most.

    Attributes:
        rates: of each moving joint of the model, without sign [rad/s or m/s].
        pairs: of each pair [m/s].
    """

    rates: list[float]
    pairs: list[float]


class CollisionGuard:
    """Watches one robot in one scene."""

    def __init__(self, collision: CollisionModel) -> None:
        self._collision = collision
        self._pairs = collision.pairs
        self._watched: list[int] = []
        self._seen_at: list[float] | None = None
        self._use: list[float] = []
        self._used = 0.0
        self._last: Distances = {}

    def look(self, position: Sequence[float]) -> Distances | None:
        """Return the distances of all pairs that may be near; None where none is."""
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
        """Return how fast bodies come nearer at (n,) joint rates, at most [rad/s or m/s]."""
        moving = np.abs(self._collision.model_rates(np.array(rates)))
        return Closing(moving.tolist(), (self._collision.sweep @ moving).tolist())

    def clear_way(self, closing: Closing) -> float:
        """Return how far from the place last looked at all pairs stay beyond `SLOW`.

        By the parameter of the way of which `closing` has the rates, forwards and backwards. A
        pair that is d apart there is at least d - s · closing apart after s; of those that are not
        watched the sum of the module's text is below 1 until they come to `NEAR`.
        """
        if not self._pairs:
            return math.inf
        used = sum([use * rate for use, rate in zip(self._use, closing.rates, strict=True)])
        way = (1.0 - self._used) / used if used > 0.0 else math.inf
        for pair, distance in self._last.items():
            rate = closing.pairs[pair]
            if rate > 0.0:
                way = min(way, (distance - SLOW) / rate)
        return way

    def _far_are_far(self, place: Array) -> bool:
        """Return whether every pair that is not watched is surely beyond `NEAR`."""
        seen_at = self._seen_at
        if seen_at is None:
            return False
        used = 0.0
        joints = self._collision.model_positions(place).tolist()
        for joint, seen, use in zip(joints, seen_at, self._use, strict=True):
            used += (joint - seen if joint > seen else seen - joint) * use
        self._used = used
        return used < 1.0

    def _look_at_all(self, place: Array) -> None:
        distances = self._collision.clearances(place)
        far = distances > _WATCHED
        self._watched = np.flatnonzero(~far).tolist()
        self._seen_at = self._collision.model_positions(place).tolist()
        left = distances[far] - NEAR
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
            before: of `look` at the start.
            after: of `look` at the end.
            way: (n,) place and (n,) direction of the motion, asked about only where bodies without
                depth touch at both ends.
            time: that it takes [s].

        Returns:
            Which share of its speed two bodies leave that come nearer, 0 where it has to stop, and
            the two; None if they leave all of it.
        """
        if after is None:
            return None
        least, worst = 1.0, -1
        for pair, distance in after.items():
            if distance >= SLOW:
                continue
            start = math.inf if before is None else before.get(pair, math.inf)
            if start == math.inf:
                # What was known to be far may have come straight.
                start = max(NEAR, distance + time * CLOSING)
            if not distance < start - _SAME and not self._presses(pair, start, distance, way):
                continue
            left = min(max((distance - CLEAR - _BETWEEN) / (SLOW - CLEAR - _BETWEEN), 0.0), 1.0)
            closing = max(start - distance, _SAME) / time
            share = math.sqrt(left) * CLOSING / closing
            if share < least:
                least, worst = share, pair
        if worst < 0:
            return None
        return least, JogCause(JogReason.COLLISION, after[worst], CLEAR, pair=self._pairs[worst])

    def _presses(
        self,
        pair: int,
        start: float,
        distance: float,
        way: tuple[Sequence[float], Sequence[float]],
    ) -> bool:
        """Return whether bodies that touch alike at both ends do not part farther on either."""
        if distance > TOUCHING or start > TOUCHING or abs(distance - start) > _SAME:
            return False
        position, rate = way
        greatest = max((abs(value) for value in rate), default=0.0)
        gain = _PROBE / greatest if greatest > 0.0 else 0.0
        ahead = [value + gain * each for value, each in zip(position, rate, strict=True)]
        return self._collision.clearances_of((pair,), np.array(ahead))[0] <= distance

    def unseen_way(self, distances: Distances, rate: Sequence[float]) -> float:
        """Return how far a motion can go before bodies beyond `SLOW` may meet and part again.

        To come from d to `CLEAR` and back to where they are seen apart, two bodies must move by
        twice d - `CLEAR` relative to each other, which sweep · |rate| bounds.

        Args:
            distances: of `look` where the motion is.
            rate: (n,) velocity by the parameter of the way [rad or m].
        """
        rates = np.abs(self._collision.model_rates(np.array(rate)))
        way = math.inf
        for pair, distance in distances.items():
            moved = float(self._collision.sweep[pair] @ rates)
            if moved > 0.0:
                way = min(way, _UNSEEN * 2.0 * (distance - CLEAR) / moved)
        return way

    def in_contact(self, distances: Distances | None) -> bool:
        """Return whether distances of `look` hold a pair nearer than a jog may stop."""
        return distances is not None and min(distances.values()) < CLEAR

    def nearest(self, position: Sequence[float]) -> JogCause | None:
        """Return the nearest two bodies as a cause; None where all are beyond `NEAR`."""
        found = self.look(position)
        if found is None:
            return None
        pair = min(found, key=found.__getitem__)
        return JogCause(JogReason.COLLISION, found[pair], CLEAR, pair=self._pairs[pair])

    def way_apart(self, position: Sequence[float]) -> list[float] | None:
        """Return the joint direction along which the near pairs part, greatest element ±1.

        The gradient of -Σ 1/d over the pairs below `SLOW`, so the nearest count most; by central
        differences. None where no joint changes their distances.
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
