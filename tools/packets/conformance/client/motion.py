"""Checks of trajectory points: their order from beginning to end, and what each of them says."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Iterator
from operator import sub

from openpendant.simplemsg import JOINT_SLOTS, CommType, SpecialSequence, ValidField
from openpendant.simplemsg.framing import HEADER_SIZE

from ..check import CannotJudge
from .check import NO_TRAJECTORY, Habit, Observation, Observed, Problem, client_check, rule_check
from .trajectories import BEGINNINGS, GroupPoint, PointAnswer, SentPoint, SentTrajectory

NO_REPETITION = "no point was sent twice"
NO_RATIO_POINT = "the client sent no point of type 11"
NO_FULL_POINT = "the client sent no point of type 14 or 2016"

DEFAULT_RATIO = struct.unpack("<f", struct.pack("<f", 0.1))[0]
"""Speed ratio of the stock client where the trajectory has no velocities, as a 4-byte real."""

MULTI_GROUP = 2016
"""Motoman's point of several groups."""

PLACEHOLDER = 10.0
"""Duration of the stock client where time does not increase [s]."""

LONGEST_SEGMENT = 3_600.0
"""No program has two points further apart [s]."""

STANDS_THERE = 0.01
"""A robot this close to a point stands there [rad or m]."""

LONGEST_START = 10.0
"""A robot that stands at the first point has nothing to wait for, for so long [s]."""


def _fresh(seen: Observed) -> list[SentTrajectory]:
    return [item for item in seen.trajectories() if item.after_stop is None]


def _downloads(seen: Observed) -> list[SentTrajectory]:
    return [item for item in seen.trajectories() if item.is_download]


def _ratio_points(seen: Observed) -> list[SentPoint]:
    return [step for step in seen.points() if not step.is_full]


def _full_points(seen: Observed) -> list[SentPoint]:
    return [step for step in seen.points() if step.is_full]


@rule_check("MC01", _fresh, NO_TRAJECTORY)
def _begins_at_first(trajectory: SentTrajectory, _: Observed) -> Problem | None:
    first = trajectory.steps[0].sequence
    return None if first in BEGINNINGS else f"it begins with sequence {first}"


@client_check("MC02", "no trajectory has two points")
def _increases_by_one(seen: Observed) -> Iterable[Observation]:
    for trajectory in seen.trajectories():
        for before, after in trajectory.pairs:
            is_next = after.sequence in (before.index + 1, SpecialSequence.END)
            yield after, None if is_next else f"sequence {after.sequence} follows {before.sequence}"


@rule_check("MC03", _downloads, "the client downloads nothing")
def _download_ends(trajectory: SentTrajectory, _: Observed) -> Problem | None:
    first, last = trajectory.steps[0], trajectory.steps[-1]
    if last.sequence != SpecialSequence.END:
        was_cut = trajectory.stop is not None or last.frame.link.closed is not None
        return None if was_cut else f"the last point has sequence {last.sequence}"
    if len(trajectory.steps) == 2 and last.parts[0].positions == first.parts[0].positions:
        name = "industrial_robot_client: a single point is downloaded twice, as -1 and -3"
        return Habit(name, "one point, sent twice")
    return None


@rule_check("MC04", Observed.trajectories, NO_TRAJECTORY)
def _comm_type_fits(trajectory: SentTrajectory, _: Observed) -> Problem | None:
    wanted = CommType.TOPIC if trajectory.is_download else CommType.REQUEST
    kind = "download" if trajectory.is_download else "stream"
    for step in trajectory.steps:
        comm = step.frame.comm_type
        if comm != wanted:
            return f"sequence {step.sequence} of a {kind} has communication type {comm}"
    return None


@client_check("MC05", NO_REPETITION)
def _repeats_with_reason(seen: Observed) -> Iterable[Observation]:
    for trajectory in seen.trajectories():
        last = trajectory.advancing[-1].sequence
        for step in trajectory.steps:
            if step.repeats is not None:
                yield step, _repetition(step, step.repeats, last)


def _repetition(step: SentPoint, before: SentPoint, last: int) -> Problem | None:
    match before.answer:
        case PointAnswer.BUSY:
            return None
        case PointAnswer.NONE if before.frame.link is not step.frame.link:
            return None
        case PointAnswer.UNREADABLE:
            name = "industrial_robot_client: the same point again after an invalid reply"
            return Habit(name, f"sequence {step.sequence} again")
        case PointAnswer.TAKEN if step.sequence == last and step.frame.data == before.frame.data:
            name = "industrial_robot_client: the last message repeated up to min_buffer_size"
            return Habit(name, f"sequence {step.sequence} again")
    return f"sequence {step.sequence} again, although its answer was: {before.answer.value}"


@client_check("MC06", NO_REPETITION)
def _repeats_unchanged(seen: Observed) -> Iterable[Observation]:
    for step in seen.points():
        if step.repeats is not None:
            same = step.frame.data == step.repeats.frame.data
            yield step, None if same else f"sequence {step.sequence} again with other values"


@rule_check("MC16", Observed.trajectories, NO_TRAJECTORY)
def _one_type(trajectory: SentTrajectory, _: Observed) -> Problem | None:
    types = {step.frame.msg_type for step in trajectory.steps}
    return f"types {sorted(types)}" if len(types) > 1 else None


@client_check("MC07", NO_TRAJECTORY)
def _unused_slots(seen: Observed) -> Iterable[Observation]:
    setup = seen.trace.setup
    dof = setup.limits.dof if setup.limits else setup.dof
    if dof is None:
        raise CannotJudge("the number of joints was not told")
    for step in seen.points():
        used = any(
            any(values[dof:])
            for part in step.parts
            for values in (part.positions, part.velocities, part.accelerations)
        )
        yield step, f"a value in a slot behind joint {dof}" if used else None


@rule_check("MC08", _ratio_points, NO_RATIO_POINT)
def _ratio_in_range(step: SentPoint, _: Observed) -> Problem | None:
    ratio = step.parts[0].ratio
    return None if ratio is not None and 0.0 < ratio <= 1.0 else f"speed ratio {ratio}"


def _moving_by_ratio(seen: Observed) -> list[SentTrajectory]:
    """Return the trajectories of type 11 alone that go somewhere."""
    return [
        item
        for item in seen.trajectories()
        if not any(step.is_full for step in item.steps)
        and len({step.parts[0].positions for step in item.steps}) > 1
    ]


@rule_check("MC09", _moving_by_ratio, "no type-11 trajectory has two different points")
def _ratio_means_something(trajectory: SentTrajectory, _: Observed) -> Problem | None:
    if any(step.parts[0].ratio != DEFAULT_RATIO for step in trajectory.steps):
        return None
    name = "industrial_robot_client: speed ratio 0.1 where no velocities are known"
    return Habit(name, f"all {len(trajectory.steps)} points have it")


@rule_check("MC10", _ratio_points, NO_RATIO_POINT)
def _duration_positive(step: SentPoint, _: Observed) -> Problem | None:
    duration = step.parts[0].duration
    if duration is None or not math.isfinite(duration) or duration < 0:
        return f"duration {duration}"
    if duration > LONGEST_SEGMENT:
        return f"duration {duration:g} s, more than {LONGEST_SEGMENT:g}"
    if duration == 0 and step.index > 0:
        return f"duration 0 at sequence {step.sequence}"
    if duration == PLACEHOLDER and step.sequence in BEGINNINGS:
        name = "industrial_robot_client: 10 s for a first point whose time does not increase"
        return Habit(name, "duration 10 s")
    return None


@client_check("MC11", NO_FULL_POINT)
def _time_increases(seen: Observed) -> Iterable[Observation]:
    for trajectory in seen.trajectories():
        last: float | None = None
        for step in trajectory.advancing:
            time = step.parts[0].time
            if time is None or not step.parts[0].valid & ValidField.TIME:
                continue
            problem: Problem | None = None
            if not (math.isfinite(time) and time >= 0):
                problem = f"time {time} s"
            elif last is None:
                problem = _late_start(seen, step, time)
            elif not time > last:
                problem = f"time {time:g} s after {last:g} s"
            yield step, problem
            last = time


def _late_start(seen: Observed, first: SentPoint, time: float) -> Problem | None:
    """Return what is wrong where a robot that stands at the first point would wait there."""
    if first.index > 0 or time <= LONGEST_START:
        return None
    for part in first.parts:
        places = seen.reports.places(first.frame.time, part.group)
        gaps = [max(map(abs, map(sub, place, part.positions))) for place in places]
        if not gaps or not min(gaps) <= STANDS_THERE:
            return None
    return f"the first point has time {time:g} s, and the robot stands there"


@rule_check("MC12", _full_points, NO_FULL_POINT)
def _bits_defined(step: SentPoint, seen: Observed) -> Problem | None:
    sent = _bits_on_the_wire(step, seen.trace.setup.real_size)
    strange = [bits for bits in sent if bits > ValidField.ALL]
    if not strange:
        return None
    text = f"valid_fields {strange[0]:#010x}"
    name = "motoman_driver leaves the upper 28 bits of valid_fields uninitialised"
    return Habit(name, text) if step.frame.msg_type == MULTI_GROUP else text


def _bits_on_the_wire(step: SentPoint, real_size: int) -> list[int]:
    """Return `valid_fields` of each group as sent; the codec masks those of type 2016."""
    frame = step.frame
    if frame.msg_type != MULTI_GROUP or frame.order is None:
        return [part.valid & 0xFFFF_FFFF for part in step.parts]
    record = 2 * 4 + (1 + 3 * JOINT_SLOTS) * real_size
    word = struct.Struct(f"{frame.order.value}I")
    places = (HEADER_SIZE + 2 * 4 + record * index + 4 for index in range(len(step.parts)))
    return [int(word.unpack_from(frame.data, place)[0]) for place in places]


@rule_check("MC13", _full_points, NO_FULL_POINT)
def _position_valid(step: SentPoint, _: Observed) -> Problem | None:
    missing = [part for part in step.parts if not part.valid & ValidField.POSITION]
    return f"valid_fields {missing[0].valid} lacks the position" if missing else None


@rule_check("MC14", _full_points, NO_FULL_POINT)
def _invalid_fields_zero(step: SentPoint, _: Observed) -> Problem | None:
    for part in step.parts:
        for bit, values, name in _fields(part):
            if not part.valid & bit and any(values):
                return f"{name} is not valid but not zero"
    return None


def _fields(part: GroupPoint) -> Iterator[tuple[ValidField, tuple[float, ...], str]]:
    yield ValidField.TIME, (part.time or 0.0,), "time"
    yield ValidField.POSITION, part.positions, "the position"
    yield ValidField.VELOCITY, part.velocities, "the velocity"
    yield ValidField.ACCELERATION, part.accelerations, "the acceleration"


@rule_check("MC15", Observed.full_trajectories, NO_FULL_POINT)
def _same_groups(trajectory: SentTrajectory, seen: Observed) -> Problem | None:
    """Compare the groups of each point with those of the first, and with the reports."""
    known = {report.group for report in seen.reports.joints}
    groups = [tuple(part.group for part in step.parts) for step in trajectory.steps]
    if any(group < 0 for group in groups[0]):
        return f"group {min(groups[0])}"
    strange = set(groups[0]) - known
    # Several groups at once are told by 2017, which not every Motoman controller sends.
    if known and strange and trajectory.steps[0].frame.msg_type != MULTI_GROUP:
        return f"group {min(strange)}, and the controller reports {sorted(known)}"
    others = [other for other in groups if other != groups[0]]
    return f"groups {groups[0]}, then {others[0]}" if others else None
