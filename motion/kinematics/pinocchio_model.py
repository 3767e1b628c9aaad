"""Pinocchio model of a serial robot, and the map from the controller's joints to the model's.

Owns the translation of a robot file's links and joints, and the one affine map from a
controller-side joint vector (n driven joints) to the model's vector (every moving joint, base to
tip): coupling, dependent joints and file order are all in it. Kinematics of the model are
`serial`'s.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..description.robot import SerialRobot
from ..description.schema import Joint, Placement
from ..pose import Array


def base_in_root(robot: SerialRobot) -> Any:
    """Return the pose of the robot's base frame in its root link, as a pinocchio placement."""
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


def model_map(robot: SerialRobot) -> tuple[Array, Array]:
    """Return gain (m, n) and offset (m,) with model vector = gain · controller vector + offset.

    The model vector has one value per moving joint (m), driven or dependent, base to tip.
    """
    chain_side = np.eye(robot.dof)
    if robot.coupling.state_factor:
        chain_side[2, 1] = robot.coupling.state_factor
    row_of = {joint.name: chain_side[index] for index, joint in enumerate(robot.driven)}
    gain = np.zeros((len(robot.moving), robot.dof))
    offset = np.zeros(len(robot.moving))
    for index, joint in enumerate(robot.moving):
        if joint.dependent is None:
            gain[index] = row_of[joint.name]
            continue
        offset[index] = joint.dependent.offset
        for term in joint.dependent.terms:
            gain[index] += term.gain * row_of[term.joint]
    return gain, offset


def greatest_travel(robot: SerialRobot) -> list[float]:
    """Return the greatest distance of each moving joint from its zero, (m,) [rad or m].

    For driven joints in their ranges: a dependent joint goes where they move it, whatever its own
    range in the robot file.
    """
    gain, offset = model_map(robot)
    ends = np.stack((gain * robot.limits.lower, gain * robot.limits.upper))
    least, most = (offset + side.sum(axis=1) for side in (ends.min(axis=0), ends.max(axis=0)))
    travel: list[float] = np.maximum(np.abs(least), np.abs(most)).tolist()
    return travel


def turning_joints(robot: SerialRobot, gain: Array) -> NDArray[np.bool_]:
    """Return (n,) True if a full revolution of the joint leaves the tool where it was, read-only.

    Args:
        gain: (m, n) as of `model_map`.
    """
    # A coupled or dependent joint follows by its gain, so the gain must be a whole number.
    prismatic = np.array([joint.prismatic for joint in robot.moving])
    whole = (gain == np.round(gain)) & ~prismatic[:, None]
    turning: NDArray[np.bool_] = (whole | (gain == 0.0)).all(axis=0)
    turning.flags.writeable = False
    return turning
