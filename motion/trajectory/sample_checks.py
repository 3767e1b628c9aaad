"""Sample checks of a trajectory: joint limits, speeds of the arm's points and rotation, and jerk.

Owns the arithmetic of the limit certificate and shares none with the planning: it uses samples,
limits, and forward kinematics at the samples. It relies on a sample's fields only where the
differences between samples agree with them. It also runs on the server's event loop, so it is
written in few array passes.

The rules, and why they refuse no sound trajectory. Let h be the sample period, V a joint's velocity
limit and A its acceleration limit, q, v, a the samples of one motion that obeys |v| ≤ V and |a| ≤ A
throughout:

- q within its range, compared exactly; |v| ≤ V (1 + 1e-6); |a| ≤ A (1 + 1e-3).
- |Δq| / h ≤ V: the mean velocity over an interval is a velocity the motion had there.
- |Δv| / h ≤ A: the mean acceleration likewise.
- |Δ²q| / h² ≤ A: this is a weighted mean of the acceleration over two intervals.
- |Δq - h (v + v₊) / 2| ≤ A h² / 4: no motion that obeys |a| ≤ A between two velocities can deviate
  further from the trapezoid of its velocities; full acceleration for half the interval and full
  deceleration for the other half just reaches it. A jump of the positions that the velocities do
  not show is found here.
- The same deviations summed over the motion stay below h²/8 times the variation of a: that is the
  error of the trapezoid rule. Velocities of another motion, wrong by a factor or a constant, are
  found here. This rule alone is not strict: the samples do not show the variation inside an
  interval, for which eight times A is allowed in all. Planned motions stay below half of the bound,
  but a motion made to oscillate between samples could be refused.

The acceleration may jump anywhere, so a sample of it is bound by nothing but its limit, unless
there is a limit of jerk. Beyond the joint limits, where such limits are given:

- |p(q + δ q̇) - p(q - δ q̇)| / 2δ ≤ limit (1 + 1e-6): the velocity of a point p at a sample, as a
  central difference over joint positions a few microradians apart.
- |p₊ - p| / h ≤ limit (1 + 1e-6): the chord between two samples is no longer than the path between
  them, so this is at most the mean speed there.
- |Δa| / h ≤ jerk limit (1 + 1e-3): the mean jerk over an interval is a jerk the motion had there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, NoReturn

import numpy as np

from ..description.limits import JointLimits
from ..errors import CertificateRefused, WrongJointCount
from ..pose import Array
from .point_speed import PointPosition, ToolSpeedLimit
from .trajectory import Trajectory

SPEED_TOLERANCE = 1e-6
JERK_TOLERANCE = 1e-3

_LEAP = 1e-5
"""Longest joint step of the central difference [rad or m]."""


class Extreme(NamedTuple):
    """Greatest value of one quantity: `ratio` to its limit, 1 being on the limit."""

    ratio: float
    joint: str
    time: float


class PointSpeed(NamedTuple):
    """Greatest speed of a point: `ratio` to its limit, 1 being on the limit."""

    point: str
    limit: float
    ratio: float
    time: float


def check_tool_speed(
    trajectory: Trajectory, points: Sequence[ToolSpeedLimit]
) -> tuple[PointSpeed, ...]:
    """Check the speeds of points of the arm; return one finding for each.

    Args:
        trajectory: the samples as they will be sent; two or more.

    Raises:
        CertificateRefused: a point is too fast; `joint` names the point.
    """
    return tuple(_point_speed(trajectory, point) for point in points)


def check_jerk(trajectory: Trajectory, limits: JointLimits, jerk: Sequence[float]) -> Extreme:
    """Check the change of the accelerations from sample to sample.

    Args:
        trajectory: the samples as they will be sent; two or more.
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
    """Return row and column of the greatest ratio, or of the first NaN if there is one."""
    row, column = np.unravel_index(int(np.argmax(ratios)), ratios.shape)
    return int(row), int(column)


VELOCITY_TOLERANCE = 1e-6
ACCELERATION_TOLERANCE = 1e-3
START_TOLERANCE = 0.01
"""Greatest distance of the robot from the first sample [rad or m]."""

_TIME_TOLERANCE = 1e-9
"""Greatest unevenness of the sample times that counts as rounding [s]."""
_UNSEEN_VARIATION = 8.0


class _Rule(NamedTuple):
    """Rule |q| <= limit · h**order · share for a quantity q, and the words of its refusal."""

    check: str
    of_velocity: bool
    order: int
    share: float
    tolerance: float
    per: str

    @property
    def field(self) -> str:
        return self.check.replace(" ", "_")


_RULES = (
    _Rule("velocity", True, 0, 1.0, VELOCITY_TOLERANCE, "/s"),
    _Rule("acceleration", False, 0, 1.0, ACCELERATION_TOLERANCE, "/s²"),
    _Rule("mean velocity", True, 1, 1.0, VELOCITY_TOLERANCE, "/s"),
    _Rule("mean acceleration", False, 1, 1.0, ACCELERATION_TOLERANCE, "/s²"),
    _Rule("second difference", False, 2, 1.0, ACCELERATION_TOLERANCE, "/s²"),
    _Rule("consistency", False, 2, 0.25, ACCELERATION_TOLERANCE, ""),
)


class Inspection:
    """Trajectory under inspection, a row per joint: (n, m) position, velocity, acceleration.

    Every check raises `CertificateRefused` with joint, value, limit and time of the worst sample.
    """

    def __init__(self, trajectory: Trajectory, limits: JointLimits) -> None:
        self.limits = limits
        self.times = trajectory.times
        self.period = float(trajectory.times[1] - trajectory.times[0])
        self.position = trajectory.position.T
        self.velocity = trajectory.velocity.T
        self.acceleration = trajectory.acceleration.T

    def check_times(self) -> None:
        """Check that time starts at 0 and advances evenly, to 1 ns."""
        steps = self.times[1:] - self.times[:-1]
        least, greatest = float(steps.min()), float(steps.max())
        uneven = max(greatest - self.period, self.period - least)
        # Written with `not`, as every comparison with a limit below: a comparison with NaN is
        # false, so a NaN is refused instead of passed.
        if not (self.times[0] == 0.0 and least > 0.0 and uneven <= _TIME_TOLERANCE):
            at = int(np.argmin(steps) if least <= 0.0 else np.argmax(abs(steps - self.period)))
            raise CertificateRefused(
                "time", "the clock", float(steps[at]), self.period, float(self.times[at]), "s"
            )

    def check_range(self) -> tuple[float, str]:
        """Check positions against the ranges; return the least margin [rad or m] and its joint."""
        least, greatest = self.position.min(axis=1).tolist(), self.position.max(axis=1).tolist()
        margin, nearest = math.inf, 0
        for joint, (low, high) in enumerate(zip(least, greatest, strict=True)):
            lower, upper = self.limits.lower[joint], self.limits.upper[joint]
            if not low >= lower:
                self._refuse("position", joint, low, lower, int(self.position[joint].argmin()))
            if not high <= upper:
                self._refuse("position", joint, high, upper, int(self.position[joint].argmax()))
            if (spare := min(low - lower, upper - high)) < margin:
                margin, nearest = spare, joint
        return margin, self.limits.names[nearest]

    def check_motion(self) -> dict[str, Extreme]:
        """Check velocities, accelerations and differences; return the worst of each rule."""
        h, names = self.period, self.limits.names
        values, drift, variation = self._quantities()
        peaks = values.max(axis=2).tolist()
        extremes: dict[str, Extreme] = {}
        for rule, rows, peak in zip(_RULES, values, peaks, strict=True):
            # Differences are compared undivided: the bound is multiplied by h once instead of every
            # sample being divided by it.
            factor = h**rule.order * rule.share
            limits = self.limits.velocity if rule.of_velocity else self.limits.acceleration
            ratios = [value / (factor * limit) for value, limit in zip(peak, limits, strict=True)]
            joint = _worst_joint(ratios)
            sample = int(rows[joint].argmax())
            if not ratios[joint] <= 1.0 + rule.tolerance:
                shown = 1.0 if rule.per == "" else h**rule.order
                value, limit = peak[joint] / shown, factor * limits[joint] / shown
                self._refuse(rule.check, joint, value, limit, sample, rule.per)
            extremes[rule.field] = Extreme(ratios[joint], names[joint], sample * h)

        # The drift rule of the module docstring; its bound differs from joint to joint.
        bounds = [
            (swing + _UNSEEN_VARIATION * limit) * h * h / 8.0
            for swing, limit in zip(variation, self.limits.acceleration, strict=True)
        ]
        ratios = [abs(value) / bound for value, bound in zip(drift, bounds, strict=True)]
        joint = _worst_joint(ratios)
        if not ratios[joint] <= 1.0:
            self._refuse("drift", joint, drift[joint], bounds[joint], len(self.times) - 1)
        extremes["drift"] = Extreme(ratios[joint], names[joint], self.times.item(-1))
        return extremes

    def check_ends(self, start_velocity: Sequence[float]) -> None:
        """Check that every joint has exactly the start velocity, and ends at rest.

        Args:
            start_velocity: (n,) at the first sample [rad/s or m/s].

        Raises:
            CertificateRefused: a joint does not.
            WrongJointCount, NotFinite: the velocity is not one of this robot.
        """
        self.limits.check_finite(start_velocity, "the start velocity")
        for sample, expected in ((0, start_velocity), (-1, [0.0] * self.limits.dof)):
            velocities: list[float] = self.velocity[:, sample].tolist()
            for joint, (value, wanted) in enumerate(zip(velocities, expected, strict=True)):
                # Exact, without tolerance: after the last sample the controller holds a position,
                # and a remaining velocity would be a step.
                if value != wanted:
                    self._refuse("rest", joint, value, wanted, sample, "/s")

    def check_start(self, start: Sequence[float] | Array) -> float:
        """Check that the motion starts at a (n,) position; return the farthest joint's distance.

        Raises:
            CertificateRefused: a joint is more than 0.01 rad or m off.
            WrongJointCount, NotFinite: the position is not one of this robot.
        """
        stands = [float(value) for value in start]
        self.limits.check_finite(stands, "the start position")
        first: list[float] = self.position[:, 0].tolist()
        distances = [abs(q - p) for q, p in zip(first, stands, strict=True)]
        joint = _worst_joint(distances)
        if not distances[joint] <= START_TOLERANCE:
            self._refuse("start", joint, distances[joint], START_TOLERANCE, 0)
        return distances[joint]

    def _quantities(self) -> tuple[Array, list[float], list[float]]:
        """Return the quantities that the rules bound.

        Returns:
            The (rules, n, m) magnitudes, a difference standing at its later sample; for each joint
            the sum of the deviations of positions from velocities; and the variation of its
            acceleration.
        """
        values = np.zeros((len(_RULES), *self.position.shape))
        velocity, acceleration, step, gain, bend, stray = values
        velocity[:] = self.velocity
        acceleration[:] = self.acceleration
        # Differences of infinities are refused later by their rule; no warning is needed here.
        with np.errstate(invalid="ignore", over="ignore"):
            # Before the first sample the motion counts as uniform, as it is when it starts at rest.
            np.multiply(velocity[:, 0], self.period, out=step[:, 0])
            np.subtract(self.position[:, 1:], self.position[:, :-1], out=step[:, 1:])
            np.subtract(velocity[:, 1:], velocity[:, :-1], out=gain[:, 1:])
            np.subtract(step[:, 1:], step[:, :-1], out=bend[:, 1:])
            np.add(velocity[:, 1:], velocity[:, :-1], out=stray[:, 1:])
            stray *= -0.5 * self.period
            stray[:, 1:] += step[:, 1:]
            drift: list[float] = stray.sum(axis=1).tolist()
            swings = acceleration[:, 1:] - acceleration[:, :-1]
            variation: list[float] = np.abs(swings, out=swings).sum(axis=1).tolist()
            # In place, as every step above: a copy of all magnitudes would cost a pass over the
            # memory.
            np.abs(values, out=values)
        return values, drift, variation

    def _refuse(
        self, check: str, joint: int, value: float, limit: float, sample: int, per: str = ""
    ) -> NoReturn:
        refuse(self.limits, check, joint, value, limit, float(self.times[sample]), per)


def refuse(
    limits: JointLimits,
    check: str,
    joint: int,
    value: float,
    limit: float,
    time: float,
    per: str = "",
) -> NoReturn:
    """Refuse a joint's value at a time [s], whose unit is that of the position and `per`."""
    kind = check if math.isfinite(value) else "finite"
    unit = limits.unit(joint) + per
    raise CertificateRefused(kind, limits.names[joint], value, limit, time, unit)


def _worst_joint(values: Sequence[float]) -> int:
    """Return the index of the greatest value, or of the first NaN if there is one."""
    for index, value in enumerate(values):
        if math.isnan(value):
            return index
    return max(range(len(values)), key=values.__getitem__)
