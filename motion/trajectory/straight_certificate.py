"""Limit certificate of a straight joint move, proved from its numbers instead of its samples.

An independent check with reasoning of its own, for moves that are planned on the server's event
loop. The path parameter accelerates evenly for `ramp` samples, has a constant rate, and decelerates
as evenly. Over a move of `steps` samples of length h its greatest rate is therefore
1 / ((steps - ramp) · h), and its acceleration is that over `ramp · h`. It never reverses, so each
joint stays between its start and its goal. Nothing is sampled, and no arithmetic of the planner is
used.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..description.limits import JointLimits
from ..errors import CertificateRefused, WrongJointCount
from .certificate import (
    ACCELERATION_TOLERANCE,
    START_TOLERANCE,
    VELOCITY_TOLERANCE,
    Extreme,
)
from .ptp import StraightMove


@dataclass(frozen=True, slots=True)
class StraightCertificate:
    """Result of the check; it exists only for a move that passed.

    Attributes:
        samples: number of samples.
        sample_period: time between samples [s].
        duration: of the move [s].
        position_margin: least distance of a joint from its limits [rad or m].
        position_joint: name of that joint.
        velocity: the greatest velocity.
        acceleration: the greatest acceleration.
        start_distance: of the first sample from where the robot stands [rad or m].
    """

    samples: int
    sample_period: float
    duration: float
    position_margin: float
    position_joint: str
    velocity: Extreme
    acceleration: Extreme
    start_distance: float

    @property
    def valid(self) -> bool:
        """True always: a move that fails gets a refusal and no certificate."""
        return True

    def as_dict(self) -> dict[str, object]:
        """Return the certificate as plain data for JSON."""
        fields = {field: getattr(self, field) for field in self.__slots__}
        return {"valid": self.valid, "method": "closed form"} | {
            name: value._asdict() if isinstance(value, Extreme) else value
            for name, value in fields.items()
        }


def certify_straight_move(
    move: StraightMove, limits: JointLimits, *, start: Sequence[float]
) -> StraightCertificate:
    """Prove that a straight move obeys the limits.

    Args:
        move: the move as it will be sent.
        limits: joint limits that it must obey.
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
            _refuse("position", limits, joint, value, lower if value < lower else upper, time)
        span = abs(there - here)
        # A joint moves by its span times the path parameter, so its speed is span · rate.
        if not span * top_rate <= speed * (1.0 + VELOCITY_TOLERANCE):
            _refuse("velocity", limits, joint, span * top_rate, speed, ramp * period, "/s")
        if not span * top_gain <= gain * (1.0 + ACCELERATION_TOLERANCE):
            _refuse("acceleration", limits, joint, span * top_gain, gain, 0.0, "/s²")
        gap = abs(here - stands)
        if not gap <= START_TOLERANCE:
            _refuse("start", limits, joint, gap, START_TOLERANCE, 0.0)
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


def _refuse(
    check: str,
    limits: JointLimits,
    joint: int,
    value: float,
    limit: float,
    time: float,
    per: str = "",
) -> None:
    kind = check if math.isfinite(value) else "finite"
    unit = limits.unit(joint) + per
    raise CertificateRefused(kind, limits.names[joint], value, limit, time, unit)
