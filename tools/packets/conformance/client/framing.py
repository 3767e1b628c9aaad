"""Checks of a client's frames: lengths, bounds and layouts."""

from __future__ import annotations

from openpendant.simplemsg import (
    MAX_REFERENCE_FRAME,
    CommType,
    Ping,
    ReplyCode,
)

from ..findings import Finding, not_applicable
from .check import ClientCheck, Habit, Observed, Problem, Tally, client_check, each
from .setup import IN_PIECES, WRITES_OBSERVED, Purpose
from .trace import HEADER, LONGEST_PLAUSIBLE, PREFIX, Frame, Link

NOTHING_SENT = "the client sent nothing"

MAX_PENDANT_FRAME = 65_532
"""Largest frame on the pendant port, as the hello announces it, bytes."""

REP_PING_BODY = 40
"""REP-I0006 gives PING ten integers that industrial_core's does not have, bytes."""


@client_check(
    "FC01",
    "each frame has exactly the bytes that its length declares",
    "REP-I0006, packet structure: the prefix counts header and body, not itself",
)
def declared_length(seen: Observed) -> Finding:
    """Compare each length with the bytes that came."""

    def rule(frame: Frame) -> Problem | None:
        if not frame.is_frame and _is_cut_short(frame):
            return None  # FC03 judges a stream that ended inside a frame
        if frame.is_frame and frame.length == len(frame.data) - PREFIX:
            return None
        return f"length {frame.length} before {max(0, len(frame.data) - PREFIX)} bytes"

    return each(seen.trace.sent, rule, NOTHING_SENT)


@client_check(
    "FC02",
    "each frame has at least a whole header",
    "REP-I0006: the header is 12 bytes; industrial_core simple_message.cpp rejects less",
)
def whole_header(seen: Observed) -> Finding:
    """Look for frames shorter than a header."""

    def rule(frame: Frame) -> Problem | None:
        if len(frame.data) >= HEADER or frame.length >= HEADER - PREFIX:
            return None
        return f"length {frame.length} is less than the header's {HEADER - PREFIX}"

    return each(seen.trace.sent, rule, NOTHING_SENT)


@client_check(
    "FC03",
    "no connection ends inside a frame",
    "REP-I0006: a stream without marks cannot be resumed inside a frame",
)
def whole_last_frame(seen: Observed) -> Finding:
    """Look at the last bytes of each connection."""

    def rule(frame: Frame) -> Problem | None:
        if frame.is_frame or not _is_cut_short(frame):
            return None
        return f"{len(frame.data)} bytes of a frame of {frame.length + PREFIX}"

    talked = [link for link in seen.trace.links.values() if _client_talked(link)]
    lasts = [[frame for frame in link.frames if frame.from_client][-1] for link in talked]
    return each(lasts, rule, NOTHING_SENT)


@client_check(
    "FC04",
    "no frame is longer than the receiver takes",
    "industrial_core simple_socket.h: sends of 1,024 bytes and more are refused, and a receiver of"
    " that library would be overrun; on the pendant port the announced 65,532",
)
def bounded(seen: Observed) -> Finding:
    """Compare each frame with the bound of its port."""

    def rule(frame: Frame) -> Problem | None:
        is_pendant = frame.link.purpose is Purpose.PENDANT
        most = MAX_PENDANT_FRAME if is_pendant else MAX_REFERENCE_FRAME
        size = max(len(frame.data), frame.length + PREFIX)
        return f"{size} bytes, at most {most}" if size > most else None

    return each(seen.trace.sent, rule, NOTHING_SENT)


@client_check(
    "FC05",
    "each body has the layout of its message type",
    "REP-I0006, message bodies; industrial_core's load routines",
)
def layout(seen: Observed) -> Finding:
    """Look for bodies that cannot be read."""

    def rule(frame: Frame) -> Problem | None:
        if isinstance(frame.message, Ping) and len(frame.data) > HEADER:
            size = len(frame.data) - HEADER
            if size == REP_PING_BODY:
                return Habit("PING with REP-I0006's 40-byte body", f"{size} bytes of body")
            return f"PING with a body of {size} bytes"
        return frame.fault or None

    sound = (frame for frame in seen.trace.sent if _has_valid_header(frame))
    return each(sound, rule, NOTHING_SENT)


@client_check(
    "FC06",
    "each frame arrives in one piece",
    "motoman_driver MotionServer.c: a frame that comes in two reads is answered INVALID/3001 and"
    " thrown away",
)
def one_write(seen: Observed) -> Finding:
    """Look at how frames reached a live judge; a recording does not say."""
    texts = [event for event in seen.trace.events if event.text in (IN_PIECES, WRITES_OBSERVED)]
    if not texts:
        return not_applicable("only a live run sees how the bytes arrived")
    if not seen.trace.sent:
        return not_applicable(NOTHING_SENT)
    tally = Tally()
    pieces = [event for event in texts if event.text == IN_PIECES]
    for frame in seen.trace.sent:
        cut = any(
            (event.port, event.connection) == (frame.link.port, frame.link.number)
            and event.time == frame.time
            for event in pieces
        )
        tally.look(frame, "the frame came in pieces" if cut else None)
    return tally.finding(NOTHING_SENT)


def _is_cut_short(frame: Frame) -> bool:
    """Tell whether bytes are the beginning of a frame; a prefix of two bytes is one, too."""
    if len(frame.data) < PREFIX:
        return True
    return len(frame.data) - PREFIX < frame.length <= LONGEST_PLAUSIBLE


def _client_talked(link: Link) -> bool:
    return any(frame.from_client for frame in link.frames)


def _has_valid_header(frame: Frame) -> bool:
    """Tell whether only the body is left to judge; headers have checks of their own."""
    is_reply = frame.comm_type == CommType.REPLY
    return (
        frame.is_whole_header
        and frame.length == len(frame.data) - PREFIX
        and frame.msg_type != 0
        and frame.comm_type != CommType.INVALID
        and is_reply == (frame.reply_code != ReplyCode.UNUSED)
    )


CHECKS: tuple[ClientCheck, ...] = (
    declared_length,
    whole_header,
    whole_last_frame,
    bounded,
    layout,
    one_write,
)
