"""ROS planning: timing of a ROS-Industrial trajectory, never faster than it was asked.

Owns the approach to a first point where the robot does not stand, and the rule of each segment.
Runs in the planning process.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import NoMotion
from openpendant.motion.paths.paths import COINCIDENT, JointSpline
from openpendant.motion.timing.parameterization import SegmentRule, time_path
from openpendant.motion.trajectory.trajectory import Trajectory, join

from ..jobs import JointVector, RosPathJob, RosPoint


def plan_ros_path(job: RosPathJob, limits: JointLimits) -> Trajectory:
    """Plan the motion that a ROS-I trajectory asks for.

    Args:
        limits: joint limits, controller side.

    Returns:
        One trajectory from where the robot stands through all points: the approach to the first
        where it stands elsewhere, then the rest without a stop.

    Raises:
        NoMotion: the robot stands at the only point already.
        MotionError: the motion cannot be made.
    """
    first, *rest = job.points
    somewhere = [point for point in rest if not _coincide(point.position, first.position)]
    legs: list[Trajectory] = []
    start = job.start
    elsewhere = _distance(start, first.position) > job.approach_tolerance
    if elsewhere or not (somewhere or _coincide(start, first.position)):
        speed = min(job.approach_speed, first.speed_fraction)
        legs.append(_follow(start, [replace(first, speed_fraction=speed)], limits))
        start = first.position
    if somewhere:
        legs.append(_follow(start, rest, limits))
    if not legs:
        raise NoMotion
    return join(legs)


def _distance(one: JointVector, other: JointVector) -> float:
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


def _coincide(one: JointVector, other: JointVector) -> bool:
    return _distance(one, other) < COINCIDENT


def _follow(start: JointVector, points: Sequence[RosPoint], limits: JointLimits) -> Trajectory:
    """Run through points without a stop; a point that comes twice makes its way take longer."""
    path = JointSpline([start, *(point.position for point in points)], limits)
    rules = [SegmentRule(point.min_duration, point.speed_fraction) for point in points]
    return time_path(path, limits, segments=rules)
