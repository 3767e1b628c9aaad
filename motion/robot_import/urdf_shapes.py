"""Collision shapes of a URDF link, as shapes of the robot schema.

Owns the replacement of a shape that the schema lacks by one that encloses it: a cylinder by the
smaller of a capsule and a box, a mesh by a box around its vertices. A link whose mesh cannot be
read has no shape for it, and a remark says so.

The box around a mesh is the smaller of two: along the mesh's own axes and along its principal axes.
Faces are not needed: a convex shape around all vertices is around all faces.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

import numpy as np

from ..description.rules import MAX_LENGTH
from ..description.schema import BoxFacts, CapsuleFacts, Placement, Shape, SphereFacts
from ..errors import MeshFileError, RobotFileError
from ..pose import Array
from ..scene.mesh_file import read_mesh
from .imported_chain import compose, to_placement
from .xml_reader import numbers

_THINNEST = 1e-4  # m: a flat mesh still gets a box


def bounding_box(vertices: Array) -> BoxFacts:
    """Return a box around (k, 3) vertices [m], placed in their frame.

    It lies along the frame's axes, or along the principal axes of the vertices if it is then
    smaller.
    """
    centred = vertices - vertices.mean(axis=0)
    _, principal = np.linalg.eigh(centred.T @ centred)
    if np.linalg.det(principal) < 0.0:
        principal[:, 0] = -principal[:, 0]
    boxes = [_box_along(axes, vertices) for axes in (np.eye(3), principal)]
    return min(boxes, key=lambda box: math.prod(box.size))


def _box_along(axes: Array, vertices: Array) -> BoxFacts:
    along = vertices @ axes
    lowest, highest = along.min(axis=0), along.max(axis=0)
    placement = np.eye(4)
    placement[:3, :3] = axes
    placement[:3, 3] = axes @ ((lowest + highest) / 2.0)
    x, y, z = (max(float(edge), _THINNEST) for edge in highest - lowest)
    where = to_placement(placement)
    return BoxFacts(type="box", size=(x, y, z), xyz=where.xyz, rpy=where.rpy)


def link_shapes(
    link: Element, origin_of: dict[Element, Placement], file: str, where: str
) -> tuple[tuple[Shape, ...], tuple[str, ...]]:
    """Return a link's collision shapes.

    Args:
        link: the `link` element.
        origin_of: placement in the link's frame of each of its `collision` elements.
        file: the file's name, for messages and for finding meshes.
        where: the link, in words.

    Returns:
        The shapes, and a remark for each that was replaced or left out.

    Raises:
        RobotFileError: a shape's measures are not positive numbers.
    """
    shapes: list[Shape] = []
    remarks: list[str] = []
    for index, collision in enumerate(link.findall("collision")):
        place = f"{where}.collision[{index}]"
        for geometry in collision.findall("geometry"):
            for found, remark in _geometry(geometry, file, place):
                if found is not None:
                    shapes.append(_moved(found, origin_of[collision]))
                if remark:
                    remarks.append(f"{where}: {remark}")
    return tuple(shapes), tuple(remarks)


def _geometry(geometry: Element, file: str, where: str) -> Iterator[tuple[Shape | None, str]]:
    for form in geometry:
        place = f"{where}.{form.tag}"
        match form.tag:
            case "box":
                x, y, z = _lengths(form, "size", 3, file, place)
                yield BoxFacts(type="box", size=(x, y, z), xyz=_HERE, rpy=_HERE), ""
            case "sphere":
                (radius,) = _lengths(form, "radius", 1, file, place)
                yield SphereFacts(type="sphere", radius=radius, xyz=_HERE, rpy=_HERE), ""
            case "cylinder" | "capsule":
                (radius,) = _lengths(form, "radius", 1, file, place)
                (length,) = _lengths(form, "length", 1, file, place)
                yield _round(form.tag, radius, length)
            case "mesh":
                yield _mesh(form, file, place)
            case _:
                yield None, f"collision shape {form.tag!r} is not known and left out"


_HERE = (0.0, 0.0, 0.0)


def _round(tag: str, radius: float, length: float) -> tuple[Shape, str]:
    capsule = CapsuleFacts(type="capsule", radius=radius, length=length, xyz=_HERE, rpy=_HERE)
    if tag == "capsule":
        return capsule, ""
    capsule_volume = math.pi * radius**2 * (length + 4.0 / 3.0 * radius)
    box = BoxFacts(type="box", size=(2.0 * radius, 2.0 * radius, length), xyz=_HERE, rpy=_HERE)
    if math.prod(box.size) <= capsule_volume:
        return box, "a cylinder is enclosed in a box"
    return capsule, "a cylinder is enclosed in a capsule"


def _mesh(form: Element, file: str, where: str) -> tuple[Shape | None, str]:
    name = form.get("filename", "")
    scale = numbers(form, "scale", 3, file, where) or (1.0, 1.0, 1.0)
    path = _mesh_path(name, Path(file))
    if path is None:
        return None, f"mesh {name!r} is not found; no shape stands for it"
    try:
        vertices = read_mesh(path).vertices * np.array(scale)
    except MeshFileError as error:
        return None, f"mesh {name!r} cannot be read ({error.problem}); no shape stands for it"
    if float(np.abs(vertices).max()) > MAX_LENGTH:
        return None, f"mesh {name!r} is over {MAX_LENGTH:g} m (its scale?); no shape stands for it"
    return bounding_box(vertices), f"mesh {name!r} is enclosed in a box"


def _mesh_path(name: str, urdf: Path) -> Path | None:
    # package://NAME/REST is searched in folders called NAME above the URDF, then beside them.
    parts = urlsplit(name)
    rest = unquote(parts.path).lstrip("/")
    folder = urdf.absolute().parent
    candidates: list[Path]
    match parts.scheme:
        case "package" | "model":
            above = [folder, *folder.parents]
            candidates = [each / rest for each in above if each.name == parts.netloc]
            candidates += [each / parts.netloc / rest for each in above]
        case "file":
            candidates = [Path("/") / rest]
        case "":
            candidates = [folder / unquote(parts.path)]
        case _:
            candidates = []
    try:
        return next((each for each in candidates if each.is_file()), None)
    except (OSError, ValueError):
        return None


def _lengths(form: Element, name: str, count: int, file: str, where: str) -> tuple[float, ...]:
    values = numbers(form, name, count, file, where)
    if values is None:
        raise RobotFileError(file, f"{where}.{name}", "is missing; accepted: lengths in metres")
    if not all(0.0 < value <= MAX_LENGTH for value in values):
        raise RobotFileError(
            file,
            f"{where}.{name}",
            f"is {list(values)}; accepted: more than 0 and at most {MAX_LENGTH:g} m",
        )
    return values


def _moved(shape: Shape, origin: Placement) -> Shape:
    moved = compose(origin, shape)
    return shape.model_copy(update={"xyz": moved.xyz, "rpy": moved.rpy})
