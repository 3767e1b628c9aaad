"""The shell round the listening sockets: one connection a turn, and never too many a second.

asyncio's own servers take up to a whole backlog of connections in one turn, which delays the
control tick by what all of them cost. Here those that have to wait do so in the system's queue.
Decides nothing about how many there may be; `accept_rate` does.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import socket
import ssl
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .accept_rate import MOST_STRANGERS, AcceptRate

log = logging.getLogger("openpendant.server")

BACKLOG = 32
"""Connections that wait in the system's queue of each port; the system turns away any more."""

EXHAUSTED_PAUSE = 1.0
"""So long nobody is taken after the system had no descriptor or memory for one [s]."""

_HANDSHAKE_DEADLINE = 2.0
"""TLS has to be agreed on by then, and taken leave of [s]; as long as hello may take."""

_EXHAUSTED = {errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM}

Protocol = Callable[[], asyncio.Protocol]


@dataclass(frozen=True, slots=True, eq=False)
class _Door:
    """A listening socket.

    Attributes:
        socket: the socket.
        protocol: makes the protocol of a connection.
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
        self._doors: list[_Door] = []
        self._waiting: deque[_Door] = deque()
        self._timer: asyncio.TimerHandle | None = None
        self._greetings: set[asyncio.Task[None]] = set()
        self._is_exhausted = False

    async def listen(
        self, host: str, port: int, protocol: Protocol, tls: ssl.SSLContext | None = None
    ) -> int:
        """Listen on a port of every address that a host has.

        Args:
            host: name or address.
            port: TCP port, 0 for any free one.
            protocol: makes the protocol of a connection.
            tls: encrypts the connections; None for clear text.

        Returns:
            The port; of several addresses that of the first.

        Raises:
            OSError: it cannot be bound, or there is no such host.
        """
        found = await self._loop.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )
        doors: list[_Door] = []
        try:
            for family, _, _, _, address in dict.fromkeys(found):
                doors.append(_Door(socket.socket(family, socket.SOCK_STREAM), protocol, tls))
                _bind(doors[-1].socket, family, address)
        except OSError:
            for door in doors:
                door.socket.close()
            raise
        for door in doors:
            self._doors.append(door)
            self._loop.add_reader(door.socket, self._knocked, door)
        bound: int = doors[0].socket.getsockname()[1]
        return bound

    def close(self) -> None:
        """Listen no more; connections that were taken stay."""
        if self._timer is not None:
            self._timer.cancel()
        self._waiting.clear()
        for door in self._doors:
            self._loop.remove_reader(door.socket)
            door.socket.close()
        self._doors.clear()

    # Who is let in when.

    def _knocked(self, door: _Door) -> None:
        """Take one connection, or have its port wait behind those that wait already."""
        wait = 0 if self._waiting else self._rate.take(self._now())
        if not self._waiting and not wait:
            self._take(door)
            return
        self._loop.remove_reader(door.socket)
        self._waiting.append(door)
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
            door = self._waiting.popleft()
            self._loop.add_reader(door.socket, self._knocked, door)
            if not self._take(door):
                return

    def _go_on_in(self, pause: float) -> None:
        """Set the only timer there is [s]."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._loop.call_later(pause, self._go_on)

    def _now(self) -> int:
        return int(self._loop.time() * 1e9)

    def _take(self, door: _Door) -> bool:
        """Take a connection that may be there; tell whether the system has means for more."""
        try:
            accepted, address = door.socket.accept()
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
        greeting = self._loop.create_task(self._greet(accepted, door))
        self._greetings.add(greeting)
        greeting.add_done_callback(self._greetings.discard)
        return True

    def _pause(self, error: OSError) -> None:
        """Take nobody for a while; said once, however long it lasts."""
        if not self._is_exhausted:
            log.error("no connection can be taken now: %s", error.strerror)
        self._is_exhausted = True
        self._waiting.clear()
        for door in self._doors:
            self._loop.remove_reader(door.socket)
            self._waiting.append(door)
        self._go_on_in(EXHAUSTED_PAUSE)

    async def _greet(self, accepted: socket.socket, door: _Door) -> None:
        """Join a connection with its protocol, which may take until TLS is agreed on."""
        deadline = None if door.tls is None else _HANDSHAKE_DEADLINE
        try:
            await self._loop.connect_accepted_socket(
                door.protocol,
                accepted,
                ssl=door.tls,
                ssl_handshake_timeout=deadline,
                ssl_shutdown_timeout=deadline,
            )
        except OSError as error:  # TLS was not agreed on, or not in time; asyncio has closed it
            log.info("a connection ended before it began: %s", error)


def _bind(door: socket.socket, family: int, address: tuple[Any, ...]) -> None:
    door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    if family == socket.AF_INET6:
        # Else "::" would take the port of "0.0.0.0" as well.
        door.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
    door.setblocking(False)
    door.bind(address)
    door.listen(BACKLOG)
