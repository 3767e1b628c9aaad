"""Checks of requests and replies: each answered once, nothing said unasked, and answers heeded."""

from __future__ import annotations

import struct
from bisect import bisect_right
from itertools import pairwise

from openpendant.simplemsg import ByteOrder, CommType, MsgType, ReplyCode
from openpendant.simplemsg.framing import HEADER_SIZE
from openpendant.simplemsg.pendant import OperatorAction, OperatorEvent

from ..check import CheckFinding
from .check import Habit, Observed, Problem, Tally, client_check, each
from .setup import Purpose
from .trace import ClientTrace, TracedFrame
from .trajectories import PointAnswer, is_stop

ANSWER_WITHIN_NS = 1_000_000_000
"""A request on the client is not called unanswered before this time is over."""

NOTHING_ASKED = "the controller asked nothing"

NO_ANSWER_TO_POSITION = (
    "industrial_robot_client: a JOINT_POSITION request is published, not answered"
)

DEAF_MOTION = "industrial_robot_client: the motion node reads nothing but answers to its points"


@client_check("RC01")
def one_at_a_time(seen: Observed) -> CheckFinding:
    """Count the outstanding requests of each motion and I/O connection."""
    trace = seen.trace
    tally = Tally()
    for purpose in (Purpose.MOTION, Purpose.IO):
        for link in trace.links_for(purpose):
            outstanding: list[TracedFrame] = []
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


def _impatience(outstanding: list[TracedFrame]) -> Problem | None:
    return f"sent while {len(outstanding)} are unanswered" if outstanding else None


@client_check("RC02")
def silent_on_state(seen: Observed) -> CheckFinding:
    """Look at everything that the client sent on the state port."""
    asked: set[int] = set()

    def rule(frame: TracedFrame) -> Problem | None:
        if frame.comm_type == CommType.REPLY:
            return None
        if _identifies(frame) and id(frame.link) not in asked:
            asked.add(id(frame.link))
            return None
        return f"type {frame.msg_type}, not a reply"

    frames = [frame for frame in seen.trace.on(Purpose.STATE) if frame.is_whole_header]
    return each(frames, rule, "the client sent nothing on a state port")


def _identifies(frame: TracedFrame) -> bool:
    """Return True if a frame is the question that does nothing, OPERATOR_EVENT with IDENTIFY."""
    if frame.msg_type != OperatorEvent.PLACE.msg_type or frame.comm_type != CommType.REQUEST:
        return False
    # Not a message of the dialect in which a stock client is read, so by its bytes.
    order = "<" if frame.order is ByteOrder.LITTLE else ">"
    action = frame.data[HEADER_SIZE : HEADER_SIZE + 4]
    return len(action) == 4 and struct.unpack(f"{order}i", action)[0] == OperatorAction.IDENTIFY


@client_check("RC03")
def answers(seen: Observed) -> CheckFinding:
    """Look for requests without a reply."""
    trace = seen.trace
    streams = any(step.frame.msg_type == MsgType.JOINT_TRAJ_PT for step in seen.motions.steps)

    def rule(request: TracedFrame) -> Problem | None:
        if request.number in trace.replies:
            return None
        if request.msg_type == MsgType.JOINT_POSITION:
            return Habit(NO_ANSWER_TO_POSITION, "no answer to a request of type 10")
        text = f"no answer to a request of type {request.msg_type}"
        if request.link.purpose is Purpose.MOTION and streams:
            return Habit(DEAF_MOTION, text)
        return text

    return each(_judgeable_requests(trace), rule, NOTHING_ASKED)


@client_check("RC04")
def answers_once(seen: Observed) -> CheckFinding:
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


@client_check("RC05")
def topics_unanswered(seen: Observed) -> CheckFinding:
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


@client_check("RC06")
def no_unasked_reply(seen: Observed) -> CheckFinding:
    """Look at each reply of the client."""
    unasked = {reply.number for reply in seen.trace.unasked}
    return each(
        [f for f in seen.trace.sent if f.is_whole_header and f.comm_type == CommType.REPLY],
        lambda reply: "nothing was asked" if reply.number in unasked else None,
        "the client sent no reply",
    )


@client_check("RC07")
def same_type(seen: Observed) -> CheckFinding:
    """Compare each reply of the client with its request.

    Only a STATUS has a body that anybody asks a client for; other types that clients know have
    none to give.
    """
    trace = seen.trace

    def rule(request: TracedFrame) -> Problem | None:
        reply = trace.replies[request.number]
        if reply.msg_type != request.msg_type:
            return f"a request of type {request.msg_type} was answered with type {reply.msg_type}"
        is_bare = reply.reply_code == ReplyCode.SUCCESS and len(reply.data) < len(request.data)
        if request.msg_type == MsgType.STATUS and is_bare:
            size = len(reply.data) - HEADER_SIZE
            return f"a STATUS request succeeded with {size} bytes of body"
        return None

    return each(_answered(trace), rule, NOTHING_ASKED)


@client_check("RC08")
def ping_succeeds(seen: Observed) -> CheckFinding:
    """Look at the answers to PING."""
    trace = seen.trace

    def rule(request: TracedFrame) -> Problem | None:
        code = trace.replies[request.number].reply_code
        return None if code == ReplyCode.SUCCESS else f"PING was answered with reply code {code}"

    pings = [request for request in _answered(trace) if request.msg_type == MsgType.PING]
    return each(pings, rule, "no PING of the controller was answered")


@client_check("RC09")
def unknown_fails(seen: Observed) -> CheckFinding:
    """Look at the answers to requests of types that nobody has."""
    trace = seen.trace

    def rule(request: TracedFrame) -> Problem | None:
        reply = trace.replies[request.number]
        if reply.reply_code == ReplyCode.FAILURE:
            return None
        return f"unknown type {request.msg_type} was answered with reply code {reply.reply_code}"

    unknown = [request for request in _answered(trace) if _is_unknown(trace, request)]
    return each(unknown, rule, "no unknown request was answered")


@client_check("RC10")
def failure_is_bare(seen: Observed) -> CheckFinding:
    """Look at the failure replies of the client."""
    return each(
        [f for f in _replies_of_client(seen.trace) if f.reply_code == ReplyCode.FAILURE],
        lambda f: (
            f"{len(f.data) - HEADER_SIZE} bytes of body" if len(f.data) > HEADER_SIZE else None
        ),
        "the client sent no failure reply",
    )


@client_check("RC11")
def survives_unknown(seen: Observed) -> CheckFinding:
    """Look whether the client closed within a second of something unknown."""
    trace = seen.trace

    def rule(frame: TracedFrame) -> Problem | None:
        link = frame.link
        if not link.closed_by_client or link.closed is None:
            return None
        if not 0 <= link.closed - frame.time <= ANSWER_WITHIN_NS:
            return None
        delay = (link.closed - frame.time) / 1e6
        return f"closed {delay:.0f} ms after a message of unknown type {frame.msg_type}"

    heard = [frame for frame in trace.from_controller() if _is_unknown(trace, frame)]
    unknown = [frame for frame in heard if frame.comm_type != CommType.REPLY]
    return each(unknown, rule, "the controller sent nothing unknown")


def _asked(trace: ClientTrace) -> list[TracedFrame]:
    return [
        frame
        for frame in trace.frames
        if not frame.from_client and frame.is_whole_header and frame.comm_type == CommType.REQUEST
    ]


def _answered(trace: ClientTrace) -> list[TracedFrame]:
    return [request for request in _asked(trace) if request.number in trace.replies]


def _judgeable_requests(trace: ClientTrace) -> list[TracedFrame]:
    """Return the controller's sound requests that were answered, or had time to be."""

    def had_time(request: TracedFrame) -> bool:
        closed = request.link.closed
        end = trace.ended if closed is None else closed
        return end - request.time >= ANSWER_WITHIN_NS

    sound = [request for request in _asked(trace) if request.message is not None]
    return [request for request in sound if request.number in trace.replies or had_time(request)]


def _replies_of_client(trace: ClientTrace) -> list[TracedFrame]:
    return [f for f in trace.sent if f.is_whole_header and f.comm_type == CommType.REPLY]


def _is_unknown(trace: ClientTrace, frame: TracedFrame) -> bool:
    """Return True if no dialect has this type and no vendor's or free range holds it."""
    known = {cls.PLACE.msg_type for cls in trace.setup.dialect.messages}
    return frame.msg_type not in known and not 65_000 <= frame.msg_type <= 65_535


PATIENCE_NS = 5_000_000_000
"""A client that waits longer for the answer to a point waits for ever."""


@client_check("RC12")
def minds_the_type(seen: Observed) -> CheckFinding:
    """Look at what follows a reply of another type."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        following = dict(trajectory.pairs)
        for step in trajectory.advancing:
            if step.answer is not PointAnswer.WRONG_TYPE:
                continue
            on = following.get(step)
            problem: Problem | None = None
            if on is not None and on.frame.msg_type == MsgType.JOINT_TRAJ_PT:
                name = "industrial_robot_client: any frame counts as the answer"
                problem = Habit(name, f"{on.where} the next point follows")
            elif on is not None:
                problem = f"{on.where} the next point follows"
            tally.look(step, problem)
    return tally.finding("no point was answered with another type")


@client_check("RC13")
def minds_the_code(seen: Observed) -> CheckFinding:
    """Look at what follows a reply with reply code 0."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        for step, on in zip(trajectory.steps, [*trajectory.steps[1:], None], strict=True):
            if step.answer is not PointAnswer.UNREADABLE:
                continue
            problem: Problem | None = None
            if on is not None and on.repeats is step:
                name = "industrial_robot_client: the same point again after an invalid reply"
                problem = Habit(name, f"sequence {on.sequence} again")
            elif on is not None:
                problem = f"sequence {on.sequence} follows as if it had been taken"
            tally.look(step, problem)
    return tally.finding("no point was answered with reply code 0")


@client_check("MC17")
def refusal_ends(seen: Observed) -> CheckFinding:
    """Look at what follows a refused point."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        following = dict(pairwise(trajectory.steps))
        for step in trajectory.steps:
            if step.answer is not PointAnswer.REFUSED:
                continue
            on = following.get(step)
            problem: Problem | None = None
            if on is not None and on.frame.msg_type == MsgType.JOINT_TRAJ_PT:
                name = "industrial_robot_client: FAILURE is ignored, the next point follows"
                problem = Habit(name, f"sequence {on.sequence} after {step.sequence} was refused")
            elif on is not None:
                problem = f"sequence {on.sequence} follows although {step.sequence} was refused"
            tally.look(step, problem)
    return tally.finding("no point was refused")


@client_check("MC18")
def reacts_to_silence(seen: Observed) -> CheckFinding:
    """Look at what the client does within 5 s of a point that is never answered."""
    frames = [*seen.motions.stops, *(step.frame for step in seen.motions.steps)]
    moves = sorted(frames, key=lambda frame: frame.number)
    tally = Tally()
    for step in seen.motions.steps:
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
            tally.look(step, Habit(name, f"nothing for {waited / 1e9:.1f} s"))
        elif gave_up:
            tally.look(step, None)
    return tally.finding("every point was answered soon, or the link was lost before")
