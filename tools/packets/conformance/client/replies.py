"""Checks of requests and replies: each answered once, nothing said unasked, and answers heeded."""

from __future__ import annotations

import struct
from bisect import bisect_right
from collections.abc import Iterable

from openpendant.simplemsg import ByteOrder, CommType, MsgType, ReplyCode
from openpendant.simplemsg.framing import HEADER_SIZE
from openpendant.simplemsg.pendant import OperatorAction, OperatorEvent

from .check import Habit, Observation, Observed, Problem, client_check, rule_check
from .framing import replies
from .setup import Purpose
from .trace import ClientTrace, TracedFrame
from .trajectories import PointAnswer, SentPoint, is_stop

ANSWER_WITHIN_NS = 1_000_000_000
"""A request on the client is not called unanswered before this time is over."""

NOTHING_ASKED = "the controller asked nothing"

NO_ANSWER_TO_POSITION = (
    "industrial_robot_client: a JOINT_POSITION request is published, not answered"
)

DEAF_MOTION = "industrial_robot_client: the motion node reads nothing but answers to its points"

PATIENCE_NS = 5_000_000_000
"""A client that waits longer for the answer to a point waits for ever."""


@client_check("RC01", "the client sent no request but STOP")
def _one_at_a_time(seen: Observed) -> Iterable[Observation]:
    """Count the outstanding requests of each motion and I/O connection."""
    trace = seen.trace
    for link in trace.links_for(Purpose.MOTION) + trace.links_for(Purpose.IO):
        outstanding: list[TracedFrame] = []
        for frame in link.frames:
            if not frame.from_client:
                outstanding = [
                    asked for asked in outstanding if trace.replies.get(asked.number) is not frame
                ]
            elif frame.comm_type == CommType.REQUEST:
                if not is_stop(frame.message):
                    count = len(outstanding)
                    yield frame, f"sent while {count} are unanswered" if count else None
                outstanding.append(frame)


@client_check("RC02", "the client sent nothing on a state port")
def _silent_on_state(seen: Observed) -> Iterable[Observation]:
    asked: set[int] = set()
    for frame in seen.trace.on(Purpose.STATE):
        if not frame.is_whole_header:
            continue
        may = frame.comm_type == CommType.REPLY
        if not may and _identifies(frame) and id(frame.link) not in asked:
            asked.add(id(frame.link))
            may = True
        yield frame, None if may else f"type {frame.msg_type}, not a reply"


def _identifies(frame: TracedFrame) -> bool:
    """Return True if a frame is the question that does nothing, OPERATOR_EVENT with IDENTIFY."""
    if frame.msg_type != OperatorEvent.PLACE.msg_type or frame.comm_type != CommType.REQUEST:
        return False
    # Not a message of the dialect in which a stock client is read, so by its bytes.
    order = "<" if frame.order is ByteOrder.LITTLE else ">"
    action = frame.data[HEADER_SIZE : HEADER_SIZE + 4]
    return len(action) == 4 and struct.unpack(f"{order}i", action)[0] == OperatorAction.IDENTIFY


def _judgeable_requests(seen: Observed) -> list[TracedFrame]:
    """Return the controller's sound requests that were answered, or had time to be."""
    trace = seen.trace

    def had_time(request: TracedFrame) -> bool:
        closed = request.link.closed
        end = trace.ended if closed is None else closed
        return end - request.time >= ANSWER_WITHIN_NS

    sound = [request for request in _asked(trace) if request.message is not None]
    return [request for request in sound if request.number in trace.replies or had_time(request)]


@rule_check("RC03", _judgeable_requests, NOTHING_ASKED)
def _answers(request: TracedFrame, seen: Observed) -> Problem | None:
    if request.number in seen.trace.replies:
        return None
    if request.msg_type == MsgType.JOINT_POSITION:
        return Habit(NO_ANSWER_TO_POSITION, "no answer to a request of type 10")
    text = f"no answer to a request of type {request.msg_type}"
    streams = any(not step.is_full for step in seen.points())
    return Habit(DEAF_MOTION, text) if request.link.purpose is Purpose.MOTION and streams else text


@rule_check("RC04", lambda seen: _asked(seen.trace), NOTHING_ASKED)
def _answers_once(request: TracedFrame, seen: Observed) -> Problem | None:
    extra = any(
        reply.link is request.link and reply.msg_type == request.msg_type
        for reply in seen.trace.unasked
    )
    return f"another reply of type {request.msg_type}" if extra else None


@client_check("RC05", "the controller sent no topics")
def _topics_unanswered(seen: Observed) -> Iterable[Observation]:
    """Look for unasked replies of a type that the controller sent as a topic."""
    for link in seen.trace.links.values():
        topics = {
            frame.msg_type: frame
            for frame in link.frames
            if not frame.from_client and frame.comm_type == CommType.TOPIC
        }
        for kind, topic in topics.items():
            unasked = (reply for reply in seen.trace.unasked if reply.link is link)
            answer = next((reply for reply in unasked if reply.msg_type == kind), None)
            yield answer or topic, f"a reply to topics of type {kind}" if answer else None


@rule_check("RC06", replies, "the client sent no reply")
def _no_unasked_reply(reply: TracedFrame, seen: Observed) -> Problem | None:
    return "nothing was asked" if reply in seen.trace.unasked else None


def _answered(seen: Observed) -> list[TracedFrame]:
    trace = seen.trace
    return [request for request in _asked(trace) if request.number in trace.replies]


@rule_check("RC07", _answered, NOTHING_ASKED)
def _same_type(request: TracedFrame, seen: Observed) -> Problem | None:
    """Compare each reply of the client with its request.

    Only a STATUS has a body that anybody asks a client for; other types that clients know have
    none to give.
    """
    reply = seen.trace.replies[request.number]
    if reply.msg_type != request.msg_type:
        return f"a request of type {request.msg_type} was answered with type {reply.msg_type}"
    is_bare = reply.reply_code == ReplyCode.SUCCESS and len(reply.data) < len(request.data)
    if request.msg_type == MsgType.STATUS and is_bare:
        return f"a STATUS request succeeded with {len(reply.data) - HEADER_SIZE} bytes of body"
    return None


def _answered_pings(seen: Observed) -> list[TracedFrame]:
    return [request for request in _answered(seen) if request.msg_type == MsgType.PING]


@rule_check("RC08", _answered_pings, "no PING of the controller was answered")
def _ping_succeeds(request: TracedFrame, seen: Observed) -> Problem | None:
    code = seen.trace.replies[request.number].reply_code
    return None if code == ReplyCode.SUCCESS else f"PING was answered with reply code {code}"


def _answered_unknown(seen: Observed) -> list[TracedFrame]:
    return [request for request in _answered(seen) if _is_unknown(seen.trace, request)]


@rule_check("RC09", _answered_unknown, "no unknown request was answered")
def _unknown_fails(request: TracedFrame, seen: Observed) -> Problem | None:
    code = seen.trace.replies[request.number].reply_code
    text = f"unknown type {request.msg_type} was answered with reply code {code}"
    return None if code == ReplyCode.FAILURE else text


@client_check("RC10", "the client sent no failure reply")
def _failure_is_bare(seen: Observed) -> Iterable[Observation]:
    for frame in replies(seen):
        if frame.reply_code == ReplyCode.FAILURE:
            size = len(frame.data) - HEADER_SIZE
            yield frame, f"{size} bytes of body" if size else None


def _unknown_heard(seen: Observed) -> list[TracedFrame]:
    heard = [frame for frame in seen.trace.from_controller() if _is_unknown(seen.trace, frame)]
    return [frame for frame in heard if frame.comm_type != CommType.REPLY]


@rule_check("RC11", _unknown_heard, "the controller sent nothing unknown")
def _survives_unknown(frame: TracedFrame, _: Observed) -> Problem | None:
    link = frame.link
    if not link.closed_by_client or link.closed is None:
        return None
    delay = link.closed - frame.time
    if not 0 <= delay <= ANSWER_WITHIN_NS:
        return None
    return f"closed {delay / 1e6:.0f} ms after a message of unknown type {frame.msg_type}"


def _asked(trace: ClientTrace) -> list[TracedFrame]:
    return [
        frame
        for frame in trace.frames
        if not frame.from_client and frame.is_whole_header and frame.comm_type == CommType.REQUEST
    ]


def _is_unknown(trace: ClientTrace, frame: TracedFrame) -> bool:
    """Return True if no dialect has this type and no vendor's or free range holds it."""
    known = {cls.PLACE.msg_type for cls in trace.setup.dialect.messages}
    return frame.msg_type not in known and not 65_000 <= frame.msg_type <= 65_535


def _excused(step: SentPoint, name: str, detail: str) -> Problem:
    """Return a fault that is a habit of the client which sends points of type 11."""
    return detail if step.is_full else Habit(name, detail)


@client_check("RC12", "no point was answered with another type")
def _minds_the_type(seen: Observed) -> Iterable[Observation]:
    name = "industrial_robot_client: any frame counts as the answer"
    for trajectory in seen.trajectories():
        following = dict(trajectory.pairs)
        for step in trajectory.advancing:
            if step.answer is PointAnswer.WRONG_TYPE:
                on = following.get(step)
                yield step, _excused(on, name, f"{on.where} the next point follows") if on else None


@client_check("RC13", "no point was answered with reply code 0")
def _minds_the_code(seen: Observed) -> Iterable[Observation]:
    for trajectory in seen.trajectories():
        for step, on in trajectory.followed:
            if step.answer is not PointAnswer.UNREADABLE:
                continue
            problem: Problem | None = None
            if on is not None and on.repeats is step:
                name = "industrial_robot_client: the same point again after an invalid reply"
                problem = Habit(name, f"sequence {on.sequence} again")
            elif on is not None:
                problem = f"sequence {on.sequence} follows as if it had been taken"
            yield step, problem


@client_check("MC17", "no point was refused")
def _refusal_ends(seen: Observed) -> Iterable[Observation]:
    for trajectory in seen.trajectories():
        for step, on in trajectory.followed:
            if step.answer is not PointAnswer.REFUSED:
                continue
            problem: Problem | None = None
            if on is not None and not on.is_full:
                name = "industrial_robot_client: FAILURE is ignored, the next point follows"
                problem = Habit(name, f"sequence {on.sequence} after {step.sequence} was refused")
            elif on is not None:
                problem = f"sequence {on.sequence} follows although {step.sequence} was refused"
            yield step, problem


@client_check("MC18", "every point was answered soon, or the link was lost before")
def _reacts_to_silence(seen: Observed) -> Iterable[Observation]:
    """Look at what the client does within 5 s of a point that is never answered."""
    frames = [*seen.motions.stops, *(step.frame for step in seen.points())]
    moves = sorted(frames, key=lambda frame: frame.number)
    for step in seen.points():
        sent, link, reply = step.frame.time, step.frame.link, step.reply
        if step.frame.comm_type != CommType.REQUEST:
            continue
        at = bisect_right(moves, step.frame.number, key=lambda frame: frame.number)
        act = moves[at] if at < len(moves) else None
        ends = [seen.trace.ended if link.closed is None else link.closed]
        ends += [frame.time for frame in (act, reply) if frame is not None]
        waited = min(ends) - sent
        left = reply is None and link.closed_by_client
        gave_up = left or (act is not None and (reply is None or act.number < reply.number))
        if waited >= PATIENCE_NS:
            name = "industrial_robot_client: waits without limit for the answer to a point"
            yield step, Habit(name, f"nothing for {waited / 1e9:.1f} s")
        elif gave_up:
            yield step, None
