"""Checks of the numbers of a trajectory: finite, within the limits, without jumps.

The velocities of full points, too: at rest at both ends, leading along the way between.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg import MOTOMAN, JointTraj, MsgType, TriState, ValidField

from ..check import CheckFinding, not_applicable
from .check import Habit, Observed, Problem, Tally, client_check, each
from .trajectories import GroupPoint, PointAnswer, SentPoint, SentTrajectory

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


@client_check("LC01")
def finite(seen: Observed) -> CheckFinding:
    """Look at each real of each point."""

    def rule(step: SentPoint) -> Problem | None:
        for part in step.parts:
            for value in _numbers(part):
                if not math.isfinite(value):
                    return f"{value} at sequence {step.sequence}"
        return None

    return each(seen.motions.steps, rule, NO_TRAJECTORY)


def _numbers(part: GroupPoint) -> Iterator[float]:
    yield from part.positions
    yield from part.velocities
    yield from part.accelerations
    for value in (part.time, part.duration, part.ratio):
        if value is not None:
            yield value


@client_check("LC02")
def positions(seen: Observed) -> CheckFinding:
    """Compare each position with the limits of its joint."""

    def outside(limits: JointLimits, part: GroupPoint) -> str | None:
        for joint, value in enumerate(part.positions[: limits.dof]):
            lower, upper = limits.lower[joint], limits.upper[joint]
            if not lower - ROUNDING <= value <= upper + ROUNDING:
                return f"joint {joint + 1} at {value:g}, limits {lower:g} to {upper:g}"
        return None

    return _against_limits(seen, outside)


@client_check("LC03")
def velocities(seen: Observed) -> CheckFinding:
    """Compare each velocity with the limit of its joint."""

    def outside(limits: JointLimits, part: GroupPoint) -> str | None:
        if not part.valid & ValidField.VELOCITY:
            return None
        return _beyond(part.velocities, limits.velocity, "moves with")

    return _against_limits(seen, outside)


@client_check("LC04")
def accelerations(seen: Observed) -> CheckFinding:
    """Compare each acceleration with the limit of its joint."""

    def outside(limits: JointLimits, part: GroupPoint) -> str | None:
        if not part.valid & ValidField.ACCELERATION:
            return None
        return _beyond(part.accelerations, limits.acceleration, "accelerates with")

    return _against_limits(seen, outside)


def _beyond(values: Sequence[float], most: Sequence[float], verb: str) -> str | None:
    for joint, limit in enumerate(most):
        if not abs(values[joint]) <= limit * SLACK:
            return f"joint {joint + 1} {verb} {values[joint]:g}, limit {limit:g}"
    return None


def _against_limits(
    seen: Observed, outside: Callable[[JointLimits, GroupPoint], str | None]
) -> CheckFinding:
    limits = seen.trace.setup.limits
    if limits is None:
        return not_applicable(NO_LIMITS)

    def rule(step: SentPoint) -> Problem | None:
        found = (outside(limits, part) for part in step.parts)
        return next((text for text in found if text is not None), None)

    return each(seen.motions.steps, rule, NO_TRAJECTORY)


@client_check("LC05")
def speed_between_points(seen: Observed) -> CheckFinding:
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


def _between(one: GroupPoint, other: GroupPoint) -> float | None:
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


@client_check("LC06")
def starts_where_it_stands(seen: Observed) -> CheckFinding:
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
    step: SentPoint,
    part: GroupPoint,
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


@client_check("LC08")
def no_joint_traj(seen: Observed) -> CheckFinding:
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


LEAST_WAY = 0.01
"""A joint that goes less far, over all, is not judged by its velocities [rad or m]."""

LEAST_SHARE, LARGEST_SHARE = -0.25, 2.0
"""What velocities add up to, over the way: 0 where each point is a stop, 1.5 in the steepest cubic
without overshoot."""

ENDED_FOR_NS = 1_000_000_000
"""A trajectory without another point for so long is over."""


@client_check("LC07")
def starts_at_rest(seen: Observed) -> CheckFinding:
    """Look at the velocities of each first point."""
    is_motoman = seen.trace.setup.dialect is MOTOMAN

    def rule(trajectory: SentTrajectory) -> Problem | None:
        for part in trajectory.steps[0].parts:
            fastest = max(map(abs, part.velocities), default=0.0)
            if part.valid & ValidField.VELOCITY and not fastest <= ROUNDING:
                text = f"it begins with a velocity of {fastest:g}"
                name = "motoman_driver: the velocity of the first point is passed on as it is"
                return Habit(name, text) if is_motoman else text
        return None

    full = [
        item
        for item in seen.motions.trajectories
        if item.steps[0].frame.msg_type != MsgType.JOINT_TRAJ_PT
    ]
    return each(full, rule, "the client sent no point of type 14 or 2016")


@client_check("LC09")
def velocities_lead_there(seen: Observed) -> CheckFinding:
    """Compare what the velocities of a trajectory add up to with its way, joint by joint."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        problem = _misled(trajectory)
        if problem is not None:
            tally.look(trajectory, problem or None)
    return tally.finding("no full trajectory with velocities has a way to go")


def _misled(trajectory: SentTrajectory) -> str | None:
    """Return what is wrong with the velocities; empty for nothing, None where none are given."""
    ways: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for before, after in trajectory.pairs:
        for one, other in zip(before.parts, after.parts, strict=False):
            for joint, led, went in _led_and_went(one, other):
                ways.setdefault((one.group, joint), []).append((led, went))
    judged = False
    for (_, joint), pairs in ways.items():
        scale = sum(went * went for _, went in pairs)
        if not scale > LEAST_WAY * LEAST_WAY:
            continue
        judged = True
        share = sum(led * went for led, went in pairs) / scale
        if not LEAST_SHARE <= share <= LARGEST_SHARE:
            return f"the velocities of joint {joint + 1} lead {share:.3g} times as far as it goes"
    return "" if judged else None


def _led_and_went(one: GroupPoint, other: GroupPoint) -> Iterator[tuple[int, float, float]]:
    """Yield joint, way by the mean velocity and way by the positions, from point to point."""
    meant = ValidField.TIME | ValidField.POSITION | ValidField.VELOCITY
    if one.valid & meant != meant or other.valid & meant != meant:
        return
    if one.time is None or other.time is None or not other.time > one.time:
        return
    for joint, (start, goal) in enumerate(zip(one.positions, other.positions, strict=True)):
        mean = (one.velocities[joint] + other.velocities[joint]) / 2
        led, went = mean * (other.time - one.time), goal - start
        if math.isfinite(led) and math.isfinite(went):
            yield joint, led, went


@client_check("LC10")
def ends_at_rest(seen: Observed) -> CheckFinding:
    """Look at the velocities of the last point of what nothing cut short."""
    is_motoman = seen.trace.setup.dialect is MOTOMAN

    def rule(trajectory: SentTrajectory) -> Problem | None:
        for part in trajectory.steps[-1].parts:
            fastest = max(map(abs, part.velocities), default=0.0)
            if part.valid & ValidField.VELOCITY and not fastest <= ROUNDING:
                text = f"it ends with a velocity of {fastest:g}"
                name = "motoman_driver: the velocity of the last point is passed on as it is"
                return Habit(name, text) if is_motoman else text
        return None

    whole = [item for item in seen.motions.trajectories if _is_whole(item, seen)]
    return each(whole, rule, "no full trajectory was seen to its end")


def _is_whole(trajectory: SentTrajectory, seen: Observed) -> bool:
    """Return True if a full trajectory ended with its last point, as far as can be seen."""
    last = trajectory.steps[-1]
    if last.frame.msg_type == MsgType.JOINT_TRAJ_PT or trajectory.stop is not None:
        return False
    later = [item.begins for item in seen.motions.trajectories if item.begins > last.frame.time]
    closed = [link.closed for link in seen.trace.links.values() if link.closed is not None]
    until = min([seen.trace.ended, *later, *(time for time in closed if time > last.frame.time)])
    status = seen.reports.status_at(last.frame.time + ENDED_FOR_NS)
    is_sound = status is None or status.e_stopped != TriState.TRUE
    is_quiet = until - last.frame.time >= ENDED_FOR_NS
    return last.answer is PointAnswer.TAKEN and is_sound and is_quiet
