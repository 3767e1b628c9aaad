"""Section K: links come and go; the robot must not go on without its client, nor by itself.

Owns, too, two links that stay open for most of a run, an idle one and one to the state port: what
ends or falls silent only after some time shows on no link that lives as long as a check.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from functools import partial

from openpendant.simplemsg import Ping

from ..check import PASSED, CannotJudge, CheckFinding, RuleBroken, Section, deviates, passed
from .answers import is_taken, must_be_ping, ping
from .checks import ANY, FULL, ServerCheck, check, check_on
from .monitor import STEADY, Watch, distance
from .moving import LEAD_IN, SPEED, STOP_WITHIN, ready
from .recordings import LOSS_SEEN, SLOW, RecordedMotion, lost_link, reset_link
from .target import Target
from .wire import TargetUnreachable, Wire

IDLE = "KS17"
"""The check that judges the idle link."""

LISTENING = "KS18"
"""The check that judges the state link."""

LEAST = 8.0
"""The links are at least so old when they are judged [s]."""

_SERVED_WITHIN = 1.0
_BEFOREHAND = (Section.FRAMING, Section.HEADER, Section.BYTE_ORDER)


class LongLivedLinks:
    """The links, where the target serves others beside them.

    A controller of one client a port would be blocked by them, and gets none.
    """

    def __init__(self, chosen: Sequence[ServerCheck]) -> None:
        """Take the checks of a run; only checks that are chosen get a link."""
        self._wires: list[Wire] = []
        self._wanted = {entry.number for entry in chosen} & {IDLE, LISTENING}
        self._has_begun = not self._wanted

    async def before(self, entry: ServerCheck, target: Target) -> None:
        """Open the links before a check: after those that confuse the byte order on purpose.

        A server that goes by the order of an address may end its other links because of those.
        """
        if self._has_begun or entry.section in _BEFOREHAND:
            return
        self._has_begun = True
        try:
            if IDLE in self._wanted:
                await self._keep_idle(target)
            if LISTENING in self._wanted and target.options.state_port is not None:
                await self._keep_listening(target)
        except TargetUnreachable:
            return  # the next check will report it
        finally:
            await target.close()

    async def _keep_idle(self, target: Target) -> None:
        wire = await target.motion()
        try:
            await target.probe.ask(wire)
            await target.probe.ask(await target.motion())
            await target.probe.ask(wire)
        except (RuleBroken, TargetUnreachable):
            return
        self._wires.append(target.keep(wire))
        target.idle_link = wire

    async def _keep_listening(self, target: Target) -> None:
        watch = await target.state()
        await watch.begin()
        try:
            other = await target.state()
        except TargetUnreachable:
            return
        count = len(watch.frames)
        is_told = await other.until(lambda: bool(other.frames), _SERVED_WITHIN)
        if not is_told or not await watch.until(lambda: len(watch.frames) > count, _SERVED_WITHIN):
            return
        self._wires.append(target.keep(watch.wire))
        target.long_watch = watch

    async def end(self) -> None:
        """Close the links."""
        for wire in self._wires:
            wire.close()


async def old_enough(watch: Watch | Wire) -> None:
    """Wait until a link is old enough to be judged."""
    wire = watch.wire if isinstance(watch, Watch) else watch
    await asyncio.sleep(max(0.0, LEAST - wire.age))


@check("KS01", profiles=ANY, is_plain=True)
async def _idle(target: Target) -> None:
    wire = await target.motion()
    await target.probe.ask(wire)
    await wire.expect_silence(1.2, "a second of silence")
    await target.probe.ask(wire, "after a second of silence")


@check("KS02", profiles=ANY, is_plain=True)
async def _come_again(target: Target) -> None:
    for attempt in range(1, 9):
        wire = await target.motion()
        await target.probe.ask(wire, f"on connection {attempt}")
        await target.close()


@check("KS03", profiles=ANY, is_plain=True)
async def _leave_by_reset(target: Target) -> None:
    for attempt in range(1, 4):
        wire = await target.motion()
        await target.probe.ask(wire, f"on connection {attempt}")
        wire.reset()
        await asyncio.sleep(0.03)
    await target.probe.ask(await target.motion(), "after three resets")


@check("KS04", profiles=FULL)
async def _many(target: Target) -> None:
    for _ in range(20):
        try:
            await target.motion()
        except TargetUnreachable:
            break
    await target.close()
    await asyncio.sleep(0.2)
    await target.probe.ask(await target.motion(), "after twenty clients came and went")


@check("KS05", is_plain=True)
async def _second_client(target: Target) -> CheckFinding:
    first = await target.motion()
    await target.probe.ask(first, "of the first of two clients")
    try:
        second: Wire | None = await target.motion()
    except TargetUnreachable:
        second = None
    if second is not None:
        second.send(target.probe.message)
        await second.poll(0.3)
    if first.is_lost:
        return deviates("Motoman: a new client replaces the old one", "the first was closed")
    await target.probe.ask(first, "of the first of two clients")
    if second is not None:
        second.close()
        await asyncio.sleep(0.03)
    await target.probe.ask(first, "of the first of two clients")
    return PASSED


@check("KS06", profiles=ANY, is_plain=True)
async def _no_listener(target: Target) -> None:
    wire = await target.motion()
    await target.probe.ask(wire, "without a state connection")
    await target.state()
    await target.probe.ask(wire, "with a state connection")


@check("KS07", profiles=ANY, is_plain=True)
async def _state_goes_on(target: Target) -> None:
    watch = await target.state()
    await watch.begin()
    wire = await target.motion()
    await target.probe.ask(wire)
    wire.close()
    count = len(watch.frames)
    await asyncio.sleep(0.7)
    if watch.wire.is_lost or len(watch.frames) <= count:
        raise RuleBroken("with the motion link the state link ended or fell silent")


@check_on(Target.motion, "KS08", profiles=FULL)
async def _flood(wire: Wire) -> None:
    wire.send(*[Ping()] * 500)
    for number in range(1, 501):
        what = f"answer {number} of five hundred"
        must_be_ping(await wire.expect(what, 3.0), f"PING {number} of five hundred")


@check("KS09", profiles=FULL)
async def _deaf_client(target: Target) -> CheckFinding:
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


async def _stops(
    target: Target, made: Callable[[Target], Awaitable[RecordedMotion]], how: str
) -> CheckFinding:
    motion = await made(target)
    final = motion.at(motion.event + LOSS_SEEN)
    late = [
        report.time - motion.event
        for report in motion.joints
        if report.time <= motion.event + LOSS_SEEN and distance(report.values, final) > 2 * STEADY
    ]
    end = max(late, default=0.0)
    part = motion.progress(final)
    if end > STOP_WITHIN + 0.2 or part > 0.95:
        seen = f"{end:.2f} s after {how} the robot still moved ({100 * part:.0f} %)"
        if target.knows_ping:
            raise RuleBroken(seen)
        return deviates("ABB: a motion goes on without its client", seen)
    return passed(f"stood {max(end, 0.0):.3f} s after {how}")


check("KS10", moves=True, is_plain=True)(partial(_stops, made=lost_link, how="the end of the link"))
check("KS11", moves=True, is_plain=True)(
    partial(_stops, made=reset_link, how="the reset of the link")
)


@check_on(lost_link, "KS12", moves=True, is_plain=True)
async def _does_not_resume(motion: RecordedMotion) -> None:
    if motion.event_reply is None:
        raise RuleBroken("the connection made after the loss was not served")
    before = motion.at(motion.event + LOSS_SEEN)
    off = distance(motion.end, before)
    if off > motion.tolerance:
        raise RuleBroken(f"with a new connection the robot moved on by {off:.3g} rad or m")


@check("KS13", moves=True, is_plain=True)
async def _works_again(target: Target) -> None:
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


@check("KS14", moves=True, profiles=FULL, is_plain=True)
async def _repeated(target: Target) -> CheckFinding:
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
    return passed(f"{'taken' if is_taken(reply) else 'refused'}, at {part:.0%}")


@check("KS15", moves=True, profiles=FULL, is_plain=True)
async def _two_commanders(target: Target) -> CheckFinding:
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


@check("KS16", moves=True, is_plain=True)
async def _lost_before_motion(target: Target) -> CheckFinding:
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


@check("KS17", profiles=ANY, is_plain=True)
async def _idle_all_the_run(target: Target) -> CheckFinding:
    wire = target.idle_link
    if wire is None:
        raise CannotJudge("the target serves one client, which an idle one would keep out")
    await old_enough(wire)
    if wire.is_lost:
        raise RuleBroken("an idle link was closed during the run")
    await target.probe.ask(wire, f"after {wire.age:.0f} s of silence")
    return passed(f"after {wire.age:.0f} s")


@check("KS18", profiles=ANY, is_plain=True)
async def _told_all_the_run(target: Target) -> CheckFinding:
    watch = target.long_watch
    if watch is None:
        raise CannotJudge("the target serves one listener, or has no state port")
    await old_enough(watch)
    if watch.wire.is_lost:
        raise RuleBroken("a state link was closed during the run")
    asked = asyncio.get_running_loop().time()
    if not await watch.until(lambda: bool(watch.joints) and watch.joints[-1].time > asked, 1.0):
        raise RuleBroken(f"a state link has fallen silent within {watch.wire.age:.0f} s")
    return passed(f"for {watch.wire.age:.0f} s")
