"""One side of a recorded connection, played again: what to send when, and what should come back.

Pure: frames and times come in, frames and differences come out. Knows no sockets.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum

from openpendant.simplemsg import CommType, codec_for
from openpendant.simplemsg.codes import ReplyCode
from openpendant.simplemsg.framing import Cut, Frame

from ..console import PacketToolError
from ..reading.reader import ALL
from ..trace import Entry, Event, Packet, TraceDirection

MAX_BYTES = 256 * 1024 * 1024
"""Largest recording that is played, bytes of packets; it is kept in memory."""


class PlayedSide(Enum):
    """Side of the recording that is played."""

    CLIENT = "client"
    SERVER = "server"

    @property
    def sends(self) -> TraceDirection:
        """The direction of what is sent."""
        return TraceDirection.TO_SERVER if self is PlayedSide.CLIENT else TraceDirection.TO_CLIENT


@dataclass(frozen=True, slots=True)
class PlayedPacket:
    """A packet to send.

    Attributes:
        at: when it was sent in the recording [ns].
        after: how many packets that count had come back by then.
        waits: even at recorded times it is not sent before those have come: a reply never
            precedes its request.
    """

    data: bytes
    at: int
    after: int
    waits: bool


@dataclass(slots=True)
class RecordedSession:
    """One recorded connection as the part to play sees it; times in ns.

    Attributes:
        port: TCP port of the recorded server.
        number: of the connection on that port.
        ended: when its last packet or event was.
        expected: what should come back and counts.
    """

    port: int
    number: int
    opened: int
    ended: int = 0
    steps: list[PlayedPacket] = field(default_factory=list)
    expected: list[Cut] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Pace:
    """Pace of the playback.

    Attributes:
        speed: factor on the recorded times; None sends as fast as replies come.
        exact: compare whole packets, topics too; otherwise type, communication and reply code.
    """

    speed: float | None = 1.0
    exact: bool = False


def sessions_of(
    entries: Iterable[Entry], part: PlayedSide, *, exact: bool
) -> list[RecordedSession]:
    """Return the connections of a recording by their starts; PacketToolError if too large."""
    sessions: dict[tuple[int, int], RecordedSession] = {}
    size = 0
    for entry in entries:
        if isinstance(entry, Event) and not entry.connection:
            continue
        key = (entry.port, entry.connection)
        session = sessions.setdefault(key, RecordedSession(*key, opened=entry.time))
        session.ended = entry.time
        if isinstance(entry, Packet):
            size += len(entry.data)
            if size > MAX_BYTES:
                raise PacketToolError(f"the recording has more than {MAX_BYTES} bytes of packets")
            _add(session, entry, part, exact=exact)
    return list(sessions.values())


def _add(session: RecordedSession, packet: Packet, part: PlayedSide, *, exact: bool) -> None:
    piece = Cut(packet.data, packet.is_frame and len(packet.data) >= 16)
    if packet.direction is part.sends:
        waits = piece.is_frame and Frame(piece.data).comm_type == CommType.REPLY
        after = len(session.expected)
        session.steps.append(PlayedPacket(packet.data, packet.time, after, waits))
    elif counts(piece, part, session.expected, exact=exact):
        session.expected.append(piece)


def counts(piece: Cut, part: PlayedSide, before: list[Cut], *, exact: bool) -> bool:
    """Return True if a packet is compared; a server's topics and stray bytes are not."""
    if not piece.is_frame:
        return not before or before[-1].is_frame
    if exact or part is PlayedSide.SERVER:
        return True
    return Frame(piece.data).comm_type != CommType.TOPIC


class Player:
    """Plays one session against a peer."""

    def __init__(self, session: RecordedSession, part: PlayedSide, pace: Pace) -> None:
        self.sent = 0
        self.differences = 0
        self.first = ""
        self._session = session
        self._part = part
        self._pace = pace
        self._received: list[Cut] = []
        self._began = 0

    @property
    def received(self) -> int:
        """Packets that came and count."""
        return len(self._received)

    @property
    def missing(self) -> int:
        """Packets that should still come."""
        return max(0, len(self._session.expected) - self.received)

    @property
    def all_sent(self) -> bool:
        """True once everything was sent."""
        return self.sent == len(self._session.steps)

    def start(self, now: int) -> None:
        """Start; recorded times count from now."""
        self._began = now

    def _time_of(self, recorded: int) -> int:
        if self._pace.speed is None:
            return self._began
        return self._began + round((recorded - self._session.opened) / self._pace.speed)

    @property
    def _next(self) -> PlayedPacket | None:
        steps = self._session.steps
        return steps[self.sent] if self.sent < len(steps) else None

    def _is_held(self, step: PlayedPacket) -> bool:
        """Return True if a packet waits for the peer."""
        return (self._pace.speed is None or step.waits) and self.received < step.after

    def due(self, now: int) -> list[bytes]:
        """Return what is to be sent now."""
        packets = []
        while (step := self._next) is not None:
            if self._is_held(step) or self._time_of(step.at) > now:
                break
            packets.append(step.data)
            self.sent += 1
        return packets

    def next_due(self, now: int) -> int | None:
        """Return the time of the next step that needs no peer, None while the peer must act."""
        step = self._next
        if step is not None:
            return None if self._is_held(step) else self._time_of(step.at)
        end = self._time_of(self._session.ended)
        return end if end > now else None

    def is_over(self, now: int) -> bool:
        """Return True if everything was sent and received, and its time is over."""
        return self.all_sent and not self.missing and self._time_of(self._session.ended) <= now

    def take(self, piece: Cut) -> bool:
        """Compare what came with the recording; return whether it counts."""
        if not counts(piece, self._part, self._received, exact=self._pace.exact):
            return False
        position = len(self._received)
        self._received.append(piece)
        expected = self._session.expected
        wanted = expected[position] if position < len(expected) else None
        if wanted is None or not self._is_same(wanted, piece):
            self.differ(
                f"packet {position + 1} should be {_words(wanted)}, and is {_words(piece)}"
                + (_first_byte(wanted, piece) if self._pace.exact else "")
            )
        return True

    def differ(self, what: str) -> None:
        """Count a difference and keep the first."""
        self.differences += 1
        if not self.first:
            self.first = f"port {self._session.port}, connection {self._session.number}: {what}"

    def _is_same(self, wanted: Cut, piece: Cut) -> bool:
        if wanted.is_frame is not piece.is_frame:
            return False
        if self._pace.exact or not piece.is_frame:
            return wanted.data == piece.data or not piece.is_frame
        one, other = Frame(wanted.data), Frame(piece.data)
        return (one.msg_type, one.comm_type, one.reply_code) == (
            other.msg_type,
            other.comm_type,
            other.reply_code,
        )


_CODES = {ReplyCode.SUCCESS: " success", ReplyCode.FAILURE: " failure"}


def _words(piece: Cut | None) -> str:
    if piece is None:
        return "none"
    if not piece.is_frame:
        return f"{len(piece.data)} bytes that are no frame"
    header = Frame(piece.data)
    name = codec_for(ALL, header.byte_order).name_of(header.msg_type, header.comm_type)
    known = {int(member): member.name.lower() for member in CommType}
    comm = known.get(header.comm_type, f"comm {header.comm_type}")
    code = _CODES.get(ReplyCode(header.reply_code), "") if header.reply_code in _CODES else ""
    return f"a {comm}{code} of type {header.msg_type} ({name})"


def _first_byte(wanted: Cut | None, piece: Cut) -> str:
    if wanted is None:
        return ""
    pairs = zip(wanted.data, piece.data, strict=False)
    shorter = min(len(wanted.data), len(piece.data))
    at = next((index for index, (one, other) in enumerate(pairs) if one != other), shorter)
    return f"; byte {at} differs, of {len(wanted.data)} and {len(piece.data)}"
