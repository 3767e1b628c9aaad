"""Grasping: whether a tool is at an object, and the scene after it has taken the object.

Owns which point of a link grasps, and the rule that what is beyond its reach is not taken. Nothing
snaps: a taken object keeps its place. Knows no time, and whether the joints are the reported ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..errors import NothingGripped, ObjectHeld
from ..frames.frame_tree import FLANGE, TOOL, FrameTree
from ..frames.grasp import DEFAULT_GRASP
from ..kinematics.serial import Kinematics
from ..pose import Pose
from .collision import distance_to_point
from .scene import Scene


class Grip(NamedTuple):
    """An object taken.

    Attributes:
        scene: with the object held.
        distance: from the grasp point to the nearest point of the body [m]; 0 inside.
        grasp: pose of the object in the tool, or in the link where it is not the tool's.
    """

    scene: Scene
    distance: float
    grasp: Pose


def gripped(
    kinematics: Kinematics,
    frames: FrameTree,
    scene: Scene,
    name: str,
    joint_position: Sequence[float],
    link: str | None = None,
) -> Grip:
    """Let a link take an object where both are, if it is within reach.

    Args:
        frames: with the selected tool, whose grasp counts.
        joint_position: (n,) controller-side [rad or m].
        link: what takes it, and may touch it from now on; None for the link of the tool. Another
            one is measured from its origin, with the default reach.

    Raises:
        UnknownObject: there is no such object.
        ObjectHeld: a link holds it already.
        FrameUnknown: there is no such link.
        NothingGripped: it is beyond reach.
        MeshFileError: its mesh cannot be read.
    """
    standing = scene.get(name)
    if standing.link is not None:
        raise ObjectHeld(name, standing.link)
    flange = kinematics.robot.tool_link
    taking = link or flange
    at = kinematics.forward(joint_position, link=taking)
    if taking == flange:
        tool, grasp = frames.selected_tool or FLANGE, frames.grasp
        holder = at.compose(frames[TOOL].pose or Pose.identity())
    else:
        tool, grasp, holder = taking, DEFAULT_GRASP, at
    place = kinematics.to_base(standing.pose, standing.frame)
    point = holder.position + holder.rotation @ grasp.point
    distance = distance_to_point(standing.shape, place.rotation.T @ (point - place.position))
    if distance > grasp.reach:
        raise NothingGripped(name, tool, distance, grasp.reach)
    origin = kinematics.to_base(Pose.identity(), standing.frame)
    taken = scene.attach(name, taking, origin.inverse().compose(at), touching=(taking,))
    return Grip(taken, distance, holder.inverse().compose(place))
