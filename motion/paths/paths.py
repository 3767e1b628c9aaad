"""Geometric paths: curves in joint space, and curves of the tool.

Owns the functions that return a path: one straight line of the tool, several lines in sequence,
joint waypoints through poses. Circles, splines and mixed lists come from `segment_planning`,
joint-space curves from `joint_curves` and `blending`; they are exported here too. Knows no timing.
The server's event loop imports this module, so inverse kinematics is imported only by the functions
that search.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import BadArgument, NoMotion, OutOfRange, PlatformLimit, PoseUnreachable
from ..pose import Array, Pose
from ..trajectory.joint_curves import (
    COINCIDENT,
    JointLine,
    JointSpline,
    Path,
    check_extent,
    settle_start,
)
from .blending import JointPolyline
from .segment_planning import plan_path
from .segments import Circ, Lin, Ptp, Segment, Spline
from .tool_curves import ToolLine
from .tool_kinematics import ToolKinematics, joints_at
from .tool_paths import follow_tool_curve

__all__ = [
    "COINCIDENT",
    "Circ",
    "JointLine",
    "JointPolyline",
    "JointSpline",
    "Lin",
    "Path",
    "Ptp",
    "Segment",
    "Spline",
    "check_extent",
    "joint_path_through_poses",
    "linear_legs",
    "linear_path",
    "plan_path",
    "settle_start",
]


def linear_path(
    kinematics: ToolKinematics,
    start: Sequence[float] | Array,
    target: Pose,
    *,
    frame: str = "base",
) -> JointSpline:
    """Return the joint path of the tool along a straight line with an even rotation.

    The whole path is solved before any motion; see `follow_tool_curve`.

    Args:
        kinematics: the robot.
        start: (n,) where the robot stands; see `settle_start`.
        target: the tool pose at the end, in `frame`.
        frame: `base` or `root`.

    Returns:
        A path with two waypoints: its start and its end.

    Raises:
        PoseUnreachable: a pose of the line; with its fraction of the path.
        BranchChange: a joint would have to jump; with the fraction, the joint and the jump.
        OutOfRange: a pose of the line is reached only outside a joint's range, with its fraction;
            or the start is, or the curve between samples.
        NoMotion: the tool is there already.
        WrongJointCount: the start does not have one value per joint.
        NotFinite: the start holds an infinity or a NaN.
        FrameUnknown: there is no such frame.
    """
    here = settle_start(start, kinematics.limits)
    line = ToolLine(kinematics.forward(here), kinematics.to_base(target, frame))
    return follow_tool_curve(kinematics, here, line)


def linear_legs(
    kinematics: ToolKinematics,
    start: Sequence[float] | Array,
    poses: Sequence[Pose],
    *,
    frame: str = "base",
) -> list[JointSpline]:
    """Return straight tool lines in sequence, through several poses.

    The legs meet at corners, so each has to be timed from rest to rest. A pose where the tool
    already is adds no leg.

    Args:
        kinematics: the robot.
        start: (n,) where the robot stands [rad or m]; see `settle_start`.
        poses: one or more tool poses in `frame`; positions in m.
        frame: `base` or `root`.

    Returns:
        One path for each leg, each beginning where the one before ends.

    Raises:
        NoMotion: no pose adds a leg.
        BadArgument: there are no poses.
        MotionError: a leg is refused, as of `linear_path`.
    """
    if not poses:
        raise BadArgument("poses", 0, "at least one pose")
    legs: list[JointSpline] = []
    here = np.array(settle_start(start, kinematics.limits))
    for pose in poses:
        try:
            legs.append(linear_path(kinematics, here, pose, frame=frame))
        except NoMotion:
            continue
        here = legs[-1].goal
    if not legs:
        raise NoMotion
    return legs


def joint_path_through_poses(
    kinematics: ToolKinematics,
    start: Sequence[float] | Array,
    poses: Sequence[Pose],
    *,
    frame: str = "base",
) -> list[Array]:
    """Return joint waypoints that lead the tool through poses, each near the one before.

    Args:
        kinematics: the robot.
        start: (n,) where the robot stands; see `settle_start`.
        poses: tool poses in `frame`.
        frame: `base` or `root`.

    Returns:
        The start, then one joint position for each pose, as `JointSpline` takes them.

    Raises:
        PoseUnreachable: a pose; its fraction counts the poses.
        OutOfRange: a pose is reached only outside a joint's range, with its fraction; or the start
            is.
        WrongJointCount: the start does not have one value per joint.
        NotFinite: the start holds an infinity or a NaN.
        FrameUnknown: there is no such frame.
    """
    waypoints = [np.array(settle_start(start, kinematics.limits))]
    for number, pose in enumerate(poses, start=1):
        try:
            waypoints.append(joints_at(kinematics, pose, waypoints[-1], frame))
        except (OutOfRange, PlatformLimit, PoseUnreachable) as error:
            error.fraction = number / len(poses)
            raise
    return waypoints
