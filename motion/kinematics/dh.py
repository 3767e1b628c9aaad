"""Forward kinematics from Denavit–Hartenberg tables: a robot file's, and that of RoboAnalyzer.

Owns the standard convention: tool = base · ∏ Rz(theta) Tz(d) Tx(a) Rx(alpha) · tool (J. Denavit and
R. S. Hartenberg, *A Kinematic Notation for Lower-Pair Mechanisms*, 1955, in the form of R. P. Paul,
*Robot Manipulators*, 1981). It shares nothing with the chain's kinematics, so that each can be
checked against the other.

Owns also the map from our joint positions to those of RoboAnalyzer's Virtual Robot Module (VRM),
theta_vrm = sign · q + offset, joint by joint, and its ∏ Rz(theta) Tz(b) Tx(a) Rx(alpha) · tool, in
the root link's frame. Source: the `robot.xml` files of RoboAnalyzer 7.1, which writes b for the
usual d.

`moving` is the (r,) chain-side position of each joint that moves [rad or m], dependent ones
included: one for each row of a table, else `WrongJointCount` or `NotFinite`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..description.robot import SerialRobot
from ..description.schema import DhRow, DhTable, Placement, Variable, Vrm
from ..errors import BadArgument, NotFinite, WrongJointCount
from ..pose import Array, Pose

SAMPLES = 50
"""Random positions at which a table is compared with the chain."""


class TableDifference(NamedTuple):
    """Greatest difference of two forward kinematics over random positions inside the limits."""

    position: float  # m
    rotation: float  # rad


def dh_forward(table: DhTable, moving: Sequence[float]) -> Pose:
    """Return the tool's pose in the root link's frame."""
    placement = _frames(table, moving)[-1] @ _matrix(table.tool)
    return Pose.from_matrix(placement[:3, :3], placement[:3, 3])


def dh_frames(table: DhTable, moving: Sequence[float]) -> tuple[Pose, ...]:
    """Return the frames in the root link's: 0, with joint 1's axis as z, then each row's end."""
    frames = _frames(table, moving)
    return tuple(Pose.from_matrix(frame[:3, :3], frame[:3, 3]) for frame in frames)


def _frames(table: DhTable, moving: Sequence[float]) -> list[Array]:
    if len(moving) != len(table.rows):
        raise WrongJointCount(len(moving), len(table.rows))
    frames = [_matrix(table.base)]
    for index, (row, value) in enumerate(zip(table.rows, moving, strict=True)):
        if not math.isfinite(value):
            raise NotFinite("the joint position", index)
        frames.append(frames[-1] @ _row(row, value))
    return frames


def _row(row: DhRow, value: float) -> Array:
    angle_moves = row.variable is Variable.THETA
    theta = row.theta_offset + (value if angle_moves else 0.0)
    d = row.d + (0.0 if angle_moves else value)
    return dh_matrix(theta, d, row.a, row.alpha)


def dh_matrix(theta: float, d: float, a: float, alpha: float) -> Array:
    """Return Rz(theta) Tz(d) Tx(a) Rx(alpha), (4, 4) [rad, m]."""
    ct, st, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
    return np.array(
        [
            [ct, -st * ca, st * sa, a * ct],
            [st, ct * ca, -ct * sa, a * st],
            [0.0, sa, ca, d],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def _matrix(placement: Placement) -> Array:
    return Pose.from_rpy(placement.xyz, placement.rpy).to_matrix()


def vrm_of(robot: SerialRobot) -> Vrm:
    """Return a robot's VRM table, or raise `BadArgument` if it is not one of the module's."""
    if robot.vrm is None:
        raise BadArgument("robot", robot.name, "a robot of RoboAnalyzer's Virtual Robot Module")
    return robot.vrm


def vrm_angles(vrm: Vrm, moving: Sequence[float]) -> tuple[float, ...]:
    """Return the module's joint angles [rad]."""
    if len(moving) != len(vrm.rows):
        raise WrongJointCount(len(moving), len(vrm.rows))
    signs, offsets = vrm.map.sign, vrm.map.offset
    return tuple(
        sign * value + offset for sign, value, offset in zip(signs, moving, offsets, strict=True)
    )


def vrm_forward(vrm: Vrm, moving: Sequence[float]) -> Pose:
    """Return the tool's pose in the root link's frame, by the module's rows."""
    placement = np.eye(4)
    for row, theta in zip(vrm.rows, vrm_angles(vrm, moving), strict=True):
        placement = placement @ dh_matrix(theta, row.b, row.a, row.alpha)
    tool = Pose.from_rpy(vrm.tool.xyz, vrm.tool.rpy)
    return Pose.from_matrix(placement[:3, :3], placement[:3, 3]).compose(tool)


def dh_difference(robot: SerialRobot) -> TableDifference | None:
    """Return the difference of a robot's DH table from the chain; None without a table."""
    table = robot.dh
    if table is None:
        return None
    return _difference(robot, lambda moving: dh_forward(table, moving))


def vrm_difference(robot: SerialRobot) -> TableDifference:
    """Return the difference between the module's forward kinematics and the chain's."""
    vrm = vrm_of(robot)
    return _difference(robot, lambda moving: vrm_forward(vrm, moving))


def _difference(robot: SerialRobot, by_table: Callable[[list[float]], Pose]) -> TableDifference:
    # Imported here, since listing and showing robots must not wait for pinocchio.
    from .pinocchio_model import model_map
    from .serial import Kinematics

    kinematics = Kinematics(robot)
    gain, offset = model_map(robot)
    random = np.random.default_rng(0)
    position = rotation = 0.0
    for joints in random.uniform(kinematics.lower, kinematics.upper, (SAMPLES, robot.dof)):
        by_chain = kinematics.forward(joints, "root")
        pose = by_table((gain @ joints + offset).tolist())
        position = max(position, by_chain.position_distance(pose))
        rotation = max(rotation, by_chain.rotation_distance(pose))
    return TableDifference(position, rotation)
