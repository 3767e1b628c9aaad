"""Section B: the protocol fixes no byte order, so a server must at least be of one mind."""

from __future__ import annotations

import math

from openpendant.simplemsg import JOINT_SLOTS, MsgType, Ping

from ..check import CannotJudge, RuleBroken
from .answers import STOP, ping
from .checks import ANY, FULL, check, check_on
from .recordings import Sample, at_rest
from .target import Target
from .wire import Wire

_PLAUSIBLE = 1e3


async def _restore_order(target: Target) -> None:
    """Let a server that remembers the order of an address forget the other one again."""
    wire = await target.motion()
    await ping(wire, "a PING in the usual order, after another client's other order")


async def _in_other_order(target: Target) -> Wire | None:
    """Return a connection that is understood in the other order; None where it is cut off.

    Raises:
        RuleBroken: it is neither.
    """
    wire = await target.motion(target.other_order)
    wire.send(Ping())
    reply = await wire.poll(1.0)
    if reply is not None and reply.msg_type == MsgType.PING:
        return wire
    if wire.stray:
        raise RuleBroken(f"a client of the other order was answered in ours: {wire.stray.hex()}")
    if reply is not None:
        raise RuleBroken(f"a PING in the other order was answered by {reply}")
    if await wire.is_closed_within(4.0):
        return None
    raise RuleBroken("a client of the other order was neither answered nor cut off in 5 s")


@check("BS01", is_plain=True)
async def _reply_order(target: Target) -> None:
    wire = await target.motion()
    await target.probe.ask(wire)
    await wire.ask(STOP, "STOP")
    await target.probe.ask(wire, "after STOP")


@check_on(at_rest, "BS02", profiles=ANY, is_plain=True)
async def _state_order(taken: Sample) -> None:
    if taken.stray:
        raise RuleBroken(f"after {len(taken.frames)} frames came {taken.stray.hex()}")
    if not taken.frames:
        raise CannotJudge("the state port says nothing")
    for frame in taken.frames:
        if not 0 < frame.msg_type <= 65_535:
            raise RuleBroken(f"message type {frame.msg_type} reads like one in the other order")


@check("BS03", is_plain=True)
async def _both_ports(target: Target) -> None:
    wire = await target.motion()
    await target.probe.ask(wire, f"in the state port's order ({target.order.name.lower()})")
    watch = await target.state()
    if not await watch.until(lambda: bool(watch.frames) or bool(watch.wire.stray), 2.5):
        raise CannotJudge("the state port says nothing")
    if watch.wire.stray:
        raise RuleBroken("the state port speaks another order than the motion port was asked in")


@check_on(at_rest, "BS04", profiles=ANY, is_plain=True)
async def _reals(taken: Sample) -> None:
    if not taken.joints:
        raise CannotJudge("the state port reports no joint values that could be read")
    for report in taken.joints:
        for slot, value in enumerate(report.values):
            tiny = value != 0 and abs(value) < 1e-30
            if not math.isfinite(value) or abs(value) > _PLAUSIBLE or tiny:
                raise RuleBroken(f"slot {slot + 1} of {JOINT_SLOTS} is {value!r}: no joint value")


@check("BS05", profiles=FULL)
async def _other_client(target: Target) -> None:
    try:
        await _in_other_order(target)
    finally:
        await _restore_order(target)


@check("BS06", profiles=FULL)
async def _side_by_side(target: Target) -> None:
    first = await target.motion()
    await ping(first)
    try:
        second = await _in_other_order(target)
        if second is None:
            raise CannotJudge("the target speaks one byte order only")
        await ping(first, "a PING in the first client's order, after the second's")
        await second.ask(STOP, "STOP in the second client's order")
        await first.ask(STOP, "STOP in the first client's order")
    finally:
        await _restore_order(target)


@check("BS07", profiles=FULL)
async def _changing_order(target: Target) -> None:
    wire = await target.motion()
    await ping(wire)
    wire.send(target.codec(target.other_order).encode(STOP))
    reply = await wire.poll(0.5)
    if reply is None and not wire.stray and not await wire.is_closed_within(4.5):
        raise RuleBroken("a frame in another order left the link open and silent for 5 s")
    if reply is not None and reply.msg_type != MsgType.JOINT_TRAJ_PT:
        raise RuleBroken(f"STOP in another order was answered by {reply}")
    await _restore_order(target)
