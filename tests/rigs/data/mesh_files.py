"""Mesh files for tests: sound ones as they are imported, and a robot that is shown by them."""

import hashlib
import struct
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

import numpy as np
from rigs.data.urdf_files import FIRST, SECOND, THIRD, written

from openpendant.motion.description.schema import MESH_FOLDER
from openpendant.motion.pose import Array

_FACES = ((0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7), (0, 1, 5), (0, 5, 4), (1, 2, 6), (1, 6, 5))
CUBE_FACES = (*_FACES, (2, 3, 7), (2, 7, 6), (3, 0, 4), (3, 4, 7))
"""Of the corners as `cube` has them, seen from outside counter-clockwise."""


def cube(size: Sequence[float] = (0.1, 0.1, 0.1)) -> Array:
    """Return the (8, 3) corners of a cuboid about the origin."""
    corners = [
        (0, 0, 0),
        (1, 0, 0),
        (1, 1, 0),
        (0, 1, 0),
        (0, 0, 1),
        (1, 0, 1),
        (1, 1, 1),
        (0, 1, 1),
    ]
    points: Array = (np.array(corners) - 0.5) * np.array(size)
    return points


def stl(points: Array, faces: Sequence[Sequence[int]] = CUBE_FACES) -> bytes:
    """Return triangles as a binary STL."""
    facets = b"".join(
        struct.pack("<12fH", 0, 0, 0, *points[list(face)].ravel().tolist(), 0) for face in faces
    )
    return bytes(80) + struct.pack("<I", len(faces)) + facets


def obj(points: Array, faces: Sequence[Sequence[int]] = CUBE_FACES) -> bytes:
    """Return triangles as an OBJ."""
    lines = [f"v {x} {y} {z}" for x, y, z in points.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    return "\n".join(lines).encode()


def prism(corners: int, radius: float, height: float) -> tuple[Array, list[tuple[int, int, int]]]:
    """Return the points and faces of a prism along z, which fills less than its box."""
    angles = 2.0 * np.pi * np.arange(corners) / corners
    ring = np.column_stack((radius * np.cos(angles), radius * np.sin(angles)))
    ends = [np.column_stack((ring, np.full(corners, side * height / 2.0))) for side in (-1, 1)]
    faces = []
    for one in range(corners):
        other = (one + 1) % corners
        faces += [(one, other, corners + other), (one, corners + other, corners + one)]
        if 0 < one < corners - 1:
            faces += [(0, other, one), (corners, corners + one, corners + other)]
    return np.vstack(ends), faces


def meshed_robot(
    folder: Path, files: Mapping[str, bytes], elements: Mapping[str, str] | None = None
) -> Path:
    """Write a URDF of three axes whose links are shown by meshes; return where it is.

    Args:
        files: content of each mesh file by its name.
        elements: what stands in a link by its letter; the collision of the first file in b if None.
    """
    for name, content in files.items():
        written(folder, content, name)
    inside = {"b": collision(next(iter(files)))} if elements is None else elements
    links = "".join(f'<link name="{each}">{inside.get(each, "")}</link>' for each in "abcd")
    return written(folder, f'<robot name="meshed">{links}{FIRST}{SECOND}{THIRD}</robot>')


def collision(mesh: str, more: str = "", tag: str = "collision") -> str:
    """Return a collision element of a mesh, or one of another tag."""
    return f'<{tag}>{more}<geometry><mesh filename="{mesh}"/></geometry></{tag}>'


def ur5_with_meshes(folder: Path, meshes: Sequence[bytes]) -> Path:
    """Write a UR5 whose forearm is shown by STL files beside it; return where it is."""
    kept = folder / MESH_FOLDER
    kept.mkdir()
    entries = []
    for content in meshes:
        name = hashlib.sha256(content).hexdigest()
        (kept / f"{name}.stl").write_bytes(content)
        entries.append(
            "- {xyz: [0.0, 0.0, 0.0], rpy: [0.0, 0.0, 0.0], link: forearm_link, form: stl,"
            f" hash: {name}, bytes: {len(content)}, scale: [1.0, 1.0, 1.0]}}"
        )
    facts = (files("openpendant.motion") / "robots" / "ur5.yaml").read_text("utf-8")
    target = folder / "ur5.yaml"
    target.write_text("\n".join([facts, "meshes:", *entries, ""]), encoding="utf-8")
    return target
