"""Limit certificate: an independent check of every sample before a trajectory is sent.

Owns the fields of the certificate and the choice of its checks. `sample_checks` compares the
samples with the joint limits, the speed limits of points of the arm and the jerk limits; it shares
no arithmetic with the planning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..description.limits import JointLimits
from ..errors import BadArgument, WrongJointCount
from ..pose import Array
from .point_speed import ToolSpeedLimit
from .sample_checks import (
    ACCELERATION_TOLERANCE,
    START_TOLERANCE,
    VELOCITY_TOLERANCE,
    Extreme,
    Inspection,
    PointSpeed,
    check_jerk,
    check_tool_speed,
)
from .trajectory import Trajectory

__all__ = [
    "ACCELERATION_TOLERANCE",
    "START_TOLERANCE",
    "VELOCITY_TOLERANCE",
    "Certificate",
    "Extreme",
    "PointSpeed",
    "certify",
]


@dataclass(frozen=True, slots=True)
class Certificate:
    """Result of the check; it exists only for a trajectory that passed.

    Attributes:
        samples: number of samples.
        sample_period: time between samples [s].
        duration: of the motion [s].
        position_margin: least distance of a joint from its limits [rad or m].
        position_joint: name of that joint.
        velocity: the greatest velocity sample.
        acceleration: the greatest acceleration sample.
        mean_velocity: the greatest difference quotient of positions.
        mean_acceleration: the greatest difference quotient of velocities.
        second_difference: the greatest second difference of positions.
        consistency: the greatest deviation of positions from velocities over an interval.
        drift: the greatest sum of those deviations over the motion.
        start_distance: of the first sample from where the robot stands [rad or m]; None if that was
            not given.
    """

    samples: int
    sample_period: float
    duration: float
    position_margin: float
    position_joint: str
    velocity: Extreme
    acceleration: Extreme
    mean_velocity: Extreme
    mean_acceleration: Extreme
    second_difference: Extreme
    consistency: Extreme
    drift: Extreme
    start_distance: float | None
    tool_speed: tuple[PointSpeed, ...] = ()
    jerk: Extreme | None = None

    @property
    def valid(self) -> bool:
        """True always: a trajectory that fails gets a refusal and no certificate."""
        return True

    def as_dict(self) -> dict[str, object]:
        """Return the certificate as plain data for JSON."""
        fields = {field: getattr(self, field) for field in self.__slots__}
        data: dict[str, object] = {"valid": self.valid} | {
            name: value._asdict() if isinstance(value, Extreme) else value
            for name, value in fields.items()
        }
        data["tool_speed"] = [point._asdict() for point in self.tool_speed]
        return data


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
        limits: joint limits that it must obey.
        start: (n,) where the robot stands; the first sample must be within 0.01 rad or m of it.
        start_velocity: (n,) velocity there [rad/s or m/s]; at rest if None.
        tool_speed: speed limits of points of the arm.
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
