"""Checks of a client's frames: lengths, bounds and layouts."""

from __future__ import annotations

from openpendant.simplemsg import (
    MAX_REFERENCE_FRAME,
    CommType,
    Ping,
    ReplyCode,
)
from openpendant.simplemsg.framing import (
    HEADER_SIZE,
    LEAST_LENGTH,
    MAX_DETECTABLE_LENGTH,
    PREFIX_SIZE,
)

from ..check import CheckFinding, not_applicable
from .check import Habit, Observed, Problem, Tally, client_check, each
from .setup import IN_PIECES, WRITES_OBSERVED, Purpose
from .trace import TracedFrame, TracedLink

NOTHING_SENT = "the client sent nothing"

MAX_PENDANT_FRAME = 65_532
"""Largest frame on the pendant port, as the hello announces it, bytes."""

REP_PING_BODY = 40
"""REP-I0006 gives PING ten integers that industrial_core's does not have, bytes."""


@client_check("FC01")
def declared_length(seen: Observed) -> CheckFinding:
    """Compare each length with the bytes that came."""

    def rule(frame: TracedFrame) -> Problem | None:
        if not frame.is_frame and _is_cut_short(frame):
            return None  # FC03 judges a stream that ended inside a frame
        if frame.is_frame and frame.length == len(frame.data) - PREFIX_SIZE:
            return None
        return f"length {frame.length} before {max(0, len(frame.data) - PREFIX_SIZE)} bytes"

    return each(seen.trace.sent, rule, NOTHING_SENT)


@client_check("FC02")
def whole_header(seen: Observed) -> CheckFinding:
    """Look for frames shorter than a header."""

    def rule(frame: TracedFrame) -> Problem | None:
        if len(frame.data) >= HEADER_SIZE or frame.length >= LEAST_LENGTH:
            return None
        return f"length {frame.length} is less than the header's {LEAST_LENGTH}"

    return each(seen.trace.sent, rule, NOTHING_SENT)


@client_check("FC03")
def whole_last_frame(seen: Observed) -> CheckFinding:
    """Look at the last bytes of each connection."""

    def rule(frame: TracedFrame) -> Problem | None:
        if frame.is_frame or not _is_cut_short(frame):
            return None
        return f"{len(frame.data)} bytes of a frame of {frame.length + PREFIX_SIZE}"

    talked = [link for link in seen.trace.links.values() if _client_talked(link)]
    lasts = [[frame for frame in link.frames if frame.from_client][-1] for link in talked]
    return each(lasts, rule, NOTHING_SENT)


@client_check("FC04")
def bounded(seen: Observed) -> CheckFinding:
    """Compare each frame with the bound of its port."""

    def rule(frame: TracedFrame) -> Problem | None:
        is_pendant = frame.link.purpose is Purpose.PENDANT
        most = MAX_PENDANT_FRAME if is_pendant else MAX_REFERENCE_FRAME
        size = max(len(frame.data), frame.length + PREFIX_SIZE)
        return f"{size} bytes, at most {most}" if size > most else None

    return each(seen.trace.sent, rule, NOTHING_SENT)


@client_check("FC05")
def layout(seen: Observed) -> CheckFinding:
    """Look for bodies that cannot be read."""

    def rule(frame: TracedFrame) -> Problem | None:
        if isinstance(frame.message, Ping) and len(frame.data) > HEADER_SIZE:
            size = len(frame.data) - HEADER_SIZE
            if size == REP_PING_BODY:
                return Habit("PING with REP-I0006's 40-byte body", f"{size} bytes of body")
            return f"PING with a body of {size} bytes"
        return frame.fault or None

    sound = (frame for frame in seen.trace.sent if _has_valid_header(frame))
    return each(sound, rule, NOTHING_SENT)


@client_check("FC06")
def one_write(seen: Observed) -> CheckFinding:
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


def _is_cut_short(frame: TracedFrame) -> bool:
    """Return True if bytes are the beginning of a frame; a prefix of two bytes is one, too."""
    if len(frame.data) < PREFIX_SIZE:
        return True
    return len(frame.data) - PREFIX_SIZE < frame.length <= MAX_DETECTABLE_LENGTH


def _client_talked(link: TracedLink) -> bool:
    return any(frame.from_client for frame in link.frames)


def _has_valid_header(frame: TracedFrame) -> bool:
    """Return True if only the body is left to judge; headers have checks of their own."""
    is_reply = frame.comm_type == CommType.REPLY
    return (
        frame.is_whole_header
        and frame.length == len(frame.data) - PREFIX_SIZE
        and frame.msg_type != 0
        and frame.comm_type != CommType.INVALID
        and is_reply == (frame.reply_code != ReplyCode.UNUSED)
    )
