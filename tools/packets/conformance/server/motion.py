"""Section M: points become motion, that motion and no other, and it ends where it was asked to."""

from __future__ import annotations

import asyncio
import math

from openpendant.simplemsg import (
    CommType,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    MsgType,
    ReplyCode,
    SpecialSequence,
    TrajPoint,
    ValidField,
    joint_array,
)

from ..check import PASSED, CannotJudge, CheckFinding, CheckVerdict, RuleBroken, deviates
from .answers import is_taken, judge_point_reply
from .checks import FULL, check
from .monitor import distance
from .moving import ARRIVED, ARRIVED_EXACTLY, LEAD_IN, SPEED, START_WITHIN, Mover, ready
from .recordings import RecordedMotion, reference
from .target import Target

_NO_SEQUENCE = "ABB, Fanuc, Stäubli, Motoman: the order of sequences is not checked"
_LONG = 1.0

_BEHIND = 0.5
"""A robot that is farther behind is given up: docs/minimum-controller.md [s]."""

_ROUND = 1.6
"""A cosine's largest speed is so many times its mean speed."""


async def _undisturbed(target: Target) -> RecordedMotion:
    motion: RecordedMotion = await target.once("a motion", reference)
    return motion


async def _arrives(mover: Mover, goal: tuple[float, ...], what: str, within: float) -> None:
    """Wait for the robot to leave and to stand at a goal.

    Raises:
        RuleBroken: it does not.
    """
    if not await mover.watch.until(lambda: mover.has_left, START_WITHIN):
        raise RuleBroken(f"{what}: the robot did not move within {START_WITHIN:g} s")
    at = await mover.rests_within(within)
    if distance(at, goal) > mover.arrival:
        raise RuleBroken(f"{what}: the robot stands {distance(at, goal):.4g} rad or m off the goal")


@check("MS01", moves=True, is_plain=True)
async def _stays(target: Target) -> CheckFinding:
    mover = await ready(target)
    await mover.accepted(0, mover.start, LEAD_IN)
    await mover.stays(0.4, "a point where the robot stands", mover.start)
    return PASSED


@check("MS02", moves=True, is_plain=True)
async def _ends_at_goal(target: Target) -> CheckFinding:
    motion: RecordedMotion = await target.once("a motion", reference, is_subject=True)
    off = distance(motion.end, motion.goal)
    if off > (ARRIVED_EXACTLY if target.is_minimum else ARRIVED):
        raise RuleBroken(f"two points: the robot stands {off:.4g} rad or m off the last one")
    return CheckFinding(CheckVerdict.PASSED, f"{off:.1g} rad or m off")


@check("MS03", moves=True, is_plain=True)
async def _replies(target: Target) -> CheckFinding:
    motion = await _undisturbed(target)
    worst = PASSED
    for reply in motion.replies:
        finding = judge_point_reply(reply)
        if finding.verdict is not CheckVerdict.PASSED:
            worst = finding
    return worst


@check("MS04", moves=True, is_plain=True)
async def _answered_in_time(target: Target) -> CheckFinding:
    motion = await _undisturbed(target)
    late = motion.replies[-1].time - motion.sent
    if late > motion.duration + 1.0:
        raise RuleBroken(f"the second of two points was answered after {late:.2f} s")
    return CheckFinding(CheckVerdict.PASSED, f"after {late:.3f} s")


@check("MS05", moves=True, is_plain=True)
async def _begins(target: Target) -> CheckFinding:
    motion = await _undisturbed(target)
    delay = motion.must_have_moved()[0].time - motion.sent
    if delay > START_WITHIN:
        raise RuleBroken(f"it began {delay:.2f} s after the last point was sent")
    return CheckFinding(CheckVerdict.PASSED, f"after {delay:.3f} s")


@check("MS06", moves=True, profiles=FULL, is_plain=True)
async def _not_faster(target: Target) -> CheckFinding:
    motion = await _undisturbed(target)
    moving = motion.must_have_moved()
    took = moving[-1].time - moving[0].time
    if took < 0.4 * motion.duration:
        return deviates(
            "Fanuc, Stäubli: the duration is not used",
            f"asked {motion.duration:.2f} s, took {took:.2f} s",
        )
    return CheckFinding(
        CheckVerdict.PASSED, f"asked {motion.duration:.2f} s, seen {took:.2f} s of it"
    )


@check("MS07", moves=True, is_plain=True)
async def _not_slower(target: Target) -> CheckFinding:
    motion = await _undisturbed(target)
    moving = motion.visibly_moving()
    took = moving[-1].time - moving[0].time
    if took > motion.duration + _BEHIND:
        raise RuleBroken(f"asked {motion.duration:.2f} s, took {took:.2f} s")
    return CheckFinding(
        CheckVerdict.PASSED, f"asked {motion.duration:.2f} s, seen {took:.2f} s of it"
    )


@check("MS08", moves=True, is_plain=True)
async def _right_way(target: Target) -> CheckFinding:
    motion = await _undisturbed(target)
    motion.must_have_moved()
    way = motion.goal[motion.joint] - motion.start[motion.joint]
    for report in motion.joints:
        part = (report.values[motion.joint] - motion.start[motion.joint]) / way
        if not -0.1 <= part <= 1.1:
            raise RuleBroken(f"it was at {100 * part:.0f} % of the way to its goal")
    return PASSED


@check("MS09", moves=True, is_plain=True)
async def _single_point(target: Target) -> CheckFinding:
    mover = await ready(target)
    await mover.accepted(0, mover.goal, mover.amplitude / SPEED)
    await _arrives(mover, mover.goal, "a single point", 6.0)
    return PASSED


@check("MS10", moves=True, is_plain=True)
async def _ten_points(target: Target) -> CheckFinding:
    mover = await ready(target)
    for sequence in range(10):
        part = (1 - math.cos(math.pi * sequence / 9)) / 2
        await mover.accepted(sequence, mover.between(part), mover.seconds(0.6) * _ROUND / 9)
    await _arrives(mover, mover.goal, "ten points", 6.0)
    return PASSED


@check("MS11", moves=True, is_plain=True)
async def _second_trajectory(target: Target) -> CheckFinding:
    mover = await ready(target)
    await mover.go(mover.amplitude / SPEED)
    await _arrives(mover, mover.goal, "the first trajectory", 5.0)
    await mover.accepted(0, mover.watch.position, LEAD_IN)
    await mover.accepted(1, mover.start, mover.amplitude / SPEED)
    if not await mover.watch.until(lambda: not mover.progress(mover.watch.position) > 0.5, 4.0):
        raise RuleBroken("the second trajectory on the same connection was not moved")
    at = await mover.rests_within(5.0)
    if distance(at, mover.start) > mover.arrival:
        raise RuleBroken(f"the way back ended {distance(at, mover.start):.4g} rad or m off")
    return PASSED


@check("MS12", moves=True, profiles=FULL, is_plain=True)
async def _duplicate(target: Target) -> CheckFinding:
    mover = await ready(target)
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
    return PASSED


@check("MS13", moves=True, profiles=FULL, is_plain=True)
async def _gap(target: Target) -> CheckFinding:
    mover = await ready(target)
    await mover.accepted(0, mover.start, LEAD_IN)
    reply = await mover.point(5, mover.goal, mover.seconds(_LONG))
    if is_taken(reply):
        return deviates(_NO_SEQUENCE, "sequence 5 after 0 was taken")
    await mover.stays(0.8, "a refused point", mover.start)
    return PASSED


@check("MS14", moves=True, profiles=FULL, is_plain=True)
async def _no_beginning(target: Target) -> CheckFinding:
    mover = await ready(target)
    reply = await mover.point(3, mover.goal, mover.seconds(_LONG))
    if is_taken(reply):
        return deviates(_NO_SEQUENCE, "a first point of sequence 3 was taken")
    await mover.stays(0.8, "a refused point", mover.start)
    return PASSED


@check("MS15", moves=True, profiles=FULL, is_plain=True)
async def _replaced(target: Target) -> CheckFinding:
    mover = await ready(target)
    await mover.set_off(mover.seconds(_LONG))
    reply = await mover.point(0, mover.start, mover.seconds(_LONG))
    taken = is_taken(reply)
    at = await mover.rests_within(10.0)
    if taken and distance(at, mover.start) > mover.arrival:
        off = distance(at, mover.start)
        raise RuleBroken(
            f"the new trajectory was taken, and the robot stands {off:.4g} off its end"
        )
    return CheckFinding(CheckVerdict.PASSED, "taken" if taken else "refused")


@check("MS16", moves=True, profiles=FULL, is_plain=True)
async def _download(target: Target) -> CheckFinding:
    mover = await ready(target)
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


@check("MS17", moves=True, profiles=FULL)
async def _full_points(target: Target) -> CheckFinding:
    mover = await ready(target)
    zeros = joint_array(())
    valid = int(ValidField.TIME | ValidField.POSITION | ValidField.VELOCITY)
    for sequence, joints in ((0, mover.start), (1, mover.goal)):
        time = sequence * 2 * mover.amplitude / SPEED
        point = JointTrajPtFull(0, sequence, valid, time, joints, zeros, zeros)
        reply = await mover.wire.ask(point, "a full point", 4.0)
        if reply.reply_code == ReplyCode.FAILURE:
            raise CannotJudge("the target refuses full points, as it may")
        if reply.msg_type != MsgType.JOINT_TRAJ_PT_FULL or not is_taken(reply):
            raise RuleBroken(f"a full point was answered by {reply}")
    await _arrives(mover, mover.goal, "two full points", 6.0)
    return PASSED


@check("MS18", moves=True, profiles=FULL)
async def _whole_trajectory(target: Target) -> CheckFinding:
    mover = await ready(target)
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
    return PASSED


@check("MS19", moves=True, profiles=FULL, is_plain=True)
async def _no_velocity(target: Target) -> CheckFinding:
    mover = await ready(target)
    replies = [
        await mover.point(0, mover.start, LEAD_IN, velocity=0.0),
        await mover.point(1, mover.goal, mover.amplitude / SPEED, velocity=0.0),
    ]
    if not all(map(is_taken, replies)):
        return deviates("Stäubli: a velocity of 0 is refused", str(replies[-1]))
    await _arrives(mover, mover.goal, "points of velocity 0", 6.0)
    return PASSED


@check("MS20", moves=True, is_plain=True)
async def _dwell(target: Target) -> CheckFinding:
    mover = await ready(target)
    half = mover.amplitude / SPEED
    middle = mover.between(0.5)
    await mover.accepted(0, mover.start, LEAD_IN)
    for sequence, joints, seconds in ((1, middle, half), (2, middle, 0.3), (3, mover.goal, half)):
        await mover.accepted(sequence, joints, seconds)
    await _arrives(mover, mover.goal, "a trajectory with a dwell", 6.0)
    return PASSED
