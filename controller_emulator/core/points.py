"""Trajectory points as they come from the wire, in one form whatever message carried them.

Owns the reading of messages 11, 12 and 14 and what makes a point unusable before any limit is
looked at: numbers that are not finite, missing fields, another robot's group. Knows no limits, no
order and no state.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from openpendant.simplemsg import JointTrajPt, JointTrajPtFull, TrajPoint, ValidField

from ..error_codes import ErrorCode, PointRefusal, ViolationKind, violation
from ..float32 import read_time

LONGEST_TIME = 4 * 3600.0
"""Greatest time or duration of a point [s]; Motoman's controller has the same bound."""


# Plain integers: bits of an enumeration are combined twenty times as slowly.
_NEEDED = int(ValidField.TIME | ValidField.POSITION)
_VELOCITY = int(ValidField.VELOCITY)
_ACCELERATION = int(ValidField.ACCELERATION)


@dataclass(slots=True)
class Point:
    """One trajectory point, controller-side joint values.

    Never changed, but not frozen, as that takes four times as long to make.

    Attributes:
        sequence: its number, or a special sequence.
        position: (dof,) [rad or m].
        velocity: (dof,) […/s], None where the sender left it open.
        acceleration: (dof,) […/s²], None where the sender left it open.
        time: when to be there, from the start of the trajectory [ns]; None where only a duration
            is given.
        duration: time from the point before [ns]; meaningless where `time` is given.
        speed_ratio: the velocity field of message 11, which must be 0 to 1; 0 otherwise.
        has_stray_joints: slots beyond the robot's joints are not 0; worth a warning.
    """

    sequence: int
    position: tuple[float, ...]
    velocity: tuple[float, ...] | None
    acceleration: tuple[float, ...] | None
    time: int | None
    duration: int
    speed_ratio: float
    has_stray_joints: bool


def read_point(
    message: JointTrajPt | TrajPoint | JointTrajPtFull, dof: int
) -> Point | PointRefusal:
    """Return the point in a message, or why there is none.

    Args:
        message: a point, not a STOP.
        dof: number of the robot's driven joints.
    """
    if isinstance(message, JointTrajPtFull):
        return _read_full(message, dof)
    numbers = (*message.joints, message.velocity, message.duration)
    bad = _not_finite(numbers, dof)
    if bad is not None:
        return bad
    if not 0 <= message.duration <= LONGEST_TIME:
        return violation(ViolationKind.TIME, -1, message.duration, LONGEST_TIME)
    return Point(
        sequence=message.sequence,
        position=message.joints[:dof],
        velocity=None,
        acceleration=None,
        time=None,
        duration=read_time(message.duration),
        speed_ratio=message.velocity,
        has_stray_joints=any(message.joints[dof:]),
    )


def _read_full(message: JointTrajPtFull, dof: int) -> Point | PointRefusal:
    valid = message.valid_fields
    if message.robot_id != 0 or valid & _NEEDED != _NEEDED:
        return PointRefusal(ErrorCode.POINT_UNUSABLE)
    has_velocity = valid & _VELOCITY != 0
    has_acceleration = has_velocity and valid & _ACCELERATION != 0
    positions, time = message.positions, message.time
    bad = _not_finite((*positions, time), dof)
    if bad is None and has_velocity:
        bad = _not_finite(message.velocities, dof)
    if bad is None and has_acceleration:
        bad = _not_finite(message.accelerations, dof)
    if bad is not None:
        return bad
    if not 0 <= time <= LONGEST_TIME:
        return violation(ViolationKind.TIME, -1, time, LONGEST_TIME)
    return Point(
        sequence=message.sequence,
        position=positions[:dof],
        velocity=message.velocities[:dof] if has_velocity else None,
        acceleration=message.accelerations[:dof] if has_acceleration else None,
        time=read_time(time),
        duration=0,
        speed_ratio=0.0,
        has_stray_joints=any(positions[dof:]),
    )


def _not_finite(values: tuple[float, ...], dof: int) -> PointRefusal | None:
    # A sum is finite only if all terms are; one that is not may still have overflowed.
    if math.isfinite(sum(values)):
        return None
    for index, value in enumerate(values):
        if not math.isfinite(value):
            return violation(ViolationKind.NOT_FINITE, index if index < dof else -1, value)
    return None
