"""Sections F, H and B: where a frame begins and ends, its sixteen bytes of header, its byte order.

Simple message has no mark to find a frame by; a receiver that takes a segment for a frame works in
the laboratory and fails in the factory. The protocol fixes no byte order, so a server must at least
be of one mind.
"""

from __future__ import annotations

import asyncio
import math
import struct
from functools import partial

from openpendant.simplemsg import JOINT_SLOTS, CommType, JointTrajPt, MsgType, Ping, ReplyCode
from openpendant.simplemsg.framing import HEADER_SIZE, PREFIX_SIZE

from ..check import PASSED, CannotJudge, CheckFinding, RuleBroken, deviates
from .answers import MOTION_REPLY, STOP, must_be_ping, ping
from .checks import ANY, FULL, STANDARD, check, check_on
from .recordings import Sample, at_rest
from .target import Target
from .wire import ReceivedFrame, Wire, raw_frame

_CLOSE_WITHIN = 5.0
_LARGE = (1024, 2048, 3000, 4096)


async def _served_anew(target: Target, after: str) -> None:
    await target.probe.ask(await target.motion(), f"on a new connection after {after}")


@check("FS01", profiles=ANY, is_plain=True)
async def _whole(target: Target) -> None:
    await target.probe.ask(await target.motion(), "in one piece")


@check("FS02", is_plain=True)
async def _cut_anywhere(target: Target) -> None:
    wire, probe = await target.motion(), target.probe
    data = wire.encode(probe.message)
    for cut in range(1, len(data)):
        await wire.send_in_pieces(data[:cut], cut, 0.005)
        wire.send(data[cut:])
        await probe.answered(wire, f"a {probe.name} cut after {cut} bytes")


@check("FS03", is_plain=True)
async def _byte_by_byte(target: Target) -> None:
    wire = await target.motion()
    await wire.send_in_pieces(wire.encode(STOP))
    await wire.expect("an answer to a STOP that came byte by byte")
    await target.probe.ask(wire, "after a STOP that came byte by byte")


@check("FS04", is_plain=True)
async def _two_at_once(target: Target) -> None:
    wire, probe = await target.motion(), target.probe
    wire.send(probe.message, probe.message)
    for which in ("first", "second"):
        await probe.answered(wire, f"the {which} of two {probe.name}s in one piece")


@check("FS05", is_plain=True)
async def _twenty_at_once(target: Target) -> None:
    wire, probe = await target.motion(), target.probe
    wire.send(*[probe.message] * 20)
    for number in range(1, 21):
        await probe.answered(wire, f"{probe.name} {number} of twenty in one piece")
    await wire.expect_silence(0.2, f"twenty answers to twenty {probe.name}s")


@check("FS06", is_plain=True)
async def _one_and_a_half(target: Target) -> None:
    wire, probe = await target.motion(), target.probe
    data = wire.encode(probe.message)
    wire.send(data, data[:7])
    what = f"a {probe.name} with half of the next behind it"
    await probe.answered(wire, what)
    await wire.expect_silence(0.1, f"the answer to {what}")
    wire.send(data[7:])
    await probe.answered(wire, f"the second {probe.name}, completed later")


@check_on(Target.motion, "FS07", is_plain=True)
async def _body_later(wire: Wire) -> None:
    stop = wire.encode(STOP)
    await wire.send_in_pieces(stop[:HEADER_SIZE], HEADER_SIZE, 0.02)
    await wire.expect_silence(0.05, "a header without its body")
    wire.send(stop[HEADER_SIZE:])
    await wire.expect("the answer to a STOP whose body came later")


async def _broken_length(target: Target, length: int, rest: bytes = b"") -> None:
    """Send a length that is none; the link may be closed, or the frame skipped, not waited for."""
    wire = await target.motion()
    wire.send(
        raw_frame(wire.codec, MsgType.PING, CommType.REQUEST, length=length)[:PREFIX_SIZE], rest
    )
    if not await wire.is_closed_within(0.5):
        wire.send(Ping())
        reply = await wire.poll(1.0)
        if reply is None and not await wire.is_closed_within(_CLOSE_WITHIN - 1.5):
            raise RuleBroken(
                f"after a length field of {length} the link is neither closed nor answers a PING"
            )
    await _served_anew(target, f"a length field of {length}")


check("FS08")(partial(_broken_length, length=0))
check("FS09")(partial(_broken_length, length=-1))
check("FS10", profiles=FULL)(partial(_broken_length, length=8, rest=bytes(8)))


@check("FS11")
async def _length_huge(target: Target) -> None:
    wire = await target.motion()
    wire.send(raw_frame(wire.codec, MsgType.PING, CommType.REQUEST, length=0x7FFF_FFFF))
    if not await wire.is_closed_within(_CLOSE_WITHIN):
        raise RuleBroken(f"the link is still open {_CLOSE_WITHIN:g} s after that length")
    await _served_anew(target, "a huge length")


@check("FS12")
async def _oversized(target: Target) -> None:
    for size in _LARGE:
        wire = await target.motion()
        # Wherever a reader of another layout begins, it finds sequence -4: STOP.
        body = struct.pack(f"{wire.codec.byte_order.value}i", STOP.sequence) * (
            (size - HEADER_SIZE) // 4
        )
        wire.send(raw_frame(wire.codec, MsgType.JOINT_TRAJ_PT, CommType.REQUEST, body=body))
        reply = await wire.poll(1.0)
        if reply is not None and reply.reply_code == ReplyCode.SUCCESS:
            raise RuleBroken(f"a frame of {size} bytes was taken: {reply}")
        if reply is None and not await wire.is_closed_within(_CLOSE_WITHIN - 1.0):
            raise RuleBroken(f"a frame of {size} bytes was neither answered nor ended the link")
    await _served_anew(target, "frames that are too large")


@check("FS13")
async def _web_browser(target: Target) -> None:
    wire = await target.motion()
    wire.send(b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n")
    frame = await wire.poll(1.0)
    if frame is not None or wire.stray:
        raise RuleBroken(f"an HTTP request was answered: {frame or wire.stray.hex()}")
    await _served_anew(target, "an HTTP request")


@check_on(Target.motion, "FS14", profiles=FULL)
async def _never_completed(wire: Wire) -> CheckFinding:
    ping = wire.encode(Ping())
    wire.send(ping[:10])
    if await wire.is_closed_within(_CLOSE_WITHIN):
        return PASSED
    wire.send(ping[10:])
    what = "a PING whose second half came 5 s later"
    must_be_ping(await wire.expect(f"the answer to {what}"), what)
    return deviates(
        "industrial_core: receives without a timeout",
        f"half a frame was still waited for after {_CLOSE_WITHIN:g} s",
    )


@check("FS15", profiles=FULL)
async def _half_closed(target: Target) -> None:
    wire = await target.motion()
    wire.send(Ping())
    wire.half_close()
    if not await wire.is_closed_within(_CLOSE_WITHIN):
        raise RuleBroken(f"the link is still open {_CLOSE_WITHIN:g} s after the client's end")
    await _served_anew(target, "a half-closed link")


@check("FS16")
async def _reset_amid_frame(target: Target) -> None:
    wire = await target.motion()
    wire.send(wire.encode(STOP)[:20])
    await asyncio.sleep(0.02)
    wire.reset()
    await asyncio.sleep(0.02)
    await _served_anew(target, "a reset amid a frame")


@check("FS17", is_plain=True)
async def _slow_frame(target: Target) -> None:
    wire, probe = await target.motion(), target.probe
    data = wire.encode(probe.message)
    await wire.send_in_pieces(data, 1, 0.5 / len(data))
    await probe.answered(wire, f"a {probe.name} that took half a second")


@check_on(Target.motion, "FS18")
async def _mixed_sizes(wire: Wire) -> None:
    topic = JointTrajPt(-4, (0.0,) * 10, 0.0, 0.0, comm_type=CommType.TOPIC)
    wire.send(Ping(), STOP, topic, Ping())
    replies = [await wire.expect(f"answer {n} of three") for n in (1, 2, 3)]
    must_be_ping(replies[0], "a PING with STOP behind it")
    must_be_ping(replies[2], "a PING behind STOP and STOP as a topic")
    await wire.expect_silence(0.1, "the answers to three requests and a topic in one piece")


_QUESTIONS = (MsgType.PING, MsgType.STATUS)
"""Requests that a controller may send to its client on the state port."""

UNKNOWN = 9999
"""A message type that nobody has assigned."""


async def _answers(target: Target) -> list[tuple[str, int, ReceivedFrame]]:
    """Return one answer to a PING, to an unknown request and to STOP, with the type asked."""
    wire = await target.motion()
    unknown = raw_frame(wire.codec, UNKNOWN, CommType.REQUEST)
    return [
        ("PING", MsgType.PING, await wire.ask(Ping(), "a PING")),
        ("an unknown request", UNKNOWN, await wire.ask(unknown, "an unknown request")),
        ("STOP", MsgType.JOINT_TRAJ_PT, await wire.ask(STOP, "STOP")),
    ]


@check("HS01")
async def _comm_type(target: Target) -> None:
    for what, _, reply in await _answers(target):
        if reply.comm_type != CommType.REPLY:
            raise RuleBroken(f"the answer to {what} has communication type {reply.comm_type}")


@check("HS02")
async def _reply_code(target: Target) -> None:
    for what, _, reply in await _answers(target):
        if reply.reply_code not in (ReplyCode.SUCCESS, ReplyCode.FAILURE):
            raise RuleBroken(
                f"the answer to {what} has reply code {reply.reply_code};"
                " the real client takes 0 for no reply at all and sends the point again"
            )


@check("HS03")
async def _type(target: Target) -> CheckFinding:
    habits = {(MsgType.JOINT_TRAJ_PT, 10): "Fanuc: points are answered by type 10"}
    for what, asked, reply in await _answers(target):
        if reply.msg_type == asked:
            continue
        habit = habits.get((MsgType(asked), reply.msg_type)) if asked != UNKNOWN else None
        if habit is None and reply.msg_type == MOTION_REPLY:
            habit = "Motoman: everything is answered by type 2002"
        if habit is None:
            raise RuleBroken(f"{what} (type {asked}) was answered by {reply}")
        return deviates(habit, f"{what} was answered by {reply}")
    return PASSED


@check_on(Target.motion, "HS04", profiles=ANY)
async def _length(wire: Wire) -> None:
    for _ in range(3):
        await ping(wire, "a PING, one of three")
    await wire.expect_silence(0.15, "three answers to three PINGs")
    if wire.is_amid_frame:
        raise RuleBroken("behind the third answer stand bytes that no frame owns")


@check_on(at_rest, "HS05", profiles=ANY, is_plain=True)
async def _topics(taken: Sample) -> None:
    if taken.stray:
        raise RuleBroken(f"the state port sends bytes that are no frame: {taken.stray.hex()}")
    for frame in taken.frames:
        is_question = frame.comm_type == CommType.REQUEST and frame.msg_type in _QUESTIONS
        if (frame.comm_type != CommType.TOPIC and not is_question) or frame.reply_code:
            raise RuleBroken(f"the state port sends {frame}; a topic has comm 1 and code 0")
    if not taken.frames:
        raise RuleBroken("the state port says nothing")


async def _not_obeyed(
    wire: Wire, what: str, header: tuple[int, int, int], habit: str
) -> CheckFinding:
    """Send a header that must not be taken: silence, a failure reply or the end are in order."""
    wire.send(raw_frame(wire.codec, *header))
    reply = await wire.poll(0.2)
    if reply is not None and reply.reply_code == ReplyCode.SUCCESS:
        if habit:
            return deviates(habit, f"{what} was answered by {reply}")
        raise RuleBroken(f"{what} was answered by {reply}")
    if not wire.is_lost:
        await ping(wire, f"a PING after {what}")
    return PASSED


_OF_ANY_TYPE = "industrial_core: answers a PING of any communication type"

for _number, _profiles, _what, _header, _habit in (
    ("HS06", STANDARD, "a PING of communication type 0", (MsgType.PING, CommType.INVALID, 0), ""),
    ("HS07", FULL, "type 0", (0, CommType.REQUEST, 0), ""),
    ("HS08", FULL, "a PING request with reply code 1", (MsgType.PING, CommType.REQUEST, 1), ""),
    ("HS10", FULL, "a PING of communication type 4", (MsgType.PING, 4, 0), _OF_ANY_TYPE),
):
    check_on(Target.motion, _number, profiles=_profiles)(
        partial(_not_obeyed, what=_what, header=_header, habit=_habit)
    )


@check_on(Target.motion, "HS09")
async def _unasked_reply(wire: Wire) -> CheckFinding:
    for msg_type in (MsgType.JOINT_TRAJ_PT, UNKNOWN):
        wire.send(raw_frame(wire.codec, msg_type, CommType.REPLY, ReplyCode.SUCCESS))
    await wire.expect_silence(0.15, "replies that nobody asked for")
    wire.send(raw_frame(wire.codec, MsgType.PING, CommType.REPLY, ReplyCode.SUCCESS))
    frame = await wire.poll(0.2)
    if frame is not None:
        return deviates(_OF_ANY_TYPE, str(frame))
    await ping(wire, "a PING after replies that nobody asked for")
    return PASSED


@check_on(Target.motion, "HS11", profiles=ANY)
async def _ping_size(wire: Wire) -> CheckFinding:
    reply = await wire.ask(Ping(), "a PING")
    if len(reply.data) == HEADER_SIZE:
        return PASSED
    if reply.body == bytes(40):
        return deviates("REP-I0006: a PING has forty bytes of zeros", str(reply))
    raise RuleBroken(f"the answer to a PING has {len(reply.body)} bytes of body")


_PLAUSIBLE = 1e3


async def _restore_order(target: Target) -> None:
    """Let a server that remembers the order of an address forget the other one again."""
    wire = await target.motion()
    await ping(wire, "a PING in the usual order, after another client's other order")


async def _in_other_order(target: Target) -> Wire | None:
    """Return a connection understood in the other order, None if cut off; else RuleBroken."""
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
