"""How near bodies come along a jog: slow from 20 mm, still 5 mm apart at rest.

Owns those distances, and which pairs count: only those that come nearer. So a pair that touches
never holds a motion that takes it apart, and a pair that stays 8 mm apart slows nobody. Both jogs
ask about the place where they could next stand still, so what is in between was asked about before.

A look costs tens of microseconds to a millisecond. In between, the bound of `CollisionModel.sweep`
does: a pair was d apart and the joints have moved by Δ, so it is at least d - sweep · |Δ| apart.
While that leaves every pair beyond 40 mm, nothing is computed.
"""

from __future__ import annotations

from collections.abc import Sequence

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

_BETWEEN = 0.001  # m, that a distance may dip between two places that were looked at
_PROBE = 0.1  # rad or m: how far ahead it is looked for a way out of a contact without depth
_SAME = 1e-12  # m
_STEP = 1e-3  # rad or m, of differences
_TOUCH = 1e-3  # m: nearer pairs count alike


class CollisionGuard:
    """Watches one robot in one scene."""

    def __init__(self, collision: CollisionModel) -> None:
        self._collision = collision
        self._pairs = collision.pairs
        self._seen: Array | None = None
        self._seen_at: Array | None = None

    def look(self, position: Sequence[float]) -> Array | None:
        """Return the (p,) distances of the pairs [m]; None where all are known to be far."""
        if not self._pairs:
            return None
        place = np.array(position)
        joints = self._collision.model_positions(place)
        if self._seen is not None and self._seen_at is not None:
            least = self._seen - self._collision.sweep @ np.abs(joints - self._seen_at)
            if least.min() > NEAR:
                return None
        distances = self._collision.clearances(place)
        self._seen, self._seen_at = distances, joints
        return distances if distances.min() <= NEAR else None

    def nearing(
        self, before: Array | None, after: Array | None, ahead: Sequence[float], time: float
    ) -> tuple[float, JogCause] | None:
        """Judge a motion by the distances at its start and at its end.

        Args:
            before: of `look` at the start.
            after: of `look` at the end.
            ahead: (n,) a place farther on the same way, asked about only where bodies without
                depth touch at both ends.
            time: that it takes [s].

        Returns:
            Which share of its speed two bodies leave that come nearer, 0 where it has to stop, and
            the two; None if they leave all of it.
        """
        if after is None:
            return None
        # What was known to be far may have come straight.
        start = after + time * CLOSING if before is None else before
        closer = after < start - _SAME
        stuck = (after <= TOUCHING) & (start <= TOUCHING) & (np.abs(after - start) <= _SAME)
        if stuck.any():
            there = self._collision.clearances(np.array(ahead))
            closer |= stuck & (there <= after)
        candidates = np.flatnonzero(closer & (after < SLOW))
        if not len(candidates):
            return None
        left = (after[candidates] - CLEAR - _BETWEEN) / (SLOW - CLEAR - _BETWEEN)
        closing = np.maximum(start[candidates] - after[candidates], _SAME) / time
        shares = np.sqrt(np.clip(left, 0.0, 1.0)) * CLOSING / closing
        worst = int(np.argmin(shares))
        if shares[worst] >= 1.0:
            return None
        pair = int(candidates[worst])
        cause = JogCause(JogReason.COLLISION, float(after[pair]), CLEAR, pair=self._pairs[pair])
        return float(shares[worst]), cause

    def ahead(self, position: Sequence[float], rate: Sequence[float]) -> list[float]:
        """Return a place a tenth of a radian or of a metre along a joint direction."""
        greatest = max((abs(value) for value in rate), default=0.0)
        gain = _PROBE / greatest if greatest > 0.0 else 0.0
        return [value + gain * each for value, each in zip(position, rate, strict=True)]

    def in_contact(self, distances: Array | None) -> bool:
        """Return whether distances of `look` hold a pair nearer than a jog may stop."""
        return distances is not None and float(distances.min()) < CLEAR

    def way_apart(self, position: Sequence[float]) -> list[float] | None:
        """Return the joint direction along which the near pairs part, greatest element ±1.

        The gradient of -Σ 1/d over the pairs below `SLOW`, so the nearest count most; by central
        differences. None where no joint changes their distances.
        """
        place = np.array(position, dtype=np.float64)
        here = self._collision.clearances(place)
        near = here < SLOW
        weights = 1.0 / np.maximum(here[near], _TOUCH) ** 2
        gradient = np.zeros(len(place))
        for joint in range(len(place)):
            for sign in (1.0, -1.0):
                moved = place.copy()
                moved[joint] += sign * _STEP
                gradient[joint] += sign * float(weights @ self._collision.clearances(moved)[near])
        greatest = float(np.abs(gradient).max())
        if greatest <= _SAME:
            return None
        way: list[float] = (gradient / greatest).tolist()
        return way
