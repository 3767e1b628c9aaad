"""Boxes around a link's collision shapes, and the few questions that drawing a robot asks of them.

Owns their geometry: where a line cuts a box, how wide it is across a line, how far a point is away.
All in the link's frame, in metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from .pose import Array, Pose
from .robot_schema import Box, Capsule, Shape

_PARALLEL = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class LinkBox:
    """A box: full extents along its own axes [m], and its (3, 3) axes and (3,) centre."""

    size: tuple[float, float, float]
    rotation: Array
    centre: Array

    def corners(self) -> Array:
        """Return the (8, 3) corners."""
        signs = np.array(list(product((-0.5, 0.5), repeat=3)))
        corners: Array = self.centre + (signs * np.array(self.size)) @ self.rotation.T
        return corners

    def distance(self, point: Array) -> float:
        """Return how far a (3,) point [m] is outside [m]; 0 inside."""
        local = np.abs(self.rotation.T @ (point - self.centre)) - np.array(self.size) / 2.0
        return float(np.linalg.norm(np.maximum(local, 0.0)))

    def width_across(self, direction: Array) -> float:
        """Return the lesser of its extents along its two axes that are most across a direction.

        Args:
            direction: (3,) of any length, in the frame that the box is in.

        Returns:
            The extent [m].
        """
        along = np.abs(self.rotation.T @ direction)
        return min(self.size[axis] for axis in np.argsort(along)[:2])


def box_of(shape: Shape) -> LinkBox:
    """Return the box around a collision shape."""
    pose = Pose.from_rpy(shape.xyz, shape.rpy)
    if isinstance(shape, Box):
        return LinkBox(shape.size, pose.rotation, pose.position)
    width = 2.0 * shape.radius
    length = width + shape.length if isinstance(shape, Capsule) else width
    return LinkBox((width, width, length), pose.rotation, pose.position)


def chord(box: LinkBox, point: Array, direction: Array) -> tuple[float, float] | None:
    """Return where the line through a (3,) point enters and leaves a box; None if it does not.

    Args:
        box: the box.
        point: a point on the line.
        direction: (3,) unit vector.

    Returns:
        Distances from `point` along `direction` [m].
    """
    # The slab method: the line is inside where it is between all three pairs of faces.
    start, way = box.rotation.T @ (point - box.centre), box.rotation.T @ direction
    enters, leaves = -np.inf, np.inf
    for position, speed, extent in zip(start, way, box.size, strict=True):
        if abs(speed) < _PARALLEL:
            if abs(position) > extent / 2.0:
                return None
            continue
        near, far = sorted(((side * extent / 2.0) - position) / speed for side in (-1.0, 1.0))
        enters, leaves = max(enters, near), min(leaves, far)
    return (float(enters), float(leaves)) if enters < leaves else None
