"""Path check: collisions on a path, and the quicker check of straight edges for searches.

Owns the check between positions. It samples a path every milliradian, but computes distances only
where it must: where the nearest bodies of every pair are farther apart than the joints could bring
them together up to some sample, nothing can touch before it (conservative advancement: B. Mirtich,
*Impulse-based dynamic simulation of rigid body systems*, 1996). Every sample is checked only where
bodies are nearer than that. So the check is finer than its nominal resolution where that matters,
and usually faster.

Owns also which positions of a straight edge in joint space are checked, and in what order. The
check of an edge may miss a contact between them; that of a path may not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..errors import PathInCollision
from ..pose import Array
from ..scene.collision import TOUCHING, CollisionModel
from ..trajectory.joint_curves import Path, check_extent

RESOLUTION = 1e-3
"""Greatest travel of a joint from one sample to the next [rad or m]."""

_WINDOW = 512
"""Greatest number of samples that one check can clear."""

_MOST_AT_ONCE = 8_000_000
"""Numbers in the table of a part of a path, a row a sample and a column a pair: 64 MB. A thousand
far waypoints among 2,000 pairs would need one of 25 GB."""


@dataclass(frozen=True, slots=True, eq=False)
class PathContact:
    """First place of a path where two bodies touch.

    Attributes:
        fraction: of the path's length, 0 to 1.
        joint_position: (n,) there [rad or m].
        distance: between them [m], negative by their overlap.
    """

    fraction: float
    joint_position: Array
    first: str
    second: str
    distance: float


def first_contact(
    collision: CollisionModel,
    path: Path | Sequence[Sequence[float] | Array] | Array,
    *,
    margin: float = TOUCHING,
    resolution: float = RESOLUTION,
) -> PathContact | None:
    """Return the first place of a path where two bodies touch; None if none do.

    Args:
        path: a path, or (w, n) waypoints joined by straight lines in joint space.
        resolution: greatest travel of a joint between samples [rad or m].

    Raises:
        WrongJointCount: the path or a waypoint is of another robot.
        NotFinite: a waypoint holds an infinity or a NaN.
        OutOfRange: the path leaves a joint's range.
    """
    fractions, positions = _sampled(collision, path, resolution)
    if not collision.pairs:
        return None
    begin = 0
    while begin < len(positions):
        end = begin + max(_MOST_AT_ONCE // len(collision.pairs), 2 * _WINDOW)
        found = _contact_in(collision, positions[begin:end], margin)
        if found is not None:
            sample, spare = begin + found[0], found[1]
            nearest = int(np.argmin(spare))
            return PathContact(
                float(fractions[sample]),
                positions[sample],
                *collision.pairs[nearest],
                float(spare[nearest] + margin),
            )
        begin = end
    return None


def _contact_in(
    collision: CollisionModel, positions: Array, margin: float
) -> tuple[int, Array] | None:
    """Return the first of (m, n) samples at which two bodies touch, and the spare of each pair."""
    travel = np.abs(np.diff(collision.model_positions(positions), axis=0))
    # Row k: greatest relative motion of each pair's bodies up to sample k.
    moved = np.vstack((np.zeros(len(collision.pairs)), np.cumsum(travel @ collision.sweep.T, 0)))
    sample = 0
    while sample < len(positions):
        spare = collision.clearances(positions[sample]) - margin
        if spare.min() <= 0.0:
            return sample, spare
        ahead = moved[sample + 1 : sample + 1 + _WINDOW]
        free = (ahead < moved[sample] + spare).all(axis=1)
        cleared = len(free) if free.all() else int(np.argmin(free))
        # Cleared samples need no check; the last of them is checked, to continue from there.
        sample += max(cleared, 1)
    return None


def check_path(
    collision: CollisionModel, path: Path | Sequence[Sequence[float] | Array] | Array
) -> None:
    """Refuse a path on which two bodies touch.

    Args:
        path: a path, or (w, n) waypoints joined by straight lines in joint space [rad or m].

    Raises:
        PathInCollision: with the bodies and the fraction of the path.
        MotionError: the path itself, as of `first_contact`.
    """
    contact = first_contact(collision, path)
    if contact is not None:
        raise PathInCollision(contact.first, contact.second, contact.distance, contact.fraction)


def _sampled(
    collision: CollisionModel,
    path: Path | Sequence[Sequence[float] | Array] | Array,
    resolution: float,
) -> tuple[Array, Array]:
    """Return fractions (m,) and positions (m, n) at most `resolution` apart in every joint."""
    limits = collision.kinematics.limits
    if isinstance(path, Sequence | np.ndarray):
        for waypoint in path:
            limits.check_position([float(value) for value in waypoint])
        return _along_lines(np.array(path, dtype=np.float64), resolution)
    check_extent(path, limits)
    knots = path.knots
    count = 1
    while True:
        s = _subdivided(knots, np.ceil(np.diff(knots) / resolution).astype(int) * count)
        positions = path.evaluate(s)
        step = float(np.abs(np.diff(positions, axis=0)).max())
        if step <= resolution:
            return s / path.length, positions
        count = int(np.ceil(count * step / resolution * 1.01))


def _along_lines(points: Array, resolution: float) -> tuple[Array, Array]:
    spans = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    kept = np.concatenate(([True], spans > 0.0))
    points = points[kept]
    knots = np.concatenate(([0.0], np.cumsum(spans[spans > 0.0])))
    if len(points) == 1:
        return knots, points
    steps = np.ceil(np.abs(np.diff(points, axis=0)).max(axis=1) / resolution).astype(int)
    s = _subdivided(knots, steps)
    positions = np.column_stack([np.interp(s, knots, column) for column in points.T])
    return s / knots[-1], positions


def _subdivided(knots: Array, steps: Array) -> Array:
    """Return the knots and places between them that divide each distance into equal steps."""
    pieces = [
        start + (end - start) * np.arange(count) / count
        for start, end, count in zip(knots[:-1], knots[1:], steps.tolist(), strict=True)
    ]
    return np.concatenate((*pieces, knots[-1:]))


class EdgeChecker:
    """Check of positions and straight edges, at one resolution and with one margin."""

    def __init__(self, collision: CollisionModel, resolution: float, margin: float) -> None:
        self.resolution = resolution
        self._collision = collision
        self._margin = margin

    def position_free(self, position: Array) -> bool:
        """Return True if nothing touches at a (n,) controller-side position [rad or m]."""
        return not self._collision.any_collides(position[np.newaxis], self._margin)

    def free(self, start: Array, end: Array) -> bool:
        """Return True if nothing touches on a line between (n,) positions, the start being free."""
        gap = end - start
        count = max(1, math.ceil(float(np.abs(gap).max()) / self.resolution))
        return not self._collision.any_collides(start + _fractions(count) * gap, self._margin)


@lru_cache(maxsize=512)
def _fractions(count: int) -> Array:
    """Return (count, 1) the fractions 1/count to 1, each far from those before: contacts show soon.

    The order is van der Corput's: that of the numbers whose binary digits are read backwards.
    """
    digits = max(1, (count - 1).bit_length())
    places = [int(f"{number:0{digits}b}"[::-1], 2) for number in range(1 << digits)]
    order = count - np.array([place for place in places if place < count])
    fractions: Array = (order / count)[:, np.newaxis]
    fractions.flags.writeable = False
    return fractions
