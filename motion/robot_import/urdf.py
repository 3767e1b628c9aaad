"""URDF file as links and joints, each read and checked by itself.

Owns the meaning of URDF's elements and their defaults (the joint's axis is x, an origin is none,
the mimic multiplier is 1), and which of them no robot file can express. The tree of links and
joints is `urdf_tree`'s, shapes and meshes are `urdf_shapes`'. What is not sound raises
`RobotFileError`, which names the link or joint and what is accepted. Source:
https://wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from xml.etree.ElementTree import Element

from ..description.rules import MAX_GAIN
from ..description.schema import MeshFacts, Placement, Shape
from ..errors import RobotFileError
from .mesh_keeping import MeshKeeper
from .urdf_shapes import (
    UNIT_TOLERANCE,
    Materials,
    check_within,
    link_meshes,
    link_shapes,
    materials_of,
    origin,
)
from .xml_reader import number, numbers, read_xml

MAX_LINKS = 1000


class UrdfType(StrEnum):
    """The joint types that URDF knows."""

    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    FIXED = "fixed"
    PLANAR = "planar"
    FLOATING = "floating"


@dataclass(frozen=True, slots=True)
class Mimic:
    """Position = multiplier · position of `joint` + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, slots=True)
class UrdfJoint:
    """Element `joint`; None for what it does not state. Units: m, rad, s."""

    name: str
    type: UrdfType
    parent: str
    child: str
    origin: Placement
    axis: tuple[float, float, float] | None
    lower: float | None
    upper: float | None
    velocity: float | None
    acceleration: float | None
    effort: float | None
    mimic: Mimic | None


@dataclass(frozen=True, slots=True)
class UrdfLink:
    """Element `link`: its mass [kg] if stated, its collision shapes, the meshes that show it.

    Attributes:
        refused: the meshes that are no use, each with the reason, in words.
    """

    name: str
    mass: float | None
    shapes: tuple[Shape, ...]
    remarks: tuple[str, ...]
    meshes: tuple[MeshFacts, ...] = ()
    refused: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class UrdfModel:
    """Whole file: links by name, joints in the file's order."""

    file: str
    name: str
    links: Mapping[str, UrdfLink]
    joints: tuple[UrdfJoint, ...]


def read_urdf(path: Path, keeper: MeshKeeper | None = None) -> UrdfModel:
    """Read a URDF file.

    Args:
        keeper: keeps its meshes, and makes their hulls; without it boxes stand for meshes.
    """
    file = str(path)
    root = read_xml(path)
    _refuse_xacro(root, file)
    if root.tag != "robot":
        raise RobotFileError(file, "", f"begins with <{root.tag[:80]}>; accepted: a URDF's <robot>")
    if len(root.findall("link")) > MAX_LINKS:
        raise RobotFileError(file, "", f"has more than {MAX_LINKS} links")
    materials = materials_of(root)
    links = [
        _link(each, index, file, keeper, materials)
        for index, each in enumerate(root.findall("link"))
    ]
    joints = [_joint(each, index, file) for index, each in enumerate(root.findall("joint"))]
    _refuse_repeated("link", (link.name for link in links), file)
    _refuse_repeated("joint", (joint.name for joint in joints), file)
    return UrdfModel(file, root.get("name", ""), {link.name: link for link in links}, tuple(joints))


def _refuse_xacro(root: Element, file: str) -> None:
    for element in root.iter():
        macro = "xacro" in element.tag.partition("}")[0]
        if macro or any("${" in value or "$(" in value for value in element.attrib.values()):
            raise RobotFileError(
                file,
                f"<{element.tag.rpartition('}')[2][:80]}>",
                "is written in xacro, which is a program; expand it first:"
                " xacro my.urdf.xacro > my.urdf",
            )


def _refuse_repeated(what: str, names: Iterable[str], file: str) -> None:
    for name, count in Counter(names).items():
        if count > 1:
            raise RobotFileError(
                file, f"{what} {name!r}", f"is there {count} times; accepted: once"
            )


def _link(
    element: Element, index: int, file: str, keeper: MeshKeeper | None, materials: Materials
) -> UrdfLink:
    name = _name(element, f"link[{index}]", file)
    where = f"link {name!r}"
    mass_element = element.find("inertial/mass")
    mass = None if mass_element is None else number(mass_element, "value", file, f"{where}.mass")
    if mass is not None and mass < 0.0:
        raise RobotFileError(file, f"{where}.mass", f"is {mass} kg; accepted: 0 or more")
    origins = {each: origin(each, file, where) for each in element.findall("collision")}
    refused: list[str] = []
    shapes, remarks = link_shapes(element, origins, file, where, refused, keeper)
    meshes: tuple[MeshFacts, ...] = ()
    if keeper is not None:
        meshes, more = link_meshes(element, name, file, refused, keeper, materials)
        remarks = (*remarks, *more)
    return UrdfLink(name, mass, shapes, remarks, meshes, tuple(refused))


def _joint(element: Element, index: int, file: str) -> UrdfJoint:
    name = _name(element, f"joint[{index}]", file)
    where = f"joint {name!r}"
    kind = element.get("type", "")
    if kind not in list(UrdfType):
        known = ", ".join(UrdfType)
        raise RobotFileError(file, f"{where}.type", f"is {kind[:80]!r}; accepted: {known}")
    limit = element.find("limit")
    bounds = {
        field: None if limit is None else number(limit, field, file, f"{where}.limit")
        for field in ("lower", "upper", "velocity", "acceleration", "effort")
    }
    _check_bounds(bounds, UrdfType(kind), file, f"{where}.limit")
    return UrdfJoint(
        name=name,
        type=UrdfType(kind),
        parent=_end(element, "parent", file, where),
        child=_end(element, "child", file, where),
        origin=origin(element, file, where),
        axis=None if kind == UrdfType.FIXED else _axis(element, file, where),
        mimic=_mimic(element, file, where),
        **bounds,
    )


def _check_bounds(
    bounds: Mapping[str, float | None], kind: UrdfType, file: str, where: str
) -> None:
    for field in ("velocity", "acceleration"):
        value = bounds[field]
        if value is not None and not value > 0.0:
            raise RobotFileError(file, f"{where}.{field}", f"is {value}; accepted: more than 0")
    effort = bounds["effort"]
    if effort is not None and effort < 0.0:
        raise RobotFileError(file, f"{where}.effort", f"is {effort}; accepted: 0 or more")
    lower, upper = bounds["lower"], bounds["upper"]
    if kind in (UrdfType.CONTINUOUS, UrdfType.FIXED) or (lower is None and upper is None):
        return
    # URDF: a value left out of a pair is zero.
    if not (lower or 0.0) < (upper or 0.0):
        raise RobotFileError(
            file,
            where,
            f"has lower = {lower or 0.0} and upper = {upper or 0.0};"
            " accepted: lower less than upper (a joint that cannot move is of type fixed)",
        )


def _name(element: Element, where: str, file: str) -> str:
    name = element.get("name", "")
    if not 1 <= len(name) <= 64 or not name.isprintable():
        raise RobotFileError(file, f"{where}.name", f"is {name[:80]!r}; accepted: 1 to 64 letters")
    return name


def _end(element: Element, tag: str, file: str, where: str) -> str:
    end = element.find(tag)
    link = None if end is None else end.get("link")
    if not link:
        raise RobotFileError(file, f"{where}.{tag}", "is missing; accepted: the name of a link")
    return link


def _axis(element: Element, file: str, where: str) -> tuple[float, float, float]:
    axis = element.find("axis")
    values = None if axis is None else numbers(axis, "xyz", 3, file, f"{where}.axis")
    x, y, z = values or (1.0, 0.0, 0.0)
    length = math.hypot(x, y, z)
    if abs(length - 1.0) > UNIT_TOLERANCE:
        raise RobotFileError(
            file,
            f"{where}.axis",
            f"is {x:g} {y:g} {z:g}, of length {length:.6g}; accepted: a direction of length 1",
        )
    return x / length, y / length, z / length


def _mimic(element: Element, file: str, where: str) -> Mimic | None:
    mimic = element.find("mimic")
    if mimic is None:
        return None
    place = f"{where}.mimic"
    leader = mimic.get("joint", "")
    if not leader:
        raise RobotFileError(file, f"{place}.joint", "is missing; accepted: the name of a joint")
    multiplier = number(mimic, "multiplier", file, place)
    multiplier = 1.0 if multiplier is None else multiplier
    check_within((multiplier,), MAX_GAIN, "", file, f"{place}.multiplier")
    if multiplier == 0.0:
        raise RobotFileError(file, f"{place}.multiplier", "is 0; accepted: a joint that follows")
    return Mimic(leader, multiplier, number(mimic, "offset", file, place) or 0.0)
