"""Section R: what is answered, by what, how often and in which order; and what is not."""

from __future__ import annotations

import struct

from openpendant.simplemsg import (
    CommType,
    GetVersion,
    Message,
    MsgType,
    Ping,
    ReplyCode,
    SpecialSequence,
    Status,
    TriState,
)
from openpendant.simplemsg.framing import HEADER_SIZE

from ..check import PASSED, CannotJudge, CheckFinding, CheckVerdict, RuleBroken, deviates, passed
from .answers import (
    FULL_STOP,
    MOTION_REPLY,
    STOP,
    STOP_TOPIC,
    judge_point_reply,
    must_be_ping,
    ping,
)
from .checks import ANY, FULL, check, check_on
from .framing import UNKNOWN
from .monitor import Watch
from .recordings import Questions, asked_in_motion
from .target import Target
from .wire import REPLY_WITHIN, Wire, raw_frame

_PROMPT = 0.25
_UNKNOWN_TYPES = (20, 21, 1399, 64_999, 0x7FFF_FFFF)


def _topic(msg_type: int, wire: Wire) -> bytes:
    return raw_frame(wire.codec, msg_type, CommType.TOPIC)


@check("RS01", profiles=ANY, is_plain=True)
async def _ping(target: Target) -> CheckFinding:
    wire = await target.motion()
    wire.send(Ping())
    reply = await wire.poll(REPLY_WITHIN)
    if reply is not None:
        must_be_ping(reply, "a PING")
        return PASSED
    if target.is_minimum or target.knows_ping:
        raise RuleBroken("a PING was not answered within 1 s")
    return deviates("ABB, Fanuc, Stäubli: PING is not known", "a PING was not answered")


@check_on(Target.motion, "RS02")
async def _ping_with_body(wire: Wire) -> CheckFinding:
    wire.send(raw_frame(wire.codec, MsgType.PING, CommType.REQUEST, body=bytes(40)))
    reply = await wire.expect("an answer to a PING with a body")
    must_be_ping(reply, "a PING with a body")
    more = await wire.poll(0.2)
    if more is not None and more.msg_type == MOTION_REPLY:
        return deviates("MotoROS: a PING has exactly 16 bytes", f"the body was answered by {more}")
    if more is not None or wire.is_lost:
        raise RuleBroken(f"after the answer to a PING with a body came {more or 'the end'}")
    return PASSED


@check_on(Target.motion, "RS03", profiles=ANY)
async def _prompt(wire: Wire) -> None:
    for number in range(1, 6):
        await ping(wire, f"PING {number} of five", _PROMPT)


@check_on(Target.motion, "RS04", profiles=FULL)
async def _ping_topic(wire: Wire) -> CheckFinding:
    wire.send(_topic(MsgType.PING, wire))
    reply = await wire.poll(0.2)
    if reply is None:
        await ping(wire, "a PING after a PING as a topic")
        return PASSED
    if reply.msg_type == MsgType.PING:
        return deviates("industrial_core: answers a PING of any communication type", str(reply))
    raise RuleBroken(f"a PING as a topic was answered by {reply}")


async def _refusal_of(wire: Wire, msg_type: int) -> CheckFinding:
    what = f"an unknown request of type {msg_type}"
    reply = await wire.ask(raw_frame(wire.codec, msg_type, CommType.REQUEST), what)
    if reply.msg_type == MOTION_REPLY and msg_type != MOTION_REPLY:
        return deviates("Motoman: unknown types are answered by type 2002, result 3", str(reply))
    if (reply.msg_type, reply.reply_code) != (msg_type, ReplyCode.FAILURE):
        raise RuleBroken(f"{what} was answered by {reply}")
    if any(reply.body):
        raise RuleBroken(f"the refusal of {what} carries {len(reply.body)} bytes that say nothing")
    return PASSED


@check("RS05")
async def _unknown_request(target: Target) -> CheckFinding:
    return await _refusal_of(await target.motion(), UNKNOWN)


@check_on(Target.motion, "RS06", profiles=FULL)
async def _unknown_requests(wire: Wire) -> CheckFinding:
    for msg_type in _UNKNOWN_TYPES:
        finding = await _refusal_of(wire, msg_type)
        if finding.verdict is not CheckVerdict.PASSED:
            return finding
    return PASSED


@check_on(Target.motion, "RS07")
async def _link_survives(wire: Wire) -> None:
    body = struct.pack("<3i", 1, 2, 3)
    wire.send(raw_frame(wire.codec, UNKNOWN, CommType.REQUEST, body=body))
    await wire.expect("an answer to an unknown request with a body")
    await ping(wire, "a PING after an unknown request")


@check_on(Target.motion, "RS08")
async def _unknown_topic(wire: Wire) -> None:
    wire.send(raw_frame(wire.codec, UNKNOWN, CommType.TOPIC, body=bytes(24)))
    await wire.expect_silence(0.2, "an unknown topic")
    await ping(wire, "a PING after an unknown topic")


@check_on(Target.motion, "RS09", profiles=FULL)
async def _version(wire: Wire) -> CheckFinding:
    reply = await wire.ask(GetVersion(), "a request for the version")
    if reply.reply_code == ReplyCode.FAILURE:
        return deviates("no vendor's server answers GET_VERSION", str(reply))
    if reply.msg_type != MsgType.GET_VERSION or len(reply.body) != 12:
        raise RuleBroken(f"the version is to be three integers of type 2, not {reply}")
    return passed("version " + ".".join(map(str, reply.integers(3))))


@check_on(Target.motion, "RS10", profiles=FULL)
async def _status_request(wire: Wire) -> CheckFinding:
    # No document says which body such a request has: none, or that of the reply.
    for body in (b"", bytes(28)):
        question = raw_frame(wire.codec, MsgType.STATUS, CommType.REQUEST, body=body)
        reply = await wire.ask(question, "a request for STATUS")
        if reply.reply_code == ReplyCode.SUCCESS:
            break
    if reply.reply_code == ReplyCode.FAILURE:
        return deviates("vendors: STATUS is told, never asked for", str(reply))
    message = reply.message()
    if not isinstance(message, Status):
        raise RuleBroken(f"a request for STATUS was answered by {reply}")
    if not {message.in_motion, message.e_stopped, message.motion_possible} <= {-1, 0, 1}:
        raise RuleBroken(f"the STATUS that was asked for holds no tri-states: {message}")
    return PASSED


@check_on(Target.state, "RS11", profiles=FULL)
async def _state_ping(watch: Watch) -> CheckFinding:
    await watch.begin()
    watch.wire.send(Ping())

    def answered() -> bool:
        return any(frame.comm_type == CommType.REPLY for frame in watch.frames)

    is_answered = await watch.until(answered, 1.0)
    count = len(watch.positions) + len(watch.feedback)
    if not await watch.until(lambda: len(watch.positions) + len(watch.feedback) > count, 1.0):
        raise RuleBroken("after a PING on the state port no joint values came any more")
    if is_answered:
        return PASSED
    return deviates("vendors: the state server never reads", "a PING there was not answered")


@check("RS12", is_plain=True)
async def _stop_at_rest(target: Target) -> CheckFinding:
    reply = await (await target.motion()).ask(STOP, "STOP")
    return judge_point_reply(reply)


@check("RS13", is_plain=True)
async def _stop_topic(target: Target) -> CheckFinding:
    wire = await target.motion()
    wire.send(STOP_TOPIC)
    reply = await wire.poll(0.2)
    if reply is None:
        await target.probe.ask(wire, "after STOP as a topic")
        return PASSED
    habits = {
        int(MsgType.JOINT_POSITION): "Fanuc: topics are answered too",
        MOTION_REPLY: "Motoman: topics are answered too",
    }
    if reply.msg_type in habits:
        return deviates(habits[reply.msg_type], str(reply))
    raise RuleBroken(f"STOP as a topic was answered by {reply}")


@check("RS14")
async def _once(target: Target) -> None:
    for what, message in (("a PING", Ping()), ("STOP", STOP), ("an unknown request", None)):
        wire = await target.motion()
        unknown = raw_frame(wire.codec, UNKNOWN, CommType.REQUEST)
        await wire.ask(unknown if message is None else message, what)
        await wire.expect_silence(0.15, f"the answer to {what}")


@check_on(Target.motion, "RS15")
async def _order(wire: Wire) -> None:
    wire.send(Ping(), raw_frame(wire.codec, UNKNOWN, CommType.REQUEST), STOP, Ping())
    replies = [await wire.expect(f"answer {n} of four") for n in range(1, 5)]
    types = [reply.msg_type for reply in replies]
    if types[0] != MsgType.PING or types[3] != MsgType.PING or types[1] != UNKNOWN:
        raise RuleBroken(f"PING, type {UNKNOWN}, STOP and PING were answered by types {types}")
    must_be_ping(replies[0], "the first PING")
    must_be_ping(replies[3], "the second PING")


def _all_stop(wire: Wire, words: int) -> bytes:
    """Return a body that says STOP to whoever reads its sequence, wherever he begins."""
    return struct.pack(f"{wire.codec.byte_order.value}i", SpecialSequence.STOP) * words


async def _not_taken(wire: Wire, frame: bytes | Message, what: str) -> CheckFinding:
    """Send a request that must not be taken; it may be refused, ignored or cost the link."""
    wire.send(frame)
    reply = await wire.poll(0.5)
    if reply is not None and reply.reply_code == ReplyCode.SUCCESS:
        raise RuleBroken(f"{what} was answered by {reply}")
    if reply is not None:
        await ping(wire, f"a PING after {what}")
        return PASSED
    if wire.is_lost:
        return PASSED
    wire.send(Ping())
    if await wire.poll(0.5) is None and not wire.is_lost:
        raise RuleBroken(f"{what} left the link open and silent")
    raise RuleBroken(f"{what} was not answered; the real client waits for ever")


@check_on(Target.motion, "RS16")
async def _short_body(wire: Wire) -> CheckFinding:
    body = _all_stop(wire, 12)
    frame = raw_frame(wire.codec, MsgType.JOINT_TRAJ_PT, CommType.REQUEST, body=body)
    return await _not_taken(wire, frame, "a point of 48 bytes")


@check_on(Target.motion, "RS17", profiles=FULL)
async def _long_body(wire: Wire) -> CheckFinding:
    # Read from either end this is a STOP, so that a lenient server does no harm.
    stop = wire.encode(STOP)[HEADER_SIZE:]
    frame = raw_frame(wire.codec, MsgType.JOINT_TRAJ_PT, CommType.REQUEST, body=stop[:4] + stop)
    wire.send(frame)
    reply = await wire.poll(0.5)
    if reply is not None and reply.reply_code == ReplyCode.SUCCESS:
        return deviates("industrial_core: bodies are read from their end", str(reply))
    if reply is None and not wire.is_lost:
        raise RuleBroken("a point of 56 bytes was not answered; the real client waits for ever")
    return PASSED


@check("RS18", profiles=FULL)
async def _full_point(target: Target) -> CheckFinding:
    reply = await (await target.motion()).ask(FULL_STOP, "STOP in a full point")
    if reply.msg_type == MOTION_REPLY:
        return deviates("Motoman: full points are answered by type 2002", str(reply))
    if reply.msg_type != MsgType.JOINT_TRAJ_PT_FULL or reply.comm_type != CommType.REPLY:
        raise RuleBroken(f"a full point was answered by {reply}")
    return PASSED


@check_on(Target.motion, "RS19", profiles=FULL)
async def _wrong_count(wire: Wire) -> CheckFinding:
    count = (7).to_bytes(4, "little" if wire.codec.byte_order.value == "<" else "big")
    body = wire.encode(STOP)[HEADER_SIZE:] + count
    frame = raw_frame(wire.codec, MsgType.JOINT_TRAJ, CommType.REQUEST, body=body)
    return await _not_taken(wire, frame, "a trajectory of one point that says seven")


@check("RS20", profiles=ANY, is_plain=True)
async def _unasked(target: Target) -> None:
    wire = await target.motion()
    await wire.expect_silence(0.2, "connecting to the motion port")
    await target.probe.ask(wire)
    await wire.expect_silence(0.2, f"the answer to a {target.probe.name}")


async def _questions(target: Target) -> Questions:
    asked = await asked_in_motion(target)
    if not asked.was_moving:
        raise CannotJudge("the robot did not move meanwhile")
    return asked


@check("RS21", moves=True)
async def _ping_in_motion(target: Target) -> None:
    reply = (await _questions(target)).ping
    if reply is None:
        raise RuleBroken("a PING in motion was not answered within 0.5 s")
    must_be_ping(reply, "a PING in motion")


@check("RS22", moves=True, profiles=FULL)
async def _status_in_motion(target: Target) -> None:
    reply = (await _questions(target)).status
    if reply is None:
        raise RuleBroken("a request for STATUS in motion was not answered within 0.5 s")
    if reply.reply_code == ReplyCode.FAILURE:
        raise CannotJudge("the target refuses the question, as it may; RS10 says so")
    message = reply.message()
    if not isinstance(message, Status) or message.in_motion == TriState.FALSE:
        raise RuleBroken(f"a moving robot answered with {message}")
