"""TCP streams out of captured frames: the segment in each frame, and one direction put in order.

Owns link types, Ethernet with VLAN tags, IPv4, IPv6 with its extension headers and the TCP header;
then sequence numbers: retransmissions, segments out of order, overlaps, and bytes that the capture
does not have. Knows nothing of connections or of what the bytes say.
"""

from __future__ import annotations

import heapq
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntFlag
from ipaddress import IPv4Address, IPv6Address

_IPV4, _IPV6 = 0x0800, 0x86DD
_VLAN_TAGS = {0x8100, 0x88A8, 0x9100}
_TCP = 6
_HOP_BY_HOP, _ROUTING, _FRAGMENT, _AUTHENTICATION = 0, 43, 44, 51
_SKIPPABLE = {_HOP_BY_HOP, _ROUTING, 60, 135, 139, 140}


class Flag(IntFlag):
    """Flags of a TCP header that matter here (RFC 9293)."""

    FIN = 1
    SYN = 2
    RST = 4
    ACK = 16


@dataclass(frozen=True, slots=True)
class TcpEndpoint:
    """One end of a TCP connection.

    Attributes:
        address: IPv4 or IPv6 address, as its 4 or 16 bytes.
    """

    address: bytes
    port: int

    def __str__(self) -> str:
        if len(self.address) == 4:
            return f"{IPv4Address(self.address)}:{self.port}"
        return f"[{IPv6Address(self.address)}]:{self.port}"


@dataclass(frozen=True, slots=True)
class TcpSegment:
    """One TCP segment.

    Attributes:
        time: when it was captured [ns].
        sequence: number of its first byte, modulo 2**32.
        acknowledged: number of the next byte that the sender expects; means nothing without ACK.
        data: its bytes, as far as they were captured.
    """

    time: int
    source: TcpEndpoint
    destination: TcpEndpoint
    sequence: int
    acknowledged: int
    flags: int
    data: bytes


class NoSegment(Exception):
    """A frame holds no TCP segment that can be read; the text says why."""


def segment_of(link_type: int, frame: bytes, time: int) -> TcpSegment | None:
    """Return the TCP segment in a frame captured at a time [ns], None for other traffic.

    Raises:
        NoSegment: it is cut off inside a header, or is one fragment of an IP packet.
    """
    try:
        found = LINK_TYPES[link_type](frame)
        return None if found is None else _tcp(found, time)
    except (struct.error, IndexError):
        raise NoSegment("cut off inside a header") from None


@dataclass(frozen=True, slots=True)
class _Transport:
    """TCP payload of an IP packet."""

    source: bytes
    destination: bytes
    payload: bytes


def _of_type(ether_type: int, frame: bytes, at: int) -> _Transport | None:
    """Take the packet at an offset, whose Ethernet type stands before it."""
    while ether_type in _VLAN_TAGS:
        (ether_type,) = struct.unpack_from(">H", frame, at + 2)
        at += 4
    if ether_type == _IPV4:
        return _ipv4(frame[at:])
    if ether_type == _IPV6:
        return _ipv6(frame[at:])
    return None


def _ethernet(frame: bytes) -> _Transport | None:
    return _of_type(struct.unpack_from(">H", frame, 12)[0], frame, 14)


def _linux_cooked(frame: bytes) -> _Transport | None:
    return _of_type(struct.unpack_from(">H", frame, 14)[0], frame, 16)


def _linux_cooked_2(frame: bytes) -> _Transport | None:
    return _of_type(struct.unpack_from(">H", frame, 0)[0], frame, 20)


def _loopback(frame: bytes) -> _Transport | None:
    # Four bytes of address family, whose numbers and order differ from system to system; the
    # packet itself says which it is.
    return _raw(frame[4:])


def _raw(packet: bytes) -> _Transport | None:
    version = packet[0] >> 4
    if version == 4:
        return _ipv4(packet)
    return _ipv6(packet) if version == 6 else None


LINK_TYPES: Mapping[int, Callable[[bytes], _Transport | None]] = {
    0: _loopback,
    1: _ethernet,
    12: _raw,
    14: _raw,
    101: _raw,
    108: _loopback,
    113: _linux_cooked,
    228: _raw,
    229: _raw,
    276: _linux_cooked_2,
}
"""Readers by link type: loopback, Ethernet, raw IP, Linux cooked 1 and 2."""


def _ipv4(packet: bytes) -> _Transport | None:
    total, fragment, protocol = struct.unpack_from(">2xH2xHxB", packet)
    start = (packet[0] & 15) * 4
    if protocol != _TCP:
        return None
    if fragment & 0x3FFF:
        raise NoSegment("a fragment of an IP packet")
    # Ethernet pads short packets; a total of 0 is what segmentation in the network card leaves.
    end = total if total >= start else len(packet)
    return _Transport(packet[12:16], packet[16:20], packet[start:end])


def _ipv6(packet: bytes) -> _Transport | None:
    size, following = struct.unpack_from(">4xHB", packet)
    source, destination = packet[8:24], packet[24:40]
    packet = packet[: 40 + size] if size else packet
    at = 40
    while following != _TCP:
        if following == _FRAGMENT:
            if struct.unpack_from(">H", packet, at + 2)[0] & 0xFFF9:
                raise NoSegment("a fragment of an IP packet")
            length = 8
        elif following == _AUTHENTICATION:
            length = (packet[at + 1] + 2) * 4
        elif following in _SKIPPABLE:
            length = (packet[at + 1] + 1) * 8
        else:
            return None
        following = packet[at]
        at += length
    return _Transport(source, destination, packet[at:])


def _tcp(found: _Transport, time: int) -> TcpSegment:
    source, destination, sequence, acknowledged, offset, flags = struct.unpack_from(
        ">HHIIBB", found.payload
    )
    start = (offset >> 4) * 4
    if start < 20 or start > len(found.payload):
        raise NoSegment("cut off inside a header")
    return TcpSegment(
        time,
        TcpEndpoint(found.source, source),
        TcpEndpoint(found.destination, destination),
        sequence,
        acknowledged,
        flags,
        found.payload[start:],
    )


MAX_WAITING_BYTES = 262_144
"""Most bytes kept that came before their predecessors."""

MAX_WAITING_SEGMENTS = 1_024
"""Most segments kept that came before their predecessors."""

MAX_WAIT = 5_000_000_000
"""Longest time that they are kept [ns]; a sender repeats a lost segment within seconds."""

PATIENCE = 3
"""Segments of the connection to wait for when the receiver has acknowledged what is missing here.

It got those bytes, so no repetition will come; but a capture may note a segment late.
"""

_WRAP = 1 << 32


@dataclass(frozen=True, slots=True)
class MissingBytes:
    """Bytes that were sent, but never captured."""

    size: int


Piece = bytes | MissingBytes


class StreamReassembly:
    """The bytes of one direction, in order.

    Positions count on beyond 2**32, so that they compare as numbers.

    Attributes:
        first: sequence number with which the stream started, None before.
        ended: true once everything up to the FIN was given.
    """

    def __init__(self) -> None:
        self.first: int | None = None
        self.ended = False
        self._next = 0
        self._acknowledged = 0
        self._end: int | None = None
        self._waiting: list[tuple[int, bytes]] = []
        self._waiting_bytes = 0
        self._waiting_since = 0
        self._patience = PATIENCE

    def begin(self, sequence: int) -> None:
        """Set the sequence number of the first byte."""
        self.first = sequence
        self._next = self._acknowledged = sequence

    def take(self, sequence: int, data: bytes, time: int) -> list[Piece]:
        """Take the bytes of a segment and its time [ns]; return those that are now in order."""
        at = self._position(sequence)
        if at + len(data) <= self._next:
            return []
        if at <= self._next:
            return self._deliver(at, data)
        if not self._waiting:
            self._waiting_since = time
            self._patience = PATIENCE
        heapq.heappush(self._waiting, (at, data))
        self._waiting_bytes += len(data)
        if self._waiting_bytes > MAX_WAITING_BYTES or len(self._waiting) > MAX_WAITING_SEGMENTS:
            return self._give_up_hole()
        return []

    def finish(self, sequence: int) -> None:
        """Set the sequence number behind the last byte: that of the FIN."""
        self._end = self._position(sequence)
        self.ended = self._next >= self._end

    def acknowledge(self, sequence: int) -> None:
        """Note that the receiver has everything before this number."""
        if self.first is not None:
            self._acknowledged = max(self._acknowledged, self._position(sequence))

    def wait(self, time: int) -> list[Piece]:
        """Note that a segment passed at a time [ns]; return what is not waited for now."""
        if not self._waiting:
            return []
        if self._acknowledged >= self._waiting[0][0]:
            self._patience -= 1
        if self._patience < 0 or time - self._waiting_since > MAX_WAIT:
            return self._give_up_hole()
        return []

    def flush(self) -> list[Piece]:
        """Return everything that waits, with what is missing in between."""
        pieces: list[Piece] = []
        while self._waiting:
            pieces += self._give_up_hole()
        return pieces

    def _position(self, sequence: int) -> int:
        ahead = (sequence - self._next) % _WRAP
        return self._next + (ahead - _WRAP if ahead >= _WRAP // 2 else ahead)

    def _give_up_hole(self) -> list[Piece]:
        at, data = heapq.heappop(self._waiting)
        self._waiting_bytes -= len(data)
        self._patience = PATIENCE
        missing = MissingBytes(at - self._next)
        self._next = at
        return [missing, *self._deliver(at, data)]

    def _deliver(self, at: int, data: bytes) -> list[Piece]:
        """Give a run of bytes that joins up, and all that waited for it."""
        pieces: list[Piece] = [data[self._next - at :]]
        self._next = at + len(data)
        while self._waiting and self._waiting[0][0] <= self._next:
            at, data = heapq.heappop(self._waiting)
            self._waiting_bytes -= len(data)
            if at + len(data) > self._next:
                pieces.append(data[self._next - at :])
                self._next = at + len(data)
        if self._end is not None:
            self.ended = self._next >= self._end
        return pieces
