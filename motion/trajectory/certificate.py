"""Limit certificate: an independent check of a trajectory before it is sent.

Owns the fields of the certificate and the choice of its checks. `sample_checks` compares the
samples with the joint limits, the speed limits of points of the arm and the jerk limits; it shares
no arithmetic with the planning.

A straight joint move that is planned on the server's event loop is certified from its numbers
instead of its samples, by reasoning of its own. The path parameter accelerates evenly for `ramp`
samples, has a constant rate, and decelerates as evenly. Over a move of `steps` samples of length h
its greatest rate is therefore 1 / ((steps - ramp) · h), and its acceleration is that over
`ramp · h`. It never reverses, so each joint stays between its start and its goal. Nothing is
sampled, and no arithmetic of the planner is used.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import ClassVar

from ..description.limits import JointLimits
from ..errors import BadArgument, CertificateRefused, WrongJointCount
from ..pose import Array
from .point_speed import ToolSpeedLimit
from .ptp import StraightMove
from .sample_checks import (
    ACCELERATION_TOLERANCE,
    START_TOLERANCE,
    VELOCITY_TOLERANCE,
    Extreme,
    Inspection,
    PointSpeed,
    check_jerk,
    check_tool_speed,
    refuse,
)
from .trajectory import Trajectory


@dataclass(frozen=True, slots=True)
class _Certified:
    """Result of a check; it exists only for a motion that passed.

    Attributes:
        sample_period: time between samples [s].
        duration: of the motion [s].
        position_margin: least distance of a joint from its limits [rad or m].
        position_joint: name of that joint.
    """

    method: ClassVar[dict[str, object]] = {}

    samples: int
    sample_period: float
    duration: float
    position_margin: float
    position_joint: str
    velocity: Extreme
    acceleration: Extreme

    @property
    def valid(self) -> bool:
        """True always: a motion that fails gets a refusal and no certificate."""
        return True

    def as_dict(self) -> dict[str, object]:
        """Return the certificate as plain data for JSON."""
        values = {field.name: _plain(getattr(self, field.name)) for field in fields(self)}
        return {"valid": self.valid} | self.method | values


def _plain(value: object) -> object:
    if isinstance(value, Extreme | PointSpeed):
        return value._asdict()
    return [_plain(each) for each in value] if isinstance(value, tuple) else value


@dataclass(frozen=True, slots=True)
class Certificate(_Certified):
    """Certificate of a trajectory, by its samples.

    Attributes:
        mean_velocity: the greatest difference quotient of positions.
        mean_acceleration: the greatest difference quotient of velocities.
        second_difference: the greatest second difference of positions.
        consistency: the greatest deviation of positions from velocities over an interval.
        drift: the greatest sum of those deviations over the motion.
        start_distance: of the first sample from where the robot stands [rad or m]; None if that was
            not given.
    """

    mean_velocity: Extreme
    mean_acceleration: Extreme
    second_difference: Extreme
    consistency: Extreme
    drift: Extreme
    start_distance: float | None
    tool_speed: tuple[PointSpeed, ...] = ()
    jerk: Extreme | None = None


@dataclass(frozen=True, slots=True)
class StraightCertificate(_Certified):
    """Certificate of a straight move, by its numbers; `start_distance` as of `Certificate`."""

    method: ClassVar[dict[str, object]] = {"method": "closed form"}

    start_distance: float


def certify(
    trajectory: Trajectory,
    limits: JointLimits,
    *,
    start: Sequence[float] | Array | None = None,
    start_velocity: Sequence[float] | None = None,
    tool_speed: Sequence[ToolSpeedLimit] = (),
    jerk: Sequence[float] | None = None,
) -> Certificate:
    """Check every sample of a trajectory.

    Args:
        trajectory: the samples as they will be sent.
        start: (n,) where the robot stands; the first sample must be within 0.01 rad or m of it.
        start_velocity: (n,) velocity there [rad/s or m/s]; at rest if None.
        jerk: (n,) greatest jerk [rad/s³ or m/s³]; not checked if None.

    Raises:
        CertificateRefused: a rule is broken; with the joint, value, limit and time.
        WrongJointCount: the trajectory, or what it is checked against, is of another robot.
        BadArgument: the trajectory has fewer than two samples.
    """
    if trajectory.dof != limits.dof:
        raise WrongJointCount(trajectory.dof, limits.dof)
    if len(trajectory.times) < 2:
        raise BadArgument("trajectory", len(trajectory.times), "two samples or more")
    inspection = Inspection(trajectory, limits)
    # Times first: every later rule divides by the sample period.
    inspection.check_times()
    margin, nearest = inspection.check_range()
    extremes = inspection.check_motion()
    inspection.check_ends([0.0] * limits.dof if start_velocity is None else start_velocity)
    # The controller would jump to a first sample that is not where the robot stands.
    distance = None if start is None else inspection.check_start(start)
    return Certificate(
        samples=len(trajectory.times),
        sample_period=inspection.period,
        duration=trajectory.duration,
        position_margin=margin,
        position_joint=nearest,
        start_distance=distance,
        tool_speed=check_tool_speed(trajectory, tool_speed),
        # Only where asked for: a trapezoidal move has jumps of acceleration and is sound.
        jerk=None if jerk is None else check_jerk(trajectory, limits, jerk),
        **extremes,
    )


def certify_straight_move(
    move: StraightMove, limits: JointLimits, *, start: Sequence[float]
) -> StraightCertificate:
    """Prove that a straight move obeys the limits.

    Args:
        start: (n,) where the robot stands; the move must start within 0.01 rad or m of it.

    Raises:
        CertificateRefused: a rule is broken; with the joint, value, limit and time.
        WrongJointCount: the move or the start is of another robot.
    """
    for given in (move.start, move.goal, start):
        if len(given) != limits.dof:
            raise WrongJointCount(len(given), limits.dof)
    steps, ramp, period = move.steps, move.ramp, move.period
    if not (1 <= ramp and 2 * ramp <= steps and 0.0 < period < math.inf):
        raise CertificateRefused("time", "the clock", float(ramp), steps / 2, 0.0, "samples")
    # The area of the trapezoid is 1, and its mean width (steps - ramp) · period.
    top_rate = 1.0 / ((steps - ramp) * period)
    top_gain = top_rate / (ramp * period)
    fastest, sharpest = (0.0, 0), (0.0, 0)
    margin, nearest, distance = math.inf, 0, 0.0
    bounds = zip(limits.lower, limits.upper, limits.velocity, limits.acceleration, strict=True)
    ends = zip(move.start, move.goal, start, strict=True)
    each = zip(ends, bounds, strict=True)
    # Each comparison is written with `not`, so that a NaN is refused.
    for joint, ((here, there, stands), (lower, upper, speed, gain)) in enumerate(each):
        # Both ends suffice: the path parameter never reverses.
        if not (lower <= here <= upper and lower <= there <= upper):
            value, time = (there, move.duration) if lower <= here <= upper else (here, 0.0)
            refuse(limits, "position", joint, value, lower if value < lower else upper, time)
        span = abs(there - here)
        # A joint moves by its span times the path parameter, so its speed is span · rate.
        if not span * top_rate <= speed * (1.0 + VELOCITY_TOLERANCE):
            refuse(limits, "velocity", joint, span * top_rate, speed, ramp * period, "/s")
        if not span * top_gain <= gain * (1.0 + ACCELERATION_TOLERANCE):
            refuse(limits, "acceleration", joint, span * top_gain, gain, 0.0, "/s²")
        gap = abs(here - stands)
        if not gap <= START_TOLERANCE:
            refuse(limits, "start", joint, gap, START_TOLERANCE, 0.0)
        fastest = max(fastest, (span * top_rate / speed, joint))
        sharpest = max(sharpest, (span * top_gain / gain, joint))
        spare = min(here - lower, there - lower, upper - here, upper - there)
        if spare < margin:
            margin, nearest = spare, joint
        if gap > distance:
            distance = gap
    names = limits.names
    return StraightCertificate(
        steps + 1,
        period,
        steps * period,
        margin,
        names[nearest],
        Extreme(fastest[0], names[fastest[1]], ramp * period),
        Extreme(sharpest[0], names[sharpest[1]], 0.0),
        distance,
    )
