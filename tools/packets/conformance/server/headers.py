"""Section H: the sixteen bytes before the body, of replies and of what is sent unasked."""

from __future__ import annotations

from functools import partial

from openpendant.simplemsg import CommType, MsgType, Ping, ReplyCode
from openpendant.simplemsg.framing import HEADER_SIZE

from ..check import PASSED, CheckFinding, RuleBroken, deviates
from .answers import MOTION_REPLY, STOP, ping
from .checks import ANY, FULL, STANDARD, check, check_on
from .recordings import Sample, at_rest
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
