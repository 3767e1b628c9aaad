"""The simple-message connections in a packet capture, as entries of a trace.

Owns which connections there are, which end is the server, and how they are numbered. Segments come
from `capture_files`, their order is `tcp_streams`', frames are cut by a searching `Splitter`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

from openpendant.simplemsg.framing import HEADER_SIZE, Cut, Mode, Splitter

from ..trace import LONGEST_TRACE, Entry, Event, Packet, TraceDirection
from .capture_files import CapturedPacket, CaptureFault
from .tcp_streams import (
    LINK_TYPES,
    Flag,
    MissingBytes,
    NoSegment,
    Piece,
    StreamReassembly,
    TcpEndpoint,
    TcpSegment,
    segment_of,
)

_LONGEST_TRACE_NS = LONGEST_TRACE * 1_000_000_000

KNOWN_PORTS = frozenset({11000, 11002, 11010, 12000, 12002, 50240, 50241, 50242})
"""Ports that servers of simple message listen on: ROS-I, ours, the emulator's, Motoman's."""

MAX_CONNECTIONS = 256
"""Most connections followed at once; the one that was silent longest is forgotten, aloud."""

_MAX_STRANGE_FRAMES = 1_000
_SEQUENCES = 1 << 32


def entries_of(frames: Iterable[CapturedPacket]) -> Iterator[Entry]:
    """Yield what travelled on the simple-message connections of a capture.

    The first frame of the capture is at time 0. A packet has the time of the segment that completed
    it. What could not be read is told as events: lost segments, strange interfaces, fragments.

    Raises:
        CaptureFault: the capture breaks off (what came before was given), or none of its frames
            has a link type that is read here.
    """
    table = _Connections()
    unread: Counter[str] = Counter()
    fault: CaptureFault | None = None
    now = 0
    try:
        for segment in _segments(frames, unread):
            now = segment.time
            yield from table.take(segment)
    except CaptureFault as broken_off:
        fault = broken_off
    yield from table.end(now)
    if unread:
        told = ", ".join(f"{count} {reason}" for reason, count in unread.items())
        yield Event(now, f"frames not read: {told}")
    if fault is not None:
        raise fault


def _segments(frames: Iterable[CapturedPacket], unread: Counter[str]) -> Iterator[TcpSegment]:
    origin: int | None = None
    readable, strange = False, 0
    frame: CapturedPacket | None = None
    for frame in frames:
        origin = frame.time if origin is None else origin
        time = frame.time - origin
        if abs(time) > _LONGEST_TRACE_NS:
            raise CaptureFault(frame.offset, f"a time {time / 1e9:.0f} s from that of the first")
        if frame.link_type not in LINK_TYPES:
            strange += 1
            unread[f"of link type {frame.link_type}"] += 1
            if not readable and strange == _MAX_STRANGE_FRAMES:
                break
            continue
        readable = True
        try:
            segment = segment_of(frame.link_type, frame.data, time)
        except NoSegment as reason:
            unread[str(reason)] += 1
            continue
        if segment is not None:
            yield segment
    if frame is not None and not readable:
        unread.clear()
        known = "Ethernet, Linux cooked, raw IP or loopback"
        raise CaptureFault(frame.offset, f"link type {frame.link_type} is not {known}")


class _Side:
    """Stream of one end of a connection.

    Attributes:
        found_frames: False until the first frame came; before it nothing says that this is simple
            message at all.
        ignored: the first bytes of what came before it, at most 16.
    """

    def __init__(self, name: str, direction: TraceDirection) -> None:
        self.name = name
        self.direction = direction
        self.stream = StreamReassembly()
        self.frames = Splitter(Mode.SEARCHING, in_step=False)
        self.found_frames = False
        self.ignored = b""
        self.told_ignored = False
        self.told_end = False

    def after_ignored(self, cuts: list[Cut]) -> list[Cut]:
        """Return what may be told: nothing that comes before the first frame."""
        told: list[Cut] = []
        for cut in cuts:
            self.found_frames |= cut.is_frame
            if self.found_frames:
                told.append(cut)
            else:
                self.ignored = self.ignored or cut.data[:HEADER_SIZE]
        return told


class _Connection:
    """One TCP connection from its first segment to its last.

    On a port that is not known nothing is told of a connection before its first frame: most of a
    capture may be other traffic.

    Attributes:
        closed: true when both ends said their last; later segments are ignored.
        carried: whether it carried any bytes.
    """

    def __init__(self, client: TcpEndpoint, server: TcpEndpoint, number: int) -> None:
        self.about = f"{client} -> {server}"
        self.closed = False
        self.told = False
        self.carried = False
        self._server = server
        self._number = number
        self._saw_begin = False
        self._client_side = _Side("client", TraceDirection.TO_SERVER)
        self._server_side = _Side("server", TraceDirection.TO_CLIENT)

    def is_reopened_by(self, segment: TcpSegment) -> bool:
        """Return True if a SYN opens another connection between the same ports."""
        side, _ = self._sides(segment)
        begun = side.stream.first
        return begun is not None and begun != _after_syn(segment)

    def take(self, segment: TcpSegment) -> Iterator[Entry]:
        """Take the next segment of either end."""
        if self.closed:
            return
        now = segment.time
        side, peer = self._sides(segment)
        if segment.flags & Flag.RST:
            yield from self.end(now)
            yield from self._tell(now, f"{side.name}-reset-connection")
            return
        sequence = self._begin_stream(side, segment)
        if segment.flags & Flag.ACK:
            peer.stream.acknowledge(segment.acknowledged)
        greeted = bool(segment.flags & Flag.SYN and segment.flags & Flag.ACK)
        if self._server.port in KNOWN_PORTS and (greeted or segment.data):
            yield from self._introduce(now)
        if segment.data:
            self.carried = True
            yield from self._pieces(side, side.stream.take(sequence, segment.data, now), now)
        if segment.flags & Flag.FIN:
            side.stream.finish((sequence + len(segment.data)) % _SEQUENCES)
        yield from self._after_each(now)

    def end(self, now: int) -> Iterator[Entry]:
        """Yield what is left; nothing more will come."""
        self.closed = True
        for side in (self._client_side, self._server_side):
            yield from self._pieces(side, side.stream.flush(), now)
            yield from self._cuts(side, side.frames.finish(), now)

    def _begin_stream(self, side: _Side, segment: TcpSegment) -> int:
        """Return the number of a segment's first byte; starts the stream of its sender."""
        opens = bool(segment.flags & Flag.SYN)
        sequence = _after_syn(segment) if opens else segment.sequence
        self._saw_begin |= opens
        if side.stream.first is None:
            side.stream.begin(sequence)
            side.frames = Splitter(Mode.SEARCHING, in_step=opens)
        return sequence

    def _after_each(self, now: int) -> Iterator[Entry]:
        for side in (self._client_side, self._server_side):
            yield from self._pieces(side, side.stream.wait(now), now)
            if side.stream.ended and not side.told_end:
                side.told_end = True
                yield from self._cuts(side, side.frames.finish(), now)
                yield from self._tell(now, f"{side.name}-closed-connection")
        self.closed = self._client_side.told_end and self._server_side.told_end

    def _sides(self, segment: TcpSegment) -> tuple[_Side, _Side]:
        """Return the side that sent a segment, then the other."""
        if segment.destination == self._server:
            return self._client_side, self._server_side
        return self._server_side, self._client_side

    def _pieces(self, side: _Side, pieces: list[Piece], now: int) -> Iterator[Entry]:
        for piece in pieces:
            if isinstance(piece, MissingBytes):
                yield from self._cuts(side, side.frames.finish(), now)
                yield from self._tell(now, f"{piece.size} bytes of the {side.name} are missing")
            else:
                yield from self._cuts(side, side.frames.feed(piece), now)

    def _cuts(self, side: _Side, cuts: list[Cut], now: int) -> Iterator[Entry]:
        cuts = side.after_ignored(cuts)
        if cuts:
            yield from self._introduce(now)
        if side.ignored and self.told and not side.told_ignored:
            side.told_ignored = True
            yield from self._tell(
                now, f"what the {side.name} sent begins with no frame: {side.ignored.hex()}"
            )
        port, number = self._server.port, self._number
        for cut in cuts:
            yield Packet(now, side.direction, cut.data, port, number, is_frame=cut.is_frame)

    def _introduce(self, now: int) -> Iterator[Entry]:
        if not self.told:
            self.told = True
            how = "client-connected" if self._saw_begin else "found-connected"
            yield from self._tell(now, f"{how} {self.about}")

    def _tell(self, now: int, text: str) -> Iterator[Entry]:
        if self.told:
            yield Event(now, text, self._server.port, self._number)


class _Connections:
    """All connections of a capture."""

    def __init__(self) -> None:
        self._open: dict[frozenset[TcpEndpoint], _Connection] = {}
        self._numbers: Counter[int] = Counter()
        self._silent = 0
        self._silent_example = ""

    def take(self, segment: TcpSegment) -> Iterator[Entry]:
        """Take the next TCP segment of the capture."""
        ends = frozenset((segment.source, segment.destination))
        connection = self._open.pop(ends, None)
        opens = bool(segment.flags & Flag.SYN)
        if connection is not None and opens and connection.is_reopened_by(segment):
            yield from self._drop(connection, segment.time)
            connection = None
        if connection is None:
            if not opens and not segment.data:
                return
            connection = self._found(segment)
        self._open[ends] = connection  # the last in the table is the one last received from
        yield from connection.take(segment)
        if len(self._open) > MAX_CONNECTIONS:
            oldest = self._open.pop(next(iter(self._open)))
            if oldest.told and not oldest.closed:
                text = f"forgotten, more than {MAX_CONNECTIONS} connections: {oldest.about}"
                yield Event(segment.time, text)
            yield from self._drop(oldest, segment.time)

    def end(self, now: int) -> Iterator[Entry]:
        """Yield what is left at the end of the capture."""
        for connection in self._open.values():
            yield from self._drop(connection, now)
        if self._silent:
            text = f"connections without any frame: {self._silent}, e.g. {self._silent_example}"
            yield Event(now, text)

    def _drop(self, connection: _Connection, now: int) -> Iterator[Entry]:
        if not connection.closed:
            yield from connection.end(now)
        if connection.carried and not connection.told:
            self._silent += 1
            self._silent_example = connection.about

    def _found(self, segment: TcpSegment) -> _Connection:
        client, server = segment.source, segment.destination
        if _sender_is_server(segment):
            client, server = server, client
        self._numbers[server.port] += 1
        return _Connection(client, server, self._numbers[server.port])


def _sender_is_server(segment: TcpSegment) -> bool:
    """Return True if a segment's sender is the server.

    The server is the end that a SYN calls, else the one with a known port, else the lower port.
    """
    if segment.flags & Flag.SYN:
        return bool(segment.flags & Flag.ACK)
    source, destination = segment.source.port, segment.destination.port
    if (source in KNOWN_PORTS) != (destination in KNOWN_PORTS):
        return source in KNOWN_PORTS
    return source < destination


def _after_syn(segment: TcpSegment) -> int:
    return (segment.sequence + 1) % _SEQUENCES
