"""Section T: the topics of the state port; how often, in which order, and whether they are true."""

from __future__ import annotations

import asyncio
import itertools
import math
from collections.abc import Sequence

from openpendant.simplemsg import JointFeedback, MsgType, ValidField
from openpendant.simplemsg.framing import HEADER_SIZE

from ..check import PASSED, CannotJudge, CheckFinding, RuleBroken, deviates, passed
from .checks import ANY, FULL, check, check_on
from .monitor import ReportedJoints, distance, longest_gap, rate
from .moving import SPEED
from .recordings import RecordedMotion, Sample, at_rest, undisturbed
from .target import Target

LEAST_RATE = 10.0
"""Joint values a second; a tenth less is granted, as a pause of 0.1 s plus the work gives."""

_GRANTED = 0.9
_LONGEST_GAP = 0.4
_LONGEST_GAP_EXACTLY = 0.25
"""Longest gap that docs/minimum-controller.md allows [s]."""

_FIRST_FRAME = 1.5
"""Stäubli starts to report a second after it notices a listener [s]."""

_FIRST_FRAME_EXACTLY = 0.5
_NOISE = 1e-3
_SIZES = {
    MsgType.JOINT_POSITION: (44, 84),
    MsgType.STATUS: (28,),
    MsgType.JOINT_FEEDBACK: (132, 256),
}
_OTHERS_MOVE = 2e-3
_HANGING = 3.0
_ENOUGH = 10


def _longest_gap(target: Target) -> float:
    return _LONGEST_GAP_EXACTLY if target.is_minimum else _LONGEST_GAP


async def _with_joints(target: Target) -> Sample:
    taken = await at_rest(target)
    if not taken.joints:
        raise RuleBroken("the state port reports no joint values")
    return taken


@check("TS01", profiles=ANY, is_plain=True)
async def _speaks(target: Target) -> CheckFinding:
    taken = await at_rest(target)
    if not taken.frames:
        raise RuleBroken("the state port said nothing for 2.2 s")
    late = taken.frames[0].time - taken.opened
    if late > (_FIRST_FRAME_EXACTLY if target.is_minimum else _FIRST_FRAME):
        raise RuleBroken(f"the first frame came {late:.2f} s after connecting")
    return passed(f"first frame after {late:.3f} s")


@check("TS02", profiles=ANY, is_plain=True)
async def _joint_rate(target: Target) -> CheckFinding:
    found = rate([report.time for report in (await _with_joints(target)).joints])
    if found < LEAST_RATE * _GRANTED:
        raise RuleBroken(f"joint values come at {found:.3g} Hz")
    return passed(f"{found:.3g} Hz")


@check("TS03", profiles=ANY, is_plain=True)
async def _gaps(target: Target) -> CheckFinding:
    taken = await _with_joints(target)
    gap = longest_gap([report.time for report in taken.joints])
    if gap > _longest_gap(target):
        raise RuleBroken(f"for {gap:.3g} s no joint values came")
    return passed(f"longest pause {gap:.3g} s")


@check("TS04", profiles=ANY, is_plain=True)
async def _status_rate(target: Target) -> CheckFinding:
    times = [told.time for told in (await at_rest(target)).statuses]
    if len(times) < 2 or longest_gap(times) > 1.1:
        raise RuleBroken(f"STATUS came {len(times)} times in 2.2 s, longest pause over 1.1 s")
    return passed(f"{rate(times):.3g} Hz")


@check_on(_with_joints, "TS05", is_plain=True)
async def _order(taken: Sample) -> None:
    kinds = [frame.msg_type for frame in taken.frames]
    joint_types = (MsgType.JOINT_POSITION, MsgType.JOINT_FEEDBACK)
    if kinds[0] not in joint_types:
        raise RuleBroken(f"the first frame after connecting is of type {kinds[0]}")
    late = 0
    for index, frame in enumerate(taken.frames[:-1]):
        following = taken.frames[index + 1]
        # What comes in one burst is one round; in it nothing follows STATUS.
        is_same_round = following.time - frame.time < 0.25 / LEAST_RATE / 10
        if frame.msg_type == MsgType.STATUS and following.msg_type in joint_types:
            late += is_same_round
    if late > len(taken.statuses) // 4:
        raise RuleBroken(f"STATUS stood in front of joint values in {late} rounds")


@check("TS06", profiles=ANY, is_plain=True)
async def _unused_slots(target: Target) -> None:
    if target.options.limits is None:
        raise CannotJudge("how many joints the robot has is not known without --robot")
    dof = target.options.limits.dof
    for report in (await _with_joints(target)).joints:
        for slot, value in enumerate(report.values[dof:], start=dof + 1):
            if value != 0:
                raise RuleBroken(f"slot {slot} is {value:g}, but the robot has {dof} joints")


@check_on(at_rest, "TS07", is_plain=True)
async def _sequence(taken: Sample) -> None:
    if not any(frame.msg_type == MsgType.JOINT_POSITION for frame in taken.frames):
        raise CannotJudge("no joint values of type 10 are reported")
    _must_be_zero(taken.joints)


def _must_be_zero(reports: Sequence[ReportedJoints]) -> None:
    for report in reports:
        if report.sequence != 0:
            raise RuleBroken(f"joint values are reported with sequence {report.sequence}")


@check_on(at_rest, "TS08", profiles=ANY, is_plain=True)
async def _sizes(taken: Sample) -> None:
    for frame in taken.frames:
        sizes = _SIZES.get(MsgType(frame.msg_type)) if frame.msg_type in _SIZES else None
        if sizes is not None and frame.size - HEADER_SIZE not in sizes:
            raise RuleBroken(
                f"{frame}: a body of {frame.size - HEADER_SIZE} bytes; expected {sizes[0]}"
            )
    if not taken.frames:
        raise CannotJudge("the state port says nothing")


@check("TS09", is_plain=True)
async def _generic_joints(target: Target) -> CheckFinding:
    kinds = {frame.msg_type for frame in (await _with_joints(target)).frames}
    if MsgType.JOINT_POSITION in kinds:
        return PASSED
    return deviates("Motoman: joint values come as type 15 only", f"types {sorted(kinds)}")


@check_on(_with_joints, "TS10", profiles=ANY, is_plain=True)
async def _still(taken: Sample) -> CheckFinding:
    first = taken.joints[0].values
    worst = max(distance(report.values, first) for report in taken.joints)
    if worst > _NOISE:
        raise RuleBroken(f"joint values of a resting robot differ by {worst:.3g} rad or m")
    return passed(f"within {worst:.1g} rad or m")


@check("TS11", profiles=ANY, is_plain=True)
async def _in_range(target: Target) -> None:
    limits = target.options.limits
    if limits is None:
        raise CannotJudge("the robot's range is not known without --robot")
    for report in (await _with_joints(target)).joints:
        for joint in range(limits.dof):
            value = report.values[joint]
            if not limits.lower[joint] - _NOISE <= value <= limits.upper[joint] + _NOISE:
                raise RuleBroken(
                    f"joint {joint + 1} reports {value:.4g}, range {limits.lower[joint]:.4g} to"
                    f" {limits.upper[joint]:.4g}"
                )


@check_on(at_rest, "TS12", profiles=ANY, is_plain=True)
async def _feedback(taken: Sample) -> None:
    if not taken.feedback:
        raise CannotJudge("no feedback of type 15 is reported")
    times: list[float] = []
    for _, told in taken.feedback:
        if told.valid_fields & ~ValidField.ALL or not told.valid_fields & ValidField.POSITION:
            raise RuleBroken(f"valid_fields is {told.valid_fields}")
        if taken.joints and distance(told.positions, taken.joints[0].values) > _NOISE:
            raise RuleBroken("positions of types 10 and 15 differ at rest")
        for field, values in _fields_of(told).items():
            if not told.valid_fields & field and any(values):
                raise RuleBroken(f"{field.name} is not valid and not zero: {max(values):.4g}")
        if told.valid_fields & ValidField.TIME:
            times.append(told.time)
    if any(later < earlier for earlier, later in itertools.pairwise(times)):
        raise RuleBroken("the time of type 15 runs backwards")


def _fields_of(told: JointFeedback) -> dict[ValidField, tuple[float, ...]]:
    return {
        ValidField.TIME: (told.time,),
        ValidField.VELOCITY: told.velocities,
        ValidField.ACCELERATION: told.accelerations,
    }


@check("TS13", profiles=FULL, is_plain=True)
async def _two_listeners(target: Target) -> CheckFinding:
    first, second = await target.state(), await target.state()
    await asyncio.sleep(1.2)
    rates = [rate([report.time for report in watch.joints]) for watch in (first, second)]
    if rates[0] < LEAST_RATE * _GRANTED and rates[1] >= LEAST_RATE * _GRANTED:
        return deviates("Motoman: a new listener replaces an old one", f"rates {rates}")
    if rates[0] < LEAST_RATE * _GRANTED:
        raise RuleBroken(f"with a second listener the first is told at {rates[0]:.3g} Hz")
    if rates[1] < LEAST_RATE * _GRANTED:
        return deviates("industrial_core: one client a port", f"the second got {rates[1]:.3g} Hz")
    if distance(first.position, second.position) > _NOISE:
        raise RuleBroken("two listeners are told different positions")
    return PASSED


@check("TS14", profiles=ANY, is_plain=True)
async def _again(target: Target) -> None:
    for attempt in range(1, 4):
        watch = await target.state()
        await watch.begin()
        if not watch.joints:
            raise RuleBroken(f"at connection {attempt} no joint values came for 2.5 s")
        await target.close()


@check("TS15", profiles=FULL, is_plain=True)
async def _hanging_listener(target: Target) -> CheckFinding:
    hanging = await target.state_wire()
    hanging.hold()
    watch = await target.state()
    await asyncio.sleep(_HANGING)
    if longest_gap([report.time for report in watch.joints]) > _longest_gap(target):
        count = len(watch.joints)
        if count == 0:
            return deviates("industrial_core: one client a port", "the second was told nothing")
        raise RuleBroken(f"beside one that hangs, a listener got {count} reports in {_HANGING:g} s")
    return PASSED


@check("TS16", moves=True, is_plain=True)
async def _pace_in_motion(target: Target) -> CheckFinding:
    motion = await undisturbed(target)
    times = [report.time for report in motion.joints]
    if rate(times) < LEAST_RATE * _GRANTED or longest_gap(times) > _longest_gap(target):
        raise RuleBroken(f"{rate(times):.3g} Hz, longest pause {longest_gap(times):.3g} s")
    return passed(f"{rate(times):.3g} Hz")


@check_on(undisturbed, "TS17", moves=True, is_plain=True)
async def _no_jumps(motion: RecordedMotion) -> None:
    motion.must_have_moved()
    way = abs(motion.goal[motion.joint] - motion.start[motion.joint])
    for earlier, later in zip(motion.joints, motion.joints[1:], strict=False):
        step = distance(earlier.values, later.values)
        # Six times the commanded mean speed is more than any velocity profile explains.
        allowed = 0.1 * way + 6 * SPEED * max(later.time - earlier.time, 0.02)
        if not math.isfinite(step) or step > allowed:
            raise RuleBroken(
                f"{step:.3g} rad or m between two reports {later.time - earlier.time:.3f} s apart"
            )


@check_on(undisturbed, "TS18", moves=True, is_plain=True)
async def _others_stay(motion: RecordedMotion) -> None:
    motion.must_have_moved()
    for slot in range(len(motion.start)):
        off = max(abs(report.values[slot] - motion.start[slot]) for report in motion.joints)
        if slot != motion.joint and off > _OTHERS_MOVE:
            raise RuleBroken(f"joint {slot + 1} moved by {off:.3g}, asked was {motion.joint + 1}")


@check_on(undisturbed, "TS19", moves=True, profiles=FULL, is_plain=True)
async def _velocities(motion: RecordedMotion) -> CheckFinding:
    moving = motion.must_have_moved()
    middle = [
        told
        for time, told in motion.feedback
        if moving[0].time <= time <= moving[-1].time and told.valid_fields & ValidField.VELOCITY
    ]
    if len(middle) < _ENOUGH:
        raise CannotJudge("no velocities are reported, or too few to judge their mean")
    joint = motion.joint
    mean = sum(told.velocities[joint] for told in middle) / len(middle)
    way = moving[-1].values[joint] - moving[0].values[joint]
    true = way / (moving[-1].time - moving[0].time)
    if not 0.8 < mean / true < 1.25:
        raise RuleBroken(f"reported {mean:.3g} rad/s on average, the positions say {true:.3g}")
    return passed(f"{mean:.3g} against {true:.3g} rad/s")


@check_on(undisturbed, "TS20", moves=True, is_plain=True)
async def _sequence_in_motion(motion: RecordedMotion) -> None:
    motion.must_have_moved()
    _must_be_zero(motion.joints)
