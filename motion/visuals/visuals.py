"""Visuals of a robot: simple coloured shapes on its links, as data for a 3D viewer.

Owns which shapes stand for a link, a joint, the foot and the flange, their proportions and colours.
All are derived from the chain and the file's collision shapes; there are no meshes. A shape is
given in its link's frame, so it moves as forward kinematics moves the link. Knows no camera and no
picture format.

Owns also the boxes around collision shapes, in the link's frame [m]: where a line cuts a box, its
width across a line, its distance from a point; and the palettes, similar to the makers' paint, so
that a robot is recognised at a glance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import product
from typing import NamedTuple

import numpy as np

from ..description.robot import ParallelRobot, Robot, SerialRobot
from ..description.schema import (
    AnyJoint,
    BoxFacts,
    CapsuleFacts,
    HullFacts,
    Joint,
    Shape,
    SphereFacts,
)
from ..pose import Array, Pose

_PARALLEL = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class LinkBox:
    """Box with full extents along its own axes [m], and its (3, 3) axes and (3,) centre."""

    size: tuple[float, float, float]
    rotation: Array
    centre: Array

    def corners(self) -> Array:
        """Return the (8, 3) corners."""
        signs = np.array(list(product((-0.5, 0.5), repeat=3)))
        corners: Array = self.centre + (signs * np.array(self.size)) @ self.rotation.T
        return corners

    def distance(self, point: Array) -> float:
        """Return the distance of a (3,) point [m] outside the box [m]; 0 inside."""
        local = np.abs(self.rotation.T @ (point - self.centre)) - np.array(self.size) / 2.0
        return float(np.linalg.norm(np.maximum(local, 0.0)))

    def width_across(self, direction: Array) -> float:
        """Return the lesser extent [m] along its two axes that are most across a direction.

        Args:
            direction: (3,) of any length, in the frame that the box is in.
        """
        along = np.abs(self.rotation.T @ direction)
        return min(self.size[axis] for axis in np.argsort(along)[:2])


def box_of(shape: Shape) -> LinkBox:
    """Return the box around a collision shape."""
    pose = Pose.from_rpy(shape.xyz, shape.rpy)
    if isinstance(shape, BoxFacts | HullFacts):
        return LinkBox(shape.size, pose.rotation, pose.position)
    width = 2.0 * shape.radius
    length = width + shape.length if isinstance(shape, CapsuleFacts) else width
    return LinkBox((width, width, length), pose.rotation, pose.position)


def chord(box: LinkBox, point: Array, direction: Array) -> tuple[float, float] | None:
    """Return where a line through a (3,) point enters and leaves a box [m along it], or None.

    Args:
        direction: (3,) unit vector.
    """
    # The slab method: the line is inside where it is between all three pairs of faces.
    start, way = box.rotation.T @ (point - box.centre), box.rotation.T @ direction
    enters, leaves = -np.inf, np.inf
    for position, speed, extent in zip(start, way, box.size, strict=True):
        if abs(speed) < _PARALLEL:
            if abs(position) > extent / 2.0:
                return None
            continue
        near, far = sorted(((side * extent / 2.0) - position) / speed for side in (-1.0, 1.0))
        enters, leaves = max(enters, near), min(leaves, far)
    return (float(enters), float(leaves)) if enters < leaves else None


class Palette(NamedTuple):
    """`#rrggbb` of an arm's body, its joints and its foot."""

    body: str
    joint: str
    foot: str = "#3c4248"


_PLAIN = Palette("#9db4c8", "#4a5662")

# The first whose word is in maker and model is used, so a model stands before its maker.
_PALETTES: tuple[tuple[str, Palette], ...] = (
    ("iiwa", Palette("#c8ccd2", "#f07d20")),
    ("abb", Palette("#f26b21", "#4b4f54")),
    ("kuka", Palette("#ff7a14", "#2d2f33")),
    ("fanuc", Palette("#f5cf1b", "#4a4a48")),
    ("universal robots", Palette("#d3d8dc", "#5d9bce")),
    ("kawasaki", Palette("#eceef0", "#7c868f")),
    ("motoman", Palette("#2467b8", "#dfe5ec")),
    ("yaskawa", Palette("#2467b8", "#dfe5ec")),
    ("epson", Palette("#f2f1ec", "#a5abb1")),
    ("mitsubishi", Palette("#e4e6e8", "#6d747b")),
    ("unimation", Palette("#e6e0cf", "#6b757c")),
)


def palette(manufacturer: str, model: str) -> Palette:
    """Return the colours of a robot."""
    words = f"{manufacturer} {model}".lower()
    return next((colours for word, colours in _PALETTES if word in words), _PLAIN)


class ShapeForm(StrEnum):
    """Solid of a shape; round ones have their axis along local z."""

    BOX = "box"
    CYLINDER = "cylinder"
    CAPSULE = "capsule"
    SPHERE = "sphere"


class VisualPart(StrEnum):
    """Part of the arm that a shape stands for."""

    BODY = "body"
    JOINT = "joint"
    FOOT = "foot"
    FLANGE = "flange"


@dataclass(frozen=True, slots=True, eq=False)
class VisualShape:
    """A coloured solid fixed to a link.

    Attributes:
        link: the link it moves with.
        size: extents along its own x, y, z [m]; a capsule's length includes its caps.
        pose: of its centre in the link's frame.
        colour: `#rrggbb`.
    """

    link: str
    form: ShapeForm
    part: VisualPart
    size: tuple[float, float, float]
    pose: Pose
    colour: str


@dataclass(frozen=True, slots=True)
class Strut:
    """Round rod between points of two links, each given in its link's frame [m]."""

    name: str
    first_link: str
    first: tuple[float, float, float]
    second_link: str
    second: tuple[float, float, float]
    diameter: float
    colour: str


@dataclass(frozen=True, slots=True)
class RobotVisuals:
    """All shapes of a robot; struts only where legs join two links."""

    name: str
    shapes: tuple[VisualShape, ...]
    struts: tuple[Strut, ...] = ()


# Proportions. Lengths that a file does not give are fractions of the arm's length.
_TUBE_ASPECT = 1.5  # length over width, beyond which a link nearly as wide as deep is a tube
_TUBE_SQUARE = 1.3
_HUB_OVERHANG = 1.1  # length of a hub over the width of the parts that it joins
_HUB_SHARE = 0.46  # of the narrowest width across the axis, as a radius
_LONGEST_HUB = 3.0  # times the radius; a longer hub is a tube that rotates about itself
_RING = 0.5
_BONE = 0.03  # radius of a link without shapes, at the root; less towards the tip
_GAP = 0.05  # greatest gap between a link's shapes and its joints
_PLATE = 0.012


def robot_visuals(robot: Robot) -> RobotVisuals:
    """Return the shapes that show a robot."""
    colours = palette(robot.manufacturer, robot.model)
    if isinstance(robot, ParallelRobot):
        return _platform(robot, colours)
    return RobotVisuals(robot.name, tuple(_arm(robot, colours)))


def _arm(robot: SerialRobot, colours: Palette) -> Iterator[VisualShape]:
    length = _arm_length(robot)
    boxes = {link: [box_of(each) for each in robot.collision.get(link, ())] for link in robot.links}
    for index, link in enumerate(robot.links):
        shown = [
            *(_body(link, shape, colours) for shape in robot.collision.get(link, ())),
            *_bone(robot, index, boxes[link], length, colours),
        ]
        above = robot.joints[index - 1] if index else None
        if isinstance(above, Joint):
            shown.append(_hub(above, boxes, length, colours))
        if index == 0:
            shown.append(_foot(link, boxes[link], length, colours))
        elif not shown or index == len(robot.links) - 1:
            shown.append(_flange(robot, link, boxes, length, colours))
        yield from shown


def _arm_length(robot: SerialRobot) -> float:
    return max(0.1, sum(math.hypot(*joint.origin.xyz) for joint in robot.joints))


def _body(link: str, shape: Shape, colours: Palette) -> VisualShape:
    pose = Pose.from_rpy(shape.xyz, shape.rpy)
    if isinstance(shape, SphereFacts):
        width = 2.0 * shape.radius
        return VisualShape(
            link, ShapeForm.SPHERE, VisualPart.BODY, (width,) * 3, pose, colours.body
        )
    if isinstance(shape, CapsuleFacts):
        width = 2.0 * shape.radius
        size = (width, width, shape.length + width)
        return VisualShape(link, ShapeForm.CAPSULE, VisualPart.BODY, size, pose, colours.body)
    order = np.argsort(shape.size)
    thin, wide, long = (shape.size[axis] for axis in order)
    if long < _TUBE_ASPECT * wide or wide > _TUBE_SQUARE * thin:
        return VisualShape(link, ShapeForm.BOX, VisualPart.BODY, shape.size, pose, colours.body)
    turned = pose.compose(_along(np.eye(3)[order[2]]))
    return VisualShape(
        link, ShapeForm.CYLINDER, VisualPart.BODY, (wide, wide, long), turned, colours.body
    )


def _bone(
    robot: SerialRobot, index: int, boxes: Sequence[LinkBox], length: float, colours: Palette
) -> Iterator[VisualShape]:
    """Yield a rod from a link's joint to the next, where its shapes do not reach both axes."""
    if index >= len(robot.joints):
        return
    above, below = robot.joints[index - 1] if index else None, robot.joints[index]
    origin = Pose.from_rpy(below.origin.xyz, below.origin.rpy)
    end = origin.position
    span = float(np.linalg.norm(end))
    ends = ((np.zeros(3), _axis(above)), (end, origin.rotation @ _axis(below)))
    bridged = boxes and all(
        any(
            chord(box, point, axis) is not None or box.distance(point) <= _GAP * length
            for box in boxes
        )
        for point, axis in ends
    )
    if span < _GAP * length or bridged:
        return
    width = 2.0 * length * _BONE * (1.0 - 0.6 * index / len(robot.joints))
    pose = Pose.from_matrix(_along(end / span).rotation, end / 2.0)
    size = (width, width, span + width)
    yield VisualShape(
        robot.links[index], ShapeForm.CAPSULE, VisualPart.BODY, size, pose, colours.body
    )


def _axis(joint: AnyJoint | None) -> Array:
    if not isinstance(joint, Joint):
        return np.array([0.0, 0.0, 1.0])
    return np.array(joint.axis) / math.hypot(*joint.axis)


def _hub(
    joint: Joint, boxes: dict[str, list[LinkBox]], length: float, colours: Palette
) -> VisualShape:
    """Return a drum about a joint's axis, as long as the joined parts are wide, in the child."""
    axis = _axis(joint)
    origin = Pose.from_rpy(joint.origin.xyz, joint.origin.rpy)
    chords, widths = [], []
    for link, point, direction in (
        (joint.parent, origin.position, origin.rotation @ axis),
        (joint.child, np.zeros(3), axis),
    ):
        cuts = [(box, chord(box, point, direction)) for box in boxes[link]]
        found = [cut for _, cut in cuts if cut is not None]
        widths += [box.width_across(direction) for box, cut in cuts if cut is not None]
        if found:
            chords.append((min(low for low, _ in found), max(high for _, high in found)))
    radius = _HUB_SHARE * min(widths) if widths else 1.3 * _BONE * length
    low, high = (
        (min(c[0] for c in chords), max(c[1] for c in chords)) if chords else (-radius, radius)
    )
    if joint.prismatic:
        size = (1.6 * radius, 1.6 * radius, 2.0 * radius)
        return VisualShape(
            joint.child, ShapeForm.BOX, VisualPart.JOINT, size, _along(axis), colours.joint
        )
    if high - low > _LONGEST_HUB * radius:
        # The axis runs along the bodies: a ring where the one ends and the other begins.
        middle = (max(c[0] for c in chords) + min(c[1] for c in chords)) / 2.0
        radius /= 2.0 * _HUB_SHARE
        low, high = middle - _RING * radius, middle + _RING * radius
    width, span = 2.0 * radius * _HUB_OVERHANG, (high - low) * _HUB_OVERHANG
    pose = Pose.from_matrix(_along(axis).rotation, axis * (low + high) / 2.0)
    return VisualShape(
        joint.child, ShapeForm.CYLINDER, VisualPart.JOINT, (width, width, span), pose, colours.joint
    )


def _foot(link: str, boxes: Sequence[LinkBox], length: float, colours: Palette) -> VisualShape:
    thickness = _PLATE * length
    if not boxes:
        size = (0.24 * length, 0.24 * length, thickness)
        pose = Pose.from_rpy((0.0, 0.0, -thickness / 2.0), (0.0, 0.0, 0.0))
        return VisualShape(link, ShapeForm.CYLINDER, VisualPart.FOOT, size, pose, colours.foot)
    corners = np.vstack([box.corners() for box in boxes])
    low, high = corners.min(axis=0), corners.max(axis=0)
    centre = (low + high) / 2.0
    x, y, _ = 1.08 * (high - low)
    pose = Pose.from_rpy((centre[0], centre[1], low[2]), (0.0, 0.0, 0.0))
    return VisualShape(link, ShapeForm.BOX, VisualPart.FOOT, (x, y, thickness), pose, colours.foot)


def _flange(
    robot: SerialRobot, link: str, boxes: dict[str, list[LinkBox]], length: float, colours: Palette
) -> VisualShape:
    """Return a disc for a link that is only a frame, as wide as the last link with shapes."""
    before = [box for each in robot.links[: robot.links.index(link) + 1] for box in boxes[each]]
    width = 0.8 * sorted(before[-1].size)[1] if before else 1.5 * _BONE * length
    pose = Pose.from_rpy((0.0, 0.0, -0.1 * width), (0.0, 0.0, 0.0))
    size = (width, width, 0.2 * width)
    return VisualShape(link, ShapeForm.CYLINDER, VisualPart.FLANGE, size, pose, colours.joint)


def _platform(robot: ParallelRobot, colours: Palette) -> RobotVisuals:
    shapes = tuple(
        _body(link, shape, colours) for link, shapes in robot.collision.items() for shape in shapes
    )
    struts = tuple(
        Strut(
            name,
            robot.root_link,
            base.xyz,
            robot.tool_link,
            platform.xyz,
            2.0 * robot.leg.body_radius,
            colours.joint,
        )
        for name, base, platform in zip(
            robot.joint_names, robot.base_anchors, robot.platform_anchors, strict=True
        )
    )
    return RobotVisuals(robot.name, shapes, struts)


def _along(direction: Array) -> Pose:
    """Return the least rotation that moves z to a (3,) unit direction."""
    x, y, z = direction.tolist()
    if z < -1.0 + 1e-12:
        return Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    # Half-angle form of the rotation about z × direction.
    return Pose(np.zeros(3), np.array([-y, x, 0.0, 1.0 + z]))
