"""Hull files: the convex hull of a mesh as points and faces, made once and named by its SHA-256.

Owns the form of such a file (OBJ, so that any viewer shows it), and what is checked before coal is
given a hull: it does not check one itself, and reads memory that is not there where neighbours are
missing. A file is a hull if it is a closed surface of triangles like a ball's, with every edge
convex and a volume inside; of a hull that somebody changed the name is another.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..bounded_file import read_bounded
from ..errors import MeshFileError
from ..pose import Array
from .mesh_file import Indices, Triangles, triangles_of

MAX_HULL_POINTS = 16_384
"""Most points of a hull: a motion is checked against each of a robot's links again and again."""

MAX_HULL_BYTES = 4 << 20
"""Most bytes of a file with one: of so many points it has at most 2 MiB."""

_FLATNESS = 1e-6
"""How far a face's neighbour may stand out, of the extent of the hull: reals are rounded."""

_LEAST_VOLUME = 1e-15
"""Least volume [m³]: a plate of 0.1 mm by 3 mm by 3 mm has this a million times."""


def hull_text(hull: Triangles) -> bytes:
    """Return the content of a file with a hull; reals keep every bit."""
    points = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in hull.vertices.tolist()]
    faces = [f"f {a} {b} {c}\n" for a, b, c in (hull.corners + 1).tolist()]
    return "".join((*points, *faces)).encode()


def hull_name(content: bytes) -> str:
    """Return the name of a hull, the SHA-256 of its file."""
    return hashlib.sha256(content).hexdigest()


@lru_cache(maxsize=64)
def read_hull(path: Path) -> Triangles:
    """Return the hull in a file that is named by its SHA-256, (p, 3) points [m] and (f, 3) faces.

    It is read once in each process, and its arrays are read-only.

    Raises:
        MeshFileError: the file cannot be read, is not the one of its name, or holds no hull.
    """
    content = read_bounded(path, MAX_HULL_BYTES, MeshFileError)
    if hull_name(content) != path.stem:
        problem = "is not the hull that was made at the import; import the robot again"
        raise MeshFileError(str(path), "", problem)
    hull = triangles_of(str(path), content)
    fault = hull_fault(hull)
    if fault is not None:
        raise MeshFileError(str(path), "", fault)
    hull.vertices.flags.writeable = hull.corners.flags.writeable = False
    return hull


def hull_fault(hull: Triangles) -> str | None:
    """Return why triangles are no convex hull that coal may be given; None where they are one."""
    points, faces = hull
    if not 4 <= len(points) <= MAX_HULL_POINTS:
        return f"has {len(points)} points; accepted: 4 to {MAX_HULL_POINTS} of a convex hull"
    if len(np.unique(faces)) != len(points):
        return "is no convex hull: a point is on no face"
    opposite = _opposite(faces, len(points))
    if opposite is None or len(points) - len(faces) // 2 != 2:
        return "is no convex hull: its faces do not close like those of a ball"
    first, second, third = (points[faces[:, corner]] for corner in range(3))
    normals = np.cross(second - first, third - first)
    if not float(np.einsum("ij,ij->", first - points[0], normals)) / 6.0 >= _LEAST_VOLUME:
        return "is no convex hull: it has no volume, or its faces look inwards"
    extent = float(np.ptp(points, axis=0).max())
    lengths = np.linalg.norm(normals, axis=1)
    for neighbours in opposite.T:
        outside = np.einsum("ij,ij->i", points[neighbours] - first, normals)
        if bool((outside > _FLATNESS * extent * lengths).any()):
            return "is no convex hull: it has an edge that is not convex"
    return None


def _opposite(faces: Indices, points: int) -> Indices | None:
    """Return for each edge of each face the far corner of its neighbour, (f, 3).

    Returns:
        None where an edge has not exactly two faces, which run along it in opposite directions.
    """
    begins, ends, far = faces.ravel(), faces[:, [1, 2, 0]].ravel(), faces[:, [2, 0, 1]].ravel()
    edges, reversed_edges = begins * points + ends, ends * points + begins
    order, other = np.argsort(edges), np.argsort(reversed_edges)
    is_paired = np.array_equal(edges[order], reversed_edges[other])
    if not is_paired or len(np.unique(edges)) != len(edges):
        return None
    found = np.empty_like(far)
    found[order] = far[other]
    return found.reshape(-1, 3)


def box_frame(points: Array) -> tuple[Array, Array, Array]:
    """Return axes (3, 3), centre (3,) and edges (3,) of the smaller of two boxes around points.

    One lies along the axes of their frame, the other along their principal axes.
    """
    centred = points - points.mean(axis=0)
    _, principal = np.linalg.eigh(centred.T @ centred)
    if np.linalg.det(principal) < 0.0:
        principal[:, 0] = -principal[:, 0]
    boxes = []
    for axes in (np.eye(3), principal):
        along = points @ axes
        lowest, highest = along.min(axis=0), along.max(axis=0)
        boxes.append((axes, axes @ ((lowest + highest) / 2.0), highest - lowest))
    return min(boxes, key=lambda box: float(np.prod(box[2])))
