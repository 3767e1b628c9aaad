"""Section H: the sixteen bytes before the body, of replies and of what is sent unasked."""

from __future__ import annotations

from openpendant.simplemsg import CommType, MsgType, Ping, ReplyCode
from openpendant.simplemsg.framing import HEADER_SIZE

from ..check import PASSED, CheckFinding, RuleBroken, deviates
from .answers import MOTION_REPLY, STOP, ping
from .checks import ANY, FULL, check
from .recordings import Sample, sample
from .target import Target
from .wire import ReceivedFrame, Wire, raw_frame

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
async def _comm_type(target: Target) -> CheckFinding:
    for what, _, reply in await _answers(target):
        if reply.comm_type != CommType.REPLY:
            raise RuleBroken(f"the answer to {what} has communication type {reply.comm_type}")
    return PASSED


@check("HS02")
async def _reply_code(target: Target) -> CheckFinding:
    for what, _, reply in await _answers(target):
        if reply.reply_code not in (ReplyCode.SUCCESS, ReplyCode.FAILURE):
            raise RuleBroken(
                f"the answer to {what} has reply code {reply.reply_code};"
                " the real client takes 0 for no reply at all and sends the point again"
            )
    return PASSED


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


@check("HS04", profiles=ANY)
async def _length(target: Target) -> CheckFinding:
    wire = await target.motion()
    for _ in range(3):
        await ping(wire, "a PING, one of three")
    await wire.expect_silence(0.15, "three answers to three PINGs")
    if wire.is_amid_frame:
        raise RuleBroken("behind the third answer stand bytes that no frame owns")
    return PASSED


@check("HS05", profiles=ANY, is_plain=True)
async def _topics(target: Target) -> CheckFinding:
    taken: Sample = await target.once("the state at rest", sample)
    if taken.stray:
        raise RuleBroken(f"the state port sends bytes that are no frame: {taken.stray.hex()}")
    for frame in taken.frames:
        is_question = frame.comm_type == CommType.REQUEST and frame.msg_type in _QUESTIONS
        if (frame.comm_type != CommType.TOPIC and not is_question) or frame.reply_code:
            raise RuleBroken(f"the state port sends {frame}; a topic has comm 1 and code 0")
    if not taken.frames:
        raise RuleBroken("the state port says nothing")
    return PASSED


async def _not_obeyed(wire: Wire, frame: bytes, what: str, habit: str = "") -> CheckFinding:
    """Send a frame that must not be taken: silence, a failure reply or the end are in order."""
    wire.send(frame)
    reply = await wire.poll(0.2)
    if reply is not None and reply.reply_code == ReplyCode.SUCCESS:
        if habit:
            return deviates(habit, f"{what} was answered by {reply}")
        raise RuleBroken(f"{what} was answered by {reply}")
    if not wire.is_lost:
        await ping(wire, f"a PING after {what}")
    return PASSED


@check("HS06")
async def _comm_invalid(target: Target) -> CheckFinding:
    wire = await target.motion()
    frame = raw_frame(wire.codec, MsgType.PING, CommType.INVALID)
    return await _not_obeyed(wire, frame, "a PING of communication type 0")


@check("HS07", profiles=FULL)
async def _type_invalid(target: Target) -> CheckFinding:
    wire = await target.motion()
    return await _not_obeyed(wire, raw_frame(wire.codec, 0, CommType.REQUEST), "type 0")


@check("HS08", profiles=FULL)
async def _request_with_code(target: Target) -> CheckFinding:
    wire = await target.motion()
    frame = raw_frame(wire.codec, MsgType.PING, CommType.REQUEST, ReplyCode.SUCCESS)
    return await _not_obeyed(wire, frame, "a PING request with reply code 1")


@check("HS09")
async def _unasked_reply(target: Target) -> CheckFinding:
    wire = await target.motion()
    for msg_type in (MsgType.JOINT_TRAJ_PT, UNKNOWN):
        wire.send(raw_frame(wire.codec, msg_type, CommType.REPLY, ReplyCode.SUCCESS))
    await wire.expect_silence(0.15, "replies that nobody asked for")
    wire.send(raw_frame(wire.codec, MsgType.PING, CommType.REPLY, ReplyCode.SUCCESS))
    frame = await wire.poll(0.2)
    if frame is not None:
        return deviates("industrial_core: answers a PING of any communication type", str(frame))
    await ping(wire, "a PING after replies that nobody asked for")
    return PASSED


@check("HS10", profiles=FULL)
async def _comm_unknown(target: Target) -> CheckFinding:
    wire = await target.motion()
    habit = "industrial_core: answers a PING of any communication type"
    frame = raw_frame(wire.codec, MsgType.PING, 4)
    return await _not_obeyed(wire, frame, "a PING of communication type 4", habit)


@check("HS11", profiles=ANY)
async def _ping_size(target: Target) -> CheckFinding:
    wire = await target.motion()
    reply = await wire.ask(Ping(), "a PING")
    if len(reply.data) == HEADER_SIZE:
        return PASSED
    if reply.body == bytes(40):
        return deviates("REP-I0006: a PING has forty bytes of zeros", str(reply))
    raise RuleBroken(f"the answer to a PING has {len(reply.body)} bytes of body")
