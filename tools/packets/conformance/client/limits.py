"""Checks of the numbers of a trajectory: finite, within the limits, without jumps.

The velocities of full points, too: at rest at both ends, leading along the way between.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg import MOTOMAN, JointTraj, MsgType, TriState, ValidField

from ..check import CannotJudge
from .check import NO_TRAJECTORY, Habit, Observation, Observed, Problem, client_check, rule_check
from .trajectories import GroupPoint, PointAnswer, SentPoint, SentTrajectory

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

LEAST_WAY = 0.01
"""A joint that goes less far, over all, is not judged by its velocities [rad or m]."""

LEAST_SHARE, LARGEST_SHARE = -0.25, 2.0
"""What velocities add up to, over the way: 0 where each point is a stop, 1.5 in the steepest cubic
without overshoot."""

ENDED_FOR_NS = 1_000_000_000
"""A trajectory without another point for so long is over."""


@rule_check("LC01", Observed.points, NO_TRAJECTORY)
def _finite(step: SentPoint, _: Observed) -> Problem | None:
    for part in step.parts:
        for value in _numbers(part):
            if not math.isfinite(value):
                return f"{value} at sequence {step.sequence}"
    return None


def _numbers(part: GroupPoint) -> Iterator[float]:
    yield from part.positions
    yield from part.velocities
    yield from part.accelerations
    for value in (part.time, part.duration, part.ratio):
        if value is not None:
            yield value


def _within_limits(number: str, outside: Callable[[JointLimits, GroupPoint], str | None]) -> None:
    """Register a check that compares each group of each point with the robot's limits."""

    @client_check(number, NO_TRAJECTORY)
    def look(seen: Observed) -> Iterable[Observation]:
        limits = seen.trace.setup.limits
        if limits is None:
            raise CannotJudge("the robot was not told")
        for step in seen.points():
            found = (outside(limits, part) for part in step.parts)
            yield step, next((text for text in found if text is not None), None)


def _position_outside(limits: JointLimits, part: GroupPoint) -> str | None:
    for joint, value in enumerate(part.positions[: limits.dof]):
        lower, upper = limits.lower[joint], limits.upper[joint]
        if not lower - ROUNDING <= value <= upper + ROUNDING:
            return f"joint {joint + 1} at {value:g}, limits {lower:g} to {upper:g}"
    return None


def _velocity_outside(limits: JointLimits, part: GroupPoint) -> str | None:
    if not part.valid & ValidField.VELOCITY:
        return None
    return _beyond(part.velocities, limits.velocity, "moves with")


def _acceleration_outside(limits: JointLimits, part: GroupPoint) -> str | None:
    if not part.valid & ValidField.ACCELERATION:
        return None
    return _beyond(part.accelerations, limits.acceleration, "accelerates with")


def _beyond(values: Sequence[float], most: Sequence[float], verb: str) -> str | None:
    for joint, limit in enumerate(most):
        if not abs(values[joint]) <= limit * SLACK:
            return f"joint {joint + 1} {verb} {values[joint]:g}, limit {limit:g}"
    return None


_within_limits("LC02", _position_outside)
_within_limits("LC03", _velocity_outside)
_within_limits("LC04", _acceleration_outside)


@client_check("LC05", "no two points with a time between them")
def _speed_between_points(seen: Observed) -> Iterable[Observation]:
    for trajectory in seen.motions.trajectories:
        for before, after in trajectory.pairs:
            for one, other in zip(before.parts, after.parts, strict=False):
                duration = _between(one, other)
                if duration is not None and duration > 0:
                    limits = seen.trace.setup.limits
                    yield after, _too_fast(one.positions, other.positions, duration, limits)


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


@client_check("LC06", "no trajectory began after a report of where the robot stands")
def _starts_where_it_stands(seen: Observed) -> Iterable[Observation]:
    for trajectory in seen.motions.trajectories:
        first = trajectory.steps[0]
        for part in first.parts:
            places = seen.reports.places(first.frame.time, part.group)
            if places:
                yield first, _start(part, places, seen)


def _start(part: GroupPoint, places: list[tuple[float, ...]], seen: Observed) -> Problem | None:
    def distance(place: Sequence[float]) -> float:
        gaps = (abs(a - b) for a, b in zip(place, part.positions, strict=True))
        return max((math.inf if math.isnan(gap) else gap for gap in gaps), default=0.0)

    setup = seen.trace.setup
    nearest = min(places, key=distance)
    gap = distance(nearest)
    if gap <= (MOTOMAN_START_TOLERANCE if setup.dialect is MOTOMAN else START_TOLERANCE):
        return None
    text = f"the first point is {gap:g} away from the robot"
    if part.duration is None:
        return text
    if _too_fast(nearest, part.positions, part.duration, setup.limits):
        return f"{text}, and has only {part.duration:g} s"
    name = "industrial_robot_client: the start is not compared with where the robot stands"
    return Habit(name, f"{text}, with {part.duration:g} s to get there")


@client_check("LC08", NO_TRAJECTORY)
def _no_joint_traj(seen: Observed) -> Iterable[Observation]:
    whole = [frame for frame in seen.trace.sent if isinstance(frame.message, JointTraj)]
    steps = [step.frame for step in seen.points()]
    for frame in sorted([*whole, *steps], key=lambda frame: frame.number):
        is_whole = isinstance(frame.message, JointTraj)
        yield frame, "JOINT_TRAJ, type 12" if is_whole else None


def _at_rest(step: SentPoint, seen: Observed, verb: str, which: str) -> Problem | None:
    """Return what is wrong with the velocities of the first or last point of a trajectory."""
    for part in step.parts:
        fastest = max(map(abs, part.velocities), default=0.0)
        if part.valid & ValidField.VELOCITY and not fastest <= ROUNDING:
            text = f"it {verb} with a velocity of {fastest:g}"
            name = f"motoman_driver: the velocity of the {which} point is passed on as it is"
            return Habit(name, text) if seen.trace.setup.dialect is MOTOMAN else text
    return None


@rule_check("LC07", Observed.full_trajectories, "the client sent no point of type 14 or 2016")
def _starts_at_rest(trajectory: SentTrajectory, seen: Observed) -> Problem | None:
    return _at_rest(trajectory.steps[0], seen, "begins", "first")


@client_check("LC09", "no full trajectory with velocities has a way to go")
def _velocities_lead_there(seen: Observed) -> Iterable[Observation]:
    for trajectory in seen.motions.trajectories:
        problem = _misled(trajectory)
        if problem is not None:
            yield trajectory, problem or None


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


def _whole_trajectories(seen: Observed) -> list[SentTrajectory]:
    return [item for item in seen.trajectories() if _is_whole(item, seen)]


@rule_check("LC10", _whole_trajectories, "no full trajectory was seen to its end")
def _ends_at_rest(trajectory: SentTrajectory, seen: Observed) -> Problem | None:
    return _at_rest(trajectory.steps[-1], seen, "ends", "last")


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
