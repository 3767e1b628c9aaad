"""One direction of a TCP connection, put back in order from captured segments.

Owns sequence numbers: retransmissions, segments out of order, overlaps, and bytes that the capture
does not have. Knows nothing of connections or of what the bytes say.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

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
    """Bytes that were sent, but never captured.

    Attributes:
        size: how many.
    """

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
        """Take the bytes of a segment; return those that are now in order.

        Args:
            sequence: number of the first byte.
            data: the bytes.
            time: when it was captured [ns].
        """
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
        """Note that another segment of the connection passed; return what is not waited for now.

        Args:
            time: when it was captured [ns].
        """
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
