"""Point-to-point motion: the fastest straight joint move from rest to rest, in closed form.

Owns the trapezoidal profile of the common path parameter. The server plans such moves on its event
loop, so `straight_move` is plain arithmetic and takes about 10 µs. Joint positions are (n,) [rad or
m]; a start is treated by `settle_start`. The sample period is in s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..description.limits import JointLimits
from ..errors import NoMotion, NotTimeable
from ..pose import Array
from .joint_curves import COINCIDENT, settle_start
from .trajectory import MAX_DURATION, SAMPLE_PERIOD, Row, Trajectory, check_rates


@dataclass(frozen=True, slots=True)
class StraightMove:
    """Straight joint move from rest to rest, as the numbers that define all of it.

    The path parameter runs from 0 to 1 in whole samples: `ramp` of them accelerate, as many
    decelerate, with constant speed between. Every joint follows in proportion.

    Attributes:
        start: (n,) first position [rad or m].
        goal: (n,) last position [rad or m].
        steps: samples after the first.
        ramp: samples of each ramp, at least 1 and at most half of `steps`.
        period: time between samples [s].
    """

    start: tuple[float, ...]
    goal: tuple[float, ...]
    steps: int
    ramp: int
    period: float

    def __len__(self) -> int:
        """Return the number of samples."""
        return self.steps + 1

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return self.steps * self.period

    @property
    def final(self) -> tuple[float, ...]:
        """Last position, (n,) [rad or m]."""
        return self.goal

    def row(self, index: int) -> Row:
        """Return one sample, without computing the others."""
        steps, ramp = self.steps, self.ramp
        total = ramp * (steps - ramp)
        left = steps - index
        if index <= ramp:
            # Sums of the integer rates in closed form, so that a row equals that of `trajectory`.
            done = index * index / (2 * total)
        elif left <= ramp:
            done = 1.0 - left * left / (2 * total)
        else:
            done = ramp * (2 * index - ramp) / (2 * total)
        rate = min(index, left, ramp) / (total * self.period)
        gain = (min(index + 1, left - 1, ramp) - min(index, left, ramp)) if left else 0
        gain_rate = gain / (total * self.period**2)
        delta = [b - a for a, b in zip(self.start, self.goal, strict=True)]
        return Row(
            index * self.period,
            list(self.goal)
            if not left
            else [a + done * d for a, d in zip(self.start, delta, strict=True)],
            [rate * d for d in delta],
            [gain_rate * d for d in delta],
        )

    def trajectory(self) -> Trajectory:
        """Return all samples as arrays."""
        steps, ramp = self.steps, self.ramp
        # Rates in units of one sample's gain, 0 1 2 … ramp … ramp … 2 1 0: exact integers.
        ticks = np.arange(steps + 1)
        rates = np.minimum(np.minimum(ticks, ticks[::-1]), ramp)
        total = ramp * (steps - ramp)
        unit = 1.0 / (total * self.period)
        profile = np.zeros((3, 1, steps + 1))
        np.cumsum(rates[1:] + rates[:-1], out=profile[0, 0, 1:])
        profile[0] /= 2 * total
        profile[1] = rates * unit
        profile[2, 0, :-1] = (rates[1:] - rates[:-1]) * (unit / self.period)

        start = np.array(self.start)[:, np.newaxis]
        fields = profile * (np.array(self.goal)[:, np.newaxis] - start)
        fields[0] += start
        fields[0, :, -1] = self.goal
        position, velocity, acceleration = fields.transpose(0, 2, 1)
        times = (ticks * self.period).astype(np.float64)
        return Trajectory(times, position, velocity, acceleration, times[::steps].copy())


def straight_move(
    start: Sequence[float] | Array,
    goal: Sequence[float] | Array,
    limits: JointLimits,
    *,
    speed: float = 1.0,
    sample_period: float = SAMPLE_PERIOD,
) -> StraightMove:
    """Plan the fastest straight line in joint space that starts and ends at rest.

    All joints start and stop together, in proportion. The phases (acceleration, constant speed,
    deceleration) are whole numbers of samples, so that the acceleration is constant between samples
    and a controller that interpolates them reproduces the motion exactly. This costs at most two
    samples compared with the continuous optimum.

    Args:
        speed: fraction of the velocity limits; the acceleration limits always hold in full.

    Raises:
        WrongJointCount, NotFinite: start or goal is not one finite value per joint.
        OutOfRange: start or goal is outside a joint's range.
        NoMotion: no joint has to move by 1e-5 rad or m or more.
        NotTimeable: the motion would last longer than an hour.
        BadArgument: speed or sample period.
    """
    check_rates(speed, sample_period)
    start = settle_start(start, limits)
    goal = list(map(float, goal))
    limits.check_position(goal)
    delta = [b - a for a, b in zip(start, goal, strict=True)]
    if max(map(abs, delta)) < COINCIDENT:
        raise NoMotion

    # Path parameter from 0 to 1: each bound is set by the joint that needs longest.
    rate = gain = math.inf
    for fastest, sharpest, way in zip(limits.velocity, limits.acceleration, delta, strict=True):
        if way:
            rate = min(rate, speed * fastest / abs(way))
            gain = min(gain, sharpest / abs(way))
    steps, ramp = _phases(rate * sample_period, gain * sample_period**2)
    if steps * sample_period > MAX_DURATION:
        reason = f"it would last more than {MAX_DURATION:g} s"
        raise NotTimeable(math.hypot(*delta), reason, lasts_too_long=True)
    return StraightMove(tuple(start), tuple(goal), steps, ramp, sample_period)


def plan_joint_move(
    start: Sequence[float] | Array,
    goal: Sequence[float] | Array,
    limits: JointLimits,
    *,
    speed: float = 1.0,
    sample_period: float = SAMPLE_PERIOD,
) -> Trajectory:
    """Return all samples of a `straight_move`, with its arguments and refusals."""
    move = straight_move(start, goal, limits, speed=speed, sample_period=sample_period)
    return move.trajectory()


def _phases(rate: float, gain: float) -> tuple[int, int]:
    """Return the least number of samples of a unit move, and that of its ramp.

    With `ramp` samples to speed up, as many to slow down and `steps` in all, the top rate per
    sample is 1 / (steps - ramp) and the gain per sample² is that / ramp.
    """
    cruise = math.ceil(1.0 / rate - _ROUNDING)
    fastest = 1.0 / rate + rate / gain if rate * rate <= gain else 2.0 / math.sqrt(gain)
    steps = max(math.ceil(fastest - _ROUNDING), 2)
    while True:
        ramp = min(steps // 2, steps - cruise)
        if ramp >= 1 and ramp * (steps - ramp) * gain >= 1.0 - _ROUNDING:
            return steps, ramp
        # Whole samples may not fit the optimum: one step more lowers both rates.
        steps += 1


# Samples: a duration that exceeds a whole number by less than this gets no further sample.
_ROUNDING = 1e-9
