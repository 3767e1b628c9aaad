"""Grasping: whether a tool is at an object, and the scene after it has taken the object.

Owns which point of a link grasps, and the rule that what is beyond its reach is not taken. Nothing
snaps: a taken object keeps its place. Knows no time, and whether the joints are the reported ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..errors import NothingGripped, ObjectHeld
from ..frames.frame_tree import FLANGE, TOOL, FrameTree
from ..frames.grasp import DEFAULT_GRASP, Grasp
from ..kinematics.serial import Kinematics
from ..pose import Pose
from ..steps import Stepwise
from .collision import distance_to_point
from .scene import Scene, SceneObject

_PER_HELD = 20.0  # µs on an ordinary machine: to measure how far a held body is
_PER_COMPARED = 0.3  # µs
_SLACK = 1e-9
"""What rounding may add to the distance of an object that was within reach [m]."""


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
    distance = _distance(standing, place, holder, grasp)
    if distance > grasp.reach:
        raise NothingGripped(name, tool, distance, grasp.reach)
    origin = kinematics.to_base(Pose.identity(), standing.frame)
    taken = scene.attach(name, taking, origin.inverse().compose(at), touching=(taking,))
    return Grip(taken, distance, holder.inverse().compose(place))


def _distance(body: SceneObject, place: Pose, holder: Pose, grasp: Grasp) -> float:
    """Return how far a grasp point is from a body [m], both in one frame; 0 inside."""
    point = holder.position + holder.rotation @ grasp.point
    return distance_to_point(body.shape, place.rotation.T @ (point - place.position))


def held_steps(
    kinematics: Kinematics, frames: FrameTree, before: Scene, after: Scene
) -> Stepwise[None]:
    """Measure each object that a scene has a link hold and another had not, in steps.

    Whatever is held is held in its link's frame, so that this is the same at all joints. A link
    that there is not is whoever's business it is to build the scene.

    Raises:
        NothingGripped: it is beyond reach of its link, as of `gripped`.
    """
    yield _PER_COMPARED * (len(before.objects) + len(after.objects))
    known = {each.name: each for each in before.objects}
    links = frozenset(kinematics.robot.links)
    for each in after.objects:
        if each.link is None or each.link not in links or known.get(each.name) == each:
            continue
        yield _PER_HELD
        tool, grasp, holder = each.link, DEFAULT_GRASP, Pose.identity()
        if tool == kinematics.robot.tool_link:
            tool, grasp = frames.selected_tool or FLANGE, frames.grasp
            holder = frames[TOOL].pose or holder
        distance = _distance(each, each.pose, holder, grasp)
        if distance > grasp.reach + _SLACK:
            raise NothingGripped(each.name, tool, distance, grasp.reach)
