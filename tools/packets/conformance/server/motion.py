"""Section M: points become motion, that motion and no other, and it ends where it was asked to."""

from __future__ import annotations

import asyncio
import math

from openpendant.simplemsg import (
    CommType,
    JointTraj,
    JointTrajPt,
    MsgType,
    ReplyCode,
    SpecialSequence,
    TrajPoint,
)

from ..check import PASSED, CannotJudge, CheckFinding, CheckVerdict, RuleBroken, deviates, passed
from .answers import full_point, is_taken, judge_point_reply
from .checks import FULL, check, check_on
from .monitor import distance
from .moving import ARRIVED, ARRIVED_EXACTLY, LEAD_IN, SPEED, START_WITHIN, Mover, ready
from .recordings import RecordedMotion, reference, undisturbed
from .target import Target

_NO_SEQUENCE = "ABB, Fanuc, Stäubli, Motoman: the order of sequences is not checked"
_LONG = 1.0

_BEHIND = 0.5
"""A robot that is farther behind is given up: docs/minimum-controller.md [s]."""

_ROUND = 1.6
"""A cosine's largest speed is so many times its mean speed."""


async def _arrives(mover: Mover, goal: tuple[float, ...], what: str, within: float) -> None:
    """Raise RuleBroken unless the robot leaves, and comes to stand at a goal."""
    if not await mover.watch.until(lambda: mover.has_left, START_WITHIN):
        raise RuleBroken(f"{what}: the robot did not move within {START_WITHIN:g} s")
    at = await mover.rests_within(within)
    if distance(at, goal) > mover.arrival:
        raise RuleBroken(f"{what}: the robot stands {distance(at, goal):.4g} rad or m off the goal")


@check_on(ready, "MS01", moves=True, is_plain=True)
async def _stays(mover: Mover) -> None:
    await mover.accepted(0, mover.start, LEAD_IN)
    await mover.stays(0.4, "a point where the robot stands", mover.start)


@check("MS02", moves=True, is_plain=True)
async def _ends_at_goal(target: Target) -> CheckFinding:
    motion: RecordedMotion = await target.once("a motion", reference, is_subject=True)
    off = distance(motion.end, motion.goal)
    if off > (ARRIVED_EXACTLY if target.is_minimum else ARRIVED):
        raise RuleBroken(f"two points: the robot stands {off:.4g} rad or m off the last one")
    return passed(f"{off:.1g} rad or m off")


@check_on(undisturbed, "MS03", moves=True, is_plain=True)
async def _replies(motion: RecordedMotion) -> CheckFinding:
    worst = PASSED
    for reply in motion.replies:
        finding = judge_point_reply(reply)
        if finding.verdict is not CheckVerdict.PASSED:
            worst = finding
    return worst


@check_on(undisturbed, "MS04", moves=True, is_plain=True)
async def _answered_in_time(motion: RecordedMotion) -> CheckFinding:
    late = motion.replies[-1].time - motion.sent
    if late > motion.duration + 1.0:
        raise RuleBroken(f"the second of two points was answered after {late:.2f} s")
    return passed(f"after {late:.3f} s")


@check_on(undisturbed, "MS05", moves=True, is_plain=True)
async def _begins(motion: RecordedMotion) -> CheckFinding:
    delay = motion.must_have_moved()[0].time - motion.sent
    if delay > START_WITHIN:
        raise RuleBroken(f"it began {delay:.2f} s after the last point was sent")
    return passed(f"after {delay:.3f} s")


@check_on(undisturbed, "MS06", moves=True, profiles=FULL, is_plain=True)
async def _not_faster(motion: RecordedMotion) -> CheckFinding:
    moving = motion.must_have_moved()
    took = moving[-1].time - moving[0].time
    if took < 0.4 * motion.duration:
        return deviates(
            "Fanuc, Stäubli: the duration is not used",
            f"asked {motion.duration:.2f} s, took {took:.2f} s",
        )
    return passed(f"asked {motion.duration:.2f} s, seen {took:.2f} s of it")


@check_on(undisturbed, "MS07", moves=True, is_plain=True)
async def _not_slower(motion: RecordedMotion) -> CheckFinding:
    moving = motion.visibly_moving()
    took = moving[-1].time - moving[0].time
    if took > motion.duration + _BEHIND:
        raise RuleBroken(f"asked {motion.duration:.2f} s, took {took:.2f} s")
    return passed(f"asked {motion.duration:.2f} s, seen {took:.2f} s of it")


@check_on(undisturbed, "MS08", moves=True, is_plain=True)
async def _right_way(motion: RecordedMotion) -> None:
    motion.must_have_moved()
    for report in motion.joints:
        part = motion.progress(report.values)
        if not -0.1 <= part <= 1.1:
            raise RuleBroken(f"it was at {100 * part:.0f} % of the way to its goal")


@check_on(ready, "MS09", moves=True, is_plain=True)
async def _single_point(mover: Mover) -> None:
    await mover.accepted(0, mover.goal, mover.amplitude / SPEED)
    await _arrives(mover, mover.goal, "a single point", 6.0)


@check_on(ready, "MS10", moves=True, is_plain=True)
async def _ten_points(mover: Mover) -> None:
    for sequence in range(10):
        part = (1 - math.cos(math.pi * sequence / 9)) / 2
        await mover.accepted(sequence, mover.between(part), mover.seconds(0.6) * _ROUND / 9)
    await _arrives(mover, mover.goal, "ten points", 6.0)


@check_on(ready, "MS11", moves=True, is_plain=True)
async def _second_trajectory(mover: Mover) -> None:
    await mover.go(mover.amplitude / SPEED)
    await _arrives(mover, mover.goal, "the first trajectory", 5.0)
    await mover.accepted(0, mover.watch.position, LEAD_IN)
    await mover.accepted(1, mover.start, mover.amplitude / SPEED)
    if not await mover.watch.until(lambda: not mover.progress(mover.watch.position) > 0.5, 4.0):
        raise RuleBroken("the second trajectory on the same connection was not moved")
    at = await mover.rests_within(5.0)
    if distance(at, mover.start) > mover.arrival:
        raise RuleBroken(f"the way back ended {distance(at, mover.start):.4g} rad or m off")


@check_on(ready, "MS12", moves=True, profiles=FULL, is_plain=True)
async def _duplicate(mover: Mover) -> None:
    watch = mover.watch
    asked = mover.seconds(_LONG)
    await mover.go(asked)
    await mover.accepted(1, mover.goal, asked)
    if not await watch.until(watch.says_motion, START_WITHIN):
        raise CannotJudge("STATUS does not say when the robot moves")
    began = asyncio.get_running_loop().time()
    at = await mover.rests_within(3 * asked)
    took = asyncio.get_running_loop().time() - began
    if distance(at, mover.goal) > mover.arrival:
        raise RuleBroken(f"it stands {distance(at, mover.goal):.4g} rad or m off the goal")
    if took > 1.5 * asked + 0.3:
        raise RuleBroken(f"a motion of {asked:g} s took {took:.2f} s with its last point twice")


@check_on(ready, "MS13", moves=True, profiles=FULL, is_plain=True)
async def _gap(mover: Mover) -> CheckFinding:
    await mover.accepted(0, mover.start, LEAD_IN)
    reply = await mover.point(5, mover.goal, mover.seconds(_LONG))
    if is_taken(reply):
        return deviates(_NO_SEQUENCE, "sequence 5 after 0 was taken")
    await mover.stays(0.8, "a refused point", mover.start)
    return PASSED


@check_on(ready, "MS14", moves=True, profiles=FULL, is_plain=True)
async def _no_beginning(mover: Mover) -> CheckFinding:
    reply = await mover.point(3, mover.goal, mover.seconds(_LONG))
    if is_taken(reply):
        return deviates(_NO_SEQUENCE, "a first point of sequence 3 was taken")
    await mover.stays(0.8, "a refused point", mover.start)
    return PASSED


@check_on(ready, "MS15", moves=True, profiles=FULL, is_plain=True)
async def _replaced(mover: Mover) -> CheckFinding:
    await mover.set_off(mover.seconds(_LONG))
    reply = await mover.point(0, mover.start, mover.seconds(_LONG))
    taken = is_taken(reply)
    at = await mover.rests_within(10.0)
    if taken and distance(at, mover.start) > mover.arrival:
        off = distance(at, mover.start)
        raise RuleBroken(
            f"the new trajectory was taken, and the robot stands {off:.4g} off its end"
        )
    return passed("taken" if taken else "refused")


@check_on(ready, "MS16", moves=True, profiles=FULL, is_plain=True)
async def _download(mover: Mover) -> CheckFinding:
    middle, time = mover.between(0.5), mover.amplitude / SPEED / 2
    for sequence, joints, seconds in (
        (SpecialSequence.START_DOWNLOAD, mover.start, LEAD_IN),
        (1, middle, time),
        (SpecialSequence.END, mover.goal, time),
    ):
        point = JointTrajPt(int(sequence), joints, SPEED, seconds, comm_type=CommType.TOPIC)
        mover.wire.send(point)
        await asyncio.sleep(0.005)
    await mover.wire.expect_silence(0.3, "a downloaded trajectory")
    if not await mover.watch.until(lambda: mover.has_left, START_WITHIN):
        return deviates("Fanuc, Stäubli, Motoman: streaming only", "a download moved nothing")
    await _arrives(mover, mover.goal, "a download", 6.0)
    return PASSED


@check_on(ready, "MS17", moves=True, profiles=FULL)
async def _full_points(mover: Mover) -> None:
    for sequence, joints in ((0, mover.start), (1, mover.goal)):
        time = sequence * 2 * mover.amplitude / SPEED
        reply = await mover.wire.ask(full_point(sequence, joints, time), "a full point", 4.0)
        if reply.reply_code == ReplyCode.FAILURE:
            raise CannotJudge("the target refuses full points, as it may")
        if reply.msg_type != MsgType.JOINT_TRAJ_PT_FULL or not is_taken(reply):
            raise RuleBroken(f"a full point was answered by {reply}")
    await _arrives(mover, mover.goal, "two full points", 6.0)


@check_on(ready, "MS18", moves=True, profiles=FULL)
async def _whole_trajectory(mover: Mover) -> None:
    points = (
        TrajPoint(0, mover.start, SPEED, LEAD_IN),
        TrajPoint(1, mover.goal, SPEED, mover.amplitude / SPEED),
    )
    reply = await mover.wire.ask(JointTraj(points), "a whole trajectory", 4.0)
    if reply.msg_type != MsgType.JOINT_TRAJ:
        raise RuleBroken(f"a whole trajectory was answered by {reply}")
    if not is_taken(reply):
        raise CannotJudge("the target refuses whole trajectories, as vendors do")
    await _arrives(mover, mover.goal, "a whole trajectory", 6.0)


@check_on(ready, "MS19", moves=True, profiles=FULL, is_plain=True)
async def _no_velocity(mover: Mover) -> CheckFinding:
    replies = [
        await mover.point(0, mover.start, LEAD_IN, velocity=0.0),
        await mover.point(1, mover.goal, mover.amplitude / SPEED, velocity=0.0),
    ]
    if not all(map(is_taken, replies)):
        return deviates("Stäubli: a velocity of 0 is refused", str(replies[-1]))
    await _arrives(mover, mover.goal, "points of velocity 0", 6.0)
    return PASSED


@check_on(ready, "MS20", moves=True, is_plain=True)
async def _dwell(mover: Mover) -> None:
    half = mover.amplitude / SPEED
    middle = mover.between(0.5)
    await mover.accepted(0, mover.start, LEAD_IN)
    for sequence, joints, seconds in ((1, middle, half), (2, middle, 0.3), (3, mover.goal, half)):
        await mover.accepted(sequence, joints, seconds)
    await _arrives(mover, mover.goal, "a trajectory with a dwell", 6.0)
