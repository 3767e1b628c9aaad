"""Checks of what a trajectory point says: slots, ratios, times, valid fields, groups."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from operator import sub

from openpendant.simplemsg import JOINT_SLOTS, MsgType, ValidField

from ..findings import Finding, not_applicable
from .check import ClientCheck, Habit, Observed, Problem, Tally, client_check, each
from .motion import NO_TRAJECTORY
from .trace import HEADER
from .trajectories import BEGINNINGS, Part, Step, Trajectory

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


@client_check(
    "MC07",
    "unused joint slots are zero",
    "industrial_core joint_data.h: ten slots, unused ones are 0",
)
def unused_slots(seen: Observed) -> Finding:
    """Look behind the robot's last joint."""
    setup = seen.trace.setup
    dof = setup.limits.dof if setup.limits else setup.dof
    if dof is None:
        return not_applicable("the number of joints was not told")

    def rule(step: Step) -> Problem | None:
        for part in step.parts:
            for values in (part.positions, part.velocities, part.accelerations):
                if any(values[dof:]):
                    return f"a value in a slot behind joint {dof}"
        return None

    return each(seen.motions.steps, rule, NO_TRAJECTORY)


@client_check(
    "MC08",
    "the speed ratio is above 0, up to 1",
    "REP-I0006, JOINT_TRAJ_PT: a fraction of the largest joint speed; observed:"
    " staubli_val3_driver drops a point of ratio 0, industrial_core never sends one",
)
def ratio_in_range(seen: Observed) -> Finding:
    """Look at the speed ratio of each type-11 point."""

    def rule(step: Step) -> Problem | None:
        ratio = step.parts[0].ratio
        return None if ratio is not None and 0.0 < ratio <= 1.0 else f"speed ratio {ratio}"

    return each(_ratio_steps(seen), rule, NO_RATIO_POINT)


@client_check(
    "MC09",
    "the speed ratio says how fast the joints move",
    "industrial_core joint_trajectory_interface.cpp, calc_velocity",
)
def ratio_means_something(seen: Observed) -> Finding:
    """Look for the placeholder in every point of a trajectory that moves."""

    def rule(trajectory: Trajectory) -> Problem | None:
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


@client_check(
    "MC10",
    "durations are positive and short, but 0 for a first point where the robot stands",
    "REP-I0006, JOINT_TRAJ_PT: the time allotted to the segment",
)
def duration_positive(seen: Observed) -> Finding:
    """Look at the duration of each type-11 point."""

    def rule(step: Step) -> Problem | None:
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


@client_check(
    "MC11",
    "the time of full points increases, and begins where the motion begins",
    "REP-I0006, JOINT_TRAJ_PT_FULL: time from the start; observed: motoman's controller silently"
    " skips a point that is not later",
)
def time_increases(seen: Observed) -> Finding:
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


def _late_start(seen: Observed, first: Step, time: float) -> Problem | None:
    """Tell whether a robot that stands at the first point would wait there for long."""
    if first.index > 0 or time <= LONGEST_START:
        return None
    for part in first.parts:
        places = seen.reports.places(first.frame.time, part.group)
        gaps = [max(map(abs, map(sub, place, part.positions))) for place in places]
        if not gaps or not min(gaps) <= STANDS_THERE:
            return None
    return f"the first point has time {time:g} s, and the robot stands there"


@client_check(
    "MC12",
    "valid_fields has no bits but the four that are defined",
    "industrial_core joint_traj_pt_full.h: time 1, position 2, velocity 4, acceleration 8",
)
def bits_defined(seen: Observed) -> Finding:
    """Look for undefined bits."""

    def rule(step: Step) -> Problem | None:
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


def _bits_on_the_wire(step: Step, real_size: int) -> list[int]:
    """Return `valid_fields` of each group as sent; the codec masks those of type 2016."""
    frame = step.frame
    if frame.msg_type != MULTI_GROUP or frame.order is None:
        return [part.valid & 0xFFFF_FFFF for part in step.parts]
    record = 2 * 4 + (1 + 3 * JOINT_SLOTS) * real_size
    word = struct.Struct(f"{frame.order.value}I")
    places = (HEADER + 2 * 4 + record * index + 4 for index in range(len(step.parts)))
    return [int(word.unpack_from(frame.data, place)[0]) for place in places]


@client_check(
    "MC13",
    "a full point has a position",
    "REP-I0006, JOINT_TRAJ_PT_FULL; motoman_driver: INVALID/3015 without",
)
def position_valid(seen: Observed) -> Finding:
    """Look for the position bit."""

    def rule(step: Step) -> Problem | None:
        missing = [part for part in step.parts if not part.valid & ValidField.POSITION]
        return f"valid_fields {missing[0].valid} lacks the position" if missing else None

    return each(_full_steps(seen), rule, NO_FULL_POINT)


@client_check(
    "MC14",
    "fields that are not valid are zero",
    "REP-I0006, JOINT_TRAJ_PT_FULL: invalid fields travel as zeros",
)
def invalid_fields_zero(seen: Observed) -> Finding:
    """Look at the values of fields that are not meant."""

    def rule(step: Step) -> Problem | None:
        for part in step.parts:
            for bit, values, name in _fields(part):
                if not part.valid & bit and any(values):
                    return f"{name} is not valid but not zero"
        return None

    return each(_full_steps(seen), rule, NO_FULL_POINT)


def _fields(part: Part) -> Iterator[tuple[ValidField, tuple[float, ...], str]]:
    yield ValidField.TIME, (part.time or 0.0,), "time"
    yield ValidField.POSITION, part.positions, "the position"
    yield ValidField.VELOCITY, part.velocities, "the velocity"
    yield ValidField.ACCELERATION, part.accelerations, "the acceleration"


@client_check(
    "MC15",
    "all points of a trajectory are for the same groups, which the controller reports",
    "REP-I0006, JOINT_TRAJ_PT_FULL: robot_id names the robot; motoman_driver: groups 0 to 3",
)
def same_groups(seen: Observed) -> Finding:
    """Compare the groups of each full point with those of the first, and with the reports."""
    known = {report.group for report in seen.reports.joints}

    def rule(trajectory: Trajectory) -> Problem | None:
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


def _ratio_steps(seen: Observed) -> list[Step]:
    return [s for s in seen.motions.steps if s.frame.msg_type == MsgType.JOINT_TRAJ_PT]


def _ratio_trajectories(seen: Observed) -> list[Trajectory]:
    return [
        item
        for item in seen.motions.trajectories
        if all(step.frame.msg_type == MsgType.JOINT_TRAJ_PT for step in item.steps)
    ]


def _full_steps(seen: Observed) -> list[Step]:
    return [step for step in seen.motions.steps if _is_full(step)]


def _is_full(step: Step) -> bool:
    return step.frame.msg_type != MsgType.JOINT_TRAJ_PT


CHECKS: tuple[ClientCheck, ...] = (
    unused_slots,
    ratio_in_range,
    ratio_means_something,
    duration_positive,
    time_increases,
    bits_defined,
    position_valid,
    invalid_fields_zero,
    same_groups,
)
