"""Shapes of a robot as a page draws them: solids, struts, links, joints, home, meshes.

Owns the fields of this report and its hash, by which a page keeps what it has drawn before. Lengths
are m, angles rad, quaternions x, y, z, w. A page places the links itself: the value of a joint in
the chain is its own controller-side value, where it is driven, plus the sum of `gain` times the
controller-side value of each joint that it is coupled to, plus `offset`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any, TypeAlias

from ..description.robot import ParallelRobot, Robot, SerialRobot
from ..description.schema import AnyJoint, FixedJoint, Joint, MeshFacts, Placement
from ..pose import Pose
from ..visuals.visuals import Strut, VisualShape, palette, robot_visuals

Report: TypeAlias = dict[str, Any]

_NO_ROTATION = [0.0, 0.0, 0.0, 1.0]

_STILL: Report = {
    "axis": None,
    "lower": None,
    "upper": None,
    "driven": False,
    "coupled_to": [],
    "offset": 0.0,
}
"""What a joint without an axis says where others say how they move."""


def shapes_report(robot: Robot) -> Report:
    """Return what a page needs to draw a robot; `hash` is the SHA-256 of all else in it."""
    visuals = robot_visuals(robot)
    body = {
        "robot": robot.name,
        "shapes": [_shape(shape) for shape in visuals.shapes],
        "struts": [_strut(strut) for strut in visuals.struts],
        **(_platform(robot) if isinstance(robot, ParallelRobot) else _chain(robot)),
    }
    return {**body, "hash": hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()}


def meshes_report(robot: Robot) -> list[Report]:
    """Return the meshes of a robot, one entry a file and scale, with its links.

    A robot of the catalogue has none.
    """
    meshes = () if isinstance(robot, ParallelRobot) else robot.meshes
    colour = palette(robot.manufacturer, robot.model).body
    found: dict[tuple[Any, ...], Report] = {}
    for mesh in meshes:
        key = (mesh.hash, mesh.scale, mesh.colour)
        told = found.setdefault(
            key,
            {
                "hash": mesh.hash,
                "bytes": mesh.bytes,
                "form": mesh.form,
                "unit_scale": list(mesh.scale),
                "links": [],
                "colour": mesh.colour or colour,
            },
        )
        told["links"].append({"link": mesh.link, **_place(mesh)})
    return list(found.values())


def _shape(shape: VisualShape) -> Report:
    return {
        "link": shape.link,
        "form": shape.form.value,
        "part": shape.part.value,
        "size": list(shape.size),
        "xyz": shape.pose.position.tolist(),
        "quat": shape.pose.quaternion.tolist(),
        "colour": shape.colour,
    }


def _strut(strut: Strut) -> Report:
    return {
        "name": strut.name,
        "first_link": strut.first_link,
        "first": list(strut.first),
        "second_link": strut.second_link,
        "second": list(strut.second),
        "diameter": strut.diameter,
        "colour": strut.colour,
    }


def _chain(robot: SerialRobot) -> Report:
    display = dict(zip((joint.name for joint in robot.driven), robot.display_names, strict=True))
    mesh_of: dict[str, MeshFacts] = {}
    for mesh in robot.meshes:
        mesh_of.setdefault(mesh.link, mesh)
    above = {joint.child: joint.name for joint in robot.joints}
    return {
        "links": [
            {
                "link": link,
                "joint": above.get(link),
                "mesh": mesh_of[link].hash if link in mesh_of else None,
            }
            for link in robot.links
        ],
        "joints": [_joint(joint, robot, display) for joint in robot.joints],
        "home": list(robot.home_position),
    }


def _joint(joint: AnyJoint, robot: SerialRobot, display: Mapping[str, str]) -> Report:
    told: Report = {
        "name": joint.name,
        "display_name": display.get(joint.name, joint.name),
        "type": joint.type.value,
        "parent": joint.parent,
        "child": joint.child,
        **_place(joint.origin),
    }
    if isinstance(joint, FixedJoint):
        return told | _STILL
    return told | {
        "axis": list(joint.axis),
        "lower": joint.lower,
        "upper": joint.upper,
        "driven": joint.dependent is None,
        "coupled_to": _couplings(joint, robot),
        "offset": 0.0 if joint.dependent is None else joint.dependent.offset,
    }


def _couplings(joint: Joint, robot: SerialRobot) -> list[Report]:
    """Return which controller-side values move a joint besides its own."""
    factor = robot.coupling.state_factor
    if joint.dependent is None:
        if not factor or joint is not robot.driven[2]:
            return []
        return [{"joint": robot.driven[1].name, "gain": float(factor)}]
    gains: dict[str, float] = {}
    for term in joint.dependent.terms:
        gains[term.joint] = gains.get(term.joint, 0.0) + term.gain
        if factor and term.joint == robot.driven[2].name:
            second = robot.driven[1].name
            gains[second] = gains.get(second, 0.0) + factor * term.gain
    return [{"joint": name, "gain": gain} for name, gain in gains.items()]


def _platform(robot: ParallelRobot) -> Report:
    """Return the parts of a platform: it floats above its base, at home where `floating` says."""
    leg = robot.leg
    floating = {
        "name": robot.tool_link,
        "display_name": robot.tool_link,
        "type": "floating",
        "parent": robot.root_link,
        "child": robot.tool_link,
        "xyz": [0.0, 0.0, robot.home_height],
        "quat": _NO_ROTATION,
        **_STILL,
    }
    legs = [
        {
            "name": name,
            "display_name": name,
            "type": "leg",
            "parent": robot.root_link,
            "child": robot.tool_link,
            "xyz": list(anchor.xyz),
            "quat": _NO_ROTATION,
            **_STILL,
            "lower": leg.min_length,
            "upper": leg.max_length,
            "driven": True,
        }
        for name, anchor in zip(robot.joint_names, robot.base_anchors, strict=True)
    ]
    return {
        "links": [
            {"link": robot.root_link, "joint": None, "mesh": None},
            {"link": robot.tool_link, "joint": robot.tool_link, "mesh": None},
        ],
        "joints": [floating, *legs],
        "home": [leg.home_length] * len(legs),
    }


def _place(placement: Placement) -> Report:
    pose = Pose.from_rpy(placement.xyz, placement.rpy)
    return {"xyz": list(placement.xyz), "quat": pose.quaternion.tolist()}
