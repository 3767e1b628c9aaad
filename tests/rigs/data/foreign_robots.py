"""URDFs of robots that no catalogue holds, as their makers might hand them out."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rigs.data.urdf_files import joint


@dataclass(frozen=True)
class Foreign:
    """A robot, the link it should end at, and a joint position well inside its reach.

    Attributes:
        keys: the axes of the base that its tool can be jogged along (x, y, z) and about (A, B, C)
            from there.
    """

    urdf: str
    tool: str
    joints: list[float]
    keys: str = "xyzABC"


Z, Y, X = ('<axis xyz="0 0 1"/>', '<axis xyz="0 1 0"/>', '<axis xyz="1 0 0"/>')
DOWN = '<axis xyz="0 0 -1"/>'


def _at(x: float, z: float, roll: float = 0.0, pitch: float = 0.0) -> str:
    return f'<origin xyz="{x} 0 {z}" rpy="{roll} {pitch} 0"/>'


def _bounds(lower: float, upper: float, velocity: float = 2.0) -> str:
    return f'<limit lower="{lower}" upper="{upper}" velocity="{velocity}" effort="10"/>'


def _chain(links: list[str], steps: list[tuple[str, str, str]], limit: str) -> list[str]:
    """Revolute joints from link to link; each step is a joint's name, its place and its axis."""
    return [
        joint(name, parent, child, origin=origin, axis=axis, limit=limit)
        for (name, origin, axis), parent, child in zip(steps, links[:-1], links[1:], strict=True)
    ]


def _robot(name: str, links: list[str], joints: list[str], content: str = "") -> str:
    listed = "".join(f'<link name="{link}">{content}</link>' for link in links)
    return f'<robot name="{name}">{listed}{"".join(joints)}</robot>'


def _six_axes() -> Foreign:
    """An ordinary arm with cylinders for shapes and a plate turned at its flange."""
    links = ["stand", "l1", "l2", "l3", "l4", "l5", "l6"]
    places = [_at(0, 0.3), _at(0.1, 0.1), _at(0, 0.4), _at(0.15, 0.05), _at(0.25, 0), _at(0.08, 0)]
    steps = [
        (f"axis{number}", place, axis)
        for number, place, axis in zip(range(1, 7), places, (Z, Y, Y, X, Y, X), strict=True)
    ]
    plate = joint("mount", "l6", "plate", kind="fixed", origin=_at(0.05, 0, 0, 1.5707963), limit="")
    shape = "<collision><geometry><cylinder radius='0.02' length='0.05'/></geometry></collision>"
    joints = [*_chain(links, steps, _bounds(-2.5, 2.5)), plate]
    return Foreign(
        _robot("six_axes", [*links, "plate"], joints, shape),
        "plate",
        [0.1, 0.3, 0.4, 0.2, 0.6, 0.1],
    )


def _seven_axes() -> Foreign:
    """A redundant arm with a gripper whose second finger mimics the first, and no mesh at hand."""
    links = ["base_link", *(f"a{number}" for number in range(1, 8))]
    axes = (Z, Y, Z, '<axis xyz="0 -1 0"/>', Z, Y, Z)
    steps = [
        (f"turn{number}", _at(0, 0.2), axis) for number, axis in zip(range(1, 8), axes, strict=True)
    ]
    stroke, slide = _bounds(0, 0.04, 0.1), '<axis xyz="0 1 0"/>'
    grip = joint("grip", "palm", "f1", kind="prismatic", axis=slide, limit=stroke)
    mimic = '<mimic joint="grip" multiplier="-1"/>'
    follow = joint("follow", "palm", "f2", kind="prismatic", axis=slide, limit=stroke, more=mimic)
    fixed = [
        joint("floor", "world", "base_link", kind="fixed", origin="", limit=""),
        joint("wrist", "a7", "palm", kind="fixed", origin=_at(0, 0.08), limit=""),
    ]
    mesh = "<collision><geometry><mesh filename='package://lost/a.stl'/></geometry></collision>"
    joints = [*_chain(links, steps, _bounds(-2.7, 2.7)), *fixed, grip, follow]
    everything = ["world", *links, "palm", "f1", "f2"]
    return Foreign(
        _robot("seven_axes", everything, joints, mesh), "palm", [0.1, 0.5, -0.4, 0.9, 0.3, 0.6, 0.1]
    )


def _flat_arm() -> Foreign:
    """A SCARA: four axes, one of them sliding and one turning without end or limits."""
    links = ["b", "u", "v", "w", "t"]
    joints = [
        joint("s1", "b", "u", origin=_at(0, 0.4), limit=_bounds(-2.2, 2.2)),
        joint("s2", "u", "v", origin=_at(0.3, 0), limit=_bounds(-2.5, 2.5)),
        joint(
            *("z", "v", "w"),
            kind="prismatic", origin=_at(0.25, 0), axis=DOWN, limit=_bounds(0, 0.2, 1),
        ),
        joint("r", "w", "t", kind="continuous", origin="", axis=DOWN, limit=""),
    ]  # fmt: skip
    return Foreign(_robot("flat_arm", links, joints), "t", [0.3, 0.8, 0.05, 0.2], "xyzC")


def _gantry() -> Foreign:
    """Three rails, one along each axis, and nothing that turns."""
    links = ["frame", "bridge", "cart", "quill"]
    rail, stroke = _bounds(0, 1, 0.5), _bounds(0, 0.5, 0.5)
    slides = [("along", X, rail), ("across", Y, rail), ("down", DOWN, stroke)]
    joints = [
        joint(name, parent, child, kind="prismatic", origin=_at(0, 0.3), axis=axis, limit=limit)
        for (name, axis, limit), parent, child in zip(slides, links[:-1], links[1:], strict=True)
    ]
    return Foreign(_robot("gantry", links, joints), "quill", [0.3, 0.3, 0.2], "xyz")


def _five_axes() -> Foreign:
    """An arm without the fourth of six axes, where its tool hangs straight down."""
    links = ["foot", "turret", "upper", "fore", "hand", "flange"]
    places = [_at(0, 0.3), _at(0.05, 0.1), _at(0, 0.35), _at(0.3, 0), _at(0.1, 0)]
    names = ["waist", "shoulder", "elbow", "bend", "roll"]
    steps = list(zip(names, places, (Z, Y, Y, Y, X), strict=True))
    return Foreign(
        _robot("five_axes", links, _chain(links, steps, _bounds(-2.8, 2.8))),
        "flange",
        [0.3, 0.4, 0.4, math.pi / 2.0 - 0.8, 0.2],
        "xyzC",
    )


def _arm_on_a_rail() -> Foreign:
    """An arm of four axes on a rail of its own, so its first joint slides."""
    links = ["floor", "sled", "column", "boom", "stick", "tip"]
    rail = joint(
        *("rail", "floor", "sled"), kind="prismatic", origin="", axis=Y, limit=_bounds(-2, 2, 1)
    )
    places = [_at(0, 0.3), _at(0, 0.2), _at(0.4, 0), _at(0.35, 0)]
    steps = list(zip(("swing", "lift", "fold", "nod"), places, (Z, Y, Y, Y), strict=True))
    joints = [rail, *_chain(links[1:], steps, _bounds(-2, 2))]
    return Foreign(
        _robot("arm_on_a_rail", links, joints), "tip", [0.1, 0.0, -0.8, 1.0, 0.3], "xyzBC"
    )


FOREIGN = {"six_axes": _six_axes(), "seven_axes": _seven_axes(), "flat_arm": _flat_arm()}

FEW_AXES = {"gantry": _gantry(), "five_axes": _five_axes(), "arm_on_a_rail": _arm_on_a_rail()}
