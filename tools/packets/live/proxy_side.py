"""One socket of a proxied connection: TCP options, back-pressure, FIN and RST.

Owns what asyncio's transports leave to their user. What the bytes mean to the other side is the
business of whoever gets the events.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
from typing import Protocol, cast

from ..trace import Direction

WRITE_HIGH = 64 * 1024
"""A side with more bytes than this unsent pauses the reading of the other side."""

_RESET_ON_CLOSE = struct.pack("ii", 1, 0)


class SideEvents(Protocol):
    """Whom a side tells what happens to it."""

    def opened(self, client: Side) -> None:
        """A client is connected."""

    def received(self, direction: Direction, data: bytes) -> None:
        """Bytes came."""

    def ended(self, direction: Direction) -> None:
        """The peer will send nothing more."""

    def lost(self, direction: Direction, error: Exception | None) -> None:
        """The connection is gone; with an error it broke."""

    def balance(self) -> None:
        """The side became full, or is full no more."""


class Side(asyncio.Protocol):
    """One of the two sockets of a link, named after the direction in which its peer sends.

    Attributes:
        is_full: more bytes wait to be sent than may pile up.
        has_ended: its peer was told that nothing follows.
        is_gone: there is no connection any more.
    """

    def __init__(self, link: SideEvents, direction: Direction) -> None:
        self.is_full = False
        self.has_ended = False
        self.is_gone = False
        self._peer_has_ended = False
        self._link = link
        self._direction = direction
        self._transport: asyncio.Transport | None = None

    @property
    def unsent(self) -> int:
        """Bytes accepted for sending that the kernel has not taken yet."""
        return self._transport.get_write_buffer_size() if self._transport else 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Prepare the socket; called by the loop."""
        self._transport = cast(asyncio.Transport, transport)
        self._transport.set_write_buffer_limits(high=WRITE_HIGH)
        sock = transport.get_extra_info("socket")
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        if self._direction is Direction.TO_SERVER:
            self._link.opened(self)
        else:
            self.pause()

    def data_received(self, data: bytes) -> None:
        """Hand bytes on; called by the loop."""
        self._link.received(self._direction, data)

    def eof_received(self) -> bool:
        """Keep the other direction open; called by the loop."""
        self._peer_has_ended = True
        self._link.ended(self._direction)
        return True

    def pause_writing(self) -> None:
        """Stop reading from the other side; called by the loop."""
        self.is_full = True
        self._link.balance()

    def resume_writing(self) -> None:
        """Go on reading from the other side; called by the loop."""
        self.is_full = False
        self._link.balance()

    def connection_lost(self, error: Exception | None) -> None:
        """Tell the link; called by the loop."""
        self.is_gone = True
        self._transport = None
        self._link.lost(self._direction, error)

    def write(self, data: bytes) -> None:
        """Send bytes, unless nothing may follow any more."""
        if self._transport is not None and not self.has_ended:
            self._transport.write(data)

    def end(self) -> None:
        """Send FIN after what was written; the peer may go on sending."""
        self.has_ended = True
        if self._transport is not None and not self._transport.is_closing():
            # A peer that has broken off meanwhile is noticed when the loop calls `connection_lost`.
            with contextlib.suppress(OSError):
                self._transport.write_eof()

    def pause(self) -> None:
        """Stop reading."""
        if self._transport is not None:
            self._transport.pause_reading()

    def resume(self) -> None:
        """Read again, unless the peer has ended: asyncio would report its end once more."""
        if self._transport is not None and not self._peer_has_ended:
            self._transport.resume_reading()

    def close(self) -> None:
        """Close in order after what was written."""
        self.has_ended = True
        if self._transport is not None:
            self._transport.close()

    def reset(self) -> None:
        """Break off with RST."""
        if self._transport is not None:
            sock = self._transport.get_extra_info("socket")
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET_ON_CLOSE)
            self._transport.abort()

    def abort(self) -> None:
        """Close without sending what is left."""
        if self._transport is not None:
            self._transport.abort()
