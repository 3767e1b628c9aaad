"""Shapes and meshes of a URDF's links, and where they are in their links.

Owns the replacement of a collision shape that the schema lacks by one that encloses it: a cylinder
by the smaller of a capsule and a box, a mesh by its convex hull, or by a box around its vertices
where it is thin or has none. A link whose mesh cannot be read has no shape for it, and a remark
says so. The box around a mesh is the smaller of two: along the mesh's own axes and along its
principal axes. Faces are not needed: a convex shape around all vertices is around all faces.

Owns also which material shows a mesh: its own, or one that is referred to by its name.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

import numpy as np

from ..description.rules import MAX_FIXED_ANGLE, MAX_LENGTH
from ..description.schema import (
    BoxFacts,
    CapsuleFacts,
    HullFacts,
    MeshFacts,
    Placement,
    Shape,
    SphereFacts,
)
from ..errors import BadArgument, MeshFileError, NotFinite, RobotFileError, shortened
from ..pose import Array, Pose
from ..scene.hull_file import box_frame
from .hull_process import NoHull
from .imported_chain import UNTURNED, compose, to_placement
from .mesh_keeping import THINNEST, MeshContent, MeshKeeper, read_mesh_content
from .xml_reader import numbers

UNIT_TOLERANCE = 1e-3
"""Greatest deviation of the length of a direction or quaternion, as written with few digits."""


def origin(element: Element, file: str, where: str) -> Placement:
    """Return where an element is in what it belongs to."""
    stated = element.find("origin")
    if stated is None:
        return UNTURNED
    place = f"{where}.origin"
    xyz = numbers(stated, "xyz", 3, file, place) or (0.0, 0.0, 0.0)
    rpy = numbers(stated, "rpy", 3, file, place) or (0.0, 0.0, 0.0)
    check_within(xyz, MAX_LENGTH, "m", file, f"{place}.xyz")
    check_within(rpy, MAX_FIXED_ANGLE, "rad", file, f"{place}.rpy")
    quaternion = numbers(stated, "quat_xyzw", 4, file, place)
    if quaternion is not None:
        return placement_of(xyz, quaternion, file, f"{place}.quat_xyzw")
    return Placement(xyz=(xyz[0], xyz[1], xyz[2]), rpy=(rpy[0], rpy[1], rpy[2]))


def placement_of(
    xyz: tuple[float, ...], quaternion: tuple[float, ...], file: str, where: str
) -> Placement:
    """Return the placement of a position [m] and a unit quaternion x, y, z, w."""
    norm = math.hypot(*quaternion)
    if abs(norm - 1.0) > UNIT_TOLERANCE:
        raise RobotFileError(
            file, where, f"has the length {norm:.6g}; accepted: a quaternion x, y, z, w of length 1"
        )
    try:
        return to_placement(Pose.from_values(xyz, quaternion).to_matrix())
    except (BadArgument, NotFinite) as error:
        raise RobotFileError(file, where, str(error)) from error


def check_within(values: tuple[float, ...], most: float, unit: str, file: str, where: str) -> None:
    """Refuse values of more than a bound, with what the unit may have been."""
    for value in values:
        if abs(value) > most:
            wrong = {"m": " (is this in millimetres?)", "rad": " (is this in degrees?)"}.get(
                unit, ""
            )
            accepted = f"at most {most:.4g} {unit}".rstrip()
            raise RobotFileError(file, where, f"has {value:g}; accepted: {accepted}{wrong}")


def bounding_box(vertices: Array) -> BoxFacts:
    """Return a box around (k, 3) vertices [m], placed in their frame.

    It lies along the frame's axes, or along the principal axes of the vertices if it is then
    smaller.
    """
    box, _ = box_and_frame(vertices)
    return box


def box_and_frame(vertices: Array) -> tuple[BoxFacts, Array]:
    """Return the box of `bounding_box`, and the vertices in its frame, (k, 3) [m]."""
    axes, centre, edges = box_frame(vertices)
    placement = np.eye(4)
    placement[:3, :3], placement[:3, 3] = axes, centre
    x, y, z = (max(float(edge), THINNEST) for edge in edges)
    where = to_placement(placement)
    box = BoxFacts(type="box", size=(x, y, z), xyz=where.xyz, rpy=where.rpy)
    return box, (vertices - centre) @ axes


def link_shapes(
    link: Element,
    origin_of: dict[Element, Placement],
    file: str,
    where: str,
    refused: list[str],
    keeper: MeshKeeper | None = None,
) -> tuple[tuple[Shape, ...], tuple[str, ...]]:
    """Return a link's collision shapes, and a remark for each that was replaced or left out.

    Args:
        origin_of: placement in the link's frame of each of its `collision` elements.
        file: the file's name, for messages and for finding meshes.
        where: the link, in words.
        refused: gets the meshes that are no use, in words.
        keeper: makes the hulls of meshes; without it boxes stand for them.
    """
    shapes: list[Shape] = []
    remarks: list[str] = []
    for index, collision in enumerate(link.findall("collision")):
        place = f"{where}.collision[{index}]"
        for geometry in collision.findall("geometry"):
            for found, remark in _geometry(geometry, file, place, refused, keeper):
                if found is not None:
                    shapes.append(_moved(found, origin_of[collision]))
                if remark:
                    remarks.append(f"{where}: {remark}")
    return tuple(shapes), tuple(remarks)


def _geometry(
    geometry: Element, file: str, where: str, refused: list[str], keeper: MeshKeeper | None
) -> Iterator[tuple[Shape | None, str]]:
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
                yield _mesh(form, file, place, refused, keeper)
            case _:
                yield None, f"collision shape {shortened(form.tag)} is not known and left out"


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


def _mesh(
    form: Element, file: str, where: str, refused: list[str], keeper: MeshKeeper | None
) -> tuple[Shape | None, str]:
    name = shortened(form.get("filename", ""))
    shown = f"mesh {name}"
    try:
        _, mesh, scale = _read_mesh(form, file, where)
    except MeshFileError as error:
        refused.append(f"{name} {error.problem}")
        return None, f"{shown} {error.problem}; no shape stands for it"
    box, points = box_and_frame(mesh.vertices * np.array(scale))
    if keeper is None:
        return box, f"{shown} is enclosed in a box"
    try:
        hull, count = keeper.hull_of(points)
    except NoHull as error:
        return box, f"{shown} keeps its box: {error}"
    facts = HullFacts(type="hull", size=box.size, hull=hull, xyz=box.xyz, rpy=box.rpy)
    return facts, f"{shown} is enclosed in its convex hull of {count} points"


def _read_mesh(
    form: Element, file: str, where: str
) -> tuple[Path, MeshContent, tuple[float, float, float]]:
    """Return where a mesh is, what it holds and its scale; `MeshFileError` where it is no use."""
    name = form.get("filename", "")
    x, y, z = numbers(form, "scale", 3, file, where) or (1.0, 1.0, 1.0)
    path = _mesh_path(name, Path(file))
    if path is None:
        raise MeshFileError(name, "", "is not found")
    try:
        mesh = read_mesh_content(path)
    except MeshFileError as error:
        raise MeshFileError(name, "", f"cannot be read ({error.problem})") from error
    if float(np.abs(mesh.vertices * np.array((x, y, z))).max()) > MAX_LENGTH:
        raise MeshFileError(name, "", f"is over {MAX_LENGTH:g} m (its scale?)")
    return path, mesh, (x, y, z)


Materials = Mapping[str, Element]
"""Elements `material` that say a colour, by the name that others refer to."""


def materials_of(root: Element) -> Materials:
    """Return the materials of a file: those of the robot, then those that a link says first."""
    found: dict[str, Element] = {}
    for each in (*root.findall("material"), *root.findall("link/visual/material")):
        name = each.get("name", "")
        if name and each.find("color") is not None:
            found.setdefault(name, each)
    return found


def link_meshes(
    link: Element,
    name: str,
    file: str,
    refused: list[str],
    keeper: MeshKeeper,
    materials: Materials,
) -> tuple[tuple[MeshFacts, ...], tuple[str, ...]]:
    """Keep the meshes that show a link: those of `visual`, or where none is any use, `collision`.

    Args:
        refused: gets the meshes that are no use, in words.
        materials: those that an element may refer to.

    Returns:
        The meshes, and a remark for each of `visual` that was left out.
    """
    remarks: list[str] = []
    for tag in ("visual", "collision"):
        found: list[MeshFacts] = []
        for index, element in enumerate(link.findall(tag)):
            where = f"link {name!r}.{tag}[{index}]"
            for form in element.findall("geometry/mesh"):
                try:
                    colour = _colour(element, materials, file, f"{where}.material")
                    found.append(_kept_mesh(form, element, name, colour, file, where, keeper))
                except (MeshFileError, RobotFileError) as error:
                    shown = shortened(form.get("filename", ""))
                    refused.append(f"{shown} {error.problem}")
                    if tag == "visual":
                        remarks.append(
                            f"link {name!r}: mesh {shown} {error.problem}; it is not shown"
                        )
        if found:
            return tuple(found), tuple(remarks)
    return (), tuple(remarks)


def _kept_mesh(
    form: Element,
    element: Element,
    link: str,
    colour: str | None,
    file: str,
    where: str,
    keeper: MeshKeeper,
) -> MeshFacts:
    path, mesh, scale = _read_mesh(form, file, f"{where}.mesh")
    placement = origin(element, file, where)
    return MeshFacts(
        link=link,
        hash=keeper.keep(mesh, path),
        form=mesh.form,
        bytes=len(mesh.content),
        scale=scale,
        colour=colour,
        xyz=placement.xyz,
        rpy=placement.rpy,
    )


def _colour(element: Element, materials: Materials, file: str, where: str) -> str | None:
    """Return the colour of a `visual`: its own, or that of the material it refers to by name."""
    material = element.find("material")
    if material is None:
        return None
    stated = material.find("color")
    if stated is None:
        referred = materials.get(material.get("name", ""))
        stated = None if referred is None else referred.find("color")
    rgba = None if stated is None else numbers(stated, "rgba", 4, file, where)
    return None if rgba is None else _hexadecimal(rgba[:3])


def _hexadecimal(colour: Sequence[float]) -> str:
    """Return red, green and blue of 0 to 1 as `#rrggbb`."""
    return "#" + "".join(f"{round(255.0 * min(max(part, 0.0), 1.0)):02x}" for part in colour)


def _mesh_path(name: str, urdf: Path) -> Path | None:
    # package://NAME/REST is searched in folders called NAME above the URDF, then beside them.
    try:
        parts = urlsplit(name)
    except ValueError:  # such as an address in brackets that is none
        return None
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
