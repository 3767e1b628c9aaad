"""Section F: where a frame begins and ends, however TCP cuts the stream.

Simple message has no mark to find a frame by; a receiver that takes a segment for a frame works in
the laboratory and fails in the factory.
"""

from __future__ import annotations

import asyncio
import struct
from functools import partial

from openpendant.simplemsg import CommType, JointTrajPt, MsgType, Ping, ReplyCode
from openpendant.simplemsg.framing import HEADER_SIZE, PREFIX_SIZE

from ..check import PASSED, CheckFinding, RuleBroken, deviates
from .answers import STOP, must_be_ping
from .checks import ANY, FULL, check, check_on
from .target import Target
from .wire import Wire, raw_frame

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
