"""Collision shapes as coal geometries: those of a robot's links, and those of a scene's objects.

Owns the translation, and is the only module that imports coal. Each geometry stands at the origin
of its own frame, as the shape does: centred, a cylinder or capsule along z. Lengths in m.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import coal
import numpy as np

from ..description.schema import BoxFacts as LinkBox
from ..description.schema import CapsuleFacts as LinkCapsule
from ..description.schema import Shape as LinkShape
from .mesh_file import read_mesh
from .scene import Box, Capsule, Cylinder, Mesh, Shape, Sphere


def link_geometry(shape: LinkShape) -> Any:
    """Return the geometry of a link's shape; where it is placed is no part of it."""
    if isinstance(shape, LinkBox):
        return coal.Box(*shape.size)
    if isinstance(shape, LinkCapsule):
        return coal.Capsule(shape.radius, shape.length)
    return coal.Sphere(shape.radius)


def object_geometry(shape: Shape) -> Any:
    """Return the geometry of an object's shape.

    Raises:
        MeshFileError: a mesh cannot be read.
    """
    match shape:
        case Box(size):
            return coal.Box(*size)
        case Sphere(radius):
            return coal.Sphere(radius)
        case Cylinder(radius, length):
            return coal.Cylinder(radius, length)
        case Capsule(radius, length):
            return coal.Capsule(radius, length)
        case Mesh(file, scale):
            return _surface(file, scale)


def _surface(file: str, scale: Sequence[float]) -> Any:
    """Return the triangles of a mesh file as a hierarchy of oriented boxes; it has no inside."""
    vertices, corners = read_mesh(file)
    surface = coal.BVHModelOBBRSS()
    surface.beginModel(len(corners), len(vertices))
    surface.addVertices(vertices * np.array(scale))
    surface.addTriangles(corners)
    surface.endModel()
    return surface
