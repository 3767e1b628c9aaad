"""The smallest simple shape around a mesh.

Owns the choice between a box along the mesh's own axes and one along its principal axes. Faces are
not needed: a convex shape around all vertices is around all faces.
"""

from __future__ import annotations

import math

import numpy as np

from ..pose import Array
from ..robot_schema import Box
from .placements import to_placement

_THINNEST = 1e-4  # m: a flat mesh still gets a box


def bounding_box(vertices: Array) -> Box:
    """Return a box around (k, 3) vertices [m], placed in their frame.

    It lies along the frame's axes, or along the principal axes of the vertices if it is smaller so.
    """
    centred = vertices - vertices.mean(axis=0)
    _, principal = np.linalg.eigh(centred.T @ centred)
    if np.linalg.det(principal) < 0.0:
        principal[:, 0] = -principal[:, 0]
    boxes = [_box_along(axes, vertices) for axes in (np.eye(3), principal)]
    return min(boxes, key=lambda box: math.prod(box.size))


def _box_along(axes: Array, vertices: Array) -> Box:
    along = vertices @ axes
    lowest, highest = along.min(axis=0), along.max(axis=0)
    placement = np.eye(4)
    placement[:3, :3] = axes
    placement[:3, 3] = axes @ ((lowest + highest) / 2.0)
    x, y, z = (max(float(edge), _THINNEST) for edge in highest - lowest)
    where = to_placement(placement)
    return Box(type="box", size=(x, y, z), xyz=where.xyz, rpy=where.rpy)
