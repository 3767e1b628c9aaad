"""A robot whose tool link is the centre point of a tool that is bolted to it.

Owns how a tool is put at the end of a chain. Whoever plans with the kinematics of such a robot
leads the tool centre point along lines and circles, turns about it, and asks for its poses.
"""

from __future__ import annotations

import math

from .pose import Array, Pose
from .robot import SerialRobot
from .robot_schema import FixedJoint, JointType, Placement

_LINK = "tool_centre_point"

_UPRIGHT = 1e-9
"""Cosine of the pitch below which roll and yaw turn about one axis."""


def with_tool(robot: SerialRobot, tcp: Pose) -> SerialRobot:
    """Return a robot with a tool: one fixed joint more, which ends at the tool centre point.

    Joints, limits and base frame are the same, so a joint position is one of both.

    Args:
        robot: the bare robot.
        tcp: the tool centre point in the frame of the robot's tool link.
    """
    link = _LINK
    while link in robot.links:
        link += "_"
    x, y, z = tcp.position.tolist()
    bolted = FixedJoint(
        type=JointType.FIXED,
        name=f"{link}_mount",
        parent=robot.tool_link,
        child=link,
        origin=Placement(xyz=(x, y, z), rpy=_roll_pitch_yaw(tcp.rotation)),
    )
    facts = {
        field.alias or name: getattr(robot, name)
        for name, field in SerialRobot.model_fields.items()
    }
    return SerialRobot(**facts | {"joints": (*robot.joints, bolted), "tool_link": link})


def _roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    """Return the turns about fixed x, y, z, in that order, that make a (3, 3) rotation [rad]."""
    (r00, _, _), (r10, r11, r12), (r20, r21, r22) = rotation.tolist()
    level = math.hypot(r00, r10)
    pitch = math.atan2(-r20, level)
    if level < _UPRIGHT:
        return math.atan2(-r12, r11), pitch, 0.0
    return math.atan2(r21, r22), pitch, math.atan2(r10, r00)
