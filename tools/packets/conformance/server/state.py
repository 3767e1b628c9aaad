"""Sections T and Q: what the state port tells; how often, in which order, and if it is true."""

from __future__ import annotations

import asyncio
import itertools
import math
from collections.abc import Sequence

from openpendant.simplemsg import (
    PENDANT,
    CommType,
    ControllerMode,
    JointFeedback,
    MsgType,
    ReplyCode,
    Status,
    TriState,
    ValidField,
)
from openpendant.simplemsg.framing import HEADER_SIZE
from openpendant.simplemsg.pendant import OperatorAction, OperatorEvent

from ..check import PASSED, CannotJudge, CheckFinding, RuleBroken, deviates, passed
from .answers import STOP, is_taken
from .checks import ANY, FULL, check, check_on
from .monitor import ReportedJoints, distance, longest_gap, rate
from .moving import LEAD_IN, SPEED, STOP_WITHIN, VERY_SLOW, ready
from .recordings import (
    SLOW,
    RecordedMotion,
    Sample,
    at_rest,
    must_be_slow,
    stopped_motion,
    undisturbed,
)
from .target import Target
from .wire import raw_frame

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


_TRI_STATES = ("drives_powered", "e_stopped", "in_error", "in_motion", "motion_possible")
_DELAY = 0.5


async def _statuses(target: Target) -> list[Status]:
    taken = await at_rest(target)
    if not taken.statuses:
        raise RuleBroken("no STATUS was reported")
    return [told.status for told in taken.statuses]


async def _told_in_motion(target: Target) -> RecordedMotion:
    motion = await undisturbed(target)
    if not motion.statuses:
        raise CannotJudge("no STATUS was reported")
    return motion


@check("QS01", profiles=ANY, is_plain=True)
async def _tri_states(target: Target) -> None:
    for status in await _statuses(target):
        for name in _TRI_STATES:
            if getattr(status, name) not in (-1, 0, 1):
                raise RuleBroken(f"{name} is {getattr(status, name)}")


@check("QS02", profiles=ANY, is_plain=True)
async def _modes(target: Target) -> None:
    for status in await _statuses(target):
        if status.mode not in (-1, 1, 2):
            raise RuleBroken(f"mode is {status.mode}")


@check("QS03", profiles=ANY, is_plain=True)
async def _error_code(target: Target) -> CheckFinding:
    for status in await _statuses(target):
        if status.in_error == TriState.TRUE and status.error_code == 0:
            raise RuleBroken("in_error is 1, error_code 0")
        if status.in_error == TriState.FALSE and status.error_code != 0:
            number = f"error_code {status.error_code} with in_error 0"
            return deviates("Fanuc: the number of the last error stays", number)
    return PASSED


@check("QS04", profiles=ANY, is_plain=True)
async def _at_rest_not_in_motion(target: Target) -> CheckFinding:
    last = (await _statuses(target))[-1]
    if last.in_motion == TriState.TRUE:
        raise RuleBroken("in_motion is 1 although the joint values stand still")
    if last.in_motion == TriState.UNKNOWN:
        return deviates("in_motion unknown: the action server passes it with a warning", "-1")
    return PASSED


@check("QS05", profiles=ANY, is_plain=True)
async def _possible(target: Target) -> None:
    for status in await _statuses(target):
        is_dead = status.e_stopped == TriState.TRUE or status.drives_powered == TriState.FALSE
        if is_dead and status.motion_possible == TriState.TRUE:
            raise RuleBroken(
                f"motion_possible is 1 with e_stopped {status.e_stopped},"
                f" drives_powered {status.drives_powered}"
            )


@check("QS06", profiles=ANY, is_plain=True)
async def _known(target: Target) -> CheckFinding:
    last = (await _statuses(target))[-1]
    unknown = [name for name in (*_TRI_STATES, "mode") if getattr(last, name) == -1]
    if unknown:
        return deviates(
            "ABB and others: values without a named output are unknown (-1)", ", ".join(unknown)
        )
    return PASSED


@check_on(_statuses, "QS07", profiles=ANY, is_plain=True)
async def _steady(states: list[Status]) -> None:
    for name in (*_TRI_STATES, "mode", "error_code"):
        values = [getattr(status, name) for status in states]
        changes = sum(a != b for a, b in itertools.pairwise(values))
        if changes > 1:
            raise RuleBroken(f"{name} changed {changes} times in 2.2 s at rest")


@check_on(_told_in_motion, "QS08", moves=True, is_plain=True)
async def _says_motion(motion: RecordedMotion) -> CheckFinding:
    left = motion.must_have_moved()[0].time
    said = [told.time for told in motion.statuses if told.status.in_motion == TriState.TRUE]
    if not said:
        if all(told.status.in_motion == TriState.UNKNOWN for told in motion.statuses):
            return deviates("in_motion unknown: the action server passes it with a warning", "-1")
        raise RuleBroken("in_motion was never 1 although the robot moved")
    if said[0] > left + _DELAY:
        raise RuleBroken(f"in_motion became 1 only {said[0] - left:.2f} s after the robot moved")
    return passed(f"{said[0] - left:+.3f} s after the first visible motion")


@check_on(_told_in_motion, "QS09", moves=True, is_plain=True)
async def _until_it_stands(motion: RecordedMotion) -> None:
    moving = motion.visibly_moving()
    began, ended = moving[0].time, moving[-1].time - 0.02
    has_said = False
    for told in motion.statuses:
        if not began < told.time < ended:
            continue
        has_said = has_said or told.status.in_motion == TriState.TRUE
        is_late = has_said or told.time > began + _DELAY
        if is_late and told.status.in_motion == TriState.FALSE:
            raise RuleBroken(f"in_motion was 0 {ended - told.time:.3f} s before the robot stood")


@check_on(_told_in_motion, "QS10", moves=True, is_plain=True)
async def _says_rest(motion: RecordedMotion) -> CheckFinding:
    stood = motion.must_have_moved()[-1].time
    rest = [
        told.time
        for told in motion.statuses
        if told.time >= stood - 0.02 and told.status.in_motion != TriState.TRUE
    ]
    if not rest or rest[0] > stood + 1.0:
        raise RuleBroken("in_motion was still 1 a second after the robot stood")
    return passed(f"{rest[0] - stood:+.3f} s")


@check_on(_told_in_motion, "QS11", moves=True, is_plain=True)
async def _had_said_possible(motion: RecordedMotion) -> None:
    motion.must_have_moved()
    before = [told.status for told in motion.statuses if told.time <= motion.sent]
    if not before:
        raise CannotJudge("no STATUS came before the motion")
    last = before[-1]
    if last.motion_possible == TriState.FALSE or last.drives_powered == TriState.FALSE:
        raise RuleBroken(
            f"it moved with motion_possible {last.motion_possible},"
            f" drives_powered {last.drives_powered}"
        )
    if last.mode == 1:
        raise RuleBroken("it moved by remote command with mode 1, manual")


@check_on(stopped_motion, "QS12", moves=True, is_plain=True)
async def _stop_is_no_error(motion: RecordedMotion) -> None:
    last = motion.statuses[-1].status
    if last.in_motion == TriState.TRUE:
        raise RuleBroken("in_motion was still 1 1.2 s after STOP")
    if last.in_error == TriState.TRUE:
        raise RuleBroken(f"after STOP the robot is in error {last.error_code}")


@check("QS13", moves=True, profiles=FULL)
async def _error_is_over(target: Target) -> None:
    await must_be_slow(target)
    mover = await ready(target)
    nan = tuple(float("nan") if slot == mover.joint else v for slot, v in enumerate(mover.start))
    short = mover.wire.encode(STOP)[HEADER_SIZE : HEADER_SIZE + 4] * 2
    mover.wire.send(
        raw_frame(mover.wire.codec, MsgType.JOINT_TRAJ_PT, CommType.REQUEST, body=short)
    )
    await mover.wire.poll(0.5)
    if not mover.wire.is_lost:
        if is_taken(await mover.point(0, nan, VERY_SLOW)):
            mover.wire.send(STOP)
            raise CannotJudge("what is no number was taken; LS01 says so")
    await target.close()
    again = await ready(target)
    if not is_taken(await again.point(0, again.start, LEAD_IN)):
        raise RuleBroken("after a refused point a good trajectory is refused too")
    await again.watch.until(lambda: not again.watch.says_motion(), 3.0)
    await again.rests_within(3.0)
    if not await again.watch.until(lambda: _no_error(again.watch.status), 1.5):
        code = again.watch.status.error_code if again.watch.status else 0
        raise RuleBroken(f"error {code} stays after a good trajectory")


def _is_off(status: Status | None) -> bool:
    return status is not None and status.drives_powered != TriState.TRUE


def _no_error(status: Status | None) -> bool:
    return status is not None and status.in_error != TriState.TRUE


async def _operate(target: Target, action: OperatorAction) -> bool:
    """Play the operator of an emulator; return True if it obeyed."""
    wire = await target.motion()
    event = target.codec(dialect=PENDANT).encode(OperatorEvent(action))
    reply = await wire.ask(event, "OPERATOR_EVENT")
    return reply.reply_code == ReplyCode.SUCCESS


@check("QS14", moves=True, profiles=FULL)
async def _emergency_stop(target: Target) -> None:
    mover = await ready(target)
    watch = mover.watch
    if not await _operate(target, OperatorAction.EMERGENCY_STOP):
        raise CannotJudge("the target takes no OPERATOR_EVENT")
    try:
        if not await watch.until(
            lambda: watch.status is not None and watch.status.e_stopped == TriState.TRUE, _DELAY
        ):
            raise RuleBroken("STATUS does not show the emergency stop")
        if watch.status is not None and watch.status.motion_possible == TriState.TRUE:
            raise RuleBroken("motion_possible is 1 in emergency stop")
        if not await watch.until(lambda: _is_off(watch.status), _DELAY):
            raise RuleBroken("drives_powered is 1 in emergency stop")
        reply = await mover.point(0, mover.start, LEAD_IN)
        if is_taken(reply):
            raise RuleBroken("a point was taken in emergency stop")
        await mover.wire.ask(STOP, "STOP in emergency stop")
    finally:
        await _operate(target, OperatorAction.RESET)
    await mover.stays(0.5, "the reset of an emergency stop", mover.start)
    if not await watch.until(
        lambda: watch.status is not None and watch.status.e_stopped == TriState.FALSE, _DELAY
    ):
        raise RuleBroken("STATUS still shows the emergency stop after its reset")


@check("QS15", moves=True, profiles=FULL)
async def _emergency_stop_in_motion(target: Target) -> None:
    mover = await ready(target)
    await mover.set_off(SLOW)
    if not await _operate(target, OperatorAction.EMERGENCY_STOP):
        raise CannotJudge("the target takes no OPERATOR_EVENT")
    try:
        await asyncio.sleep(STOP_WITHIN)
        stood = mover.watch.position
        await mover.stays(0.4, "an emergency stop", stood)
    finally:
        await _operate(target, OperatorAction.RESET)
    await mover.stays(0.8, "the reset of an emergency stop", stood)


@check_on(_told_in_motion, "QS16", moves=True, is_plain=True)
async def _healthy(motion: RecordedMotion) -> None:
    moving = motion.visibly_moving()
    for told in motion.statuses:
        if moving[0].time <= told.time <= moving[-1].time:
            _must_be_healthy(told.status)


def _must_be_healthy(status: Status) -> None:
    if status.in_error == TriState.TRUE:
        raise RuleBroken(f"in_error is 1, error {status.error_code}, while the robot moves")
    if status.e_stopped == TriState.TRUE:
        raise RuleBroken("e_stopped is 1 while the robot moves")
    if status.drives_powered == TriState.FALSE:
        raise RuleBroken("drives_powered is 0 while the robot moves")
    if status.mode == ControllerMode.MANUAL:
        raise RuleBroken("mode is 1, manual, while the robot moves by remote command")
