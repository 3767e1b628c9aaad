"""Checks of the numbers of a trajectory: finite, within the limits, and without jumps.

Whether its velocities make sense is judged in `velocities`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from openpendant.motion.limits import JointLimits
from openpendant.simplemsg import MOTOMAN, JointTraj, ValidField

from ..findings import Finding, not_applicable
from .check import ClientCheck, Habit, Observed, Problem, Tally, client_check, each
from .trajectories import Part, Step

NO_LIMITS = "the robot was not told"
NO_TRAJECTORY = "the client sent no trajectory"

PLAUSIBLE_SPEED = 4 * math.pi
"""No joint of a known industrial robot is faster [rad/s or m/s]."""

ROUNDING = 1e-6
"""Positions were rounded to 4-byte reals [rad or m]."""

SLACK = 1.01
"""Differences of rounded positions over differences of rounded times are off by less."""

START_TOLERANCE = 0.01
"""Largest distance of a first point from the robot [rad or m]."""

MOTOMAN_START_TOLERANCE = 1e-3
"""The same for Motoman controllers, which take 30 pulses [rad or m]."""


@client_check(
    "LC01",
    "every number is finite",
    "observed: no vendor's server looks for NaN; a joint would be sent anywhere",
)
def finite(seen: Observed) -> Finding:
    """Look at each real of each point."""

    def rule(step: Step) -> Problem | None:
        for part in step.parts:
            for value in _numbers(part):
                if not math.isfinite(value):
                    return f"{value} at sequence {step.sequence}"
        return None

    return each(seen.motions.steps, rule, NO_TRAJECTORY)


def _numbers(part: Part) -> Iterator[float]:
    yield from part.positions
    yield from part.velocities
    yield from part.accelerations
    for value in (part.time, part.duration, part.ratio):
        if value is not None:
            yield value


@client_check(
    "LC02",
    "positions keep to the joint limits",
    "observed: staubli_val3_driver drops such a point, motoman_driver does not look",
)
def positions(seen: Observed) -> Finding:
    """Compare each position with the limits of its joint."""

    def outside(limits: JointLimits, part: Part) -> str | None:
        for joint, value in enumerate(part.positions[: limits.dof]):
            lower, upper = limits.lower[joint], limits.upper[joint]
            if not lower - ROUNDING <= value <= upper + ROUNDING:
                return f"joint {joint + 1} at {value:g}, limits {lower:g} to {upper:g}"
        return None

    return _against_limits(seen, outside)


@client_check(
    "LC03",
    "velocities keep to the joint limits",
    "industrial_core joint_trajectory_interface.cpp, is_valid; motoman_driver: INVALID/3013",
)
def velocities(seen: Observed) -> Finding:
    """Compare each velocity with the limit of its joint."""

    def outside(limits: JointLimits, part: Part) -> str | None:
        if not part.valid & ValidField.VELOCITY:
            return None
        return _beyond(part.velocities, limits.velocity, "moves with")

    return _against_limits(seen, outside)


@client_check(
    "LC04",
    "accelerations keep to the joint limits",
    "industrial_core joint_traj_pt_full.h: what is sent as valid is meant",
)
def accelerations(seen: Observed) -> Finding:
    """Compare each acceleration with the limit of its joint."""

    def outside(limits: JointLimits, part: Part) -> str | None:
        if not part.valid & ValidField.ACCELERATION:
            return None
        return _beyond(part.accelerations, limits.acceleration, "accelerates with")

    return _against_limits(seen, outside)


def _beyond(values: Sequence[float], most: Sequence[float], verb: str) -> str | None:
    for joint, limit in enumerate(most):
        if not abs(values[joint]) <= limit * SLACK:
            return f"joint {joint + 1} {verb} {values[joint]:g}, limit {limit:g}"
    return None


def _against_limits(seen: Observed, outside: Callable[[JointLimits, Part], str | None]) -> Finding:
    limits = seen.trace.setup.limits
    if limits is None:
        return not_applicable(NO_LIMITS)

    def rule(step: Step) -> Problem | None:
        found = (outside(limits, part) for part in step.parts)
        return next((text for text in found if text is not None), None)

    return each(seen.motions.steps, rule, NO_TRAJECTORY)


@client_check(
    "LC05",
    "no joint has to move faster than it can from one point to the next",
    "observed: no vendor's server checks it; a controller that follows would jump",
)
def speed_between_points(seen: Observed) -> Finding:
    """Compare the way between two points with the time between them."""
    limits = seen.trace.setup.limits
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        for before, after in trajectory.pairs:
            for one, other in zip(before.parts, after.parts, strict=False):
                duration = _between(one, other)
                if duration is not None and duration > 0:
                    problem = _too_fast(one.positions, other.positions, duration, limits)
                    tally.look(after, problem)
    return tally.finding("no two points with a time between them")


def _between(one: Part, other: Part) -> float | None:
    if other.duration is not None:
        return other.duration
    return None if one.time is None or other.time is None else other.time - one.time


def _too_fast(
    start: Sequence[float], goal: Sequence[float], duration: float, limits: JointLimits | None
) -> str | None:
    for joint, (a, b) in enumerate(zip(start, goal, strict=True)):
        known = limits is not None and joint < limits.dof
        most = limits.velocity[joint] if limits is not None and known else PLAUSIBLE_SPEED
        if not max(0.0, abs(b - a) - ROUNDING) <= most * SLACK * duration:
            speed = abs(b - a) / duration if duration else math.inf
            return f"joint {joint + 1} would move with {speed:g}, at most {most:g}"
    return None


@client_check(
    "LC06",
    "the first point is where the robot stands",
    "motoman_driver joint_trajectory_streamer.cpp and its controller (INVALID/3011);"
    " industrial_core does not look (industrial_core#187)",
)
def starts_where_it_stands(seen: Observed) -> Finding:
    """Compare each first point with the robot's last report."""
    tolerance = START_TOLERANCE
    if seen.trace.setup.dialect is MOTOMAN:
        tolerance = MOTOMAN_START_TOLERANCE
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        first = trajectory.steps[0]
        for part in first.parts:
            places = seen.reports.places(first.frame.time, part.group)
            if places:
                tally.look(first, _start(first, part, places, tolerance, seen))
    return tally.finding("no trajectory began after a report of where the robot stands")


def _start(
    step: Step,
    part: Part,
    places: list[tuple[float, ...]],
    tolerance: float,
    seen: Observed,
) -> Problem | None:
    def distance(place: Sequence[float]) -> float:
        gaps = (abs(a - b) for a, b in zip(place, part.positions, strict=True))
        return max((math.inf if math.isnan(gap) else gap for gap in gaps), default=0.0)

    nearest = min(places, key=distance)
    gap = distance(nearest)
    if gap <= tolerance:
        return None
    text = f"the first point is {gap:g} away from the robot"
    if part.duration is None:
        return text
    if _too_fast(nearest, part.positions, part.duration, seen.trace.setup.limits):
        return f"{text}, and has only {part.duration:g} s"
    name = "industrial_robot_client: the start is not compared with where the robot stands"
    return Habit(name, f"{text}, with {part.duration:g} s to get there")


@client_check(
    "LC08",
    "no whole trajectory is sent in one message",
    "REP-I0006: JOINT_TRAJ is deprecated; no vendor's server takes it",
)
def no_joint_traj(seen: Observed) -> Finding:
    """Look for JOINT_TRAJ."""

    def is_motion(message: object) -> bool:
        return isinstance(message, JointTraj)

    asked = [frame for frame in seen.trace.sent if frame.message is not None]
    moving = [frame for frame in asked if is_motion(frame.message)]
    steps = [step.frame for step in seen.motions.steps]
    return each(
        sorted([*moving, *steps], key=lambda frame: frame.number),
        lambda frame: "JOINT_TRAJ, type 12" if is_motion(frame.message) else None,
        NO_TRAJECTORY,
    )


CHECKS: tuple[ClientCheck, ...] = (
    finite,
    positions,
    velocities,
    accelerations,
    speed_between_points,
    starts_where_it_stands,
    no_joint_traj,
)
