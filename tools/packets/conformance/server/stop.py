"""Section S: STOP (sequence -4) in every phase of a motion; the robot stands, and goes on standing.

The clause behind most: STOP is what cancel, shutdown and an empty trajectory send, and the client
takes its success for granted.
"""

from __future__ import annotations

import asyncio

from openpendant.simplemsg import CommType, JointTrajPt, SpecialSequence

from ..check import PASSED, CannotJudge, CheckFinding, RuleBroken, deviates, passed
from .answers import FULL_STOP, STOP, STOP_TOPIC, is_taken, judge_point_reply
from .checks import FULL, check, check_on
from .monitor import STEADY, distance, longest_gap
from .moving import LEAD_IN, SPEED, STOP_WITHIN, Mover, ready
from .recordings import SLOW, RecordedMotion, stopped_motion
from .target import Target
from .wire import Wire


async def _stands(mover: Mover, what: str, seconds: float = 0.4) -> None:
    """Raise RuleBroken unless the robot stands in half a second, short of its goal, and stays."""
    await asyncio.sleep(STOP_WITHIN)
    at = mover.watch.position
    await mover.stays(seconds, what, at)
    if mover.progress(mover.watch.position) > 0.95:
        raise RuleBroken(f"after {what} the robot went on to its goal")


@check_on(stopped_motion, "SS01", moves=True, is_plain=True)
async def _answered(motion: RecordedMotion) -> CheckFinding:
    reply = motion.event_reply
    if reply is None:
        raise RuleBroken("STOP in motion was not answered within 1 s; the real client hangs")
    if reply.time - motion.event > STOP_WITHIN:
        raise RuleBroken(f"STOP in motion was answered after {reply.time - motion.event:.2f} s")
    return judge_point_reply(reply)


@check_on(stopped_motion, "SS02", moves=True, is_plain=True)
async def _stands_in_time(motion: RecordedMotion) -> CheckFinding:
    final = motion.end
    moving = [at.time for at in motion.joints if distance(at.values, final) > 2 * STEADY]
    late = (max(moving) if moving else motion.event) - motion.event
    if late > STOP_WITHIN:
        raise RuleBroken(f"the robot moved for {late:.2f} s after STOP")
    return passed(f"stood {max(late, 0.0):.3f} s after STOP")


@check_on(stopped_motion, "SS03", moves=True, is_plain=True)
async def _does_not_resume(motion: RecordedMotion) -> None:
    settled = motion.at(motion.event + STOP_WITHIN)
    for report in motion.joints:
        if report.time > motion.event + STOP_WITHIN:
            off = distance(report.values, settled)
            if off > motion.tolerance:
                raise RuleBroken(
                    f"{report.time - motion.event:.2f} s after STOP it had moved by {off:.3g} more"
                )


@check_on(stopped_motion, "SS04", moves=True, is_plain=True)
async def _on_its_way(motion: RecordedMotion) -> CheckFinding:
    way = motion.goal[motion.joint] - motion.start[motion.joint]
    at_event = motion.progress(motion.at(motion.event))
    part = motion.progress(motion.end)
    speed = motion.speed_before(motion.event)
    # Longest way after STOP: speed times the time of a stop and of the longest gap in reports.
    seen_late = longest_gap([report.time for report in motion.joints])
    overshoot = (speed * (STOP_WITHIN + seen_late) + motion.tolerance) / abs(way)
    if not at_event - 0.1 <= part <= min(at_event + overshoot, 0.95):
        raise RuleBroken(f"at {100 * at_event:.0f} % of the way STOP led to {100 * part:.0f} %")
    fastest = motion.fastest(motion.event + seen_late)
    if fastest > 1.5 * speed + 4 * STEADY / max(seen_late, 0.02):
        raise RuleBroken(f"after STOP it moved at {fastest:.3g} rad/s, before at {speed:.3g}")
    return passed(f"from {100 * at_event:.0f} % to {100 * part:.0f} % of the way")


@check_on(ready, "SS05", moves=True, is_plain=True)
async def _new_trajectory(mover: Mover) -> None:
    await mover.set_off(SLOW)
    if not is_taken(await mover.wire.ask(STOP, "STOP")):
        raise CannotJudge("STOP was refused; SS01 says so")
    await mover.rests_within(3.0)
    here = mover.watch.position
    await mover.accepted(0, here, LEAD_IN)
    await mover.accepted(1, mover.start, mover.amplitude / SPEED)
    await mover.watch.until(lambda: distance(mover.watch.position, here) > 0.001, 3.0)
    at = await mover.rests_within(5.0)
    if distance(at, mover.start) > mover.arrival:
        raise RuleBroken(f"a trajectory after STOP ended {distance(at, mover.start):.4g} off")


@check_on(ready, "SS06", moves=True, is_plain=True)
async def _before_motion(mover: Mover) -> None:
    await mover.go(SLOW)
    await mover.wire.ask(STOP, "STOP before the motion began")
    await _stands(mover, "STOP before the motion began")


@check_on(ready, "SS07", moves=True, is_plain=True)
async def _amid_points(mover: Mover) -> None:
    await mover.accepted(0, mover.start, LEAD_IN)
    for sequence in range(1, 9):
        await mover.accepted(sequence, mover.between(sequence / 8), SLOW / 8)
    if not await mover.watch.until(lambda: mover.has_left, 4.0):
        raise CannotJudge("the robot did not move")
    await mover.wire.ask(STOP, "STOP amid eight points")
    await _stands(mover, "STOP amid eight points")


@check_on(ready, "SS08", moves=True, profiles=FULL, is_plain=True)
async def _twice(mover: Mover) -> None:
    await mover.set_off(SLOW)
    for which in ("first", "second", "third"):
        reply = await mover.wire.ask(STOP, f"the {which} STOP")
        if not is_taken(reply):
            raise RuleBroken(f"the {which} STOP was answered by {reply}")
    await _stands(mover, "three STOPs", 0.3)


@check_on(ready, "SS09", moves=True, profiles=FULL, is_plain=True)
async def _left_over(mover: Mover) -> CheckFinding:
    await mover.set_off(SLOW)
    await mover.wire.ask(STOP, "STOP")
    await mover.rests_within(3.0)
    here = mover.watch.position
    reply = await mover.point(2, mover.goal, 1.0)
    if is_taken(reply):
        habit = "ABB, Fanuc, Stäubli, Motoman: the order of sequences is not checked"
        return deviates(habit, "sequence 2 of a stopped trajectory was taken")
    await mover.stays(0.8, "a point left over from a stopped trajectory", here)
    return PASSED


@check("SS10", moves=True, profiles=FULL, is_plain=True)
async def _by_another(target: Target) -> CheckFinding:
    mover = await ready(target)
    await mover.set_off(SLOW)
    other: Wire = await target.motion()
    other.send(STOP)
    reply = await other.poll(1.0)
    if reply is None:
        return deviates("industrial_core: one client a port", "the second was not answered")
    if not is_taken(reply):
        raise RuleBroken(f"STOP from another connection was answered by {reply}")
    await _stands(mover, "STOP from another connection")
    return PASSED


@check_on(ready, "SS11", moves=True, profiles=FULL, is_plain=True)
async def _as_topic(mover: Mover) -> None:
    await mover.set_off(SLOW)
    mover.wire.send(STOP_TOPIC)
    await _stands(mover, "STOP as a topic")


@check_on(ready, "SS12", moves=True, profiles=FULL, is_plain=True)
async def _with_a_point(mover: Mover) -> None:
    await mover.accepted(0, mover.start, LEAD_IN)
    mover.wire.send(JointTrajPt(1, mover.goal, SPEED, SLOW), STOP)
    for what in ("a point", "STOP behind it"):
        await mover.wire.expect(f"an answer to {what}, both in one piece")
    await _stands(mover, "STOP in one piece with a point")


@check_on(ready, "SS13", moves=True, profiles=FULL, is_plain=True)
async def _in_pieces(mover: Mover) -> None:
    await mover.set_off(SLOW)
    await mover.wire.send_in_pieces(mover.wire.encode(STOP), 37, 0.02)
    await mover.wire.expect("an answer to a STOP in two pieces")
    await _stands(mover, "STOP in two pieces", 0.5)


@check_on(ready, "SS14", moves=True, profiles=FULL, is_plain=True)
async def _amid_download(mover: Mover) -> None:
    for sequence, part in ((SpecialSequence.START_DOWNLOAD, 0.0), (1, 0.5), (2, 1.0)):
        joints, seconds = mover.between(part), SLOW if part else LEAD_IN
        point = JointTrajPt(int(sequence), joints, SPEED, seconds, comm_type=CommType.TOPIC)
        mover.wire.send(point)
    await mover.wire.ask(STOP, "STOP amid a download")
    await mover.stays(1.0, "STOP amid a download", mover.start)


@check_on(ready, "SS15", moves=True, profiles=FULL)
async def _full_stop(mover: Mover) -> None:
    await mover.set_off(SLOW)
    reply = await mover.wire.ask(FULL_STOP, "STOP in a full point")
    if not is_taken(reply):
        raise CannotJudge("the target refuses full points, as it may")
    await _stands(mover, "STOP in a full point")
