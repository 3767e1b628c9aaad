"""Time parameterization of a path: as fast as joint limits and tool speed limits allow, by TOPP-RA.

Owns the problem given to the solver: a grid that holds every knot, with numbers scaled to the order
of one. The solver obeys limits at the grid points only. So its answer is evaluated here (with a
constant path acceleration between grid points), measured in between, and slowed down by the worst
excess.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..description.limits import JointLimits
from ..errors import NotTimeable
from ..paths.segments import RuleSpan, SegmentRule, folded
from ..pose import Array
from ..trajectory.joint_curves import Path, check_extent
from ..trajectory.point_speed import ToolSpeedLimit, speed_ratios
from ..trajectory.trajectory import MAX_DURATION, SAMPLE_PERIOD, Trajectory, check_rates, join
from .path_limits import rate_from_rest, steady_rate, timing_grid
from .toppra_solver import fastest_rates
from .velocity_profile import VelocityProfile, measured_places

__all__ = ["SegmentRule", "time_legs", "time_path"]

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
        path: the path.
        limits: joint limits to obey.
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
        raise NotTimeable(path.length, f"it would last more than {MAX_DURATION:g} s")
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
        with np.errstate(divide="ignore"):
            bound: Array = (self.velocity / np.abs(self.slope)).min(axis=1)
        # A grid point on a knot obeys the rules of both sides.
        bound *= np.minimum(np.append(self.fraction, 1.0), np.append(1.0, self.fraction))
        if self.tool is not None:
            rates = self.tool.max(axis=2)
            with np.errstate(divide="ignore"):
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
