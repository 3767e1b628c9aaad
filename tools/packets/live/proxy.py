"""A TCP proxy on asyncio: listens, connects, and does what its relay decides.

Owns sockets, their options, the clock, back-pressure, FIN and RST: a side is read only while the
other side takes the bytes. What is forwarded, and when, is the relay's business. All runs on one
loop, so no two calls of the relay overlap.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple, cast

from ..console import PeerError
from ..trace import TraceDirection
from .endpoints import Endpoint, in_short
from .relay import Action, CloseBoth, EndStream, Freeze, ProxyLinkId, Relay, ResetBoth, SendBytes

WRITE_HIGH = 64 * 1024
"""A side with more bytes than this unsent pauses the reading of the other side."""

_RESET_ON_CLOSE = struct.pack("ii", 1, 0)


class ProxySide(asyncio.Protocol):
    """One of the two sockets of a link, named after the direction in which its peer sends.

    Attributes:
        is_full: more bytes wait to be sent than may pile up.
        has_ended: its peer was told that nothing follows.
        is_gone: there is no connection any more.
    """

    def __init__(self, link: ProxyLink, direction: TraceDirection) -> None:
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
        if self._direction is TraceDirection.TO_SERVER:
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
        """Resume reading from the other side; called by the loop."""
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
        """Send FIN after the written bytes; the peer may continue to send."""
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


CONNECT_TIMEOUT = 10.0
"""A server that is not connected by then counts as refused [s]."""

MAX_LINKS = 256
"""Connections at once; further ones are closed."""

_NANOSECONDS = 1e9
_OPPOSITE = {
    TraceDirection.TO_SERVER: TraceDirection.TO_CLIENT,
    TraceDirection.TO_CLIENT: TraceDirection.TO_SERVER,
}


class Pair(NamedTuple):
    """Listening address, and the server to connect each client to."""

    listen: Endpoint
    target: Endpoint


class Proxy:
    """Several listening ports, each with the server behind it."""

    def __init__(
        self,
        pairs: Sequence[Pair],
        relay: Relay,
        *,
        connect_timeout: float = CONNECT_TIMEOUT,
        max_links: int = MAX_LINKS,
    ) -> None:
        """Make a proxy that is not listening yet, its time-out in s; needs a running loop."""
        self.links: dict[ProxyLinkId, ProxyLink] = {}
        self.relay = relay
        self.connect_timeout = connect_timeout
        self._pairs = pairs
        self._max_links = max_links
        self._loop = asyncio.get_running_loop()
        self._numbers: Counter[int] = Counter()
        self._servers: list[asyncio.Server] = []
        self._timer: asyncio.TimerHandle | None = None

    @property
    def now(self) -> int:
        """The loop's time [ns]."""
        return round(self._loop.time() * _NANOSECONDS)

    @property
    def unsent(self) -> int:
        """Bytes forwarded that the kernel has not taken yet, all connections together."""
        return sum(link.unsent for link in self.links.values())

    async def start(self) -> list[int]:
        """Listen on all ports, return them in order; PeerError, and nothing open, if one fails."""
        ports = []
        for index, pair in enumerate(self._pairs, 1):
            try:
                ports.append(await self._listen(index, pair))
            except (OSError, UnicodeError) as error:
                await self.close()
                raise PeerError(f"cannot listen on {pair.listen}: {in_short(error)}") from None
        return ports

    async def _listen(self, index: int, pair: Pair) -> int:
        def accept() -> ProxySide:
            return ProxySide(ProxyLink(self, index, pair.target), TraceDirection.TO_SERVER)

        server = await self._loop.create_server(accept, pair.listen.host, pair.listen.port)
        self._servers.append(server)
        bound: int = server.sockets[0].getsockname()[1]
        return bound

    async def close(self) -> None:
        """Stop listening and drop every connection, without a word to the relay."""
        if self._timer is not None:
            self._timer.cancel()
        for server in self._servers:
            server.close()
        for link in list(self.links.values()):
            link.drop()
        for server in self._servers:
            await server.wait_closed()
        self._servers.clear()

    def admit(self, link: ProxyLink, pair: int, port: int) -> ProxyLinkId | None:
        """Give a new connection its number, None where there are too many."""
        if len(self.links) >= self._max_links:
            return None
        self._numbers[port] += 1
        made = ProxyLinkId(pair, port, self._numbers[port])
        self.links[made] = link
        return made

    def act(self, actions: Iterable[Action]) -> None:
        """Do what the relay decided, and set the timer for what it put off."""
        for action in actions:
            link = self.links.get(action.link)
            if link is not None:
                link.act(action)
        self._schedule()

    def _schedule(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        due = self.relay.next_due()
        if due is not None:
            self._timer = self._loop.call_at(due / _NANOSECONDS, self._on_timer)

    def _on_timer(self) -> None:
        self._timer = None
        self.act(self.relay.due(self.now))
        for link in self.links.values():
            link.balance()


class ProxyLink:
    """One client's connection and the connection to the server that belongs to it."""

    def __init__(self, proxy: Proxy, pair: int, target: Endpoint) -> None:
        self._proxy = proxy
        self._pair = pair
        self._target = target
        self._id: ProxyLinkId | None = None
        self._sides: dict[TraceDirection, ProxySide] = {}
        self._connecting: asyncio.Task[None] | None = None
        self._is_frozen = False

    @property
    def unsent(self) -> int:
        """Bytes that either side has not taken yet."""
        return sum(side.unsent for side in self._sides.values())

    def opened(self, client: ProxySide) -> None:
        """Number the new client, and connect to the server; the client waits unread."""
        self._id = self._proxy.admit(self, self._pair, self._target.port)
        if self._id is None:
            client.close()
            return
        self._sides[TraceDirection.TO_SERVER] = client
        client.pause()
        self._proxy.relay.opened(self._id, self._proxy.now)
        self._connecting = asyncio.get_running_loop().create_task(self._connect(self._id))

    async def _connect(self, link: ProxyLinkId) -> None:
        loop = asyncio.get_running_loop()
        server = ProxySide(self, TraceDirection.TO_CLIENT)
        try:
            async with asyncio.timeout(self._proxy.connect_timeout):
                await loop.create_connection(lambda: server, self._target.host, self._target.port)
        except (OSError, UnicodeError) as error:
            # A time-out is an OSError without a number.
            reason = in_short(error) or f"no answer within {self._proxy.connect_timeout:g} s"
            self._proxy.relay.refused(link, f"{self._target}: {reason}", self._proxy.now)
            self._sides[TraceDirection.TO_SERVER].close()
            return
        finally:
            self._connecting = None
        self._sides[TraceDirection.TO_CLIENT] = server
        self.balance()

    def received(self, direction: TraceDirection, data: bytes) -> None:
        """Ask the relay what to do with bytes."""
        if self._id is not None and not self._is_frozen:
            proxy = self._proxy
            proxy.act(proxy.relay.received(self._id, direction, data, proxy.now))
            self.balance()

    def ended(self, direction: TraceDirection) -> None:
        """Tell the relay that a side will send nothing more."""
        if self._id is not None and not self._is_frozen:
            self._proxy.act(self._proxy.relay.ended(self._id, direction, self._proxy.now))

    def lost(self, direction: TraceDirection, error: Exception | None) -> None:
        """Note a side that is gone; a break is passed on to the other side."""
        side = self._sides.get(direction)
        if self._id is None or side is None:
            return
        if error is not None and not self._is_frozen:
            self._proxy.act(self._proxy.relay.reset(self._id, direction, self._proxy.now))
        if self._connecting is None and all(side.is_gone for side in self._sides.values()):
            self._forget()

    def _forget(self) -> None:
        if self._id is not None and self._proxy.links.pop(self._id, None) is not None:
            self._proxy.relay.closed(self._id, self._proxy.now)

    def act(self, action: Action) -> None:
        """Do one thing that the relay decided."""
        match action:
            case SendBytes():
                self._receiver(action.direction).write(action.data)
            case EndStream():
                self._receiver(action.direction).end()
                if all(side.has_ended for side in self._sides.values()):
                    self._close()
            case CloseBoth():
                self._close()
            case ResetBoth():
                self._break_off()
            case Freeze():
                self._is_frozen = True
                for side in self._sides.values():
                    side.pause()

    def _receiver(self, direction: TraceDirection) -> ProxySide:
        return self._sides[_OPPOSITE[direction]]

    def balance(self) -> None:
        """Read each side exactly while the other one takes bytes and the relay holds few."""
        if self._id is None or self._is_frozen or len(self._sides) < len(TraceDirection):
            return
        for direction, side in self._sides.items():
            held = self._proxy.relay.held(self._id, direction)
            if self._receiver(direction).is_full or held > WRITE_HIGH:
                side.pause()
            else:
                side.resume()

    def _close(self) -> None:
        for side in self._sides.values():
            side.close()

    def _break_off(self) -> None:
        for side in self._sides.values():
            side.reset()

    def drop(self) -> None:
        """Let go of both sides at once, and of a connection that is being made."""
        if self._connecting is not None:
            self._connecting.cancel()
        if self._id is not None:
            del self._proxy.links[self._id]
            self._id = None
        for side in self._sides.values():
            side.abort()
