"""URDF file as links and joints, each read and checked by itself.

Owns the meaning of URDF's elements and their defaults (the joint's axis is x, an origin is none,
the mimic multiplier is 1), and which of them no robot file can express. The tree of links and
joints is `urdf_tree`'s. Source: https://wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from xml.etree.ElementTree import Element

from ..description.rules import MAX_FIXED_ANGLE, MAX_GAIN, MAX_LENGTH
from ..description.schema import Placement, Shape
from ..errors import BadArgument, NotFinite, RobotFileError
from ..pose import Pose
from .imported_chain import UNTURNED, to_placement
from .urdf_shapes import link_shapes
from .xml_reader import number, numbers, read_xml

MAX_LINKS = 1000

_UNIT_TOLERANCE = 1e-3  # of the length of a direction or quaternion written with few digits


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
    """Element `link`: its mass [kg] if stated, and its collision shapes."""

    name: str
    mass: float | None
    shapes: tuple[Shape, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class UrdfModel:
    """Whole file: links by name, joints in the file's order."""

    file: str
    name: str
    links: Mapping[str, UrdfLink]
    joints: tuple[UrdfJoint, ...]


def read_urdf(path: Path) -> UrdfModel:
    """Read a URDF file.

    Raises:
        RobotFileError: the file is no sound URDF; it names the link or joint and what is accepted.
    """
    file = str(path)
    root = read_xml(path)
    _refuse_xacro(root, file)
    if root.tag != "robot":
        raise RobotFileError(file, "", f"begins with <{root.tag}>; accepted: a URDF's <robot>")
    if len(root.findall("link")) > MAX_LINKS:
        raise RobotFileError(file, "", f"has more than {MAX_LINKS} links")
    links = [_link(each, index, file) for index, each in enumerate(root.findall("link"))]
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
                f"<{element.tag.rpartition('}')[2]}>",
                "is written in xacro, which is a program; expand it first:"
                " xacro my.urdf.xacro > my.urdf",
            )


def _refuse_repeated(what: str, names: Iterable[str], file: str) -> None:
    for name, count in Counter(names).items():
        if count > 1:
            raise RobotFileError(
                file, f"{what} {name!r}", f"is there {count} times; accepted: once"
            )


def _link(element: Element, index: int, file: str) -> UrdfLink:
    name = _name(element, f"link[{index}]", file)
    where = f"link {name!r}"
    mass_element = element.find("inertial/mass")
    mass = None if mass_element is None else number(mass_element, "value", file, f"{where}.mass")
    if mass is not None and mass < 0.0:
        raise RobotFileError(file, f"{where}.mass", f"is {mass} kg; accepted: 0 or more")
    origins = {each: _origin(each, file, where) for each in element.findall("collision")}
    shapes, remarks = link_shapes(element, origins, file, where)
    return UrdfLink(name, mass, shapes, remarks)


def _joint(element: Element, index: int, file: str) -> UrdfJoint:
    name = _name(element, f"joint[{index}]", file)
    where = f"joint {name!r}"
    kind = element.get("type", "")
    if kind not in list(UrdfType):
        known = ", ".join(UrdfType)
        raise RobotFileError(file, f"{where}.type", f"is {kind!r}; accepted: {known}")
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
        origin=_origin(element, file, where),
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


def _origin(element: Element, file: str, where: str) -> Placement:
    origin = element.find("origin")
    if origin is None:
        return UNTURNED
    place = f"{where}.origin"
    xyz = numbers(origin, "xyz", 3, file, place) or (0.0, 0.0, 0.0)
    rpy = numbers(origin, "rpy", 3, file, place) or (0.0, 0.0, 0.0)
    _check_within(xyz, MAX_LENGTH, "m", file, f"{place}.xyz")
    _check_within(rpy, MAX_FIXED_ANGLE, "rad", file, f"{place}.rpy")
    quaternion = numbers(origin, "quat_xyzw", 4, file, place)
    if quaternion is not None:
        return placement_of(xyz, quaternion, file, f"{place}.quat_xyzw")
    return Placement(xyz=(xyz[0], xyz[1], xyz[2]), rpy=(rpy[0], rpy[1], rpy[2]))


def placement_of(
    xyz: tuple[float, ...], quaternion: tuple[float, ...], file: str, where: str
) -> Placement:
    """Return the placement of a position [m] and a unit quaternion x, y, z, w.

    Raises:
        RobotFileError: the quaternion is not of length 1, or a number is not finite.
    """
    norm = math.hypot(*quaternion)
    if abs(norm - 1.0) > _UNIT_TOLERANCE:
        raise RobotFileError(
            file, where, f"has the length {norm:.6g}; accepted: a quaternion x, y, z, w of length 1"
        )
    try:
        return to_placement(Pose.from_values(xyz, quaternion).to_matrix())
    except (BadArgument, NotFinite) as error:
        raise RobotFileError(file, where, str(error)) from error


def _axis(element: Element, file: str, where: str) -> tuple[float, float, float]:
    axis = element.find("axis")
    values = None if axis is None else numbers(axis, "xyz", 3, file, f"{where}.axis")
    x, y, z = values or (1.0, 0.0, 0.0)
    length = math.hypot(x, y, z)
    if abs(length - 1.0) > _UNIT_TOLERANCE:
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
    _check_within((multiplier,), MAX_GAIN, "", file, f"{place}.multiplier")
    if multiplier == 0.0:
        raise RobotFileError(file, f"{place}.multiplier", "is 0; accepted: a joint that follows")
    return Mimic(leader, multiplier, number(mimic, "offset", file, place) or 0.0)


def _check_within(values: tuple[float, ...], most: float, unit: str, file: str, where: str) -> None:
    for value in values:
        if abs(value) > most:
            wrong = {"m": " (is this in millimetres?)", "rad": " (is this in degrees?)"}.get(
                unit, ""
            )
            accepted = f"at most {most:.4g} {unit}".rstrip()
            raise RobotFileError(file, where, f"has {value:g}; accepted: {accepted}{wrong}")
