"""Pairs of links that a new robot's collision checks leave out, and a home where nothing touches.

Owns the rules of the schema's `allowed_collisions`: neighbours; pairs further apart whose bounding
shapes overlap so often that they would only ever cry wolf; and, as a last resort, what touches at
home. The sampling is by the collision model that planning uses too.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..pose import Array
from ..robot import SerialRobot
from ..robot_schema import AllowedReason

if TYPE_CHECKING:
    from ..collision import CollisionModel

Pairs = tuple[tuple[str, str, AllowedReason], ...]

OVERLAP_SHARE = 0.27
"""A pair with one link between that touches at least this often is bounded too coarsely there."""
ALWAYS_SHARE = 0.95
"""A pair any number of links apart that touches this often."""

_SAMPLES = 300
_HOME_TRIALS = 300


def neighbours(links: Sequence[str], shaped: Sequence[str]) -> Pairs:
    """Return each two successive links that have shapes; `links` are root to tip."""
    with_shapes = [link for link in links if link in shaped]
    return tuple((first, second, AllowedReason.ADJACENT) for first, second in pairwise(with_shapes))


def overlapping(robot: SerialRobot) -> Pairs:
    """Return pairs that touch in too many random positions for the touch to mean anything."""
    model = _collision_model(robot)
    random = np.random.default_rng(0)
    counts: Counter[tuple[str, str]] = Counter()
    for position in random.uniform(robot.limits.lower, robot.limits.upper, (_SAMPLES, robot.dof)):
        counts.update(_contacts(model, position))
    shaped = [link for link in robot.links if link in robot.collision]
    found = []
    for (first, second), count in sorted(counts.items()):
        apart = abs(shaped.index(first) - shaped.index(second))
        if count >= (OVERLAP_SHARE if apart <= 2 else ALWAYS_SHARE) * _SAMPLES:
            found.append((first, second, AllowedReason.OVERLAP))
    return tuple(found)


def touching(robot: SerialRobot, position: Sequence[float]) -> tuple[tuple[str, str], ...]:
    """Return the pairs of links that touch at a controller-side joint position."""
    return tuple(sorted(_contacts(_collision_model(robot), np.array(position))))


def free_home(robot: SerialRobot) -> Array | None:
    """Return the position nearest to the robot's home, of random ones, where nothing touches.

    Returns:
        (n,) controller-side [rad or m], or None if all of them touch.
    """
    model = _collision_model(robot)
    random = np.random.default_rng(0)
    lower, upper = np.array(robot.limits.lower), np.array(robot.limits.upper)
    trials = random.uniform(lower, upper, (_HOME_TRIALS, robot.dof))
    effort = np.abs((trials - np.array(robot.home_position)) / (upper - lower)).sum(axis=1)
    for index in np.argsort(effort):
        position: Array = np.round(trials[index], 2)
        if (lower <= position).all() and (position <= upper).all() and not model.collides(position):
            return position
    return None


def _contacts(model: CollisionModel, position: Array) -> set[tuple[str, str]]:
    clearances = model.clearances(position).tolist()
    return {pair for pair, free in zip(model.pairs, clearances, strict=True) if free <= 0.0}


def _collision_model(robot: SerialRobot) -> CollisionModel:
    # Imported here, since a robot without shapes needs no pinocchio to be imported.
    from ..collision import CollisionModel
    from ..kinematics import Kinematics

    return CollisionModel(Kinematics(robot))
