"""Jerk-limited point-to-point motion: all joints together, from rest or from a moving state.

Owns the use of ruckig (Berscheid and Kröger, "Jerk-limited Real-time Trajectory Generation with
Arbitrary Target States", RSS 2021), an optional library that is imported when first used and by no
other module. Joint vectors are (n,) controller-side driven joints in file order [rad or m, s].

A move that starts at rest, or along the line to its goal, is a straight line in joint space. It is
solved as one motion of the fraction of the line, whose limits are those of the joint that each
binds first. From any other state there is no straight line; then each joint has its own motion, and
all arrive at the same time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from ..description.limits import JointLimits
from ..errors import BadArgument, LibraryMissing, NoMotion, NotTimeable, OutOfRange, WrongJointCount
from ..pose import Array
from .joint_curves import COINCIDENT, ROUNDING, settle_start
from .trajectory import MAX_DURATION, SAMPLE_PERIOD, Trajectory, check_rates

RAMP = 0.1
"""Default time in which a joint builds up its full acceleration [s]."""

_COLLINEAR = 1e-9  # rad/s or m/s, and per second: greatest component off the line
_ROUNDING = 1e-9  # samples: a lesser excess over a whole number is rounding
_MOST_DURATIONS = 20  # tried: for a moving start some longer durations do not exist


def jerk_limits(limits: JointLimits, ramp: float = RAMP) -> tuple[float, ...]:
    """Return the (n,) jerk that builds up a joint's full acceleration in a ramp [rad/s³ or m/s³].

    Raises:
        BadArgument: the ramp is not 1 ms to 10 s.
    """
    if not 1e-3 <= ramp <= 10.0:
        raise BadArgument("ramp", ramp, "0.001 to 10 s")
    return tuple(acceleration / ramp for acceleration in limits.acceleration)


def jerk_limited_move(
    start: Sequence[float] | Array,
    goal: Sequence[float] | Array,
    limits: JointLimits,
    *,
    jerk: Sequence[float] | None = None,
    start_velocity: Sequence[float] | None = None,
    start_acceleration: Sequence[float] | None = None,
    speed: float = 1.0,
    sample_period: float = SAMPLE_PERIOD,
) -> Trajectory:
    """Plan the fastest joint move to rest at a goal under velocity, acceleration and jerk limits.

    The duration is rounded up to whole sample periods by a slower motion.

    Args:
        start: (n,) where the robot is [rad or m]; see `settle_start` for feedback noise.
        jerk: (n,) greatest jerk [rad/s³ or m/s³]; `jerk_limits(limits)` if None.
        start_velocity: (n,) velocity at the start [rad/s or m/s]; at rest if None.
        start_acceleration: (n,) acceleration at the start [rad/s² or m/s²]; 0 if None.
        speed: fraction of the velocity limits; the other limits always hold in full. A start that
            is faster slows down to it first.

    Raises:
        LibraryMissing: ruckig is not installed.
        WrongJointCount, NotFinite: a vector is not one finite value per joint.
        OutOfRange: the start, the goal, or what must be passed in between, is outside a range.
        TooFast, TooSharp: the state at the start is beyond a limit.
        NoMotion: the robot stands at the goal already.
        NotTimeable: there is no such motion, or it would last longer than an hour.
        BadArgument: a jerk limit, speed or sample period.
    """
    check_rates(speed, sample_period)
    here = np.array(settle_start(start, limits))
    there = np.array([float(value) for value in goal])
    limits.check_position(there.tolist())
    velocity = np.array(start_velocity or [0.0] * limits.dof, dtype=np.float64)
    limits.check_velocity(velocity.tolist())
    acceleration = np.array(start_acceleration or [0.0] * limits.dof, dtype=np.float64)
    limits.check_acceleration(acceleration.tolist())
    moving = bool(velocity.any() or acceleration.any())
    if not moving and np.abs(there - here).max() < COINCIDENT:
        raise NoMotion
    move = _Move(here, there, velocity, acceleration)
    rates = (
        speed * np.array(limits.velocity),
        np.array(limits.acceleration),
        _checked_jerk(jerk, limits),
    )
    solution, steps = move.solve(rates, sample_period)
    trajectory = move.sampled(solution, steps, sample_period)
    _check_range(trajectory, limits)
    return trajectory


@dataclass(frozen=True, slots=True, eq=False)
class _Move:
    """Move between two states; each array is (n,)."""

    start: Array
    goal: Array
    velocity: Array
    acceleration: Array

    @property
    def directions(self) -> Array:
        """(k, n) directions of the move's k variables: the whole line, or each joint."""
        way = self.goal - self.start
        square = float(way @ way)
        if square > 0.0:
            shares = np.array((self.velocity @ way, self.acceleration @ way)) / square
            beside = np.stack((self.velocity, self.acceleration)) - np.outer(shares, way)
            if np.abs(beside).max() <= _COLLINEAR:
                return way[np.newaxis]
        return np.eye(len(way))

    def solve(self, rates: tuple[Array, Array, Array], period: float) -> tuple[Any, int]:
        """Return ruckig's motion of the variables, and its duration in sample periods.

        Args:
            rates: (n,) each: velocity, acceleration and jerk limits.
            period: the sample period [s].
        """
        ruckig = _ruckig()
        directions = self.directions
        count = len(directions)
        problem = ruckig.InputParameter(count)
        # Least squares is exact here: the state lies along the directions.
        to_variables = np.linalg.pinv(directions).T
        problem.current_position = [0.0] * count
        problem.current_velocity = (to_variables @ self.velocity).tolist()
        problem.current_acceleration = (to_variables @ self.acceleration).tolist()
        problem.target_position = (to_variables @ (self.goal - self.start)).tolist()
        with np.errstate(divide="ignore"):
            # Of the joints along a line the one whose limit binds first; one that does not move
            # binds never.
            bounds = [(limit / np.abs(directions)).min(axis=1).tolist() for limit in rates]
        problem.max_velocity, problem.max_acceleration, problem.max_jerk = bounds
        steps = 1
        for _ in range(_MOST_DURATIONS):
            solution = ruckig.Trajectory(count)
            self._calculate(ruckig, problem, solution)
            samples = solution.duration / period
            if not solution.duration <= MAX_DURATION:
                self._refuse(f"it would last more than {MAX_DURATION:g} s")
            if samples <= steps + _ROUNDING:
                return solution, steps
            steps = math.ceil(samples - _ROUNDING)
            problem.minimum_duration = steps * period
        self._refuse("no duration is a whole number of samples")

    def sampled(self, solution: Any, steps: int, period: float) -> Trajectory:
        """Return ruckig's motion of the variables as joint samples."""
        times = (np.arange(steps + 1) * period).astype(np.float64)
        states = np.array([solution.at_time(time) for time in times.tolist()])
        position, velocity, acceleration = states.transpose(1, 0, 2) @ self.directions
        position += self.start
        # Exactly at the goal and at rest: the certificate accepts no rounding at the end.
        position[-1], velocity[-1], acceleration[-1] = self.goal, 0.0, 0.0
        velocity[0] = self.velocity
        return Trajectory(times, position, velocity, acceleration, times[::steps].copy())

    def _calculate(self, ruckig: Any, problem: Any, solution: Any) -> None:
        try:
            result = ruckig.Ruckig(len(problem.current_position)).calculate(problem, solution)
        except ruckig.RuckigError as error:
            self._refuse(str(error))
        if result not in (ruckig.Result.Working, ruckig.Result.Finished):
            self._refuse(str(result))

    def _refuse(self, reason: str) -> NoReturn:
        raise NotTimeable(float(np.linalg.norm(self.goal - self.start)), reason)


def _checked_jerk(jerk: Sequence[float] | None, limits: JointLimits) -> Array:
    if jerk is None:
        return np.array(jerk_limits(limits))
    if len(jerk) != limits.dof:
        raise WrongJointCount(len(jerk), limits.dof)
    for name, value in zip(limits.names, jerk, strict=True):
        if not (math.isfinite(value) and value > 0.0):
            raise BadArgument(f"jerk of {name}", value, "more than 0 and finite")
    return np.array(jerk, dtype=np.float64)


def _check_range(trajectory: Trajectory, limits: JointLimits) -> None:
    """Check that a motion that must brake first stays inside the joint ranges."""
    least, greatest = trajectory.position.min(axis=0), trajectory.position.max(axis=0)
    for index, name in enumerate(limits.names):
        lower, upper = limits.lower[index], limits.upper[index]
        for value in (float(least[index]), float(greatest[index])):
            if not lower - ROUNDING <= value <= upper + ROUNDING:
                raise OutOfRange(name, value, lower, upper, limits.unit(index), index)


def _ruckig() -> Any:
    try:
        import ruckig
    except ImportError:
        raise LibraryMissing("ruckig", "motion") from None
    return ruckig
