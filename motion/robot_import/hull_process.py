"""The convex hull of points, in a process of its own: what a library makes of bad points ends this.

    python -m openpendant.motion.robot_import.hull_process < points > faces

`ConvexHull` of scipy raises where points are flat, in a line, coincident or not finite, while
`Convex.convexHull` of coal 3.0.3 ends the whole process. In a process of its own either is a
remark of the import. Owns both ends of the pipe: 8-byte little-endian reals x, y, z go in; out come
4-byte numbers of the corners of each face, seen from outside counter-clockwise, or one line that
says why there is no hull.
"""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np

from ..pose import Array
from ..scene.hull_file import MAX_HULL_POINTS
from ..scene.mesh_file import Indices, Triangles

LONGEST = 120.0
"""Longest that a hull may take [s]: one of 500,000 points on a ball takes 12."""

_NO_HULL = 3
"""Exit code where the points have no hull."""


class NoHull(Exception):
    """Points have no convex hull, or it was not found; the text says why."""


def hull_of(points: Array) -> Triangles:
    """Return the convex hull of (k, 3) points, its own points first to last as they were given.

    Raises:
        NoHull: they have none, or it was not found.
    """
    command = [sys.executable, "-m", "openpendant.motion.robot_import.hull_process"]
    try:
        ended = subprocess.run(
            command,
            input=points.astype("<f8").tobytes(),
            capture_output=True,
            timeout=LONGEST,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        )
    except subprocess.TimeoutExpired:
        raise NoHull(f"it was not found in {LONGEST:g} s") from None
    except OSError as error:
        raise NoHull(f"the process for it did not start: {error.strerror}") from None
    if ended.returncode == _NO_HULL:
        raise NoHull(ended.stdout.decode(errors="replace").strip())
    if ended.returncode != 0:
        raise NoHull(f"the process for it ended with code {ended.returncode}")
    faces = np.frombuffer(ended.stdout, "<i4").reshape(-1, 3).astype(np.int64)
    used, corners = np.unique(faces, return_inverse=True)
    return Triangles(points[used], corners.reshape(-1, 3))


def faces_of(points: Array) -> Indices:
    """Return the (f, 3) faces of the hull of (k, 3) points, seen from outside counter-clockwise.

    Raises:
        ValueError: the points have none.
    """
    try:
        from scipy.spatial import ConvexHull, QhullError
    except ImportError:
        raise ValueError("scipy is not installed") from None
    try:
        hull = ConvexHull(points)
    except QhullError:
        # Its text is a page about the library.
        raise ValueError("the points are flat, in a line or coincident") from None
    if len(hull.vertices) > MAX_HULL_POINTS:
        raise ValueError(f"it has {len(hull.vertices)} points; accepted: {MAX_HULL_POINTS}")
    faces: Indices = hull.simplices.astype(np.int64)
    first, second, third = (points[faces[:, corner]] for corner in range(3))
    along = np.einsum("ij,ij->i", np.cross(second - first, third - first), hull.equations[:, :3])
    faces[along < 0.0] = faces[along < 0.0][:, [0, 2, 1]]
    return faces


def _main() -> int:
    points = np.frombuffer(sys.stdin.buffer.read(), "<f8").reshape(-1, 3)
    try:
        faces = faces_of(points)
    except ValueError as error:
        sys.stdout.write(str(error))
        return _NO_HULL
    sys.stdout.buffer.write(faces.astype("<i4").tobytes())
    return 0


if __name__ == "__main__":
    raise SystemExit(_main())
