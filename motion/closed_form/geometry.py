"""Where the joint axes of a serial arm lie when every joint is at zero.

Owns the reading of axes, points and tool placement from a robot file, in the robot's base frame:
the screws of a product of exponentials. Knows no joint values, no limits and no pinocchio, so it
is also a second opinion on the forward kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..pose import Array, Pose
from ..robot import SerialRobot
from ..robot_schema import Joint, Placement


@dataclass(frozen=True, slots=True, eq=False)
class ArmGeometry:
    """The arm at its chain-side zero position, in the base frame; one row per moving joint.

    Attributes:
        axes: (m, 3) unit directions of the joint axes.
        points: (m, 3) a point on each axis [m].
        prismatic: (m,) whether the joint slides along its axis instead of turning about it.
        tool: (4, 4) placement of the tool link.
    """

    axes: Array
    points: Array
    prismatic: tuple[bool, ...]
    tool: Array

    def without_first(self) -> ArmGeometry:
        """Return the rest of the arm, the first joint held at zero."""
        return ArmGeometry(self.axes[1:], self.points[1:], self.prismatic[1:], self.tool)


def arm_geometry(robot: SerialRobot) -> ArmGeometry:
    """Read the geometry of a robot, dependent joints included."""
    placement = inverse(_base_in_root(robot))
    axes, points = [], []
    for joint in robot.joints:
        placement = placement @ _matrix(joint.origin)
        if isinstance(joint, Joint):
            axis = placement[:3, :3] @ np.array(joint.axis)
            axes.append(axis / np.linalg.norm(axis))
            points.append(placement[:3, 3])
    prismatic = tuple(joint.prismatic for joint in robot.moving)
    return ArmGeometry(np.array(axes), np.array(points), prismatic, placement)


def common_point(axes: Array, points: Array) -> tuple[Array, float]:
    """Return the point nearest to several lines, and its greatest distance from one of them.

    The sum of squared distances is least where Σ (I - aᵢaᵢᵀ)(x - pᵢ) = 0. Parallel lines have no
    single such point; the one of least norm is returned.

    Args:
        axes: (k, 3) unit directions.
        points: (k, 3) a point on each line [m].

    Returns:
        The (3,) point and the distance [m].
    """
    across = np.eye(3) - axes[:, :, np.newaxis] * axes[:, np.newaxis, :]
    right = np.einsum("kij,kj->i", across, points)
    point = np.linalg.lstsq(across.sum(axis=0), right, rcond=None)[0]
    distances = np.linalg.norm(np.einsum("kij,kj->ki", across, point - points), axis=1)
    return point, float(distances.max())


def rotation_about(axis: Array, angle: float) -> Array:
    """Return the (3, 3) rotation by an angle [rad] about a unit axis, by Rodrigues' formula."""
    x, y, z = axis.tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    return rotation


def inverse(placement: Array) -> Array:
    """Return the inverse of a (4, 4) placement."""
    result = np.eye(4)
    result[:3, :3] = placement[:3, :3].T
    result[:3, 3] = -placement[:3, :3].T @ placement[:3, 3]
    return result


def _base_in_root(robot: SerialRobot) -> Array:
    placement = np.eye(4)
    for joint in robot.joints:
        if robot.base_frame.parent == joint.parent:
            break
        placement = placement @ _matrix(joint.origin)
    return placement @ _matrix(robot.base_frame)


def _matrix(placement: Placement) -> Array:
    return Pose.from_rpy(placement.xyz, placement.rpy).to_matrix()
