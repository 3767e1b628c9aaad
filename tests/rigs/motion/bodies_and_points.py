"""Distances from a point to a body by formulas of its own, and random bodies.

Independent of the product and of its collision library: a box, ball, cylinder and capsule by the
clamping of coordinates, a triangle by its regions (Ericson, Real-Time Collision Detection, 5.1.5).
"""

import math

import numpy as np
from numpy.typing import NDArray

from openpendant.motion.scene.scene import Box, Capsule, Cylinder, Shape, Sphere

Vector = NDArray[np.float64]


def distance_to(shape: Shape, point: Vector) -> float:
    """Return how far a point in the frame of a solid is from it [m]; 0 inside."""
    x, y, z = point.tolist()
    match shape:
        case Box((a, b, c)):
            return math.hypot(
                max(abs(x) - a / 2, 0), max(abs(y) - b / 2, 0), max(abs(z) - c / 2, 0)
            )
        case Sphere(radius):
            return max(math.hypot(x, y, z) - radius, 0.0)
        case Cylinder(radius, length):
            return math.hypot(max(math.hypot(x, y) - radius, 0), max(abs(z) - length / 2, 0))
        case Capsule(radius, length):
            return max(math.hypot(x, y, max(abs(z) - length / 2, 0)) - radius, 0.0)
    raise AssertionError(shape)


def to_triangle(p: Vector, a: Vector, b: Vector, c: Vector) -> float:
    """Return how far a point is from a triangle [m]."""
    ab, ac, bc = b - a, c - a, c - b
    normal = np.cross(ab, ac)
    edges = min(to_edge(p, a, ab), to_edge(p, a, ac), to_edge(p, b, bc))
    inside = all(
        np.dot(np.cross(edge, p - start), normal) >= 0
        for start, edge in ((a, ab), (b, bc), (c, -ac))
    )
    if not inside:
        return edges
    return min(edges, abs(float(np.dot(p - a, normal))) / float(np.linalg.norm(normal)))


def to_edge(p: Vector, start: Vector, edge: Vector) -> float:
    along = float(np.clip(np.dot(p - start, edge) / np.dot(edge, edge), 0.0, 1.0))
    return float(np.linalg.norm(p - start - along * edge))


def any_solid(random: np.random.Generator) -> Shape:
    """Return a box, ball, cylinder or capsule of 2 mm to 0.2 m."""
    a, b, c = (0.002 * 100 ** random.uniform(0, 1, 3)).tolist()
    shapes: list[Shape] = [Box((a, b, c)), Sphere(a), Cylinder(a, b), Capsule(a, b)]
    return shapes[random.integers(4)]


def any_turn(random: np.random.Generator) -> tuple[float, float, float, float]:
    """Return a quaternion, all orientations alike."""
    x, y, z, w = random.normal(size=4).tolist()
    norm = math.hypot(x, y, z, w)
    return x / norm, y / norm, z / norm, w / norm
