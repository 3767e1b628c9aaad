"""Checks of a client's frames: lengths, bounds, layouts, headers and byte order."""

from __future__ import annotations

from collections.abc import Iterable

from openpendant.simplemsg import MAX_REFERENCE_FRAME, MOTOMAN, CommType, MsgType, Ping, ReplyCode
from openpendant.simplemsg.framing import (
    HEADER_SIZE,
    LEAST_LENGTH,
    MAX_DETECTABLE_LENGTH,
    PREFIX_SIZE,
)

from ..check import CannotJudge
from .check import Habit, Observation, Observed, Problem, client_check, rule_check
from .setup import IN_PIECES, WRITES_OBSERVED, Purpose
from .trace import TracedFrame

NOTHING_SENT = "the client sent nothing"
_NOTHING_ASKED = "the client sent no topic and no request"

MAX_PENDANT_FRAME = 65_532
"""Largest frame on the pendant port, as the hello announces it, bytes."""

REP_PING_BODY = 40
"""REP-I0006 gives PING ten integers that industrial_core's does not have, bytes."""

_STANDARD_ASKED = {
    MsgType.PING,
    MsgType.GET_VERSION,
    MsgType.JOINT_TRAJ_PT,
    MsgType.JOINT_TRAJ,
    MsgType.JOINT_TRAJ_PT_FULL,
}
_MOTOMAN_ASKED = {2001, 2003, 2005, 2007, 2009, 2012, 2013, 2016, 2018, 2020}
_FREE_TYPES = range(65_000, 65_536)


def _sent(seen: Observed) -> list[TracedFrame]:
    return seen.trace.sent


def _headed(seen: Observed) -> list[TracedFrame]:
    return [frame for frame in seen.trace.sent if frame.is_whole_header]


def _ordered(seen: Observed) -> list[TracedFrame]:
    return [frame for frame in seen.trace.sent if frame.order is not None]


def _on_each_link(seen: Observed) -> list[list[TracedFrame]]:
    """Return the client's frames on each connection on which it spoke."""
    links = seen.trace.links.values()
    sent = ([frame for frame in link.frames if frame.from_client] for link in links)
    return [frames for frames in sent if frames]


@rule_check("FC01", _sent, NOTHING_SENT)
def _declared_length(frame: TracedFrame, _: Observed) -> Problem | None:
    if not frame.is_frame and _is_cut_short(frame):
        return None  # FC03 judges a stream that ended inside a frame
    if frame.is_frame and frame.length == len(frame.data) - PREFIX_SIZE:
        return None
    return f"length {frame.length} before {max(0, len(frame.data) - PREFIX_SIZE)} bytes"


@rule_check("FC02", _sent, NOTHING_SENT)
def _whole_header(frame: TracedFrame, _: Observed) -> Problem | None:
    if len(frame.data) >= HEADER_SIZE or frame.length >= LEAST_LENGTH:
        return None
    return f"length {frame.length} is less than the header's {LEAST_LENGTH}"


@rule_check("FC03", lambda seen: [frames[-1] for frames in _on_each_link(seen)], NOTHING_SENT)
def _whole_last_frame(frame: TracedFrame, _: Observed) -> Problem | None:
    if frame.is_frame or not _is_cut_short(frame):
        return None
    return f"{len(frame.data)} bytes of a frame of {frame.length + PREFIX_SIZE}"


@rule_check("FC04", _sent, NOTHING_SENT)
def _bounded(frame: TracedFrame, _: Observed) -> Problem | None:
    is_pendant = frame.link.purpose is Purpose.PENDANT
    most = MAX_PENDANT_FRAME if is_pendant else MAX_REFERENCE_FRAME
    size = max(len(frame.data), frame.length + PREFIX_SIZE)
    return f"{size} bytes, at most {most}" if size > most else None


def _with_valid_header(seen: Observed) -> Iterable[TracedFrame]:
    """Return the frames of which only the body is left to judge; headers have their own checks."""
    return (
        frame
        for frame in _headed(seen)
        if frame.length == len(frame.data) - PREFIX_SIZE
        and frame.msg_type != 0
        and frame.comm_type != CommType.INVALID
        and (frame.comm_type == CommType.REPLY) == (frame.reply_code != ReplyCode.UNUSED)
    )


@rule_check("FC05", _with_valid_header, NOTHING_SENT)
def _layout(frame: TracedFrame, _: Observed) -> Problem | None:
    size = len(frame.data) - HEADER_SIZE
    if not isinstance(frame.message, Ping) or not size:
        return frame.fault or None
    if size == REP_PING_BODY:
        return Habit("PING with REP-I0006's 40-byte body", f"{size} bytes of body")
    return f"PING with a body of {size} bytes"


@client_check("FC06", NOTHING_SENT)
def _one_write(seen: Observed) -> Iterable[Observation]:
    """Look at how frames reached a live judge; a recording does not say."""
    texts = [event for event in seen.trace.events if event.text in (IN_PIECES, WRITES_OBSERVED)]
    if not texts:
        raise CannotJudge("only a live run sees how the bytes arrived")
    pieces = {(e.port, e.connection, e.time) for e in texts if e.text == IN_PIECES}
    for frame in seen.trace.sent:
        cut = (frame.link.port, frame.link.number, frame.time) in pieces
        yield frame, "the frame came in pieces" if cut else None


def _is_cut_short(frame: TracedFrame) -> bool:
    """Return True if bytes are the beginning of a frame; a prefix of two bytes is one, too."""
    if len(frame.data) < PREFIX_SIZE:
        return True
    return len(frame.data) - PREFIX_SIZE < frame.length <= MAX_DETECTABLE_LENGTH


@rule_check("HC01", _headed, NOTHING_SENT)
def _type_given(frame: TracedFrame, _: Observed) -> Problem | None:
    return None if frame.msg_type else "message type 0"


@rule_check("HC02", _headed, NOTHING_SENT)
def _comm_type_known(frame: TracedFrame, _: Observed) -> Problem | None:
    known = (CommType.TOPIC, CommType.REQUEST, CommType.REPLY)
    return None if frame.comm_type in known else f"communication type {frame.comm_type}"


def _not_replies(seen: Observed) -> list[TracedFrame]:
    return [frame for frame in _headed(seen) if frame.comm_type != CommType.REPLY]


def replies(seen: Observed) -> list[TracedFrame]:
    """Return the replies of the client."""
    return [frame for frame in _headed(seen) if frame.comm_type == CommType.REPLY]


@rule_check("HC03", _not_replies, _NOTHING_ASKED)
def _no_code_but_in_replies(frame: TracedFrame, _: Observed) -> Problem | None:
    return f"reply code {frame.reply_code} in no reply" if frame.reply_code else None


@rule_check("HC04", replies, "the client sent no reply")
def _code_in_replies(frame: TracedFrame, _: Observed) -> Problem | None:
    verdicts = (ReplyCode.SUCCESS, ReplyCode.FAILURE)
    return None if frame.reply_code in verdicts else f"reply code {frame.reply_code}"


@rule_check("HC05", lambda seen: [f for f in _not_replies(seen) if f.msg_type], _NOTHING_ASKED)
def _asks_what_exists(frame: TracedFrame, seen: Observed) -> Problem | None:
    known = _STANDARD_ASKED | (_MOTOMAN_ASKED if seen.trace.setup.dialect is MOTOMAN else set())
    is_known = frame.msg_type in known or frame.msg_type in _FREE_TYPES
    return None if is_known else f"type {frame.msg_type} is nothing that a client asks"


def _pings(seen: Observed) -> list[TracedFrame]:
    return [frame for frame in _headed(seen) if frame.msg_type == MsgType.PING]


@rule_check("HC06", _pings, "the client sent no PING")
def _ping_is_no_topic(frame: TracedFrame, _: Observed) -> Problem | None:
    return "PING as a topic" if frame.comm_type == CommType.TOPIC else None


@rule_check("BC01", _ordered, NOTHING_SENT)
def _constant_order(frame: TracedFrame, _: Observed) -> Problem | None:
    first = next(other for other in frame.link.frames if other.from_client and other.order)
    return None if frame.order is first.order else "the byte order changed"


@client_check("BC02", NOTHING_SENT)
def _controllers_order(seen: Observed) -> Iterable[Observation]:
    heard = (frame.order for frame in seen.trace.frames if not frame.from_client and frame.order)
    order = seen.trace.setup.order or next(heard, None)
    if order is None:
        raise CannotJudge("the controller said nothing and its byte order was not told")
    for frame in _ordered(seen):
        yield frame, None if frame.order is order else f"not {order.name.lower()}-endian"


@client_check("BC03", NOTHING_SENT)
def _one_order(seen: Observed) -> Iterable[Observation]:
    firsts = [frames[0] for frames in _on_each_link(seen)]
    if len(firsts) < 2:
        raise CannotJudge("the client spoke on one connection only")
    for frame in firsts:
        other = frame.order is not firsts[0].order
        yield frame, "another byte order than before" if other else None
