"""One TCP connection of the emulator: bytes in, bytes out, and the deadlines of a link.

Owns what depends on the socket: one write per frame without delay, keep-alive, slow and silent
peers. What a message means is the controller's business.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import NamedTuple, cast

from openpendant.simplemsg import ByteOrder, Connection, LocalProtocolError, Message, Received
from openpendant.simplemsg.journal import Journal

from ..float32 import NANOSECONDS

FRAME_DEADLINE = 1 * NANOSECONDS
"""A frame must be complete within this time after its first byte [ns]."""

STATE_BACKLOG = 16 * 1024
"""A state listener with more bytes than this unsent misses rounds until it caught up."""

STATE_STALL = 2 * NANOSECONDS
"""A state listener that does not catch up within this time is cut off [ns]."""

REPLY_BACKLOG = 64 * 1024
"""A motion client that lets more bytes of replies than this pile up is cut off."""

_KERNEL_BUFFER = 8 * 1024


class LinkEvents(NamedTuple):
    """Callbacks of a link to the service that made it.

    Attributes:
        wire_bytes: notes bytes that came on a link by its number, before they are decoded; returns
            the time [ns].
        opened: a new link; False refuses it.
        learned: called when the first bytes of a link show its byte order.
        received: a message, or a frame that is none.
        closed: a link that was opened is gone.
    """

    wire_bytes: Callable[[int, bytes], int]
    opened: Callable[[EmulatorLink], bool]
    learned: Callable[[EmulatorLink, ByteOrder], None]
    received: Callable[[EmulatorLink, Received], None]
    closed: Callable[[EmulatorLink], None]


class EmulatorLink(asyncio.Protocol):
    """A connection on either port.

    Attributes:
        number: unique within the run.
        topic_order: byte order of the topics sent to it on the state port.
        is_open: False before the connection is made and after it is lost.
        stalled_since: when a listener fell behind [ns], None while it keeps up.
    """

    def __init__(
        self,
        number: int,
        connection: Connection,
        events: LinkEvents,
        journal: Journal,
    ) -> None:
        self.number = number
        self.address = ""
        self.topic_order = ByteOrder.LITTLE
        self.is_open = False
        self.stalled_since: int | None = None
        self._connection = connection
        self._events = events
        self._journal = journal
        self._transport: asyncio.Transport | None = None
        self._partial_since: int | None = None
        self._is_ending = False

    @property
    def backlog(self) -> int:
        """Bytes accepted for sending that the kernel has not taken yet."""
        return self._transport.get_write_buffer_size() if self._transport else 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Prepare the socket; called by the loop."""
        self._transport = cast(asyncio.Transport, transport)
        peer = transport.get_extra_info("peername")
        self.address = peer[0] if peer else ""
        _prepare(transport.get_extra_info("socket"))
        self.is_open = True
        if not self._events.opened(self):
            self.is_open = False
            self.abort()

    def data_received(self, data: bytes) -> None:
        """Hand on the messages that the bytes complete; called by the loop."""
        if not self.is_open or self._transport is None:
            return
        now = self._events.wire_bytes(self.number, data)
        known = self._connection.byte_order
        complete = self._connection.receive(data)
        order = self._connection.byte_order
        if order is not None and order is not known:
            self._events.learned(self, order)
        for message in complete:
            self._events.received(self, message)
        if self._connection.fault is not None:
            self.close()
        elif self._connection.more:
            # One talkative client must not hold up the others: the rest waits for the next turn.
            self._transport.pause_reading()
            asyncio.get_running_loop().call_soon(self._receive_more)
        if not self._connection.partial:
            self._partial_since = None
        elif self._partial_since is None or complete:
            self._partial_since = now

    def _receive_more(self) -> None:
        if self.is_open and self._transport is not None and not self._transport.is_closing():
            self._transport.resume_reading()
            self.data_received(b"")

    def connection_lost(self, error: Exception | None) -> None:
        """Tell the service; called by the loop."""
        was_open, self.is_open = self.is_open, False
        self._transport = None
        if was_open:
            self._events.closed(self)

    def send(self, message: Message) -> None:
        """Send a message, or cut off a client that takes none."""
        if not self._takes_bytes:
            return
        try:
            frame = self._connection.send(message)
        except LocalProtocolError:
            # The peer's header broke a rule that our own reply would have to break, too.
            self.close()
            return
        self._write(frame)
        if self._noted("flooded", self.backlog > REPLY_BACKLOG):
            self.abort()

    def send_state(self, frames: bytes, now: int) -> None:
        """Send a round of state, or skip it while the listener is behind: the newest wins."""
        if not self._takes_bytes:
            return
        if self._noted("clogged", self.backlog > STATE_BACKLOG):
            if self.stalled_since is None:
                self.stalled_since = now
            return
        self.stalled_since = None
        self._write(frames)

    @property
    def _takes_bytes(self) -> bool:
        transport = self._transport
        if transport is None or self._is_ending:
            return False
        # The loop closes a transport by itself when the kernel reports an error.
        return not self._noted("gone", transport.is_closing())

    def _noted(self, question: str, answer: bool) -> bool:
        journal = self._journal
        return journal.answer(question, self.number, answer) if journal.is_kept else answer

    def _write(self, frames: bytes) -> None:
        assert self._transport is not None
        if self._journal.is_kept:
            self._journal.out(self.number, frames)
        self._transport.write(frames)

    def check_deadlines(self, now: int) -> None:
        """Cut the link off if the peer left a frame unfinished or state unread for too long."""
        began, stalled = self._partial_since, self.stalled_since
        is_slow = began is not None and now - began > FRAME_DEADLINE
        is_stalled = stalled is not None and now - stalled > STATE_STALL
        if is_slow or is_stalled:
            self.abort()

    def close(self) -> None:
        """Close the connection after what was written has left."""
        self._is_ending = True
        if self._transport is not None:
            self._transport.close()

    def abort(self) -> None:
        """Close the connection without sending what is left."""
        self._is_ending = True
        if self._transport is not None:
            self._transport.abort()


def _prepare(sock: socket.socket | None) -> None:
    """Set what makes a link prompt, and a dead peer noticed within about three seconds.

    Where two probes of an idle link stay unanswered it ends; one may be lost.
    """
    if sock is None or sock.family not in (socket.AF_INET, socket.AF_INET6):
        return
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KERNEL_BUFFER)
    for name, value in _KEEP_ALIVE:
        option = getattr(socket, name, None)
        if option is not None:
            sock.setsockopt(socket.IPPROTO_TCP, option, value)


_KEEP_ALIVE = (
    ("TCP_KEEPIDLE", 1),
    ("TCP_KEEPINTVL", 1),
    ("TCP_KEEPCNT", 2),
    ("TCP_USER_TIMEOUT", 2500),
)
