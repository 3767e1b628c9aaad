"""Admission of points: the controller's own check of each one before it enters the buffer.

Owns the limits as the controller applies them: exactly for what a sender states (rounded outward to
the next 4-byte real), with an allowance for rounding where values are divided by a short time.
Nothing is clipped: a point is taken as it is or refused with its numbers. Pure functions of a point
and the state before it; knows no buffer, no sequence and no clock.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from operator import add
from typing import NamedTuple

from openpendant.motion.description.limits import JointLimits, float32_ceiling

from ..error_codes import PointRefusal, ViolationKind, violation
from ..float32 import NANOSECONDS, rounding, roundings
from ..interpolation.legs import Knot, MotionLeg
from ..interpolation.polynomials import Bounds
from ..interpolation.segment import connect
from ..interpolation.stop_ramp import REST_FRACTION, AxisLimits
from .points import Point

_TIME_ALLOWANCE = 0.25
"""Most of an acceleration limit that rounded time stamps may account for."""

_APPROACH_SHARE = 0.5
"""Part of the acceleration limit used to close the gap to a first point."""


PLACEHOLDER_DURATION = 10 * NANOSECONDS
"""Duration of a first point that the stock client states where it knows none [ns]."""

_DEFAULT_RATIO = 0.1
"""Part of the speed limits where the velocity field says none, as the stock client assumes."""


class Tolerances(NamedTuple):
    """Tolerances beyond the limits that the controller allows.

    Attributes:
        velocity: relative, on stated and mean velocities.
        acceleration: relative, on stated accelerations and on Δvelocity/Δtime.
        interpolation: relative, on the acceleration *between* two points that are legal.
        start: how far the first point at time 0 may be from the robot [rad or m].
    """

    velocity: float = 1e-6
    acceleration: float = 1e-3
    interpolation: float = 0.05
    start: float = 0.01


class _JointBasis(NamedTuple):
    """Values of one joint from which its bounds on a leg are made.

    Attributes:
        lower: least position [rad or m].
        upper: greatest position [rad or m].
        velocity: greatest speed […/s].
        acceleration: greatest acceleration that may be stated, and is taken on a polynomial […/s²].
        hardest: greatest acceleration, before allowances for rounding […/s²].
        velocity_blur: adds to the acceleration, divided by the duration of the leg […/s].
        most_timed: most that rounded time stamps may add to the acceleration […/s²].
    """

    lower: float
    upper: float
    velocity: float
    acceleration: float
    hardest: float
    velocity_blur: float
    most_timed: float


class Admission:
    """The checks, for one robot."""

    def __init__(self, limits: JointLimits, tolerances: Tolerances) -> None:
        self.limits = limits
        self.axes = AxisLimits(limits, tolerances.interpolation)
        self._tolerances = tolerances
        wire = limits.as_float32()
        self._lower, self._upper = wire.lower, wire.upper
        velocity = [float32_ceiling(v * (1 + tolerances.velocity)) for v in limits.velocity]
        excess = 1 + tolerances.acceleration
        self._acceleration = [float32_ceiling(a * excess) for a in limits.acceleration]
        self._basis = tuple(
            map(
                _JointBasis,
                self._lower,
                self._upper,
                velocity,
                self._acceleration,
                self.axes.hardest,
                [4 * rounding(v) for v in velocity],
                [_TIME_ALLOWANCE * a for a in limits.acceleration],
            )
        )

    def first(self, point: Point, before: Knot) -> MotionLeg | PointRefusal:
        """Check the first point of a trajectory.

        A point at time 0 states where the motion starts and must be where the robot stands; a small
        gap is closed by a slow motion before the trajectory's clock starts. A later point is moved
        to from rest in its time. The stock client's placeholder of 10 s is no time at all: where
        the robot stands it costs nothing, elsewhere the velocity field says how fast.

        Args:
            before: state in which the robot will be found, with its velocity known.
        """
        refusal = self._values(point)
        if refusal is not None:
            return refusal
        for joint, value in enumerate(before.velocity or ()):
            if abs(value) > REST_FRACTION * self.limits.velocity[joint]:
                return violation(ViolationKind.START_VELOCITY, joint, value)
        if point.time is None and point.duration == PLACEHOLDER_DURATION:
            gaps = [abs(b - a) for a, b in zip(before.position, point.position, strict=True)]
            if max(gaps) <= self._tolerances.start:
                return self._start(point, before)
            point = replace(point, duration=self._approach_time(gaps, point.speed_ratio))
        if point.duration if point.time is None else point.time:
            return self.next(point, Knot.at_rest(before.position), 0)
        return self._start(point, before)

    def _approach_time(self, gaps: Sequence[float], speed_ratio: float) -> int:
        """Return how long the way to a first point takes at a part of the speed limits [ns]."""
        ratio = speed_ratio or _DEFAULT_RATIO
        limits = zip(gaps, self.limits.velocity, self.limits.acceleration, strict=True)
        seconds = max(
            max(gap / (ratio * velocity), math.sqrt(4 * gap / (_APPROACH_SHARE * acceleration)))
            for gap, velocity, acceleration in limits
        )
        return math.ceil(seconds * NANOSECONDS)

    def _start(self, point: Point, before: Knot) -> MotionLeg | PointRefusal:
        for joint, value in enumerate(point.velocity or ()):
            limit = self._tolerances.acceleration * self.limits.velocity[joint]
            if abs(value) > limit:
                return violation(ViolationKind.START_VELOCITY, joint, value, limit)
        gaps = [b - a for a, b in zip(before.position, point.position, strict=True)]
        for joint, gap in enumerate(gaps):
            if abs(gap) > self._tolerances.start:
                return violation(ViolationKind.START_POSITION, joint, gap, self._tolerances.start)
        rest = Knot.at_rest(point.position)
        end = replace(rest, acceleration=point.acceleration)
        # From rest to rest with least peak acceleration a over a distance d takes √(4d/a).
        seconds = max(
            math.sqrt(4 * abs(gap) / (_APPROACH_SHARE * limit))
            for gap, limit in zip(gaps, self.limits.acceleration, strict=True)
        )
        duration = math.ceil(seconds * NANOSECONDS)
        leg = MotionLeg(point.sequence, duration, end, (), None)
        if duration:
            zeros = rest.mean_velocity
            blur = roundings(point.position)
            leg.bounds = self._bounds(before.position, seconds, blur, zeros)
            start = before.with_velocity(zeros)
            segment = connect(leg.seconds, start.ends(), rest.ends(), leg.bounds)
            if isinstance(segment, PointRefusal):
                return segment
            leg.segment = segment
        return leg

    def next(self, point: Point, before: Knot, elapsed: int) -> MotionLeg | PointRefusal:
        """Check a point that follows another.

        Args:
            elapsed: time of the point before, from the start of the trajectory [ns].
        """
        refusal = self._values(point)
        if refusal is not None:
            return refusal
        duration = point.duration if point.time is None else point.time - elapsed
        if duration <= 0:
            return violation(ViolationKind.TIME, -1, duration / NANOSECONDS)
        seconds = duration / NANOSECONDS
        mean = tuple(
            [(b - a) / seconds for a, b in zip(before.position, point.position, strict=True)]
        )
        end = Knot(point.position, point.velocity, point.acceleration, mean, seconds)
        # Error that 4-byte reals allow in the duration of the leg.
        blur = list(map(add, roundings(before.position), roundings(point.position)))
        stamp = 0.0 if point.time is None else 2 * rounding(point.time / NANOSECONDS)
        timed_blur = [abs(v) * stamp for v in mean]
        refusal = self._steps(before, end, blur, timed_blur)
        if refusal is not None:
            return refusal
        bounds = self._bounds(before.position, seconds, blur, timed_blur)
        leg = MotionLeg(point.sequence, duration, end, bounds, None)
        if before.velocity is not None and end.velocity is not None:
            segment = connect(seconds, before.ends(), end.ends(), bounds)
            if isinstance(segment, PointRefusal):
                return segment
            leg.segment = segment
        return leg

    def _values(self, point: Point) -> PointRefusal | None:
        """Check what the point states, each number by itself."""
        if not 0 <= point.speed_ratio <= 1:
            return violation(ViolationKind.VELOCITY, -1, point.speed_ratio, 1.0)
        for joint, (value, lower, upper) in enumerate(
            zip(point.position, self._lower, self._upper, strict=True)
        ):
            if not lower <= value <= upper:
                limit = lower if value < lower else upper
                return violation(ViolationKind.RANGE, joint, value, limit)
        if point.velocity is not None:
            refusal = self._velocities(point.position, point.velocity)
            if refusal is not None:
                return refusal
        if point.acceleration is None:
            return None
        for joint, (value, limit) in enumerate(
            zip(point.acceleration, self._acceleration, strict=True)
        ):
            if abs(value) > limit:
                return violation(ViolationKind.ACCELERATION, joint, value, limit)
        return None

    def _velocities(
        self, position: Sequence[float], velocity: Sequence[float]
    ) -> PointRefusal | None:
        """Check stated velocities, each by itself and whether the joint can stop in its range.

        A joint that could not stop inside its range any more is as good as outside.
        """
        joints = enumerate(zip(velocity, position, self._basis, strict=True))
        for joint, (value, start, basis) in joints:
            speed = abs(value)
            if speed > basis.velocity:
                return violation(ViolationKind.VELOCITY, joint, value, basis.velocity)
            stop = start + value * speed / (2 * basis.hardest)
            if value and not basis.lower <= stop <= basis.upper:
                least, most = basis.lower, basis.upper
                return violation(ViolationKind.RANGE, joint, stop, least if stop < least else most)
        return None

    def _steps(
        self, before: Knot, end: Knot, blur: Sequence[float], timed_blur: Sequence[float]
    ) -> PointRefusal | None:
        """Check Δposition/Δtime and Δvelocity/Δtime."""
        seconds = end.span
        off = list(map(add, blur, timed_blur))
        olds, news, noises, time = _velocity_step(before, end, off)
        for joint, (mean, off_by, old, new, noise, basis) in enumerate(
            zip(end.mean_velocity, off, olds, news, noises, self._basis, strict=True)
        ):
            limit = basis.velocity + off_by / seconds
            if abs(mean) > limit:
                return violation(ViolationKind.POSITION_STEP, joint, mean, limit)
            rate = (new - old) / time
            limit = basis.acceleration + noise / time
            if abs(rate) > limit:
                return violation(ViolationKind.VELOCITY_STEP, joint, rate, limit)
        return None

    def _bounds(
        self,
        position: Sequence[float],
        seconds: float,
        blur: Sequence[float],
        timed_blur: Sequence[float],
    ) -> tuple[Bounds, ...]:
        """Return what each joint may do on a leg that begins at a position."""
        bounds = []
        square = seconds * seconds
        for start, fixed, timed, basis in zip(position, blur, timed_blur, self._basis, strict=True):
            lower, upper, velocity, smooth, hardest, velocity_blur, most_timed = basis
            by_time = 4 * timed / square
            sharp = (
                hardest
                + 4 * fixed / square
                + velocity_blur / seconds
                + (by_time if by_time < most_timed else most_timed)
            )
            fast = velocity + 2 * (fixed + timed) / seconds
            # A stop may have ended slightly outside the range; a motion back into it is allowed.
            if start < lower:
                lower = start
            elif start > upper:
                upper = start
            bounds.append(Bounds(lower, upper, fast, sharp, smooth))
        return tuple(bounds)


def _velocity_step(
    before: Knot, end: Knot, off: Sequence[float]
) -> tuple[Sequence[float], Sequence[float], Sequence[float], float]:
    """Return how velocities change over a leg: from, to, by how much that is off, in which time.

    Args:
        off: by how much the length of the leg may be off its time, for each joint.
    """
    if before.velocity is not None and end.velocity is not None:
        noise = list(map(add, roundings(before.velocity), roundings(end.velocity)))
        return before.velocity, end.velocity, noise, end.span
    # The velocities are open, but mean velocities of adjacent legs cannot differ by more than the
    # acceleration limit times the time between the legs' middles.
    shortest = min(end.span, before.span or end.span)
    noise = [2 * each / shortest for each in off]
    return before.mean_velocity, end.mean_velocity, noise, (before.span + end.span) / 2
