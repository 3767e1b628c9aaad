"""RoboAnalyzer's Virtual Robot Module (VRM): its robots in its own rows, letters and angles.

Owns the map from our joint positions to the module's: theta_vrm = sign · q + offset, joint by
joint, and its forward kinematics ∏ Rz(theta) Tz(b) Tx(a) Rx(alpha) · tool, in the root link's
frame. Source: the `robot.xml` files of RoboAnalyzer 7.1, which writes b for the usual d.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..description.robot import SerialRobot
from ..description.schema import Vrm
from ..errors import BadArgument, WrongJointCount
from ..pose import Pose
from .dh import dh_matrix
from .pinocchio_model import model_map
from .serial import Kinematics

_SAMPLES = 50


@dataclass(frozen=True, slots=True)
class TableDifference:
    """Greatest difference of two forward kinematics over random positions inside the limits."""

    position: float  # m
    rotation: float  # rad
    samples: int


def vrm_of(robot: SerialRobot) -> Vrm:
    """Return a robot's VRM table.

    Raises:
        BadArgument: the robot is not one of the module's.
    """
    if robot.vrm is None:
        raise BadArgument("robot", robot.name, "a robot of RoboAnalyzer's Virtual Robot Module")
    return robot.vrm


def vrm_angles(vrm: Vrm, moving: Sequence[float]) -> tuple[float, ...]:
    """Return the module's joint angles [rad].

    Args:
        vrm: the robot's table.
        moving: (r,) chain-side position of each joint that moves [rad], dependent ones included.

    Raises:
        WrongJointCount: not one value per row.
    """
    if len(moving) != len(vrm.rows):
        raise WrongJointCount(len(moving), len(vrm.rows))
    signs, offsets = vrm.map.sign, vrm.map.offset
    return tuple(
        sign * value + offset for sign, value, offset in zip(signs, moving, offsets, strict=True)
    )


def vrm_forward(vrm: Vrm, moving: Sequence[float]) -> Pose:
    """Return the tool's pose in the root link's frame, by the module's rows.

    Args:
        vrm: the robot's table.
        moving: (r,) chain-side position of each joint that moves [rad], dependent ones included.

    Raises:
        WrongJointCount: not one value per row.
    """
    placement = np.eye(4)
    for row, theta in zip(vrm.rows, vrm_angles(vrm, moving), strict=True):
        placement = placement @ dh_matrix(theta, row.b, row.a, row.alpha)
    tool = Pose.from_rpy(vrm.tool.xyz, vrm.tool.rpy)
    return Pose.from_matrix(placement[:3, :3], placement[:3, 3]).compose(tool)


def vrm_difference(robot: SerialRobot, samples: int = _SAMPLES) -> TableDifference:
    """Return the difference between the module's forward kinematics and the chain's.

    Raises:
        BadArgument: the robot is not one of the module's.
    """
    vrm = vrm_of(robot)
    kinematics = Kinematics(robot)
    gain, offset = model_map(robot)
    random = np.random.default_rng(0)
    position = rotation = 0.0
    for joints in random.uniform(kinematics.lower, kinematics.upper, (samples, robot.dof)):
        by_chain = kinematics.forward(joints, "root")
        by_module = vrm_forward(vrm, (gain @ joints + offset).tolist())
        position = max(position, by_chain.position_distance(by_module))
        rotation = max(rotation, by_chain.rotation_distance(by_module))
    return TableDifference(position, rotation, samples)
