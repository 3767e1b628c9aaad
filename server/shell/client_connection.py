"""Shell of one client's TCP connection: bytes to the core, messages back.

Owns the socket's options, the deadline of a begun frame and back-pressure, and that a STOP acts in
the turn that reads it: what a client says is handled in turns of the loop, each of which ends once
it has had its share of the processor, but read on meanwhile, up to a bound, and looked through. It
decides nothing about motion.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import cast

from openpendant.simplemsg import (
    MAX_REFERENCE_FRAME,
    PENDANT,
    PENDANT_STOPS,
    ROS_STOPS,
    STANDARD,
    Arrival,
    Connection,
    Message,
    Role,
)
from openpendant.simplemsg.masking import SecretMask
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, Hello

from ..access.connection_loads import ConnectionLoad
from ..events.events import Port
from .inbox import Inbox, Observations
from .loop_share import SHARE_NS, LoopShare
from .socket_options import PENDANT_UNANSWERED, prepare_socket
from .waiting_line import WaitingLine

log = logging.getLogger("openpendant.server")

FRAME_DEADLINE_NS = 1_000_000_000
"""A begun frame must be complete by then (promise 8)."""

STATE_BACKLOG = 16 * 1024
"""State is skipped for a client with more unread bytes than this (promise 4)."""

DRAIN_DEADLINE_NS = 2_000_000_000
"""A client that reads nothing of a full backlog for so long is cut off (promise 4)."""

REQUESTS_PER_TURN = 16
"""Most frames of a pendant that are taken in a turn of the loop, however little they cost."""

POINTS_PER_TURN = 64
"""The same of a ROS-Industrial client."""

TURN_NS = 500_000
"""Processor time after which a turn takes no other frame: with the dearest one it stays below 2 ms
(promise 53)."""

BULK = 16 * 1024
"""After a read of so many bytes the next one goes first, and what waits is handled after it."""

REPLY_BACKLOG = 256 * 1024
"""A client that asks but does not read is cut off at so many unread bytes."""

_LAST_READ = 64 * 1024


class ClientConnection(asyncio.Protocol):
    """One accepted connection.

    Attributes:
        cell: number of the cell whose port that is; None for the pendant port of all.
        load: what it sent and took since it was opened.
    """

    def __init__(
        self,
        inbox: Inbox,
        observations: Observations,
        port: Port,
        cell: int | None = None,
        processor_time: Callable[[], int] = time.thread_time_ns,
        share: LoopShare | None = None,
    ) -> None:
        """Make the protocol of a connection that was just accepted.

        Args:
            share: of all clients of the server; one of its own where left out.
            processor_time: what the loop's thread has used of the processor [ns].
        """
        self.port = port
        self.cell = cell
        self.session = 0
        self.address = ""
        self.wire: Connection
        self.load = ConnectionLoad()
        self._inbox = inbox
        self._observations = observations
        # For good, as each message would have to ask: a journal is kept from the start or never.
        self._is_noted = inbox.is_noted
        self._processor_time = processor_time
        self._share = share or LoopShare()
        self._finish_tag = 0
        self._most = REQUESTS_PER_TURN if port is Port.PENDANT else POINTS_PER_TURN
        self._line = WaitingLine()
        self._lines_up = False
        self._transport: asyncio.Transport | None = None
        self._frame_begun: int | None = None
        self._is_behind = False
        self._clogged_since: int | None = None
        self._is_ending = False
        self._has_to_stop = False  # a STOP has arrived that waits for the hello in front of it
        self._goes_on = False
        self._is_paused = False
        self._read_first = False
        self._rest = 0
        self._last_words: deque[bytes] = deque()
        self._unsent: Exception | None = None
        self._has_secrets = port is Port.PENDANT
        self._heard_mask = SecretMask()
        self._said_mask = SecretMask()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Set the socket up and introduce the connection to the core."""
        self._transport = cast(asyncio.Transport, transport)  # uvloop's are none by class
        peer = transport.get_extra_info("peername")
        self.address = peer[0] if peer else ""
        prepare_socket(transport.get_extra_info("socket"), PENDANT_UNANSWERED)
        if self.port is Port.PENDANT:
            self.wire = Connection(
                Role.SERVER,
                PENDANT,
                max_frame=MAX_PENDANT_FRAME,
                frames_per_call=1,
                stop_rule=PENDANT_STOPS,
            )
        else:
            known = (
                self._inbox.clients.state_byte_order(self) if self.port is Port.ROS_STATE else None
            )
            self.wire = Connection(
                Role.SERVER,
                STANDARD,
                byte_order=known,
                max_frame=MAX_REFERENCE_FRAME,
                frames_per_call=1,
                stop_rule=ROS_STOPS,
            )
        self._inbox.opened(self)

    def data_received(self, data: bytes) -> None:
        """Decode what came and hand each message to the core; a fault of ours ends this, not us."""
        began = self._processor_time()
        masks = self._is_noted and self._has_secrets
        noted = self._heard_mask.feed(data) if masks else data
        now = self._inbox.wire_bytes(self.session, noted)
        try:
            self._take(data, now, began)
        except Exception as error:
            self._inbox.client_failed(self, error, now)
        cost, share = self._processor_time() - began, self._share
        self.load.received += len(data)
        self.load.cost_ns += cost
        self._finish_tag = max(self._finish_tag, share.served) + cost
        share.spent += cost
        if share.spent >= SHARE_NS:
            share.renew()

    def _take(self, data: bytes, now: int, begun: int) -> None:
        """Decode what came and hand each message to the core, on this call stack.

        Args:
            begun: processor time at which this turn began [ns].
        """
        wire = self.wire
        order = wire.byte_order
        is_over = self.is_closing
        # Inline, as each packet comes by: have the clients had their share of this iteration?
        waits = wire.more or self._share.spent >= SHARE_NS
        if self._is_noted and data and not wire.more:
            waits = self._observations.turn_ended(self.session, 0, waits)
        if is_over or (data and waits):
            self._read_on(data, now)
            return
        if self._lines_up and not self._may_decode(data, now, begun):
            return
        taken = 0
        waited = wire.waiting if self._lines_up else 0
        decoded = wire.receive(data)
        if wire.stops:
            self._stop_first(now)
        while True:
            complete: Sequence[Arrival] = wire.marked(decoded) if wire.overtaking else decoded
            for received in complete:
                if self._lines_up and self._line.put(received):
                    continue
                self._inbox.received(self.session, received, now)
                if self._has_to_stop and isinstance(received, Hello):
                    self._stop_first(now)
                if self.is_closing:
                    return
            taken += len(decoded)
            self.load.frames += len(decoded)
            if not (wire.more and decoded) or self._is_over(taken, begun):
                break
            decoded = wire.receive_next()
        if wire.fault is not None:
            self.close(str(wire.fault))
            return
        if wire.byte_order is not order and self.port is Port.ROS_MOTION:
            self._inbox.clients.learn_byte_order(self)
        if self._lines_up:
            self._line.size += max(waited + len(data) - wire.waiting, 0)
        if wire.more or self._is_paused or self._lines_up:
            self._read_first = len(data) >= BULK
            self._share_the_loop()
        # As `_time_the_frame`, without a call: each packet of a pendant comes by here.
        if not wire.partial:
            self._frame_begun = None
        elif self._frame_begun is None or taken:
            self._frame_begun = now

    def _is_over(self, taken: int, begun: int) -> bool:
        """Return True if the turn that began at a processor time takes no more frames [ns]."""
        if taken >= self._most or (self._lines_up and self._line.is_full):
            return True
        is_over = self._processor_time() - begun >= TURN_NS
        # By what this turn has cost here and now, so a rerun ends it where it ended.
        if self._is_noted:
            return self._observations.turn_ended(self.session, taken, is_over)
        return is_over

    def _may_decode(self, data: bytes, now: int, begun: int) -> bool:
        """Go on with the line; return True if frames are to be decoded in this turn, too."""
        if self._line.is_held and not self._line.is_full:
            return True
        if data:
            self.wire.read_ahead(data)
            if self.wire.stops:
                self._stop_first(now)
        taken = 0
        while self._line and not self._line.is_held:
            self._inbox.received(self.session, self._line.take(), now)
            if self.is_closing:
                return False
            taken += 1
            if self._is_over(taken, begun):
                break
        self._lines_up = self._line.is_held or len(self._line) > 0
        if not self._lines_up:
            self._line.size = 0
        self._time_the_frame(data, now)
        self._share_the_loop()
        return False

    def _time_the_frame(self, data: bytes | int, now: int) -> None:
        """Note since when a frame has been begun and is not whole, from the last progress on."""
        if not self.wire.partial:
            self._frame_begun = None
        elif self._frame_begun is None or data:
            self._frame_begun = now

    def hold(self) -> None:
        """Let wait what it sends, but for what stops or keeps alive."""
        self._line.is_held = self._lines_up = True

    def release(self) -> None:
        """Go on with what waits, in a turn of its own."""
        self._line.is_held = False
        self._share_the_loop()

    def _read_on(self, data: bytes, now: int) -> None:
        """Take bytes whose turn has not come, or never will; a STOP among them acts even so."""
        self.wire.read_ahead(data)
        if self.wire.stops:
            self._last_words.clear()  # after a STOP nothing counts that an ended connection said
            self._stop_first(now)
        if not self._is_ending:
            self._time_the_frame(data, now)
            self._read_first = len(data) >= BULK
            self._share_the_loop()

    def _stop_first(self, now: int) -> None:
        """Let the STOPs that have arrived act before their turn: one for all that came at once."""
        wire = self.wire
        wire.stops.clear()
        stop = wire.stop_to_act()
        self._has_to_stop = stop is not None
        if stop is not None and self._inbox.stop_first(self.session, stop, now):
            wire.stops_have_acted(is_answered=self.port is Port.PENDANT)
            self._has_to_stop = False
            if self._lines_up:
                self._line.stop()

    @property
    def is_closing(self) -> bool:
        """Whether the connection is closed, or will be once what was written has left."""
        transport = self._transport
        if transport is None or self._is_ending:
            return True
        # The loop closes a transport by itself when the kernel reports an error.
        if self._is_noted:
            return self._observations.is_gone(self.session, transport)
        return transport.is_closing()

    @property
    def has_turn(self) -> bool:
        """Whether something waits that a later turn of the loop can go on with."""
        # A line that is held goes on when it is released; till then it is decoded on.
        if self._line.is_held:
            return self.wire.more and not self._line.is_full
        return self.wire.more or self._lines_up

    def _share_the_loop(self) -> None:
        """Leave the rest to a later turn of the loop; read no more than may wait meanwhile."""
        transport, wire = self._transport, self.wire
        if transport is None or transport.is_closing():
            return
        if self.has_turn and not self._goes_on:
            self._goes_on = True
            self._share.wait(max(self._finish_tag, self._share.served), self._go_on)
        is_full = wire.more or self._lines_up
        if is_full:
            is_full = wire.waiting + self._line.size >= self._inbox.clients.read_ahead(self)
        if is_full and not self._is_paused:
            transport.pause_reading()
        elif self._is_paused and not is_full:
            transport.resume_reading()
        self._is_paused = is_full

    def _go_on(self) -> None:
        self._goes_on = False
        if self._transport is None or self._is_ending or self._transport.is_closing():
            return
        if self._read_first and not self._is_paused:
            # More is likely to have come: a STOP behind it must not wait until this was handled.
            self._read_first = False
            self._share_the_loop()
            return
        self.data_received(b"")

    def eof_received(self) -> bool:
        """Treat a half-closed connection as closed: a peer that says no more is gone."""
        return False

    def connection_lost(self, exc: Exception | None) -> None:
        """Tell the core that the client is gone, and before that whether it said STOP."""
        if exc is not None:
            log.info("session %d (%s %s): %s", self.session, self.port.value, self.address, exc)
        if self._transport is not None:
            # The socket is closed behind this, and to look through all takes more than a turn.
            most = self._inbox.clients.read_ahead(self) - self._rest
            self._last_words.extend(unread(self._transport, most))
        self._end()

    def _end(self) -> None:
        """Look through the next part of what came last; tell the core where that was all."""
        if self._last_words or (self._transport is not None and self.wire.is_searching):
            self.data_received(self._last_words.popleft() if self._last_words else b"")
        if self._last_words or (self._transport is not None and self.wire.is_searching):
            asyncio.get_running_loop().call_soon(self._end)
            return
        self._transport = None
        self._inbox.closed(self)

    def _read_the_rest(self) -> None:
        """Look through what has arrived on a connection that has ended: a STOP may be in it."""
        if self._transport is None:
            return
        most = min(self._inbox.clients.read_ahead(self) - self._rest, _LAST_READ)
        for data in unread(self._transport, most):
            self._rest += len(data)
            self.data_received(data)

    def send(self, message: Message) -> None:
        """Write a message; the next tick ends the connection where we failed to."""
        try:
            self.write(self.wire.send(message))
        except Exception as error:
            self.failed(error)

    def failed(self, error: Exception) -> None:
        """Take note of what went wrong with a message to it; the next tick ends the connection."""
        # Not here: what the core wants done may go on behind this message, and a stop with it.
        self._unsent = self._unsent or error

    def write(self, frame: bytes) -> None:
        """Write a frame that was encoded for this conversation."""
        transport = self._transport
        if transport is None or self.is_closing:
            return
        if self._is_noted:
            noted = self._said_mask.feed(frame) if self._has_secrets else frame
            self._observations.sent(self.session, noted)
        transport.write(frame)
        unread = transport.get_write_buffer_size()
        self._is_behind = unread > STATE_BACKLOG
        if self._is_noted:
            self._is_behind = self._observations.is_clogged(self.session, self._is_behind)
        if not self._is_behind:
            return
        if self._observations.is_flooded(self.session, unread > REPLY_BACKLOG):
            self.abort("does not read its replies")

    @property
    def unread(self) -> int:
        """How many bytes wait for it to read them."""
        return 0 if self._transport is None else self._transport.get_write_buffer_size()

    def is_clogged(self) -> bool:
        """Return True if the client reads too slowly for another state message."""
        transport = self._transport
        if transport is None:
            return True
        # Only what is written here makes the backlog longer, so that it is looked at again only
        # where it was too long then.
        if self._is_behind:
            unread = transport.get_write_buffer_size()
            self._is_behind = self._observations.is_clogged(self.session, unread > STATE_BACKLOG)
        return self._is_behind

    def check_deadlines(self, now: int) -> None:
        """Cut off a client whose frame never ends or who never reads; called once a tick.

        Raises:
            Exception: what went wrong with a message to it.
        """
        if self._is_ending and self._transport is not None:
            # Its last bytes may need a while to leave. An event of its own, not of the tick.
            asyncio.get_running_loop().call_soon(self._read_the_rest)
        unsent, self._unsent = self._unsent, None
        # One that ends was told of already, and may stay for as long as its peer does not read.
        if unsent is not None and not self._is_ending:
            raise unsent
        if self._frame_begun is not None and now - self._frame_begun > FRAME_DEADLINE_NS:
            self.abort("a frame was begun and not completed within 1 s")
        elif not self.is_clogged():
            self._clogged_since = None
        elif self._clogged_since is None:
            self._clogged_since = now
        elif now - self._clogged_since > DRAIN_DEADLINE_NS:
            self.abort("does not read")

    def close(self, reason: str) -> None:
        """Close after what was written has left."""
        if self._transport is not None and not self.is_closing:
            log.info("session %d (%s %s): %s", self.session, self.port.value, self.address, reason)
            self._is_ending = True
            self._transport.close()
            asyncio.get_running_loop().call_soon(self._read_the_rest)

    def abort(self, reason: str) -> None:
        """Close at once; what was not written is lost."""
        if self._transport is not None:
            log.info("session %d (%s %s): %s", self.session, self.port.value, self.address, reason)
            self._is_ending = True
            self._transport.abort()


def unread(transport: asyncio.BaseTransport, most: int) -> Iterator[bytes]:
    """Return what has arrived on a connection that the loop reads no more, where it is clear text.

    An end of ours, or an error of a write, may come between the arrival of bytes and their reading.

    Args:
        transport: it has ended, and its socket is still open.
    """
    if transport.get_extra_info("sslcontext") is not None:
        return
    try:
        sock = socket.socket(fileno=transport.get_extra_info("socket").fileno())
    except (AttributeError, OSError, TypeError):
        return
    try:
        while most > 0 and (data := sock.recv(min(most, _LAST_READ))):
            most -= len(data)
            yield data
    except OSError:  # nothing more has come
        return
    finally:
        sock.detach()
