"""Time parameterization of a path: as fast as joint limits and tool speed limits allow, by TOPP-RA.

Owns the problem given to the solver: a grid that holds every knot, with numbers scaled to the order
of one, and a slow motion that always exists. The solver obeys limits at the grid points only. So
its answer is evaluated here (with a constant path acceleration between grid points), measured in
between, and slowed down by the worst excess. Joint vectors are controller-side driven joints in
file order [rad or m, s]; s is the path parameter of `joint_curves`, q' and q'' the path's
derivatives by it. A grid is (g,) path positions; in the bounds of a solver's rate, slope and bend
are (g, n), q' and q'' of each joint in units of its acceleration limit.

On a step of length Δs with the path acceleration u, from the path velocity v to v₊:

    v₊² = v² + 2 u Δs        Δt = 2 Δs / (v + v₊)        s(t) = s + v t + u t²/2
    dq/dt = q' v             d²q/dt² = q' u + q'' v²

the discretisation of TOPP-RA (Pham and Pham, "A New Approach to Time-Optimal Path Parameterization
Based on Reachability Analysis", IEEE T-RO 34(3), 2018). The square of the velocity is linear in s,
so both ratios to limits are smooth on a step but not linear: they are measured in between.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..description.limits import JointLimits
from ..errors import NotTimeable
from ..paths.segments import RuleSpan, SegmentRule, folded
from ..pose import Array
from ..trajectory.joint_curves import Indices, Path, check_extent
from ..trajectory.point_speed import ToolSpeedLimit, speed_ratios
from ..trajectory.trajectory import (
    FINER,
    MAX_DURATION,
    MOST_FINE,
    SAMPLE_PERIOD,
    FineSamples,
    Trajectory,
    check_rates,
    join,
)
from .toppra_solver import fastest_rates

_TOLERATED = 1.003  # a greater slowing of the whole motion for one place is worth a second solution
_GREATEST_RATE = 99.0  # of the scaled problem; toppra's own bound is 100
_ROUNDING = 1e-9  # samples: a lesser excess over a whole number is rounding


def time_path(
    path: Path,
    limits: JointLimits,
    *,
    speed: float = 1.0,
    segments: Sequence[SegmentRule] | None = None,
    tool_speed: Sequence[ToolSpeedLimit] = (),
    sample_period: float = SAMPLE_PERIOD,
) -> Trajectory:
    """Time a path from rest to rest, near the fastest that the limits and rules allow.

    The continuous motion obeys every limit between samples too; its duration is rounded up to whole
    sample periods by slowing it down as a whole.

    Args:
        speed: fraction of the velocity limits, also of those that a rule lowers; the acceleration
            limits always hold in full.
        segments: one rule for the path to each waypoint after the first. Where waypoints coincide,
            the time asked for is spent on the next part that has length.
        tool_speed: speed limits of points of the arm; no fraction lowers them.
        sample_period: time between samples [s].

    Raises:
        OutOfRange: the path leaves a joint's range.
        WrongJointCount: the path is of another robot.
        NotTimeable: it would last longer than an hour.
        BadArgument: speed, sample period, or a rule.
    """
    check_rates(speed, sample_period)
    check_extent(path, limits)
    problem = _Problem(path, limits, speed, folded(path, segments), tool_speed)
    profile = problem.solve()
    excess = problem.excess(profile)
    if _slowing(*excess) > _TOLERATED:
        problem.tighten(*excess)
        profile = problem.solve()
        excess = problem.excess(profile)
    duration = profile.duration * max(1.0, _slowing(*excess), problem.haste(profile))
    if not duration <= MAX_DURATION:
        reason = f"it would last more than {MAX_DURATION:g} s"
        raise NotTimeable(path.length, reason, lasts_too_long=True)
    samples = max(math.ceil(duration / sample_period - _ROUNDING), 1)
    waypoints = problem.at_knots[path.waypoint_knots]
    return profile.sampled(path, limits, waypoints, samples, sample_period)


def time_legs(
    legs: Sequence[Path],
    limits: JointLimits,
    *,
    speed: float = 1.0,
    tool_speed: Sequence[ToolSpeedLimit] = (),
    sample_period: float = SAMPLE_PERIOD,
) -> Trajectory:
    """Time several paths that follow one another, with a stop between each two.

    Raises:
        BadArgument: there are no legs, or one does not start where the one before ends.
        MotionError: a leg is refused, as of `time_path`.
    """
    return join(
        [
            time_path(leg, limits, speed=speed, tool_speed=tool_speed, sample_period=sample_period)
            for leg in legs
        ]
    )


class _Problem:
    """Path with its limits and rules, on the grid where it is solved."""

    def __init__(
        self,
        path: Path,
        limits: JointLimits,
        speed: float,
        rules: Sequence[RuleSpan],
        tool_speed: Sequence[ToolSpeedLimit],
    ) -> None:
        self.path = path
        self.limits = limits
        self.rules = rules
        self.velocity = speed * np.array(limits.velocity)
        self.acceleration = np.array(limits.acceleration)
        self.grid = timing_grid(path.knots)
        self.at_knots = np.searchsorted(self.grid, path.knots)
        self.slope = path.evaluate(self.grid, 1)
        self.bend = path.evaluate(self.grid, 2)
        self.tool = None
        if tool_speed:
            self.tool = speed_ratios(tool_speed, path, measured_places(path, self.grid))
        # Share of a limit that the solver may use, at each grid point.
        self.speed_margin = np.ones(len(self.grid))
        self.gain_margin = np.ones(len(self.grid))
        # The speed fraction on each step between grid points.
        self.fraction = np.ones(len(self.grid) - 1)
        for rule in rules:
            first, last = self.at_knots[[rule.first, rule.last]]
            self.fraction[first:last] = rule.speed_fraction

    def solve(self) -> VelocityProfile:
        """Return the fastest profile that obeys the limits at the grid points.

        Where the solver fails for rounding it is a slower profile, which always exists.
        """
        # In units of the path's length and of the time that the acceleration limits alone would
        # take, so that the solver's absolute tolerances fit.
        length = self.path.length
        time = math.sqrt(length * float((np.abs(self.slope) / self.acceleration).max()))
        usable = self.acceleration * self.gain_margin[:, np.newaxis] * time**2
        grid, slope, bend = self.grid / length, self.slope * length / usable, self.bend / usable
        bend *= length**2
        allowed = self._greatest_rate() * (time / length)
        bound = np.minimum(allowed, rate_from_rest(grid, slope))
        rate = fastest_rates(grid, slope, bend, np.minimum(bound, _GREATEST_RATE))
        if rate is None:
            rate = steady_rate(grid, slope, bend, allowed)
        rate = np.concatenate(([0.0], rate[1:-1] * (length / time), [0.0]))
        return VelocityProfile.through(self.grid, rate)

    def excess(self, profile: VelocityProfile) -> tuple[Array, Array]:
        """Return the ratios of velocities and accelerations to their limits on each step."""
        allowed = self.velocity * self.fraction[:, np.newaxis]
        return profile.excess(self.path, allowed, self.acceleration, self.tool)

    def tighten(self, speeds: Array, gains: Array) -> None:
        """Lower the limits given to the solver at both ends of each step that exceeds them."""
        for margin, excess in ((self.speed_margin, speeds), (self.gain_margin, gains)):
            over = np.maximum(excess, 1.0)
            margin /= np.maximum(np.append(over, 1.0), np.append(1.0, over))

    def haste(self, profile: VelocityProfile) -> float:
        """Return the factor by which to slow a profile down so that it obeys the durations."""
        passing = profile.times[self.at_knots].tolist()
        return max(
            (rule.min_duration / (passing[rule.last] - passing[rule.first]) for rule in self.rules),
            default=1.0,
        )

    def _greatest_rate(self) -> Array:
        """Return the (g,) greatest path velocity that joints, points of the arm and rules allow."""
        # A joint that stands has a slope of rounding errors only.
        with np.errstate(divide="ignore", over="ignore"):
            bound: Array = (self.velocity / np.abs(self.slope)).min(axis=1)
        # A grid point on a knot obeys the rules of both sides.
        bound *= np.minimum(np.append(self.fraction, 1.0), np.append(1.0, self.fraction))
        if self.tool is not None:
            rates = self.tool.max(axis=2)
            with np.errstate(divide="ignore", over="ignore"):
                bound = np.minimum(bound, 1.0 / np.append(rates[:, 0], rates[-1, -1]))
        bound *= self.speed_margin
        for rule in self.rules:
            if rule.min_duration:
                first, last = self.at_knots[[rule.first, rule.last]]
                mean = float(self.grid[last] - self.grid[first]) / rule.min_duration
                bound[first : last + 1] = np.minimum(bound[first : last + 1], mean)
        return bound


def _slowing(speeds: Array, gains: Array) -> float:
    """Return the factor in time that makes up for the worst excess."""
    return max(float(speeds.max()), math.sqrt(float(gains.max())))


_PER_SPAN = 16
_LEAST_POINTS = 200
_END_POINTS = 4
_LEAST_STEP = 1e-6  # of the path's length; the solver fails on much smaller ones
_MOST_DIVIDED = 1600  # points besides one for each knot
_SLACK = 2.0  # factor on a bound; the error of the grid is less


def timing_grid(knots: Array) -> Array:
    """Return the path positions where limits are imposed: at the knots and between them.

    Sixteen points between two knots and two hundred in all. Where there are many knots each needs
    fewer, because the curve bends less between them, and the cost grows with the number of points.
    The first and the last step are divided further, because the acceleration from and to rest is
    constant on a step.
    """
    spans = len(knots) - 1
    count = max(min(_PER_SPAN, math.ceil(_MOST_DIVIDED / spans)), math.ceil(_LEAST_POINTS / spans))
    inner = np.arange(count) / count
    steady = (knots[:-1, np.newaxis] + np.diff(knots)[:, np.newaxis] * inner).ravel()
    end = knots[-1]
    ends = 0.25 ** np.arange(_END_POINTS, 0, -1)
    first, last = ends * steady[1], ends * (end - steady[-1])
    least = end * _LEAST_STEP
    return np.concatenate(
        ([0.0], first[first > least], steady[1:], end - last[last > least][::-1], [end])
    )


def rate_from_rest(grid: Array, slope: Array) -> Array:
    """Return a path velocity that the joints' accelerations cannot exceed from rest to rest.

    From d(q̇²/2)/dq = q̈ a joint that has covered the distance V since the motion began, or has yet
    to cover it, has q̇² <= 2 A V; and q̇ is the slope times the path velocity. It bounds no motion
    that the limits allow. Without it a solver's numbers may be thousands of times those of its
    answer, and it fails for rounding, as toppra did on short lines past a wrist singularity.

    Returns:
        (g,), infinite where no joint moves.
    """
    steepness = np.abs(slope)
    way = np.diff(grid)[:, np.newaxis] * (steepness[1:] + steepness[:-1]) / 2.0
    # Both are sums of small parts; a difference of sums would round the smallest to 0. At the ends,
    # where one is 0, it is that of the next place.
    run = np.cumsum(way, axis=0)
    left = np.cumsum(way[::-1], axis=0)[::-1]
    nearest = np.minimum(np.vstack((run[:1], run)), np.vstack((left, left[-1:])))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        squares = 2.0 * _SLACK * nearest / steepness**2
    rate: Array = np.sqrt(np.where(steepness > 0.0, squares, np.inf).min(axis=1))
    return rate


def steady_rate(grid: Array, slope: Array, bend: Array, greatest_rate: Array) -> Array:
    """Return a motion with one acceleration, one greatest rate and one deceleration.

    Half of each limit is given to |slope x''| and half to |bend x'²|, both by their greatest value
    anywhere, so that it exists for every path.

    Args:
        greatest_rate: (g,) that the other limits allow.
    """
    gain = 0.5 / float(np.abs(slope).max())
    with np.errstate(divide="ignore"):
        square = 0.5 / np.abs(bend).max()
    top = min(float(square), float(greatest_rate.min()) ** 2)
    rates: Array = np.sqrt(np.minimum(2.0 * gain * np.minimum(grid, 1.0 - grid), top))
    return rates


_MEASURED = 32  # places measured between two knots of the path, about
_LEAST_MEASURED = 4  # least number of places between two grid points


@dataclass(frozen=True, slots=True, eq=False)
class VelocityProfile:
    """Profile of a run along a path from rest to rest; its squared rate is linear on each step.

    Attributes:
        grid: (g,) path positions s from 0 to the path's length, with every knot among them.
        rate: (g,) path velocity v there [unit of s per s], 0 at both ends.
        gain: (g - 1,) path acceleration u on the step that follows [unit of s per s²].
        times: (g,) time at each position, from 0 [s].
    """

    grid: Array
    rate: Array
    gain: Array
    times: Array

    @classmethod
    def through(cls, grid: Array, rate: Array) -> VelocityProfile:
        """Return the profile with given rates at the grid points.

        Args:
            rate: (g,) path velocities, 0 or more, no two successive ones 0 [unit of s per s].
        """
        steps = np.diff(grid)
        both = rate[1:] + rate[:-1]
        gain = np.diff(rate) * both / (2.0 * steps)
        return cls(grid, rate, gain, np.concatenate(([0.0], np.cumsum(2.0 * steps / both))))

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""
        return float(self.times[-1])

    def excess(
        self, path: Path, velocity: Array, acceleration: Array, tool: Array | None = None
    ) -> tuple[Array, Array]:
        """Return the greatest ratios of the run to its limits between the grid points.

        Args:
            path: the path, n joints.
            velocity: (g - 1, n) velocity limits on each step [rad/s or m/s].
            acceleration: (n,) acceleration limits [rad/s² or m/s²].
            tool: (g - 1, places, k) at the `measured_places`, for each of k points of the arm the
                ratio of its speed to its limit at path velocity 1, as of `speed_ratios`.

        Returns:
            For each step (g - 1,) the greatest ratio of a joint velocity or tool speed, and of a
            joint acceleration, to its limit; 1 is at the limit. Both are upper bounds where a curve
            is a parabola between places, see `_crests`.
        """
        s = measured_places(path, self.grid)
        steps, places = s.shape
        ahead = s - self.grid[:-1, np.newaxis]
        square = self.rate[:-1, np.newaxis] ** 2 + 2.0 * self.gain[:, np.newaxis] * ahead
        square = np.maximum(square, 0.0)[:, :, np.newaxis]
        slope, bend = (
            path.evaluate(s.ravel(), order).reshape(steps, places, path.dof) for order in (1, 2)
        )
        speeds = np.square(slope / velocity[:, np.newaxis]) * square
        gains = (slope * self.gain[:, np.newaxis, np.newaxis] + bend * square) / acceleration
        fastest = _crests(speeds)
        if tool is not None:
            fastest = np.maximum(fastest, _crests(np.square(tool) * square))
        return np.sqrt(fastest), _crests(gains)

    def sampled(
        self, path: Path, limits: JointLimits, waypoints: Indices, samples: int, period: float
    ) -> Trajectory:
        """Return the samples of the run, slowed down as a whole to last a number of sample periods.

        Slower by the factor c, the run passes each place at c times its time: its path velocity is
        divided by c, its path acceleration by c².

        Args:
            path: the path, n joints.
            limits: limits whose ranges the path obeys but for rounding.
            waypoints: (w,) indices of the path's waypoints in the grid.
            samples: number m of sample periods; m times the period is the duration or more.
            period: their length [s].

        Returns:
            m + 1 samples of n joints, and finer ones between them unless there are too many.
        """
        slower = samples * period / self.duration
        finer = FINER if samples <= MOST_FINE else 1
        elapsed = np.arange(finer * samples) * (period / finer / slower)
        step = np.searchsorted(self.times[1:-1], elapsed, side="right")
        since = elapsed - self.times[step]
        gain, before = self.gain[step], self.rate[step]
        s = self.grid[step] + (before + 0.5 * gain * since) * since
        s = np.append(np.minimum(s, self.grid[step + 1]), path.length)
        rate = np.append(np.maximum(before + gain * since, 0.0), 0.0)[:, np.newaxis] / slower
        gain = np.append(gain, 0.0)[:, np.newaxis] / slower**2
        slope = path.evaluate(s, 1)
        # A curve that just touches a limit may exceed it by rounding.
        position = np.clip(path.evaluate(s), limits.lower, limits.upper)
        velocity = slope * rate
        # The samples sent to the controller are every `FINER`th of them.
        sent = slice(None, None, finer)
        bend = path.evaluate(s[sent], 2)
        return Trajectory(
            times=np.asarray(np.arange(samples + 1) * period, dtype=np.float64),
            position=np.asfortranarray(position[sent]),
            velocity=np.asfortranarray(velocity[sent]),
            acceleration=np.asfortranarray(slope[sent] * gain[sent] + bend * rate[sent] ** 2),
            waypoint_times=self.times[waypoints] * slower,
            fine=FineSamples(position, velocity) if finer > 1 else None,
        )


def measured_places(path: Path, grid: Array) -> Array:
    """Return the (g - 1, places) path positions where a run is measured, ends of steps included."""
    steps = len(grid) - 1
    count = max(_MEASURED * len(path.knots) // steps, _LEAST_MEASURED)
    ahead = np.diff(grid)[:, np.newaxis] * (np.arange(count + 1) / count)
    places: Array = np.minimum(grid[:-1, np.newaxis] + ahead, grid[1:, np.newaxis])
    return places


def _crests(values: Array) -> Array:
    """Return the (steps,) greatest magnitude on each step of curves given at (steps, places, n).

    Between neighbouring places at a distance h a parabola rises above their chord by at most
    h² |f''| / 8 (the remainder of linear interpolation), and h² f'' is its second difference.
    """
    rise = np.abs(np.diff(values, 2, axis=1)).max(axis=(1, 2)) / 8.0
    greatest: Array = np.abs(values).max(axis=(1, 2)) + rise
    return greatest
