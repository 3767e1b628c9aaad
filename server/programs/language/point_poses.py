"""Poses of teach points: as values of motion, and compared with the points' joints.

Knows no kinematics: the caller of the comparison supplies them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from openpendant.motion.pose import Pose
from openpendant.simplemsg.pendant.management.program_values import (
    JointVector,
    PointPose,
    TeachPoint,
)

from .program_errors import PointInconsistent

_POSITION_TOLERANCE = 1e-4
_ROTATION_TOLERANCE = 1e-3


def pose_of(placed: PointPose) -> Pose:
    """Return where the tool is in its frame, with the quaternion normalised."""
    return Pose.from_values(placed.position, placed.quaternion)


Forward: TypeAlias = Callable[[JointVector, str, str], Pose]
"""Forward kinematics of (joints, frame's name, tool's name): the tool's pose in the frame."""


def check_consistency(
    point: TeachPoint,
    forward: Forward,
    *,
    position_tolerance: float = _POSITION_TOLERANCE,
    rotation_tolerance: float = _ROTATION_TOLERANCE,
) -> None:
    """Check that a point's joints put its tool where its pose says; a point without one passes.

    Args:
        forward: the robot's forward kinematics, with the tools and frames of the cell.
        position_tolerance: greatest distance of both places [m].
        rotation_tolerance: greatest angle between both orientations [rad].

    Raises:
        PointInconsistent: they differ by more.
        MotionError: the frame or the tool is unknown.
    """
    if point.pose is None:
        return
    there = pose_of(point.pose)
    reached = forward(point.joints, point.pose.frame, point.pose.tool)
    distance = reached.position_distance(there)
    angle = reached.rotation_distance(there)
    if not (distance <= position_tolerance and angle <= rotation_tolerance):
        within = f"{position_tolerance:g} m and {rotation_tolerance:g} rad"
        raise PointInconsistent(point.name, distance, angle, within)
