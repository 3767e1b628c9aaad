"""Section H: the sixteen bytes before the body, of replies and of what is sent unasked."""

from __future__ import annotations

from openpendant.simplemsg import CommType, MsgType, Ping, ReplyCode

from ..findings import PASSED, Finding, Section, deviates
from .answers import MOTION_REPLY, STOP, ping
from .checks import ANY, FULL, check
from .recordings import Sample, sample
from .target import Target
from .wire import HEADER, Frame, RuleBroken, Wire, raw_frame

_HEADER = "REP-I0006, header"
_VALID = "industrial_core simple_message.cpp, validateMessage: such a frame is dropped"
_QUESTIONS = (MsgType.PING, MsgType.STATUS)
"""What a controller may ask its client on the state port."""

UNKNOWN = 9999
"""A message type that nobody has assigned."""


async def _answers(target: Target) -> list[tuple[str, int, Frame]]:
    """Return one answer to a PING, to an unknown request and to STOP, with the type asked."""
    wire = await target.motion()
    unknown = raw_frame(wire.codec, UNKNOWN, CommType.REQUEST)
    return [
        ("PING", MsgType.PING, await wire.ask(Ping(), "a PING")),
        ("an unknown request", UNKNOWN, await wire.ask(unknown, "an unknown request")),
        ("STOP", MsgType.JOINT_TRAJ_PT, await wire.ask(STOP, "STOP")),
    ]


@check("HS01", "an answer is marked as a reply", _HEADER, Section.HEADER)
async def _comm_type(target: Target) -> Finding:
    for what, _, reply in await _answers(target):
        if reply.comm_type != CommType.REPLY:
            raise RuleBroken(f"the answer to {what} has communication type {reply.comm_type}")
    return PASSED


@check("HS02", "a reply says success or failure", _HEADER, Section.HEADER)
async def _reply_code(target: Target) -> Finding:
    for what, _, reply in await _answers(target):
        if reply.reply_code not in (ReplyCode.SUCCESS, ReplyCode.FAILURE):
            raise RuleBroken(
                f"the answer to {what} has reply code {reply.reply_code};"
                " the real client takes 0 for no reply at all and sends the point again"
            )
    return PASSED


@check("HS03", "a reply has the type of its request", _HEADER, Section.HEADER)
async def _type(target: Target) -> Finding:
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


@check(
    "HS04",
    "the length of a reply counts the bytes behind it",
    "REP-I0006, prefix: it does not count itself",
    Section.HEADER,
    profiles=ANY,
)
async def _length(target: Target) -> Finding:
    wire = await target.motion()
    for _ in range(3):
        await ping(wire, "a PING, one of three")
    await wire.expect_silence(0.15, "three answers to three PINGs")
    if wire.is_amid_frame:
        raise RuleBroken("behind the third answer stand bytes that no frame owns")
    return PASSED


@check(
    "HS05",
    "what the state port says is marked as topics",
    _HEADER,
    Section.HEADER,
    profiles=ANY,
    is_plain=True,
)
async def _topics(target: Target) -> Finding:
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


async def _not_obeyed(wire: Wire, frame: bytes, what: str, habit: str = "") -> Finding:
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


@check("HS06", "a frame of communication type 0 is not taken", _VALID, Section.HEADER)
async def _comm_invalid(target: Target) -> Finding:
    wire = await target.motion()
    frame = raw_frame(wire.codec, MsgType.PING, CommType.INVALID)
    return await _not_obeyed(wire, frame, "a PING of communication type 0")


@check("HS07", "a frame of message type 0 is not taken", _VALID, Section.HEADER, profiles=FULL)
async def _type_invalid(target: Target) -> Finding:
    wire = await target.motion()
    return await _not_obeyed(wire, raw_frame(wire.codec, 0, CommType.REQUEST), "type 0")


@check("HS08", "a request with a reply code is not taken", _VALID, Section.HEADER, profiles=FULL)
async def _request_with_code(target: Target) -> Finding:
    wire = await target.motion()
    frame = raw_frame(wire.codec, MsgType.PING, CommType.REQUEST, ReplyCode.SUCCESS)
    return await _not_obeyed(wire, frame, "a PING request with reply code 1")


@check(
    "HS09",
    "a reply that nobody asked for is ignored",
    "REP-I0006: ignore a reply nobody asked for",
    Section.HEADER,
)
async def _unasked_reply(target: Target) -> Finding:
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


@check(
    "HS10",
    "an unknown communication type is ignored",
    "REP-I0006: warn and ignore",
    Section.HEADER,
    profiles=FULL,
)
async def _comm_unknown(target: Target) -> Finding:
    wire = await target.motion()
    habit = "industrial_core: answers a PING of any communication type"
    frame = raw_frame(wire.codec, MsgType.PING, 4)
    return await _not_obeyed(wire, frame, "a PING of communication type 4", habit)


@check(
    "HS11",
    "a reply that carries no data is sixteen bytes",
    "industrial_core ping_message.cpp: an empty body; REP-I0006 has forty zeros",
    Section.HEADER,
    profiles=ANY,
)
async def _ping_size(target: Target) -> Finding:
    wire = await target.motion()
    reply = await wire.ask(Ping(), "a PING")
    if len(reply.data) == HEADER:
        return PASSED
    if reply.body == bytes(40):
        return deviates("REP-I0006: a PING has forty bytes of zeros", str(reply))
    raise RuleBroken(f"the answer to a PING has {len(reply.body)} bytes of body")
