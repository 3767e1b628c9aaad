"""Section Q: STATUS, its seven values, and how they change with the motion."""

from __future__ import annotations

import asyncio
import itertools

from openpendant.simplemsg import (
    PENDANT,
    CommType,
    ControllerMode,
    MsgType,
    ReplyCode,
    Status,
    TriState,
)
from openpendant.simplemsg.framing import HEADER_SIZE
from openpendant.simplemsg.pendant import OperatorAction, OperatorEvent

from ..check import PASSED, CannotJudge, CheckFinding, RuleBroken, deviates, passed
from .answers import STOP, is_taken
from .checks import ANY, FULL, check, check_on
from .moving import LEAD_IN, STOP_WITHIN, VERY_SLOW, ready
from .recordings import (
    SLOW,
    RecordedMotion,
    at_rest,
    must_be_slow,
    stopped_motion,
    undisturbed,
)
from .target import Target
from .wire import raw_frame

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
