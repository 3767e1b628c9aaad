"""Checks of requests and replies: one at a time, each answered once, nothing said unasked."""

from __future__ import annotations

import struct

from openpendant.simplemsg import ByteOrder, CommType, MsgType, ReplyCode
from openpendant.simplemsg.pendant import OperatorAction, OperatorEvent

from ..findings import Finding
from .check import ClientCheck, Habit, Observed, Problem, Tally, client_check, each
from .setup import Purpose
from .trace import HEADER, ClientTrace, Frame
from .trajectories import is_stop

ANSWER_WITHIN_NS = 1_000_000_000
"""A request on the client is not called unanswered before this time is over."""

NOTHING_ASKED = "the controller asked nothing"

NO_ANSWER_TO_POSITION = (
    "industrial_robot_client: a JOINT_POSITION request is published, not answered"
)

DEAF_MOTION = "industrial_robot_client: the motion node reads nothing but answers to its points"


@client_check(
    "RC01",
    "a request waits for the reply to the one before it",
    "observed: motoman_driver's controller loses pipelined frames; industrial_core"
    " joint_trajectory_streamer waits; STOP alone may overtake (its stop_motion service does)",
)
def one_at_a_time(seen: Observed) -> Finding:
    """Count the outstanding requests of each motion and I/O connection."""
    trace = seen.trace
    tally = Tally()
    for purpose in (Purpose.MOTION, Purpose.IO):
        for link in trace.links_for(purpose):
            outstanding: list[Frame] = []
            for frame in link.frames:
                if not frame.from_client:
                    outstanding = [
                        asked
                        for asked in outstanding
                        if trace.replies.get(asked.number) is not frame
                    ]
                elif frame.comm_type == CommType.REQUEST:
                    if not is_stop(frame.message):
                        tally.look(frame, _impatience(outstanding))
                    outstanding.append(frame)
    return tally.finding("the client sent no request but STOP")


def _impatience(outstanding: list[Frame]) -> Problem | None:
    return f"sent while {len(outstanding)} are unanswered" if outstanding else None


@client_check(
    "RC02",
    "nothing but replies, and once IDENTIFY, is sent on the state port",
    "industrial_core robot_state_interface only listens there; vendors' servers do not read",
)
def silent_on_state(seen: Observed) -> Finding:
    """Look at everything that the client sent on the state port."""
    asked: set[int] = set()

    def rule(frame: Frame) -> Problem | None:
        if frame.comm_type == CommType.REPLY:
            return None
        if _identifies(frame) and id(frame.link) not in asked:
            asked.add(id(frame.link))
            return None
        return f"type {frame.msg_type}, not a reply"

    frames = [frame for frame in seen.trace.on(Purpose.STATE) if frame.is_whole_header]
    return each(frames, rule, "the client sent nothing on a state port")


def _identifies(frame: Frame) -> bool:
    """Tell whether a frame is the question that does nothing, OPERATOR_EVENT with IDENTIFY."""
    if frame.msg_type != OperatorEvent.PLACE.msg_type or frame.comm_type != CommType.REQUEST:
        return False
    # Not a message of the dialect in which a stock client is read, so by its bytes.
    order = "<" if frame.order is ByteOrder.LITTLE else ">"
    action = frame.data[HEADER : HEADER + 4]
    return len(action) == 4 and struct.unpack(f"{order}i", action)[0] == OperatorAction.IDENTIFY


@client_check(
    "RC03",
    "each request of the controller is answered within 1 s",
    "REP-I0006: a service request has a reply; unsupported ones get FAILURE",
)
def answers(seen: Observed) -> Finding:
    """Look for requests without a reply."""
    trace = seen.trace
    streams = any(step.frame.msg_type == MsgType.JOINT_TRAJ_PT for step in seen.motions.steps)

    def rule(request: Frame) -> Problem | None:
        if request.number in trace.replies:
            return None
        if request.msg_type == MsgType.JOINT_POSITION:
            return Habit(NO_ANSWER_TO_POSITION, "no answer to a request of type 10")
        text = f"no answer to a request of type {request.msg_type}"
        if request.link.purpose is Purpose.MOTION and streams:
            return Habit(DEAF_MOTION, text)
        return text

    return each(_judgeable_requests(trace), rule, NOTHING_ASKED)


@client_check(
    "RC04",
    "no request is answered twice",
    "REP-I0006: one reply to a request",
)
def answers_once(seen: Observed) -> Finding:
    """Look for replies that answer nothing, where something had been asked."""
    trace = seen.trace
    tally = Tally()
    for request in _asked(trace):
        extra = any(
            reply.link is request.link and reply.msg_type == request.msg_type
            for reply in trace.unasked
        )
        tally.look(request, f"another reply of type {request.msg_type}" if extra else None)
    return tally.finding(NOTHING_ASKED)


@client_check(
    "RC05",
    "topics are never answered",
    "REP-I0006: topics have no reply; observed: a reply to a topic is later taken for another's",
)
def topics_unanswered(seen: Observed) -> Finding:
    """Look for unasked replies of a type that the controller sent as a topic."""
    trace = seen.trace
    tally = Tally()
    for link in trace.links.values():
        topics = {
            frame.msg_type: frame
            for frame in link.frames
            if not frame.from_client and frame.comm_type == CommType.TOPIC
        }
        for topic in topics.values():
            answers = [
                reply
                for reply in trace.unasked
                if reply.link is link and reply.msg_type == topic.msg_type
            ]
            where = answers[0] if answers else topic
            tally.look(where, f"a reply to topics of type {topic.msg_type}" if answers else None)
    return tally.finding("the controller sent no topics")


@client_check(
    "RC06",
    "a reply comes only after a request",
    "REP-I0006: replies answer requests",
)
def no_unasked_reply(seen: Observed) -> Finding:
    """Look at each reply of the client."""
    unasked = {reply.number for reply in seen.trace.unasked}
    return each(
        [f for f in seen.trace.sent if f.is_whole_header and f.comm_type == CommType.REPLY],
        lambda reply: "nothing was asked" if reply.number in unasked else None,
        "the client sent no reply",
    )


@client_check(
    "RC07",
    "a reply has the type of its request, and where it succeeds its body",
    "REP-I0006: the reply repeats the message type, and a successful one has the body;"
    " industrial_core message_manager.cpp, simple_message.cpp toReply",
)
def same_type(seen: Observed) -> Finding:
    """Compare each reply of the client with its request.

    Only a STATUS has a body that anybody asks a client for; other types that clients know have
    none to give.
    """
    trace = seen.trace

    def rule(request: Frame) -> Problem | None:
        reply = trace.replies[request.number]
        if reply.msg_type != request.msg_type:
            return f"a request of type {request.msg_type} was answered with type {reply.msg_type}"
        is_bare = reply.reply_code == ReplyCode.SUCCESS and len(reply.data) < len(request.data)
        if request.msg_type == MsgType.STATUS and is_bare:
            size = len(reply.data) - HEADER
            return f"a STATUS request succeeded with {size} bytes of body"
        return None

    return each(_answered(trace), rule, NOTHING_ASKED)


@client_check(
    "RC08",
    "PING is answered with success",
    "industrial_core ping_handler.cpp",
)
def ping_succeeds(seen: Observed) -> Finding:
    """Look at the answers to PING."""
    trace = seen.trace

    def rule(request: Frame) -> Problem | None:
        code = trace.replies[request.number].reply_code
        return None if code == ReplyCode.SUCCESS else f"PING was answered with reply code {code}"

    pings = [request for request in _answered(trace) if request.msg_type == MsgType.PING]
    return each(pings, rule, "no PING of the controller was answered")


@client_check(
    "RC09",
    "an unknown request is answered FAILURE",
    "REP-I0006, unsupported requests; industrial_core message_manager.cpp",
)
def unknown_fails(seen: Observed) -> Finding:
    """Look at the answers to requests of types that nobody has."""
    trace = seen.trace

    def rule(request: Frame) -> Problem | None:
        reply = trace.replies[request.number]
        if reply.reply_code == ReplyCode.FAILURE:
            return None
        return f"unknown type {request.msg_type} was answered with reply code {reply.reply_code}"

    unknown = [request for request in _answered(trace) if _is_unknown(trace, request)]
    return each(unknown, rule, "no unknown request was answered")


@client_check(
    "RC10",
    "a failure reply has no body to rely on",
    "REP-I0006: the body of a failure reply is meaningless; industrial_core sends none",
)
def failure_is_bare(seen: Observed) -> Finding:
    """Look at the failure replies of the client."""
    return each(
        [f for f in _replies_of_client(seen.trace) if f.reply_code == ReplyCode.FAILURE],
        lambda f: f"{len(f.data) - HEADER} bytes of body" if len(f.data) > HEADER else None,
        "the client sent no failure reply",
    )


@client_check(
    "RC11",
    "a message of unknown type ends no connection",
    "REP-I0006: ignore unsupported topics, refuse unsupported requests",
)
def survives_unknown(seen: Observed) -> Finding:
    """Look whether the client hung up within a second of something unknown."""
    trace = seen.trace

    def rule(frame: Frame) -> Problem | None:
        link = frame.link
        if not link.closed_by_client or link.closed is None:
            return None
        if not 0 <= link.closed - frame.time <= ANSWER_WITHIN_NS:
            return None
        delay = (link.closed - frame.time) / 1e6
        return f"closed {delay:.0f} ms after a message of unknown type {frame.msg_type}"

    heard = [frame for frame in trace.heard() if _is_unknown(trace, frame)]
    unknown = [frame for frame in heard if frame.comm_type != CommType.REPLY]
    return each(unknown, rule, "the controller sent nothing unknown")


def _asked(trace: ClientTrace) -> list[Frame]:
    return [
        frame
        for frame in trace.frames
        if not frame.from_client and frame.is_whole_header and frame.comm_type == CommType.REQUEST
    ]


def _answered(trace: ClientTrace) -> list[Frame]:
    return [request for request in _asked(trace) if request.number in trace.replies]


def _judgeable_requests(trace: ClientTrace) -> list[Frame]:
    """Return the controller's sound requests that were answered, or had time to be."""

    def had_time(request: Frame) -> bool:
        closed = request.link.closed
        end = trace.ended if closed is None else closed
        return end - request.time >= ANSWER_WITHIN_NS

    sound = [request for request in _asked(trace) if request.message is not None]
    return [request for request in sound if request.number in trace.replies or had_time(request)]


def _replies_of_client(trace: ClientTrace) -> list[Frame]:
    return [f for f in trace.sent if f.is_whole_header and f.comm_type == CommType.REPLY]


def _is_unknown(trace: ClientTrace, frame: Frame) -> bool:
    """Tell whether no dialect has this type and no vendor's or free range holds it."""
    known = {cls.PLACE.msg_type for cls in trace.setup.dialect.messages}
    return frame.msg_type not in known and not 65_000 <= frame.msg_type <= 65_535


CHECKS: tuple[ClientCheck, ...] = (
    one_at_a_time,
    silent_on_state,
    answers,
    answers_once,
    topics_unanswered,
    no_unasked_reply,
    same_type,
    ping_succeeds,
    unknown_fails,
    failure_is_bare,
    survives_unknown,
)
