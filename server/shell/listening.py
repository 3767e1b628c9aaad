"""Listening sockets of a server: its ports, one connection a turn, and never too many a second.

asyncio's own servers take up to a whole backlog of connections in one turn, which delays the
control tick by what all of them cost. Here those that have to wait do so in the system's queue
(promises 20 and 21), which says nothing of whom it holds. So where there are accounts, up to 32 are
taken of it in a turn, what an address opens beyond its rate is closed at once, and the others wait
here, in turn by address, to be let in at the same rate (promise 54).

Owns what is listened on where, when a connection is begun, and what is said where a port cannot be
had. The rates and the order are those of `arrivals`; how many there may be is `places`' business.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import socket
import ssl
import struct
from collections import Counter, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

from ..access.arrivals import BURST, PER_SECOND, AddressRates, FairQueue
from ..access.exposure import is_loopback, served_ports
from ..access.lockout import source_of
from ..access.places import MOST_STRANGERS, STRANGERS_OF_ADDRESS
from ..access.token_bucket import TokenBucket
from ..events.events import Port
from ..settings.cell_settings import CellSettings

log = logging.getLogger("openpendant.server")

BACKLOG = 32
"""Connections that wait in the system's queue of each port; the system turns away any more."""

CROWD_BACKLOG = 512
"""The same where they are taken quickly: whoever is turned away there tries again after a second
only, so that one host's flood must not fill it between two turns of the loop."""

TAKEN_IN_A_TURN = 32
"""Connections taken of the system's queue in one turn, to be let in or closed."""

EXHAUSTED_PAUSE = 1.0
"""So long nobody is taken after the system had no descriptor or memory for one [s]."""

_HANDSHAKE_DEADLINE = 2.0
"""TLS has to be agreed on by then, and taken leave of [s]; as long as hello may take."""

_EXHAUSTED = {errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM}

_RESET_AT_ONCE = struct.pack("ii", 1, 0)
"""Linger for no time: what is closed is reset, and nothing of it stays in the system."""

Protocol = Callable[[], asyncio.Protocol]


@dataclass(frozen=True, slots=True, eq=False)
class _ListeningSocket:
    """A listening socket.

    Attributes:
        tls: encrypts its connections; None for clear text.
    """

    socket: socket.socket
    protocol: Protocol
    tls: ssl.SSLContext | None


@dataclass(frozen=True, slots=True, eq=False)
class _Arrival:
    """A connection that waits to be let in.

    Attributes:
        is_counted: it counts with those of its source: neither of this machine nor of a gateway.
    """

    socket: socket.socket
    source: str
    is_counted: bool
    listener: _ListeningSocket


def _never() -> bool:
    return False


def _is_none(_address: str) -> bool:
    return False


class Listening:
    """All listening sockets of a server."""

    def __init__(
        self,
        by_address: Callable[[], bool] = _never,
        rates: AddressRates | None = None,
        is_gateway: Callable[[str], bool] = _is_none,
    ) -> None:
        """Listen nowhere yet.

        Args:
            by_address: returns whether connections are told apart by their addresses now.
            rates: of each address; none of others where left out.
            is_gateway: returns whether an address is a gateway's, which speaks for others: what
                comes from there counts for nobody's rate before it has said for whom.
        """
        self._loop = asyncio.get_running_loop()
        self._by_address = by_address
        self._rate = TokenBucket(PER_SECOND, BURST)
        self._rates = AddressRates() if rates is None else rates
        self._is_gateway = is_gateway
        self._arrivals: FairQueue[_Arrival] = FairQueue()
        self._letting_in: asyncio.Handle | None = None
        self._sockets: list[_ListeningSocket] = []
        self._of_port: dict[int, list[_ListeningSocket]] = {}
        self._waiting: deque[_ListeningSocket] = deque()
        self._timer: asyncio.TimerHandle | None = None
        # Whose TLS is being agreed on, in the order in which that began; empty for uncounted ones.
        self._greetings: dict[asyncio.Task[None], str] = {}
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
                backlog = CROWD_BACKLOG if self._by_address() else BACKLOG
                _bind(sockets[-1].socket, family, address, backlog)
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
        if self._letting_in is not None:
            self._letting_in.cancel()
        for arrival in self._arrivals.clear():
            arrival.socket.close()
        self._waiting.clear()
        for listener in self._sockets:
            self._loop.remove_reader(listener.socket)
            listener.socket.close()
        self._sockets.clear()

    # Who is let in when.

    def _on_readable(self, listener: _ListeningSocket) -> None:
        """Take one connection, or have its port wait behind those that wait already."""
        if self._by_address():
            self._take_many(listener)
            return
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
            wait = 0 if self._by_address() else self._rate.take(self._now())
            if wait:
                self._go_on_in(wait / 1e9)
                return
            listener = self._waiting.popleft()
            self._loop.add_reader(listener.socket, self._on_readable, listener)
            if not self._by_address() and not self._take(listener):
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
        accepted, has_means = self._accepted(listener)
        if accepted is not None:
            sock, address = accepted
            self._join(_Arrival(sock, *self._charged(address), listener))
        return has_means

    def _accepted(
        self, listener: _ListeningSocket
    ) -> tuple[tuple[socket.socket, str] | None, bool]:
        """Return a connection and its address, if there is one, and if there are means for more."""
        try:
            accepted, address = listener.socket.accept()
        except OSError as error:
            if error.errno in _EXHAUSTED:
                self._pause(error)
                return None, False
            if not isinstance(error, BlockingIOError | ConnectionAbortedError):
                log.info("a connection was lost before it was taken: %s", error.strerror)
            return None, True
        self._is_exhausted = False
        accepted.setblocking(False)
        return (accepted, address[0]), True

    def _join(self, arrival: _Arrival) -> None:
        """Begin the conversation on a connection, where it may agree on TLS before."""
        if not self._may_greet(arrival):
            log.info("%s: more than %d connections agree on TLS", arrival.source, MOST_STRANGERS)
            arrival.socket.close()
            return
        greeting = self._loop.create_task(self._greet(arrival.socket, arrival.listener))
        self._greetings[greeting] = arrival.source if arrival.is_counted else ""
        greeting.add_done_callback(lambda done: self._greetings.pop(done, None))

    def _may_greet(self, arrival: _Arrival) -> bool:
        """Return True if one more may agree on TLS.

        Where addresses are told apart, the longest of the same makes room for it, or where all
        places are taken that of the address that has most.
        """
        if not self._by_address() or not arrival.is_counted:
            return len(self._greetings) < MOST_STRANGERS
        source = arrival.source
        counts = Counter(filter(None, self._greetings.values()))
        if counts[source] >= STRANGERS_OF_ADDRESS:
            fullest = source
        elif counts.total() >= MOST_STRANGERS:
            fullest = max(counts, key=lambda each: (counts[each], each == source))
        else:
            return True
        longest = next(task for task, each in self._greetings.items() if each == fullest)
        # It has begun, as one is let in a turn; so its socket is closed by asyncio.
        del self._greetings[longest]
        longest.cancel()
        return True

    # Where addresses are told apart.

    def _charged(self, address: str) -> tuple[str, bool]:
        """Return what an address is charged to, and whether it counts with others of that."""
        source, is_own = _charged(address)
        return source, not is_own and not self._is_gateway(address)

    def _take_many(self, listener: _ListeningSocket) -> None:
        """Take what waits of one port: close what is beyond its rate, and queue the rest."""
        now = self._now()
        for _ in range(TAKEN_IN_A_TURN):
            if self._arrivals.own >= BACKLOG:
                # As if there were no accounts: whoever is on this machine waits in the system.
                self._loop.remove_reader(listener.socket)
                self._waiting.append(listener)
                break
            accepted, _ = self._accepted(listener)
            if accepted is None:
                break
            sock, address = accepted
            source, is_counted = self._charged(address)
            if is_counted and not self._rates.is_within(source, now):
                _reset(sock)
                continue
            gone = self._arrivals.add(source, _Arrival(sock, source, is_counted, listener), now)
            if gone is not None:
                _reset(gone.socket)
        if self._letting_in is not None:
            self._letting_in.cancel()  # it may be the turn of somebody else now
        self._let_in()

    def _let_in(self) -> None:
        """Begin one conversation, if that may be now; the next in another turn, or in its time."""
        self._letting_in = None
        if not self._arrivals:
            return
        now = self._now()
        wait = self._rate.take(now, self._arrivals.next_spare(now))
        if wait:
            self._letting_in = self._loop.call_later(wait / 1e9, self._let_in)
            return
        self._join(self._arrivals.take(now))
        if self._waiting and not self._is_exhausted and self._arrivals.own < BACKLOG:
            self._go_on_in(0.0)
        self._letting_in = self._loop.call_soon(self._let_in)

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


@lru_cache(1_024)
def _charged(address: str) -> tuple[str, bool]:
    """Return what an address is charged to, and whether it is this machine's own."""
    return source_of(address), is_loopback(address)


def _reset(sock: socket.socket) -> None:
    """Close a connection at once."""
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET_AT_ONCE)
    sock.close()


def _bind(listener: socket.socket, family: int, address: tuple[Any, ...], backlog: int) -> None:
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    if family == socket.AF_INET6:
        # Else "::" would take the port of "0.0.0.0" as well.
        listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
    listener.setblocking(False)
    listener.bind(address)
    listener.listen(backlog)


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
