"""Listening sockets of a server: its ports, one connection a turn, and never too many a second.

asyncio's own servers take up to a whole backlog of connections in one turn, which delays the
control tick by what all of them cost. Here those that have to wait do so in the system's queue
(promises 20 and 21).

Owns the rate and the burst of connections, what is listened on where, and what is said where a
port cannot be had. Must not know who connects; how many there may be is `clients`' business.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import socket
import ssl
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from ..access.exposure import served_ports
from ..events.events import Port
from ..settings.cell_settings import CellSettings
from .clients import MOST_STRANGERS

log = logging.getLogger("openpendant.server")

PER_SECOND = 50
"""Connections taken in one second, all ports together."""

BURST = 20
"""Connections taken at once after a quiet time."""

_INTERVAL_NS = 1_000_000_000 // PER_SECOND

BACKLOG = 32
"""Connections that wait in the system's queue of each port; the system turns away any more."""

EXHAUSTED_PAUSE = 1.0
"""So long nobody is taken after the system had no descriptor or memory for one [s]."""

_HANDSHAKE_DEADLINE = 2.0
"""TLS has to be agreed on by then, and taken leave of [s]; as long as hello may take."""

_EXHAUSTED = {errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM}

Protocol = Callable[[], asyncio.Protocol]


class AcceptRate:
    """A token bucket: `BURST` connections at once, one more each 20 ms.

    It is kept as one number, the time at which the bucket would be full again.
    """

    def __init__(self) -> None:
        """Make a full bucket."""
        self._full_at = 0

    def take(self, now: int) -> int:
        """Take a connection if one may be taken.

        Returns:
            0 where it is taken; else how long to wait before asking again [ns].
        """
        begin = max(self._full_at, now)
        wait = begin - now - (BURST - 1) * _INTERVAL_NS
        if wait > 0:
            return wait
        self._full_at = begin + _INTERVAL_NS
        return 0


@dataclass(frozen=True, slots=True, eq=False)
class _ListeningSocket:
    """A listening socket.

    Attributes:
        tls: encrypts its connections; None for clear text.
    """

    socket: socket.socket
    protocol: Protocol
    tls: ssl.SSLContext | None


class Listening:
    """All listening sockets of a server."""

    def __init__(self) -> None:
        """Listen nowhere yet."""
        self._loop = asyncio.get_running_loop()
        self._rate = AcceptRate()
        self._sockets: list[_ListeningSocket] = []
        self._of_port: dict[int, list[_ListeningSocket]] = {}
        self._waiting: deque[_ListeningSocket] = deque()
        self._timer: asyncio.TimerHandle | None = None
        self._greetings: set[asyncio.Task[None]] = set()
        self._is_exhausted = False

    async def listen(
        self, host: str, port: int, protocol: Protocol, tls: ssl.SSLContext | None = None
    ) -> int:
        """Listen on a port of every address that a host has.

        Args:
            port: TCP port, 0 for any free one.

        Returns:
            The port; of several addresses that of the first.

        Raises:
            OSError: it cannot be bound, or there is no such host.
        """
        found = await self._loop.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )
        sockets: list[_ListeningSocket] = []
        try:
            for family, _, _, _, address in dict.fromkeys(found):
                sockets.append(
                    _ListeningSocket(socket.socket(family, socket.SOCK_STREAM), protocol, tls)
                )
                _bind(sockets[-1].socket, family, address)
        except OSError:
            for listener in sockets:
                listener.socket.close()
            raise
        for listener in sockets:
            self._sockets.append(listener)
            self._loop.add_reader(listener.socket, self._on_readable, listener)
        bound: int = sockets[0].socket.getsockname()[1]
        self._of_port[bound] = sockets
        return bound

    def stop(self, port: int) -> None:
        """Listen no more on a port that `listen` returned; connections that were taken stay."""
        for listener in self._of_port.pop(port, ()):
            self._loop.remove_reader(listener.socket)
            listener.socket.close()
            self._sockets.remove(listener)
            if listener in self._waiting:
                self._waiting.remove(listener)

    def close(self) -> None:
        """Listen no more; connections that were taken stay."""
        if self._timer is not None:
            self._timer.cancel()
        self._waiting.clear()
        for listener in self._sockets:
            self._loop.remove_reader(listener.socket)
            listener.socket.close()
        self._sockets.clear()

    # Who is let in when.

    def _on_readable(self, listener: _ListeningSocket) -> None:
        """Take one connection, or have its port wait behind those that wait already."""
        wait = 0 if self._waiting else self._rate.take(self._now())
        if not self._waiting and not wait:
            self._take(listener)
            return
        self._loop.remove_reader(listener.socket)
        self._waiting.append(listener)
        if self._timer is None:
            self._go_on_in(wait / 1e9)

    def _go_on(self) -> None:
        """Take as many as may be taken by now, one from each port in turn."""
        self._timer = None
        while self._waiting:
            wait = self._rate.take(self._now())
            if wait:
                self._go_on_in(wait / 1e9)
                return
            listener = self._waiting.popleft()
            self._loop.add_reader(listener.socket, self._on_readable, listener)
            if not self._take(listener):
                return

    def _go_on_in(self, pause: float) -> None:
        """Set the only timer there is [s]."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._loop.call_later(pause, self._go_on)

    def _now(self) -> int:
        return int(self._loop.time() * 1e9)

    def _take(self, listener: _ListeningSocket) -> bool:
        """Take a connection that may be there; return True if the system has means for more."""
        try:
            accepted, address = listener.socket.accept()
        except OSError as error:
            if error.errno in _EXHAUSTED:
                self._pause(error)
                return False
            if not isinstance(error, BlockingIOError | ConnectionAbortedError):
                log.info("a connection was lost before it was taken: %s", error.strerror)
            return True
        self._is_exhausted = False
        accepted.setblocking(False)
        if len(self._greetings) >= MOST_STRANGERS:
            log.info("%s: more than %d connections agree on TLS", address[0], MOST_STRANGERS)
            accepted.close()
            return True
        greeting = self._loop.create_task(self._greet(accepted, listener))
        self._greetings.add(greeting)
        greeting.add_done_callback(self._greetings.discard)
        return True

    def _pause(self, error: OSError) -> None:
        """Take nobody for a while; said once, however long it lasts."""
        if not self._is_exhausted:
            log.error("no connection can be taken now: %s", error.strerror)
        self._is_exhausted = True
        self._waiting.clear()
        for listener in self._sockets:
            self._loop.remove_reader(listener.socket)
            self._waiting.append(listener)
        self._go_on_in(EXHAUSTED_PAUSE)

    async def _greet(self, accepted: socket.socket, listener: _ListeningSocket) -> None:
        """Join a connection with its protocol, which may take until TLS is agreed on."""
        deadline = None if listener.tls is None else _HANDSHAKE_DEADLINE
        try:
            await self._loop.connect_accepted_socket(
                listener.protocol,
                accepted,
                ssl=listener.tls,
                ssl_handshake_timeout=deadline,
                ssl_shutdown_timeout=deadline,
            )
        except OSError as error:  # TLS was not agreed on, or not in time; asyncio has closed it
            log.info("a connection ended before it began: %s", error)


def _bind(listener: socket.socket, family: int, address: tuple[Any, ...]) -> None:
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    if family == socket.AF_INET6:
        # Else "::" would take the port of "0.0.0.0" as well.
        listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
    listener.setblocking(False)
    listener.bind(address)
    listener.listen(BACKLOG)


Connect = Callable[[Port, int | None], asyncio.Protocol]
"""Makes the protocol of a connection to a port of a cell; None for the port of all cells."""


@dataclass(frozen=True, slots=True)
class RosPorts:
    """Where one cell listens for ROS-Industrial; None for nowhere."""

    motion: int | None
    state: int | None


@dataclass(frozen=True, slots=True)
class Ports:
    """The ports that the server listens on.

    Attributes:
        pendant: pendant protocol, for all cells.
        ros: ROS-Industrial, by the name of the cell.
    """

    pendant: int
    ros: dict[str, RosPorts]


class ListenFailed(Exception):
    """A port cannot be listened on.

    Attributes:
        reason: why, in the words of the system.
    """

    def __init__(self, host: str, port: int, reason: str) -> None:
        super().__init__(f"cannot listen on {host} port {port}: {reason}")
        self.host = host
        self.port = port
        self.reason = reason


async def listen_for(
    cells: Sequence[CellSettings],
    listening: Listening,
    connect: Connect,
    tls: ssl.SSLContext | None,
    *,
    is_guarded: bool,
) -> Ports:
    """Listen for the pendants of all cells, and for each cell's ROS-Industrial clients.

    Args:
        cells: the cells; the pendant port is that of the first.
        is_guarded: whoever would move a robot has to log in.

    Raises:
        ListenFailed: a port cannot be bound; the others may be.
    """
    host, number = cells[0].listen.host, cells[0].listen.pendant_port
    pendant = await _listen_on(listening, host, number, partial(connect, Port.PENDANT, None), tls)
    ros = {}
    for cell, settings in enumerate(cells):
        served = served_ports(settings.listen, is_guarded=is_guarded)
        bound = [
            None
            if wanted is None
            else await _listen_on(listening, host, wanted, partial(connect, port, cell))
            for port, wanted in zip((Port.ROS_MOTION, Port.ROS_STATE), served, strict=True)
        ]
        ros[settings.name] = RosPorts(*bound)
    return Ports(pendant, ros)


def unasked_ports(cells: Sequence[CellSettings], ports: Ports) -> list[int]:
    """Return the ports that are listened on though nobody asked for them."""
    found: list[int] = []
    for settings in cells:
        kept = served_ports(settings.listen, is_guarded=True)
        bound = ports.ros[settings.name]
        pairs = zip((bound.motion, bound.state), kept, strict=True)
        found += [port for port, asked in pairs if port is not None and asked is None]
    return found


async def _listen_on(
    listening: Listening,
    host: str,
    number: int,
    connect: Callable[[], asyncio.Protocol],
    tls: ssl.SSLContext | None = None,
) -> int:
    try:
        return await listening.listen(host, number, connect, tls)
    except OSError as error:
        number_of_error = error.errno or 0
        reason = os.strerror(number_of_error) if number_of_error > 0 else str(error)
        raise ListenFailed(host, number, reason) from None
