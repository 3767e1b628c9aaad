"""Checks of the headers of a client's frames, and of their byte order."""

from __future__ import annotations

from openpendant.simplemsg import MOTOMAN, CommType, MsgType, ReplyCode

from ..check import CheckFinding, not_applicable
from .check import Observed, Problem, client_check, each
from .framing import NOTHING_SENT
from .trace import ClientTrace, TracedFrame

_STANDARD_ASKED = {
    MsgType.PING,
    MsgType.GET_VERSION,
    MsgType.JOINT_TRAJ_PT,
    MsgType.JOINT_TRAJ,
    MsgType.JOINT_TRAJ_PT_FULL,
}
_MOTOMAN_ASKED = {2001, 2003, 2005, 2007, 2009, 2012, 2013, 2016, 2018, 2020}
_FREE_TYPES = range(65_000, 65_536)


@client_check("HC01")
def type_given(seen: Observed) -> CheckFinding:
    """Look at the type of each frame."""
    return each(
        _headed(seen.trace),
        lambda frame: None if frame.msg_type else "message type 0",
        NOTHING_SENT,
    )


@client_check("HC02")
def comm_type_known(seen: Observed) -> CheckFinding:
    """Look at the communication type of each frame."""
    known = (CommType.TOPIC, CommType.REQUEST, CommType.REPLY)
    return each(
        _headed(seen.trace),
        lambda f: None if f.comm_type in known else f"communication type {f.comm_type}",
        NOTHING_SENT,
    )


@client_check("HC03")
def no_code_but_in_replies(seen: Observed) -> CheckFinding:
    """Look at the reply code of everything but replies."""
    return each(
        [frame for frame in _headed(seen.trace) if frame.comm_type != CommType.REPLY],
        lambda f: f"reply code {f.reply_code} in no reply" if f.reply_code else None,
        "the client sent no topic and no request",
    )


@client_check("HC04")
def code_in_replies(seen: Observed) -> CheckFinding:
    """Look at the reply code of replies."""
    verdicts = (ReplyCode.SUCCESS, ReplyCode.FAILURE)
    return each(
        [frame for frame in _headed(seen.trace) if frame.comm_type == CommType.REPLY],
        lambda f: None if f.reply_code in verdicts else f"reply code {f.reply_code}",
        "the client sent no reply",
    )


@client_check("HC05")
def asks_what_exists(seen: Observed) -> CheckFinding:
    """Look at the types of topics and requests."""
    known = _STANDARD_ASKED | (_MOTOMAN_ASKED if seen.trace.setup.dialect is MOTOMAN else set())

    def rule(frame: TracedFrame) -> Problem | None:
        is_known = frame.msg_type in known or frame.msg_type in _FREE_TYPES
        return None if is_known else f"type {frame.msg_type} is nothing that a client asks"

    asked = [f for f in _headed(seen.trace) if f.comm_type != CommType.REPLY and f.msg_type]
    return each(asked, rule, "the client sent no topic and no request")


@client_check("HC06")
def ping_is_no_topic(seen: Observed) -> CheckFinding:
    """Look at the client's pings."""
    return each(
        [frame for frame in _headed(seen.trace) if frame.msg_type == MsgType.PING],
        lambda frame: "PING as a topic" if frame.comm_type == CommType.TOPIC else None,
        "the client sent no PING",
    )


@client_check("BC01")
def constant_order(seen: Observed) -> CheckFinding:
    """Compare each frame with the first of its connection."""

    def rule(frame: TracedFrame) -> Problem | None:
        first = next(other for other in frame.link.frames if other.from_client and other.order)
        return None if frame.order is first.order else "the byte order changed"

    return each(_ordered(seen.trace), rule, NOTHING_SENT)


@client_check("BC02")
def controllers_order(seen: Observed) -> CheckFinding:
    """Compare the client's frames with those of the controller."""
    setup = seen.trace.setup
    heard = (frame.order for frame in seen.trace.frames if not frame.from_client and frame.order)
    order = setup.order or next(heard, None)
    if order is None:
        return not_applicable("the controller said nothing and its byte order was not told")
    return each(
        _ordered(seen.trace),
        lambda f: None if f.order is order else f"not {order.name.lower()}-endian",
        NOTHING_SENT,
    )


@client_check("BC03")
def one_order(seen: Observed) -> CheckFinding:
    """Compare the connections with each other."""
    talked = [
        link
        for link in seen.trace.links.values()
        if any(frame.from_client for frame in link.frames)
    ]
    if len(talked) < 2:
        return not_applicable("the client spoke on one connection only")
    firsts = [next(f for f in link.frames if f.from_client) for link in talked]
    return each(
        firsts,
        lambda frame: None if frame.order is firsts[0].order else "another byte order than before",
        NOTHING_SENT,
    )


def _headed(trace: ClientTrace) -> list[TracedFrame]:
    return [frame for frame in trace.sent if frame.is_whole_header]


def _ordered(trace: ClientTrace) -> list[TracedFrame]:
    return [frame for frame in trace.sent if frame.order is not None]
