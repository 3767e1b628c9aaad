"""Shapes of bodies in a scene, as plain data about their own frame [m].

Owns the shapes and which sizes are accepted. Knows no pose and no file's content.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

from ..errors import BadArgument, NotFinite

LEAST_SIZE = 1e-6
"""Smallest edge, radius or scale of a shape [m]."""
GREATEST_SIZE = 1e3
"""Largest edge, radius, length or coordinate [m]."""

Vector: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Box:
    """Cuboid about its centre; `size` holds the full edge lengths [m]."""

    size: Vector

    def __post_init__(self) -> None:
        if len(self.size) != 3:
            raise BadArgument("size of a box", self.size, "three lengths")
        for value in self.size:
            _check_size("size of a box", value)


@dataclass(frozen=True, slots=True)
class Sphere:
    """Ball about its centre; `radius` [m]."""

    radius: float

    def __post_init__(self) -> None:
        _check_size("radius of a sphere", self.radius)


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Cylinder along local z about its centre; `radius` and full `length` [m]."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        _check_size("radius of a cylinder", self.radius)
        _check_size("length of a cylinder", self.length)


@dataclass(frozen=True, slots=True)
class Capsule:
    """Cylinder along local z with round caps; `length` is the straight part [m]."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        _check_size("radius of a capsule", self.radius)
        _check_size("length of a capsule", self.length)


@dataclass(frozen=True, slots=True)
class Mesh:
    """Surface of triangles in an STL or OBJ file; it has no inside.

    Attributes:
        file: path of the file.
        scale: factor to metres along each axis; 0.001 for a file in millimetres.
    """

    file: str
    scale: Vector = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        if not self.file:
            raise BadArgument("file of a mesh", self.file, "the path of an STL or OBJ file")
        if len(self.scale) != 3:
            raise BadArgument("scale of a mesh", self.scale, "three factors")
        for value in self.scale:
            _check_size("scale of a mesh", value)


Shape: TypeAlias = Box | Sphere | Cylinder | Capsule | Mesh


def _check_size(what: str, value: float) -> None:
    if not math.isfinite(value):
        raise NotFinite(what, 0)
    if not LEAST_SIZE <= value <= GREATEST_SIZE:
        raise BadArgument(what, value, f"{LEAST_SIZE:g} to {GREATEST_SIZE:g}")
