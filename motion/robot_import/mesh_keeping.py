"""Meshes of an imported robot: what is kept of them, within which bounds, and where.

Owns the folder of meshes beside a robot file: each mesh as it was imported under its SHA-256, so
that robots share what is the same, and the hull of each that stands for it in collision checks.
While a description is read they are put aside in another folder, because the import may still be
refused; `stored_meshes` moves what the robot file names, and takes it away again where that file
cannot be written.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..bounded_file import read_bounded
from ..description.schema import MeshForm
from ..errors import MeshFileError, RobotFileError
from ..pose import Array
from ..scene.hull_file import hull_fault, hull_name, hull_text
from ..scene.mesh_file import triangles_of
from .hull_process import NoHull, hull_of

MAX_MESH_BYTES = 32 << 20
"""Largest mesh file."""

MAX_ROBOT_BYTES = 64 << 20
"""Most bytes of all meshes of a robot."""

MAX_STORE_BYTES = 256 << 20
"""Most bytes of a folder of meshes."""

THINNEST = 1e-4
"""Thickness of the box around a flat mesh, and least of a mesh that gets a hull [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class MeshContent:
    """A sound mesh file: its bytes, and its (k, 3) vertices in its own unit."""

    content: bytes
    form: MeshForm
    vertices: Array

    @property
    def hash(self) -> str:
        """SHA-256 of its bytes."""
        return hashlib.sha256(self.content).hexdigest()


def read_mesh_content(path: Path) -> MeshContent:
    """Read a mesh within the bounds of an import.

    Raises:
        MeshFileError: it cannot be read, is too large, of another format or not sound.
    """
    ending = path.suffix.lower().removeprefix(".")
    if ending == "dae":
        problem = "is COLLADA, which no library here converts; accepted: .stl or .obj"
        raise MeshFileError(str(path), "", problem)
    if ending not in list(MeshForm):
        raise MeshFileError(str(path), "", f"ends in {path.suffix!r}; accepted: .stl or .obj")
    content = read_bounded(path, MAX_MESH_BYTES, MeshFileError)
    return MeshContent(content, MeshForm(ending), triangles_of(str(path), content).vertices)


class MeshKeeper:
    """The meshes and hulls of a robot that is imported, put aside in a folder.

    Attributes:
        folder: where they are.
    """

    def __init__(self, folder: Path) -> None:
        """Keep none yet."""
        self.folder = folder
        self._sizes: dict[str, int] = {}
        # Links on the left and on the right often have the same mesh.
        self._hulls: dict[bytes, tuple[str, int] | str] = {}

    def keep(self, mesh: MeshContent, path: Path) -> str:
        """Put a mesh aside; return its SHA-256.

        Raises:
            MeshFileError: the robot would have too many bytes of meshes.
        """
        name = mesh.hash
        if name not in self._sizes:
            total = sum(self._sizes.values()) + len(mesh.content)
            if total > MAX_ROBOT_BYTES:
                problem = f"makes {total} bytes of this robot; accepted: {MAX_ROBOT_BYTES} in all"
                raise MeshFileError(str(path), "", problem)
            (self.folder / f"{name}.{mesh.form}").write_bytes(mesh.content)
            self._sizes[name] = len(mesh.content)
        return name

    def hull_of(self, points: Array) -> tuple[str, int]:
        """Put the convex hull of (k, 3) points [m] aside.

        Returns:
            Its name, and how many points it has.

        Raises:
            NoHull: they have none, it has too many points, or they are too thin for one.
        """
        key = hashlib.sha256(np.ascontiguousarray(points).tobytes()).digest()
        found = self._hulls.get(key)
        if found is None:
            try:
                found = self._put_hull_aside(points)
            except NoHull as error:
                found = str(error)
            self._hulls[key] = found
        if isinstance(found, str):
            raise NoHull(found)
        return found

    def _put_hull_aside(self, points: Array) -> tuple[str, int]:
        thickness = float(np.ptp(points, axis=0).min())
        if thickness < THINNEST:
            raise NoHull(f"it is {1000.0 * thickness:.3g} mm thin, less than 0.1 mm")
        hull = hull_of(points)
        fault = hull_fault(hull)
        if fault is not None:
            raise NoHull(fault)
        content = hull_text(hull)
        name = hull_name(content)
        (self.folder / f"{name}.obj").write_bytes(content)
        return name, len(hull.vertices)


@contextmanager
def stored_meshes(
    content: Mapping[str, Any], aside: Path, folder: Path, file: str
) -> Iterator[None]:
    """Put what a robot file names into the folder of meshes beside it, which is written inside.

    Where either fails nothing is left of it; what was there before stays.

    Args:
        content: of the robot file.
        aside: where its meshes are.
        folder: need not exist.
        file: the robot's description, for messages.

    Raises:
        RobotFileError: the folder would have too many bytes, or cannot be written.
    """
    put: list[Path] = []
    try:
        _store(sorted({*_files(content)}), aside, folder, file, put)
        yield
    except BaseException:
        for each in reversed(put):
            # Whoever put something else into the folder meanwhile keeps it.
            with suppress(OSError):
                each.rmdir() if each.is_dir() else each.unlink()
        raise


def _store(names: Sequence[str], aside: Path, folder: Path, file: str, put: list[Path]) -> None:
    """Copy files into a folder, and tell in `put` what comes into being, before it does."""
    if not names:
        return
    try:
        if not folder.exists():
            put.append(folder)
            folder.mkdir()
        there = {each.name: each.stat().st_size for each in folder.iterdir() if each.is_file()}
        missing = [name for name in names if name not in there]
        total = sum(there.values()) + sum((aside / name).stat().st_size for name in missing)
        if total > MAX_STORE_BYTES:
            problem = f"would have {total} bytes; accepted: {MAX_STORE_BYTES} in {folder}"
            raise RobotFileError(file, "meshes", problem)
        for name in missing:
            # Whole or not at all: its name says what is in it.
            begun = folder / f".{name}.{os.getpid()}"
            put += (begun, folder / name)
            shutil.copyfile(aside / name, begun)
            begun.replace(folder / name)
    except OSError as error:
        problem = f"cannot be kept in {folder}: {error.strerror}"
        raise RobotFileError(file, "meshes", problem) from error


def _files(content: Mapping[str, Any]) -> Iterator[str]:
    for mesh in content.get("meshes", ()):
        yield f"{mesh['hash']}.{mesh['form']}"
    for shapes in content.get("collision", {}).values():
        yield from (f"{shape['hull']}.obj" for shape in shapes if shape["type"] == "hull")
