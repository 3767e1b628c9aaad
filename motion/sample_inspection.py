"""The rules that the samples of a trajectory must keep, looked at one by one.

Owns the arithmetic of the limit certificate, and shares none with the planning: it takes samples
and limits, and trusts neither the fields nor each other without the differences between samples
agreeing. It also runs on the server's event loop, so it is written in few array passes.

What is checked, and why that refuses no sound trajectory. Let h be the sample period, A a joint's
acceleration limit, q, v, a the samples of one motion that keeps |v| ≤ V and |a| ≤ A throughout:

- q within its range, compared exactly; |v| ≤ V (1 + 1e-6); |a| ≤ A (1 + 1e-3).
- |Δq| / h ≤ V: the mean velocity over an interval is a velocity the motion had there.
- |Δv| / h ≤ A: the mean acceleration likewise.
- |Δ²q| / h² ≤ A: this is a weighted mean of the acceleration over two intervals.
- |Δq - h (v + v₊) / 2| ≤ A h² / 4: no motion that keeps |a| ≤ A between two velocities can stray
  further from the trapezoid of its velocities; speeding up fully for half the interval and slowing
  down for the other half just reaches it. A jump that the velocities do not tell of is found here.
- The same deviations summed over the motion stay below h²/8 times the variation of a: that is the
  error of the trapezoid rule. Velocities that tell of another motion, by a factor or a constant,
  are found here. This rule alone is not strict: the samples do not show the variation inside an
  interval, for which eight times A is allowed in all. Planned motions stay below half of the bound,
  but one made to chatter between samples could be refused.

The acceleration may jump anywhere, so a sample of it is tied to nothing but its limit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, NoReturn

import numpy as np

from .errors import CertificateRefused
from .further_checks import Extreme
from .limits import JointLimits
from .trajectory import Array, Trajectory

VELOCITY_TOLERANCE = 1e-6
ACCELERATION_TOLERANCE = 1e-3
START_TOLERANCE = 0.01
"""How far from the first sample the robot may stand [rad or m]."""

_TIME_TOLERANCE = 1e-9
"""Unevenness of the sample times that rounding explains [s]."""
_UNSEEN_VARIATION = 8.0


class _Rule(NamedTuple):
    """A quantity q that must keep |q| <= limit · h**order · share, and how a refusal shows it."""

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
    """One trajectory under inspection, a row per joint: (n, m) position, velocity, acceleration.

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
        """Check that time starts at 0 and advances evenly, to 1 ns.

        Raises:
            CertificateRefused: it does not.
        """
        steps = self.times[1:] - self.times[:-1]
        least, greatest = float(steps.min()), float(steps.max())
        uneven = max(greatest - self.period, self.period - least)
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
            factor = h**rule.order * rule.share
            limits = self.limits.velocity if rule.of_velocity else self.limits.acceleration
            ratios = [value / (factor * limit) for value, limit in zip(peak, limits, strict=True)]
            joint = _worst(ratios)
            sample = int(rows[joint].argmax())
            if not ratios[joint] <= 1.0 + rule.tolerance:
                shown = 1.0 if rule.per == "" else h**rule.order
                value, limit = peak[joint] / shown, factor * limits[joint] / shown
                self._refuse(rule.check, joint, value, limit, sample, rule.per)
            extremes[rule.field] = Extreme(ratios[joint], names[joint], sample * h)

        bounds = [
            (swing + _UNSEEN_VARIATION * limit) * h * h / 8.0
            for swing, limit in zip(variation, self.limits.acceleration, strict=True)
        ]
        ratios = [abs(value) / bound for value, bound in zip(drift, bounds, strict=True)]
        joint = _worst(ratios)
        if not ratios[joint] <= 1.0:
            self._refuse("drift", joint, drift[joint], bounds[joint], len(self.times) - 1)
        extremes["drift"] = Extreme(ratios[joint], names[joint], self.times.item(-1))
        return extremes

    def check_ends(self, start_velocity: Sequence[float]) -> None:
        """Check that every joint sets off exactly as it should, and ends standing still.

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
                if value != wanted:
                    self._refuse("rest", joint, value, wanted, sample, "/s")

    def check_start(self, start: Sequence[float] | Array) -> float:
        """Check that the motion starts where the robot stands, a (n,) joint position [rad or m].

        Returns:
            How far off it is [rad or m], of the joint that is farthest.

        Raises:
            CertificateRefused: a joint is more than 0.01 rad or m off.
            WrongJointCount, NotFinite: the position is not one of this robot.
        """
        stands = [float(value) for value in start]
        self.limits.check_finite(stands, "the start position")
        first: list[float] = self.position[:, 0].tolist()
        distances = [abs(q - p) for q, p in zip(first, stands, strict=True)]
        joint = _worst(distances)
        if not distances[joint] <= START_TOLERANCE:
            self._refuse("start", joint, distances[joint], START_TOLERANCE, 0)
        return distances[joint]

    def _quantities(self) -> tuple[Array, list[float], list[float]]:
        """Return what the rules bound.

        Returns:
            The (rules, n, m) magnitudes, a difference standing at its later sample; for each joint
            the sum of the deviations of positions from velocities; and the variation of its
            acceleration.
        """
        values = np.zeros((len(_RULES), *self.position.shape))
        velocity, acceleration, step, gain, bend, stray = values
        velocity[:] = self.velocity
        acceleration[:] = self.acceleration
        # Differences of infinities are refused below as what they are, not warned of here.
        with np.errstate(invalid="ignore", over="ignore"):
            # Before the first sample the motion counts as even, which it is when at rest.
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
            np.abs(values, out=values)
        return values, drift, variation

    def _refuse(
        self, check: str, joint: int, value: float, limit: float, sample: int, per: str = ""
    ) -> NoReturn:
        if not math.isfinite(value):
            check = "finite"
        raise CertificateRefused(
            check,
            self.limits.names[joint],
            value,
            limit,
            float(self.times[sample]),
            self.limits.unit(joint) + per,
        )


def _worst(values: Sequence[float]) -> int:
    """Return the place of the greatest value, of the first that is not a number if there is one."""
    for index, value in enumerate(values):
        if math.isnan(value):
            return index
    return max(range(len(values)), key=values.__getitem__)
