"""The pinocchio model of a serial robot, built from its description.

Owns how links and joints of a robot file become the model's; who asks the model is `kinematics`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from .robot import SerialRobot
from .robot_schema import Joint, Placement


def base_in_root(robot: SerialRobot) -> Any:
    """Return where the robot's base frame is in its root link, as a pinocchio placement."""
    placement = pin.SE3.Identity()
    for joint in robot.joints:
        if robot.base_frame.parent == joint.parent:
            break
        placement = placement * _placement(joint.origin)
    return placement * _placement(robot.base_frame)


def serial_model(robot: SerialRobot, root: Any) -> Any:
    """Return the pinocchio model of a robot, with a frame for each link.

    Args:
        robot: the robot; its joints are the model's in their order.
        root: placement of its root link in what the model calls the world.
    """
    model = pin.Model()
    joint_id, placement = 0, root
    model.addFrame(pin.Frame(robot.root_link, 0, 0, placement, pin.FrameType.BODY))
    for joint in robot.joints:
        placement = placement * _placement(joint.origin)
        if isinstance(joint, Joint):
            joint_id = model.addJoint(joint_id, _joint_model(joint), placement, joint.name)
            placement = pin.SE3.Identity()
        model.addFrame(pin.Frame(joint.child, joint_id, 0, placement, pin.FrameType.BODY))
    return model


def _placement(placement: Placement) -> Any:
    rotation = pin.rpy.rpyToMatrix(*placement.rpy)
    return pin.SE3(rotation, np.array(placement.xyz))


def _joint_model(joint: Joint) -> Any:
    axis = np.array(joint.axis)
    axis /= np.linalg.norm(axis)
    if joint.prismatic:
        return pin.JointModelPrismaticUnaligned(axis)
    return pin.JointModelRevoluteUnaligned(axis)
