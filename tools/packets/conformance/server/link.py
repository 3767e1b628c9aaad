"""Section K: links come and go; the robot must not go on without its client, nor by itself."""

from __future__ import annotations

import asyncio

from openpendant.simplemsg import Ping

from ..findings import PASSED, Finding, Section, Verdict, deviates
from .answers import is_taken, must_be_ping, ping
from .checks import ANY, FULL, check
from .moving import LEAD_IN, SPEED, STOP_WITHIN, ready
from .recordings import LOSS_SEEN, SLOW, Motion, lost, lost_by_reset
from .target import Target
from .vigil import old_enough
from .watch import STEADY, distance
from .wire import CannotJudge, RuleBroken, Unreachable, Wire

_SILENCE = "docs/ros-i.md: silence is legal; the real client says nothing between trajectories"
_AGAIN = "observed, industrial_robot_client: it connects again after 10 ms, or 5 s"
_ONE_CLIENT = "industrial_core tcp_server.cpp: one client a port"
_LOSS = "a robot nobody commands must stand: ISO 10218-1 5.4; ABB does not stop"


@check("KS01", "an idle link stays open", _SILENCE, Section.LINK, profiles=ANY, is_plain=True)
async def _idle(target: Target) -> Finding:
    wire = await target.motion()
    await target.knock.ask(wire)
    await wire.expect_silence(1.2, "a second of silence")
    await target.knock.ask(wire, "after a second of silence")
    return PASSED


@check(
    "KS02", "a client may leave and come again", _AGAIN, Section.LINK, profiles=ANY, is_plain=True
)
async def _come_again(target: Target) -> Finding:
    for attempt in range(1, 9):
        wire = await target.motion()
        await target.knock.ask(wire, f"on connection {attempt}")
        await target.close()
    return PASSED


@check("KS03", "a client may leave by a reset", _AGAIN, Section.LINK, profiles=ANY, is_plain=True)
async def _leave_by_reset(target: Target) -> Finding:
    for attempt in range(1, 4):
        wire = await target.motion()
        await target.knock.ask(wire, f"on connection {attempt}")
        wire.reset()
        await asyncio.sleep(0.03)
    await target.knock.ask(await target.motion(), "after three resets")
    return PASSED


@check(
    "KS04",
    "many silent clients do not lock out the next for ever",
    _ONE_CLIENT,
    Section.LINK,
    profiles=FULL,
)
async def _many(target: Target) -> Finding:
    for _ in range(20):
        try:
            await target.motion()
        except Unreachable:
            break
    await target.close()
    await asyncio.sleep(0.2)
    await target.knock.ask(await target.motion(), "after twenty clients came and went")
    return PASSED


@check(
    "KS05",
    "a second client does not disturb the first",
    _ONE_CLIENT + "; a second waits, is refused or served",
    Section.LINK,
    is_plain=True,
)
async def _second_client(target: Target) -> Finding:
    first = await target.motion()
    await target.knock.ask(first, "of the first of two clients")
    try:
        second: Wire | None = await target.motion()
    except Unreachable:
        second = None
    if second is not None:
        second.send(target.knock.message)
        await second.poll(0.3)
    if first.is_lost:
        return deviates("Motoman: a new client replaces the old one", "the first was closed")
    await target.knock.ask(first, "of the first of two clients")
    if second is not None:
        second.close()
        await asyncio.sleep(0.03)
    await target.knock.ask(first, "of the first of two clients")
    return PASSED


@check(
    "KS06",
    "the motion port works before anybody listens to the state port",
    "industrial_robot_client: three processes connect independently, in no fixed order",
    Section.LINK,
    profiles=ANY,
    is_plain=True,
)
async def _no_listener(target: Target) -> Finding:
    wire = await target.motion()
    await target.knock.ask(wire, "without a state connection")
    await target.state()
    await target.knock.ask(wire, "with a state connection")
    return PASSED


@check(
    "KS07",
    "a lost motion link leaves the state link alone",
    _AGAIN,
    Section.LINK,
    profiles=ANY,
    is_plain=True,
)
async def _state_goes_on(target: Target) -> Finding:
    watch = await target.state()
    await watch.begin()
    wire = await target.motion()
    await target.knock.ask(wire)
    wire.close()
    count = len(watch.frames)
    await asyncio.sleep(0.7)
    if watch.wire.is_lost or len(watch.frames) <= count:
        raise RuleBroken("with the motion link the state link ended or fell silent")
    return PASSED


@check(
    "KS08",
    "five hundred PINGs in one piece are all answered",
    "TCP: what was acknowledged was received",
    Section.LINK,
    profiles=FULL,
)
async def _flood(target: Target) -> Finding:
    wire = await target.motion()
    wire.send(*[Ping()] * 500)
    for number in range(1, 501):
        what = f"answer {number} of five hundred"
        must_be_ping(await wire.expect(what, 3.0), f"PING {number} of five hundred")
    return PASSED


@check(
    "KS09",
    "a client that reads no answers holds nobody up",
    "TCP: a full window must not stop the others",
    Section.LINK,
    profiles=FULL,
)
async def _deaf_client(target: Target) -> Finding:
    deaf = await target.motion()
    deaf.hold()
    for _ in range(20):
        deaf.send(*[Ping()] * 200)
        await asyncio.sleep(0.01)
    other = await target.motion()
    other.send(Ping())
    if await other.poll(1.0) is not None:
        return PASSED
    deaf.reset()
    await asyncio.sleep(0.1)
    await ping(await target.motion(), "a PING after a client that read nothing")
    return deviates("industrial_core: one client a port", "the second was served after the first")


async def _judge_loss(target: Target, motion: Motion, how: str) -> Finding:
    final = motion.at(motion.event + LOSS_SEEN)
    late = [
        report.time - motion.event
        for report in motion.joints
        if report.time <= motion.event + LOSS_SEEN and distance(report.values, final) > 2 * STEADY
    ]
    end = max(late, default=0.0)
    way = motion.goal[motion.joint] - motion.start[motion.joint]
    part = (final[motion.joint] - motion.start[motion.joint]) / way
    if end > STOP_WITHIN + 0.2 or part > 0.95:
        seen = f"{end:.2f} s after {how} the robot still moved ({100 * part:.0f} %)"
        if target.knows_ping:
            raise RuleBroken(seen)
        return deviates("ABB: a motion goes on without its client", seen)
    return Finding(Verdict.PASSED, f"stood {max(end, 0.0):.3f} s after {how}")


@check(
    "KS10", "the robot stops when its client leaves", _LOSS, Section.LINK, moves=True, is_plain=True
)
async def _stops_on_close(target: Target) -> Finding:
    motion: Motion = await target.once("a lost link", lost)
    return await _judge_loss(target, motion, "the end of the link")


@check(
    "KS11",
    "the robot stops when its client disappears",
    _LOSS,
    Section.LINK,
    moves=True,
    is_plain=True,
)
async def _stops_on_reset(target: Target) -> Finding:
    motion: Motion = await target.once("a reset link", lost_by_reset)
    return await _judge_loss(target, motion, "the reset of the link")


@check(
    "KS12",
    "a new link does not set an old motion going again",
    "docs/architecture.md: reconnecting restores neither control nor motion",
    Section.LINK,
    moves=True,
    is_plain=True,
)
async def _does_not_resume(target: Target) -> Finding:
    motion: Motion = await target.once("a lost link", lost)
    if motion.event_reply is None:
        raise RuleBroken("the connection made after the loss was not served")
    before = motion.at(motion.event + LOSS_SEEN)
    off = distance(motion.end, before)
    if off > motion.tolerance:
        raise RuleBroken(f"with a new connection the robot moved on by {off:.3g} rad or m")
    return PASSED


@check(
    "KS13",
    "after a lost link a new trajectory is moved",
    _AGAIN,
    Section.LINK,
    moves=True,
    is_plain=True,
)
async def _works_again(target: Target) -> Finding:
    mover = await ready(target)
    await mover.set_off(SLOW)
    mover.wire.close()
    if not await mover.watch.standstill(6.0):
        raise CannotJudge("the robot does not stop; KS10 says so")
    here = mover.watch.position
    mover.wire = await target.motion()
    for sequence, joints in ((0, here), (1, mover.start)):
        seconds = sequence * mover.amplitude / SPEED + LEAD_IN
        reply = await mover.point(sequence, joints, seconds)
        if not is_taken(reply):
            raise RuleBroken(f"after a lost link a new trajectory was refused: {reply}")
    await mover.watch.until(lambda: distance(mover.watch.position, here) > 0.001, 3.0)
    at = await mover.rests_within(5.0)
    if distance(at, mover.start) > mover.arrival:
        raise RuleBroken(f"it ended {distance(at, mover.start):.4g} rad or m off")
    return PASSED


@check(
    "KS14",
    "a point repeated on a new link is answered once and moves once at most",
    "observed, industrial_robot_client: the unanswered point comes again, with its sequence",
    Section.LINK,
    moves=True,
    profiles=FULL,
    is_plain=True,
)
async def _repeated(target: Target) -> Finding:
    mover = await ready(target)
    asked = mover.seconds(1.0)
    await mover.go(asked)
    mover.wire.reset()
    await asyncio.sleep(0.03)
    mover.wire = await target.motion()
    reply = await mover.point(1, mover.goal, asked)
    more = await mover.wire.poll(0.3)
    if more is not None:
        raise RuleBroken(f"a repeated point was answered twice, the second time by {more}")
    at = await mover.rests_within(6.0)
    part = mover.progress(at)
    if not -0.1 <= part <= 1.1:
        raise RuleBroken(f"it stands at {100 * part:.0f} % of the way")
    return Finding(Verdict.PASSED, f"{'taken' if is_taken(reply) else 'refused'}, at {part:.0%}")


@check(
    "KS15",
    "points of a second client do not mix with those of the first",
    "docs/emulator.md: only the connection that began a motion may send its points",
    Section.LINK,
    moves=True,
    profiles=FULL,
    is_plain=True,
)
async def _two_commanders(target: Target) -> Finding:
    mover = await ready(target)
    await mover.set_off(mover.seconds(SLOW / 2))
    first, mover.wire = mover.wire, await target.motion()
    try:
        reply = await mover.point(2, mover.start, 0.5, within=1.0)
    except RuleBroken as error:
        detail = str(error)
        taken = False
    else:
        detail, taken = str(reply), is_taken(reply)
    at = await mover.rests_within(6.0)
    if first.is_lost:
        return deviates("Motoman: a new client replaces the old one", "the first was closed")
    if taken or distance(at, mover.goal) > mover.arrival:
        raise RuleBroken(
            f"the first client's motion ended {distance(at, mover.goal):.3g} off its goal;"
            f" the second's point: {detail}"
        )
    return PASSED


@check(
    "KS16",
    "a link that is lost before the motion began prevents it",
    _LOSS,
    Section.LINK,
    moves=True,
    is_plain=True,
)
async def _lost_before_motion(target: Target) -> Finding:
    mover = await ready(target)
    await mover.go(SLOW)
    mover.wire.close()
    await asyncio.sleep(STOP_WITHIN + 0.2)
    if mover.watch.says_motion() or not mover.watch.is_steady(mover.watch.began):
        seen = "the link was closed before the motion began, and the robot moves"
        if target.knows_ping:
            raise RuleBroken(seen)
        return deviates("ABB: a motion goes on without its client", seen)
    await mover.stays(0.3, "a link that was lost before the motion", mover.watch.position)
    return PASSED


@check(
    "KS17",
    "a link that is idle all the run stays open and is answered at its end",
    _SILENCE,
    Section.LINK,
    profiles=ANY,
    is_plain=True,
)
async def _idle_all_the_run(target: Target) -> Finding:
    wire = target.idle_link
    if wire is None:
        raise CannotJudge("the target serves one client, which an idle one would keep out")
    await old_enough(wire)
    if wire.is_lost:
        raise RuleBroken("an idle link was closed during the run")
    await target.knock.ask(wire, f"after {wire.age:.0f} s of silence")
    return Finding(Verdict.PASSED, f"after {wire.age:.0f} s")


@check(
    "KS18",
    "a listener is told joint values all the run long",
    _SILENCE,
    Section.LINK,
    profiles=ANY,
    is_plain=True,
)
async def _told_all_the_run(target: Target) -> Finding:
    watch = target.long_watch
    if watch is None:
        raise CannotJudge("the target serves one listener, or has no state port")
    await old_enough(watch)
    if watch.wire.is_lost:
        raise RuleBroken("a state link was closed during the run")
    asked = asyncio.get_running_loop().time()
    if not await watch.until(lambda: bool(watch.joints) and watch.joints[-1].time > asked, 1.0):
        raise RuleBroken(f"a state link has fallen silent within {watch.wire.age:.0f} s")
    return Finding(Verdict.PASSED, f"for {watch.wire.age:.0f} s")
