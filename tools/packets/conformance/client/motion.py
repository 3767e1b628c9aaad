"""Checks of trajectory points: their order from beginning to end, and what each of them says."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from operator import sub

from openpendant.simplemsg import JOINT_SLOTS, CommType, MsgType, SpecialSequence, ValidField
from openpendant.simplemsg.framing import HEADER_SIZE

from ..check import CheckFinding, not_applicable
from .check import Habit, Observed, Problem, Tally, client_check, each
from .trajectories import BEGINNINGS, GroupPoint, PointAnswer, SentPoint, SentTrajectory

NO_TRAJECTORY = "the client sent no trajectory"


@client_check("MC01")
def begins_at_first(seen: Observed) -> CheckFinding:
    """Look at the first sequence number of each trajectory."""

    def rule(trajectory: SentTrajectory) -> Problem | None:
        first = trajectory.steps[0].sequence
        return None if first in BEGINNINGS else f"it begins with sequence {first}"

    fresh = [item for item in seen.motions.trajectories if item.after_stop is None]
    return each(fresh, rule, NO_TRAJECTORY)


@client_check("MC02")
def increases_by_one(seen: Observed) -> CheckFinding:
    """Compare each sequence number with the one before."""

    def rule(pair: tuple[SentPoint, SentPoint]) -> Problem | None:
        before, after = pair
        if after.sequence in (before.index + 1, SpecialSequence.END):
            return None
        return f"sequence {after.sequence} follows {before.sequence}"

    tally = Tally()
    for trajectory in seen.motions.trajectories:
        for pair in trajectory.pairs:
            tally.look(pair[1], rule(pair))
    return tally.finding("no trajectory has two points")


@client_check("MC03")
def download_ends(seen: Observed) -> CheckFinding:
    """Look at the last sequence number of downloads."""

    def rule(trajectory: SentTrajectory) -> Problem | None:
        last = trajectory.steps[-1]
        if last.sequence != SpecialSequence.END:
            was_cut = trajectory.stop is not None or last.frame.link.closed is not None
            return None if was_cut else f"the last point has sequence {last.sequence}"
        first = trajectory.steps[0]
        if len(trajectory.steps) == 2 and last.parts[0].positions == first.parts[0].positions:
            name = "industrial_robot_client: a single point is downloaded twice, as -1 and -3"
            return Habit(name, "one point, sent twice")
        return None

    downloads = [item for item in seen.motions.trajectories if item.is_download]
    return each(downloads, rule, "the client downloads nothing")


@client_check("MC04")
def comm_type_fits(seen: Observed) -> CheckFinding:
    """Look at the communication type of each point."""

    def rule(trajectory: SentTrajectory) -> Problem | None:
        wanted = CommType.TOPIC if trajectory.is_download else CommType.REQUEST
        wrong = [step for step in trajectory.steps if step.frame.comm_type != wanted]
        if not wrong:
            return None
        step = wrong[0]
        kind = "download" if trajectory.is_download else "stream"
        return f"sequence {step.sequence} of a {kind} has communication type {step.frame.comm_type}"

    return each(seen.motions.trajectories, rule, NO_TRAJECTORY)


@client_check("MC05")
def repeats_with_reason(seen: Observed) -> CheckFinding:
    """Look at each point that has the sequence number of the one before."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        last = trajectory.advancing[-1].sequence
        for step in trajectory.steps:
            if step.repeats is not None:
                tally.look(step, _repetition(step, step.repeats, last))
    return tally.finding("no point was sent twice")


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


@client_check("MC06")
def repeats_unchanged(seen: Observed) -> CheckFinding:
    """Compare repetitions with what they repeat, byte by byte."""

    def rule(step: SentPoint) -> Problem | None:
        assert step.repeats is not None
        same = step.frame.data == step.repeats.frame.data
        return None if same else f"sequence {step.sequence} again with other values"

    repeated = [step for step in seen.motions.steps if step.repeats is not None]
    return each(repeated, rule, "no point was sent twice")


@client_check("MC16")
def one_type(seen: Observed) -> CheckFinding:
    """Compare the types of a trajectory's points."""

    def rule(trajectory: SentTrajectory) -> Problem | None:
        types = {step.frame.msg_type for step in trajectory.steps}
        return f"types {sorted(types)}" if len(types) > 1 else None

    return each(seen.motions.trajectories, rule, NO_TRAJECTORY)


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


@client_check("MC07")
def unused_slots(seen: Observed) -> CheckFinding:
    """Look behind the robot's last joint."""
    setup = seen.trace.setup
    dof = setup.limits.dof if setup.limits else setup.dof
    if dof is None:
        return not_applicable("the number of joints was not told")

    def rule(step: SentPoint) -> Problem | None:
        for part in step.parts:
            for values in (part.positions, part.velocities, part.accelerations):
                if any(values[dof:]):
                    return f"a value in a slot behind joint {dof}"
        return None

    return each(seen.motions.steps, rule, NO_TRAJECTORY)


@client_check("MC08")
def ratio_in_range(seen: Observed) -> CheckFinding:
    """Look at the speed ratio of each type-11 point."""

    def rule(step: SentPoint) -> Problem | None:
        ratio = step.parts[0].ratio
        return None if ratio is not None and 0.0 < ratio <= 1.0 else f"speed ratio {ratio}"

    return each(_ratio_steps(seen), rule, NO_RATIO_POINT)


@client_check("MC09")
def ratio_means_something(seen: Observed) -> CheckFinding:
    """Look for the placeholder in every point of a trajectory that moves."""

    def rule(trajectory: SentTrajectory) -> Problem | None:
        if any(step.parts[0].ratio != DEFAULT_RATIO for step in trajectory.steps):
            return None
        name = "industrial_robot_client: speed ratio 0.1 where no velocities are known"
        return Habit(name, f"all {len(trajectory.steps)} points have it")

    moving = [
        trajectory
        for trajectory in _ratio_trajectories(seen)
        if len({step.parts[0].positions for step in trajectory.steps}) > 1
    ]
    return each(moving, rule, "no type-11 trajectory has two different points")


@client_check("MC10")
def duration_positive(seen: Observed) -> CheckFinding:
    """Look at the duration of each type-11 point."""

    def rule(step: SentPoint) -> Problem | None:
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

    return each(_ratio_steps(seen), rule, NO_RATIO_POINT)


@client_check("MC11")
def time_increases(seen: Observed) -> CheckFinding:
    """Compare the time of each full point with the one before."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
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
            tally.look(step, problem)
            last = time
    return tally.finding(NO_FULL_POINT)


def _late_start(seen: Observed, first: SentPoint, time: float) -> Problem | None:
    """Return True if a robot that stands at the first point would wait there for long."""
    if first.index > 0 or time <= LONGEST_START:
        return None
    for part in first.parts:
        places = seen.reports.places(first.frame.time, part.group)
        gaps = [max(map(abs, map(sub, place, part.positions))) for place in places]
        if not gaps or not min(gaps) <= STANDS_THERE:
            return None
    return f"the first point has time {time:g} s, and the robot stands there"


@client_check("MC12")
def bits_defined(seen: Observed) -> CheckFinding:
    """Look for undefined bits."""

    def rule(step: SentPoint) -> Problem | None:
        sent = _bits_on_the_wire(step, seen.trace.setup.real_size)
        strange = [bits for bits in sent if bits > ValidField.ALL]
        if not strange:
            return None
        text = f"valid_fields {strange[0]:#010x}"
        if step.frame.msg_type == MULTI_GROUP:
            name = "motoman_driver leaves the upper 28 bits of valid_fields uninitialised"
            return Habit(name, text)
        return text

    return each(_full_steps(seen), rule, NO_FULL_POINT)


def _bits_on_the_wire(step: SentPoint, real_size: int) -> list[int]:
    """Return `valid_fields` of each group as sent; the codec masks those of type 2016."""
    frame = step.frame
    if frame.msg_type != MULTI_GROUP or frame.order is None:
        return [part.valid & 0xFFFF_FFFF for part in step.parts]
    record = 2 * 4 + (1 + 3 * JOINT_SLOTS) * real_size
    word = struct.Struct(f"{frame.order.value}I")
    places = (HEADER_SIZE + 2 * 4 + record * index + 4 for index in range(len(step.parts)))
    return [int(word.unpack_from(frame.data, place)[0]) for place in places]


@client_check("MC13")
def position_valid(seen: Observed) -> CheckFinding:
    """Look for the position bit."""

    def rule(step: SentPoint) -> Problem | None:
        missing = [part for part in step.parts if not part.valid & ValidField.POSITION]
        return f"valid_fields {missing[0].valid} lacks the position" if missing else None

    return each(_full_steps(seen), rule, NO_FULL_POINT)


@client_check("MC14")
def invalid_fields_zero(seen: Observed) -> CheckFinding:
    """Look at the values of fields that are not meant."""

    def rule(step: SentPoint) -> Problem | None:
        for part in step.parts:
            for bit, values, name in _fields(part):
                if not part.valid & bit and any(values):
                    return f"{name} is not valid but not zero"
        return None

    return each(_full_steps(seen), rule, NO_FULL_POINT)


def _fields(part: GroupPoint) -> Iterator[tuple[ValidField, tuple[float, ...], str]]:
    yield ValidField.TIME, (part.time or 0.0,), "time"
    yield ValidField.POSITION, part.positions, "the position"
    yield ValidField.VELOCITY, part.velocities, "the velocity"
    yield ValidField.ACCELERATION, part.accelerations, "the acceleration"


@client_check("MC15")
def same_groups(seen: Observed) -> CheckFinding:
    """Compare the groups of each full point with those of the first, and with the reports."""
    known = {report.group for report in seen.reports.joints}

    def rule(trajectory: SentTrajectory) -> Problem | None:
        groups = [tuple(part.group for part in step.parts) for step in trajectory.steps]
        if any(group < 0 for group in groups[0]):
            return f"group {min(groups[0])}"
        strange = set(groups[0]) - known
        # Several groups at once are told by 2017, which not every Motoman controller sends.
        if known and strange and trajectory.steps[0].frame.msg_type != MULTI_GROUP:
            return f"group {min(strange)}, and the controller reports {sorted(known)}"
        others = [other for other in groups if other != groups[0]]
        return f"groups {groups[0]}, then {others[0]}" if others else None

    full = [item for item in seen.motions.trajectories if _is_full(item.steps[0])]
    return each(full, rule, NO_FULL_POINT)


def _ratio_steps(seen: Observed) -> list[SentPoint]:
    return [s for s in seen.motions.steps if s.frame.msg_type == MsgType.JOINT_TRAJ_PT]


def _ratio_trajectories(seen: Observed) -> list[SentTrajectory]:
    return [
        item
        for item in seen.motions.trajectories
        if all(step.frame.msg_type == MsgType.JOINT_TRAJ_PT for step in item.steps)
    ]


def _full_steps(seen: Observed) -> list[SentPoint]:
    return [step for step in seen.motions.steps if _is_full(step)]


def _is_full(step: SentPoint) -> bool:
    return step.frame.msg_type != MsgType.JOINT_TRAJ_PT
