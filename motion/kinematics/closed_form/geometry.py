"""Geometry of a serial arm for closed forms, and the protocol of every closed form.

Owns the reading of axes, points and tool placement from a robot file, with every joint at zero, in
the robot's base frame: the screws of a product of exponentials. This reading knows no joint values,
no limits and no pinocchio, so it is also a check of the forward kinematics.

Owns also the types shared by the families: the branches that a closed form returns, and the three
measures whose signs are an arm's configuration and whose zeros are its singularities.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np

from ...description.robot import SerialRobot
from ...description.schema import Joint, Placement
from ...pose import Array, Pose

FULL_TURN = 2.0 * math.pi

Position: TypeAlias = tuple[float, ...]
"""Chain-side joint position [rad or m], each angle in any revolution."""


class Branches(NamedTuple):
    """Joint positions that reach a pose, or come nearest to it; two lists of the same length.

    Attributes:
        positions: the joint position of each branch.
        gaps: distance of the wrist from where the pose needs it [m]; 0 if it gets there.
    """

    positions: list[Position]
    gaps: list[float]

    def within(self, gap: float) -> list[Position]:
        """Return the positions of the branches that miss the pose by a gap [m] at most."""
        if max(self.gaps, default=0.0) <= gap:
            return self.positions
        return [self.positions[index] for index, miss in enumerate(self.gaps) if miss <= gap]


class Measures(NamedTuple):
    """Three lengths and angles whose product is the Jacobian's determinant, up to a factor.

    Attributes:
        shoulder: distance of the wrist in front of axis 1 [m]; behind it, negative.
        elbow: the bend from upper arm to forearm [rad], 0 if straight, ±π if folded; positive
            where the elbow is above the line from shoulder to wrist in the frame of axis 1.
        wrist: angle of the wrist's middle joint from where its outer axes are parallel [rad].
    """

    shoulder: float
    elbow: float
    wrist: float


class ClosedForm(Protocol):
    """Inverse kinematics by formulas, without limits; all values chain-side.

    Attributes:
        free_joint: index of the joint whose position is a free choice in any pose; None without
            a spare joint.
    """

    @property
    def free_joint(self) -> int | None:
        """Index of the joint whose position is a free choice; None without a spare joint."""
        ...

    def branches(self, target: Array, preferred: Sequence[float]) -> Branches:
        """Return all joint positions that reach a pose, at most eight.

        Args:
            target: (4, 4) wanted tool placement in the base frame.
            preferred: values that the free joint, and undetermined joints, keep [rad or m].

        Returns:
            The branches; where the pose is out of reach, nearest misses with their gaps.
        """
        ...

    def measures(self, position: Sequence[float]) -> Measures:
        """Return the signed distances of a joint position from the singularities."""
        ...


def wrapped(angle: float) -> float:
    """Return the same direction as an angle from -π to π [rad]."""
    return math.remainder(angle, FULL_TURN)


@dataclass(frozen=True, slots=True, eq=False)
class ArmGeometry:
    """Arm at its chain-side zero position, in the base frame; one row per moving joint.

    Attributes:
        axes: (m, 3) unit directions of the joint axes.
        points: (m, 3) a point on each axis [m].
        prismatic: (m,) True if the joint slides along its axis instead of rotating about it.
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
    """Return the geometry of a robot, dependent joints included."""
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
