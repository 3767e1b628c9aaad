"""Tool kinematics for paths, with one function for serial arms and Stewart platforms each.

Owns the questions whose answer depends on the kind of robot: a joint position for a pose, and what
a path must obey beside the joint ranges. A platform answers a pose by formula, but its cones and
workspace belong to no joint. The server's event loop imports this module, so inverse kinematics is
imported only by the functions that search.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from ..kinematics.stewart.platform import StewartKinematics
from ..pose import Array, Pose
from ..trajectory.joint_curves import Path
from .stewart_path import check_path

NEAR_SINGULARITY = 0.1
"""Distance from a singularity within which it explains a jump [rad, m or no unit]."""

if TYPE_CHECKING:
    from ..kinematics.serial import Kinematics

ToolKinematics: TypeAlias = "Kinematics | StewartKinematics"


def joints_at(kinematics: ToolKinematics, pose: Pose, seed: Array, frame: str = "base") -> Array:
    """Return an (n,) joint position that reaches a pose, near the seed if there is one.

    Raises:
        PoseUnreachable: none does.
        OutOfRange: one does, but for a joint's range.
        PlatformLimit: the pose breaks a limit of the platform.
        FrameUnknown: there is no such frame.
    """
    if isinstance(kinematics, StewartKinematics):
        return kinematics.inverse(pose, frame)
    from ..kinematics.ik.ik import solve

    return solve(kinematics, pose, seed, frame=frame).joint_position


def next_joints(kinematics: ToolKinematics, pose: Pose, before: Array) -> Array:
    """Return the (n,) joint position that leads the tool on to a pose nearby, in the base frame.

    Args:
        before: (n,) joint position before it.

    Raises:
        MotionError: as of `joints_at`; no answer far from `before` is searched.
    """
    if isinstance(kinematics, StewartKinematics):
        return kinematics.inverse(pose)
    from ..kinematics.ik.ik import solve

    return solve(kinematics, pose, before, restarts=0, time_cap=None).joint_position


def check_workspace(kinematics: ToolKinematics, path: Path) -> None:
    """Check what a path must obey beside the joint ranges: nothing, except for a platform.

    Raises:
        PlatformLimit: a place breaks a cone or the workspace; the fraction is that of its leg.
        NoAssembly: no platform pose has the leg lengths of a place.
    """
    if isinstance(kinematics, StewartKinematics):
        check_path(kinematics, path)


def singularity_near(kinematics: ToolKinematics, joint_position: Array) -> str:
    """Return the name of the singularity that a joint position is at, empty if it is at none."""
    if isinstance(kinematics, StewartKinematics):
        return ""
    from ..kinematics.ik.singularity import dexterity

    found = dexterity(kinematics, joint_position)
    return found.kind.value if found.distance < NEAR_SINGULARITY else ""


def leg_of(path: Path, fraction: float) -> tuple[int, float]:
    """Return the part between two waypoints at a fraction of the length, and how far along it."""
    passed = path.knots[path.waypoint_knots]
    leg = int(np.clip(np.searchsorted(passed, fraction * path.length) - 1, 0, len(passed) - 2))
    begin, end = passed[leg : leg + 2].tolist()
    along = (fraction * path.length - begin) / (end - begin) if end > begin else 1.0
    return leg, min(max(along, 0.0), 1.0)
