"""Which reply is the answer to which request, by their types alone.

Owns the rule: a reply has the type of its request, unless the declaration names another one. What
known controllers do instead is accepted and named. Whether the answer is good news is not asked.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from openpendant.simplemsg import DIALECTS, MsgType
from openpendant.simplemsg.layout import HEADER_SIZE
from openpendant.simplemsg.motoman import MotomanMotionCtrl, MotomanMotionReply
from openpendant.simplemsg.pendant import Hello, Management, Verdict

from ..faulty.frame_surgery import header_of, integer_at

COMMAND_AT = HEADER_SIZE + 8
"""Offset of the field `command` in types 2001 and 2002; integers only stand before it."""

_MOTION_CONTROL = MotomanMotionCtrl.PLACE.msg_type
_MOTION_REPLY = MotomanMotionReply.PLACE.msg_type
_VERDICT = Verdict.PLACE.msg_type
_MAY_FAIL_SO = {Hello.PLACE.msg_type, Management.PLACE.msg_type}
"""Requests with an answer of their own type that are refused by a verdict."""


class Answering(NamedTuple):
    """Whether a reply answers a request.

    Attributes:
        fits: it does.
        remark: why not, or whose habit it is; empty for what the protocol says.
    """

    fits: bool
    remark: str = ""


def answering(request: bytes, reply: bytes) -> Answering:
    """Compare the types of two whole frames."""
    asked, told = header_of(request).msg_type, header_of(reply).msg_type
    if told == asked:
        return Answering(True)
    if told == _MOTION_REPLY:
        return _by_command(request, asked, reply)
    if told == _declared_answers().get(asked) or (told == _VERDICT and asked in _MAY_FAIL_SO):
        return Answering(True)
    if (asked, told) == (MsgType.JOINT_TRAJ_PT, MsgType.JOINT_POSITION):
        return Answering(True, "type 11 was answered by type 10, a habit of Fanuc's")
    return Answering(False, f"a reply of type {told} is no answer to type {asked}")


def _by_command(request: bytes, asked: int, reply: bytes) -> Answering:
    """Judge a MOTION_REPLY, which names what it answers: a command, else a message type."""
    command = integer_at(reply, COMMAND_AT)
    meant = {asked, integer_at(request, COMMAND_AT) if asked == _MOTION_CONTROL else asked}
    if command not in meant:
        about = "nothing" if command is None else f"command {command}"
        return Answering(False, f"a motion reply about {about} is no answer to type {asked}")
    is_declared = _declared_answers().get(asked) == _MOTION_REPLY
    return Answering(
        True, "" if is_declared else f"type {asked} was answered by type 2002, a habit of Motoman's"
    )


@cache
def _declared_answers() -> dict[int, int]:
    """Return the types of requests whose answers have another type, with the latter."""
    places = [cls.PLACE for dialect in DIALECTS.values() for cls in dialect.messages]
    types = {place.name: int(place.msg_type) for place in places}
    return {int(place.msg_type): types[place.reply] for place in places if place.reply in types}
