"""Checked pairs of a collision model's bodies, and a bound of how fast each pair approaches.

Owns the rule that `collision` describes, and the bound of how far two bodies can move relative to
each other. Computed for all pairs at once, because the server's event loop waits for it when a
scene changes. Knows bodies by numbers only, and no collision library. Lengths in m.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..pose import Array


@dataclass(frozen=True, slots=True)
class CollisionBody:
    """Shape on the model.

    Attributes:
        name: of the link or the object; a link may have several shapes.
        joint: moving joint of the model that carries it, counted from 1; 0 for none.
        is_link: True if it is a shape of the robot.
        is_held: True if a link holds it.
    """

    name: str
    joint: int
    is_link: bool
    is_held: bool


def checked_pairs(
    bodies: Sequence[CollisionBody], allowed: Iterable[Sequence[str]], wrist: Sequence[int]
) -> NDArray[np.bool_]:
    """Return which pairs of bodies are checked: (b, b), true above the diagonal only.

    Args:
        bodies: the shapes.
        allowed: pairs of names that are not checked against one another.
        wrist: first and last joint of the wrist, whose links are not; empty for none.
    """
    joint = np.array([body.joint for body in bodies], dtype=np.intp)
    is_link = np.array([body.is_link for body in bodies], dtype=bool)
    stands = (joint == 0) & ~np.array([body.is_held for body in bodies], dtype=bool)
    numbers: dict[str, int] = {}
    name = np.array([numbers.setdefault(body.name, len(numbers)) for body in bodies], dtype=np.intp)
    # Pairs that need no check, first among links, then among objects, then among all.
    unchecked = np.abs(joint[:, np.newaxis] - joint) <= 1
    if wrist:
        first, last = joint == wrist[0], joint == wrist[1]
        unchecked |= (first[:, np.newaxis] & last) | (last[:, np.newaxis] & first)
    unchecked &= is_link[:, np.newaxis] & is_link
    unchecked |= (joint[:, np.newaxis] == joint) & ~(is_link[:, np.newaxis] | is_link)
    unchecked |= stands[:, np.newaxis] & stands
    unchecked |= name[:, np.newaxis] == name
    unchecked |= _allowed(numbers, allowed)[name[:, np.newaxis], name]
    return np.triu(~unchecked, 1)


def _allowed(numbers: dict[str, int], allowed: Iterable[Sequence[str]]) -> NDArray[np.bool_]:
    """Return which names, by their numbers, may touch."""
    found = np.zeros((len(numbers), len(numbers)), dtype=bool)
    for first, second, *_ in allowed:
        # A link without a shape has no number.
        if first in numbers and second in numbers:
            row, column = numbers[first], numbers[second]
            found[row, column] = found[column, row] = True
    return found


def sweep_of(
    joint: NDArray[np.intp],
    reach: Array,
    lengths: Sequence[float],
    travel: Sequence[float],
    prismatic: Sequence[bool],
) -> Array:
    """Return how far the bodies of each pair can move relative to each other: (p, j).

    Per unit of travel of each moving joint [m/rad or m/m], over all positions. A revolute joint
    moves a point on the farther body by at most its distance to the axis. Links being rigid, that
    is at most the lengths of the links between and the body's own radius.

    Args:
        joint: (p, 2) number of the moving joint that carries each body of a pair, 0 for none.
        reach: (p, 2) radius of a ball about the origin of that joint that holds the body [m].
        lengths: (j,) distance of each moving joint from the one before it [m].
        travel: (j,) greatest distance of each moving joint from its zero [rad or m].
        prismatic: (j,) True if it slides.
    """
    near, far = joint.min(axis=1), joint.max(axis=1)
    lever = np.where(joint[:, 1] >= joint[:, 0], reach[:, 1], reach[:, 0])
    sweep = np.zeros((len(joint), len(lengths)))
    for index in range(len(lengths) - 1, -1, -1):
        between = (near <= index) & (index < far)
        sweep[between, index] = 1.0 if prismatic[index] else lever[between]
        lever[between] += lengths[index]
        if prismatic[index]:
            lever[between] += travel[index]
    return sweep
