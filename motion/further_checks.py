"""Checks of a trajectory beyond the joint limits: speeds of the arm's points and turn, and jerk.

Independent of the planning: only samples are used, and forward kinematics at them. What is checked,
and why that refuses no sound trajectory, with h the sample period:

- |p(q + δ q̇) - p(q - δ q̇)| / 2δ ≤ limit (1 + 1e-6): the velocity of a point p at a sample, as a
  central difference over joint positions a few microradians apart.
- |p₊ - p| / h ≤ limit (1 + 1e-6): the chord between two samples is no longer than the way between
  them, so this is at most the mean speed there.
- |Δa| / h ≤ jerk limit (1 + 1e-3): the mean jerk over an interval is a jerk the motion had there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .errors import CertificateRefused, WrongJointCount
from .limits import JointLimits
from .tool_speed import PointPosition, ToolSpeedLimit
from .trajectory import Array, Trajectory

SPEED_TOLERANCE = 1e-6
JERK_TOLERANCE = 1e-3

_LEAP = 1e-5
"""Longest joint step of the central difference [rad or m]."""


class Extreme(NamedTuple):
    """The worst case of one quantity: `ratio` is to its limit, 1 being on the limit."""

    ratio: float
    joint: str
    time: float


class PointSpeed(NamedTuple):
    """The fastest moment of a point: `ratio` is to its limit, 1 being on the limit."""

    point: str
    limit: float
    ratio: float
    time: float


def check_tool_speed(
    trajectory: Trajectory, points: Sequence[ToolSpeedLimit]
) -> tuple[PointSpeed, ...]:
    """Check how fast points of the arm move.

    Args:
        trajectory: what is to be sent; two samples or more.
        points: the points and their limits.

    Returns:
        One finding for each point.

    Raises:
        CertificateRefused: a point is too fast; `joint` names the point.
    """
    return tuple(_point_speed(trajectory, point) for point in points)


def check_jerk(trajectory: Trajectory, limits: JointLimits, jerk: Sequence[float]) -> Extreme:
    """Check how sharply the accelerations change from sample to sample.

    Args:
        trajectory: what is to be sent; two samples or more.
        limits: whose joints they are.
        jerk: (n,) greatest jerk [rad/s³ or m/s³].

    Raises:
        CertificateRefused: a joint's jerk exceeds its limit.
        WrongJointCount: there is not one jerk limit for each joint.
    """
    if len(jerk) != limits.dof:
        raise WrongJointCount(len(jerk), limits.dof)
    period = float(trajectory.times[1] - trajectory.times[0])
    measured = np.abs(np.diff(trajectory.acceleration, axis=0)) / period
    ratios = measured / np.array(jerk)
    sample, joint = _worst(ratios)
    ratio, time = float(ratios[sample, joint]), float(trajectory.times[sample])
    name = limits.names[joint]
    if not ratio <= 1.0 + JERK_TOLERANCE:
        value, unit = float(measured[sample, joint]), limits.unit(joint) + "/s³"
        check = "jerk" if math.isfinite(value) else "finite"
        raise CertificateRefused(check, name, value, float(jerk[joint]), time, unit)
    return Extreme(ratio, name, time)


def _point_speed(trajectory: Trajectory, point: ToolSpeedLimit) -> PointSpeed:
    period = float(trajectory.times[1] - trajectory.times[0])
    places = point.position(trajectory.position)
    chords = np.linalg.norm(np.diff(places, axis=0), axis=1) / period
    speeds = _speeds(point.position, trajectory.position, trajectory.velocity)
    speeds[1:] = np.maximum(speeds[1:], chords)
    sample, _ = _worst(speeds[:, np.newaxis])
    speed, time = float(speeds[sample]), float(trajectory.times[sample])
    if not speed <= point.limit * (1.0 + SPEED_TOLERANCE):
        check = "tool speed" if math.isfinite(speed) else "finite"
        raise CertificateRefused(check, f"the {point.name}", speed, point.limit, time, point.unit)
    return PointSpeed(point.name, point.limit, speed / point.limit, time)


def _speeds(position: PointPosition, joints: Array, velocity: Array) -> Array:
    """Return the (m,) speed of a point at samples [m/s]."""
    fastest = float(np.abs(velocity).max(initial=0.0))
    if fastest == 0.0:
        return np.zeros(len(joints))
    delta = _LEAP / fastest
    apart = position(joints + delta * velocity) - position(joints - delta * velocity)
    speeds: Array = np.linalg.norm(apart, axis=1) / (2.0 * delta)
    return speeds


def _worst(ratios: Array) -> tuple[int, int]:
    """Return the place of the greatest ratio, of the first that is not a number if there is one."""
    row, column = np.unravel_index(int(np.argmax(ratios)), ratios.shape)
    return int(row), int(column)
