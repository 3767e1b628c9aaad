"""TCP connections to the robot controllers, and the check that no two cells drive one controller.

Owns the attempts to connect and reconnect; what comes is passed on to the core. What a lost
connection means for a motion is the core's decision.

Owns how much of what a controller says is handled in one turn of the loop, by processor time, and
that a connection is given up whose messages have waited for so long that they tell of the past.

Owns which host names are one machine, so that two cells do not drive one robot by two names. That
check asks the name service, so it may block; a name that is not known there, or not yet, is
compared as it is written. `addresses_of` must not know what a cell is.
"""

from __future__ import annotations

import asyncio
import logging
import socket
from collections import deque
from collections.abc import Callable
from functools import cache
from ipaddress import IPv6Address, ip_address
from time import thread_time_ns
from typing import Any, cast

from openpendant.simplemsg import (
    PENDANT,
    STANDARD,
    CommType,
    Connection,
    LocalProtocolError,
    Message,
    Received,
    Role,
    Unasked,
)

from ..events.events import ControllerGarbled, ControllerReport, Event, PathChanged
from ..settings.cell_settings import CellSettings, ControllerLink, ControllerPath
from ..settings.config_file import ConfigurationError
from ..settings.server_settings import ServerSettings
from .inbox import Inbox, Observations
from .socket_options import CONTROLLER_UNANSWERED, prepare_socket

log = logging.getLogger("openpendant.server")

_REPLY = CommType.REPLY
_CONNECT_TIMEOUT = 2.0
_FAREWELL = 0.25

TURN_NS = 1_500_000
"""Processor time of a turn [ns]. The message during which it is used up is the turn's last, so that
with that one a turn stays below 2 ms."""

READ_AHEAD = 64 * 1024
"""While so many bytes wait for their turn no more are read."""

UNREAD = 64 * 1024
"""A controller that does not read so many bytes of points or answers is given up."""

_RECEIVE_BUFFER = 64 * 1024
"""Bytes that the kernel may keep of what a controller says: what waits there is not counted as
waiting here, and ages as well."""

_PROMPT_NS = 10_000_000
"""A read so long after the last one was handled had not waited in the kernel [ns]."""


class ControllerConnection(asyncio.Protocol):
    """One path to the controller, kept up for as long as the server runs.

    Attributes:
        link: its name in the log and in the journal.
    """

    def __init__(
        self,
        inbox: Inbox,
        observations: Observations,
        cell: int,
        label: str,
        path: ControllerPath,
        link: ControllerLink,
    ) -> None:
        """Make a path that is not connected yet.

        Args:
            label: begins the link's name; empty for the only cell.
        """
        self.path = path
        self.link = label + path.name.lower()
        self._inbox = inbox
        self._observations = observations
        self._cell = cell
        self._deliver: Callable[[Event, int], None]
        self._is_noted = False
        self._link = link
        self._port = link.state_port if path is ControllerPath.STATE else link.motion_port
        self._transport: asyncio.Transport | None = None
        self._wire: Connection | None = None
        self._lost = asyncio.Event()
        self._complained = False
        self._ending = False
        self._is_closing = False
        self._begin_anew()

    def _begin_anew(self) -> None:
        """Forget what waits: it was said on a connection that is gone."""
        self._decoded: deque[Received] = deque()
        self._later = 0  # answers among them, which the connection has counted already
        self._is_behind = False
        self._is_paused = False
        self._goes_on = False
        self._behind_since: int | None = None
        self._handled = 0  # when the last of all that had come was handled [ns]

    @property
    def is_up(self) -> bool:
        """Whether the path is connected."""
        transport = self._transport
        if transport is None or self._is_closing:
            return False
        # The loop closes a transport by itself when the kernel reports an error.
        if self._is_noted:
            return not self._observations.is_gone(self.link, transport)
        return not transport.is_closing()

    async def keep_up(self) -> None:
        """Connect, wait for the end, connect again; runs until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            self._lost.clear()
            try:
                async with asyncio.timeout(_CONNECT_TIMEOUT):
                    await loop.create_connection(lambda: self, self._link.host, self._port)
            except Exception as error:  # whatever it is: an end here would leave the robot for good
                self._complain(error)
            else:
                await self._lost.wait()
            await asyncio.sleep(self._link.reconnect_period)

    def _complain(self, error: Exception) -> None:
        """Log the first failure of a series only."""
        if not self._complained:
            self._complained = True
            is_usual, name = isinstance(error, OSError), type(error).__name__
            log.log(
                logging.WARNING if is_usual else logging.ERROR,
                "controller %s link to %s:%d: %s",
                self.link,
                self._link.host,
                self._port,
                (str(error) or name) if is_usual else f"{name}: {error}",
            )

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin a conversation and tell the core."""
        prepare_socket(transport.get_extra_info("socket"), CONTROLLER_UNANSWERED)
        _bound_receive_buffer(transport.get_extra_info("socket"))
        self._deliver = self._inbox.entrance(self._cell)
        self._is_noted = self._inbox.is_noted  # as in a client's connection
        self._transport = cast(asyncio.Transport, transport)  # uvloop's are none by class
        self._is_closing = False
        self._begin_anew()
        # Only here it is asked for more than motion, by our own messages.
        dialect = PENDANT if self.path is ControllerPath.STATE else STANDARD
        self._wire = Connection(
            Role.CLIENT, dialect, self._link.order, real_size=self._link.real_size
        )
        self._complained = False
        log.info("controller %s link is up", self.link)
        self._inbox.path_changed(self._cell, self.link, PathChanged(self.path, True))

    def data_received(self, data: bytes) -> None:
        """Decode what came and hand each message to the core, on this call stack.

        What a turn leaves is handed on in later ones, and what comes meanwhile waits behind it.
        """
        wire = self._wire
        if wire is None:
            return
        now = self._inbox.wire_bytes(self.link, data)
        was_behind = self._is_behind
        if was_behind and data:
            wire.read_ahead(data)
            self._bound_reading(wire)
            return
        # Nearly always this is one report or one answer, so that all of it is in one function.
        deliver, path, decoded = self._deliver, self.path, self._decoded
        began, taken, is_over = thread_time_ns(), 0, False
        while not is_over:
            if not decoded:
                awaited = wire.awaited
                decoded.extend(wire.receive(data))
                data = b""
                # The connection has counted all answers; each is to be judged as if it came alone.
                self._later = awaited - wire.awaited
                if not decoded:
                    break
            received = decoded.popleft()
            if self._later and _is_answer(received):
                self._later -= 1
            deliver(ControllerReport(path, received, wire.awaited + self._later), now)
            taken += 1
            if not decoded and not wire.more and not was_behind:
                break
            is_over = thread_time_ns() - began >= TURN_NS
            if self._is_noted:
                is_over = self._observations.turn_ended(self.link, taken, is_over)
        self._is_behind = is_over
        problem = "" if is_over or wire.fault is None else str(wire.fault)
        if is_over or self._behind_since is not None:
            problem = problem or self._too_late(was_behind, now)
        if problem:
            deliver(ControllerGarbled(path, problem), now)
            self.drop(problem)
        elif is_over or self._is_paused:
            self._bound_reading(wire)
            self._share_the_loop()

    def _too_late(self, was_behind: bool, now: int) -> str:
        """Return in words that messages have waited for too long, if so; called behind each turn.

        Args:
            was_behind: the turn went on with what an earlier one had left.
        """
        if not was_behind and now - self._handled > _PROMPT_NS:
            self._behind_since = None
        if self._is_behind:
            if self._behind_since is None:
                self._behind_since = now
            late = now - self._behind_since
            if late > self._link.abort_age_ns:
                text = "it says more than can be handled: messages have waited for"
                return f"{text} {late / 1e6:.0f} ms"
            return ""
        self._handled = now
        if not was_behind:
            self._behind_since = None  # all that had come, in one turn
        return ""

    def _bound_reading(self, wire: Connection) -> None:
        """Read no more while much waits for its turn."""
        transport, is_full = self._transport, self._is_behind and wire.waiting >= READ_AHEAD
        if transport is None or is_full is self._is_paused or transport.is_closing():
            return
        self._is_paused = is_full
        if is_full:
            transport.pause_reading()
        else:
            transport.resume_reading()

    def _share_the_loop(self) -> None:
        """Leave what waits to the next turn of the loop."""
        if self._is_behind and not self._goes_on:
            self._goes_on = True
            asyncio.get_running_loop().call_soon(self._go_on)

    def _go_on(self) -> None:
        self._goes_on = False
        transport = self._transport
        if self._is_behind and transport is not None:
            if not self._is_closing and not transport.is_closing():
                self.data_received(b"")

    def eof_received(self) -> bool:
        """A controller that says no more is lost."""
        return False

    def connection_lost(self, exc: Exception | None) -> None:
        """Tell the core that this path is gone."""
        self._transport = None
        self._wire = None
        if not self._ending:
            log.warning("controller %s link was lost: %s", self.link, exc or "closed there")
        self._inbox.path_changed(self._cell, self.link, PathChanged(self.path, False))
        self._lost.set()

    def send(self, message: Message) -> bool:
        """Write a message in one piece; return True if there was a connection to write to."""
        if self._wire is None or not self.is_up:
            return False
        assert self._transport is not None
        try:
            frame = self._wire.send(message)
        except LocalProtocolError:
            log.exception("controller %s link: not sent", self.link)
            return False
        if self._is_noted:
            self._observations.sent(self.link, frame)
        self._transport.write(frame)
        is_deaf = self._transport.get_write_buffer_size() > UNREAD
        if self._is_noted:
            is_deaf = self._observations.is_flooded(self.link, is_deaf)
        if is_deaf:
            self.drop(f"more than {UNREAD} bytes to it are unread")
            self._transport.abort()  # what is left would never leave
        return True

    def end(self) -> None:
        """Close the path because the server is going down."""
        self._ending = True
        self._close()

    def drop(self, reason: str) -> None:
        """Close the path; it connects anew."""
        if self._transport is not None:
            log.warning("controller %s link dropped: %s", self.link, reason)
            self._close()

    def _close(self) -> None:
        """Close gently, so that a stop just written still leaves; by force where nobody reads."""
        transport = self._transport
        if transport is not None:
            self._is_closing = True
            transport.close()
            asyncio.get_running_loop().call_later(_FAREWELL, transport.abort)


def _is_answer(received: Received) -> bool:
    """Return True if a message answers a request of ours, readable or not."""
    return not isinstance(received, Unasked) and received.comm_type == _REPLY


def _bound_receive_buffer(sock: socket.socket) -> None:
    """Have the kernel keep little: a controller that is not read has to wait, or to say less."""
    if sock.family in (socket.AF_INET, socket.AF_INET6):
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)


_THIS_MACHINE = "127.0.0.1"
"""Stands for every loopback address: a controller on this machine may listen on all of them."""


def addresses_of(host: str) -> frozenset[str]:
    """Return all addresses of a host, each in one form only; its name where it has none."""
    name = host.lower().removesuffix(".")
    try:
        found = socket.getaddrinfo(name, None, type=socket.SOCK_STREAM)
    except OSError:
        return frozenset([name])
    return frozenset(_in_one_form(address) for *_, address in found)


def _in_one_form(address: tuple[Any, ...]) -> str:
    ip = ip_address(address[0])
    if isinstance(ip, IPv6Address) and ip.ipv4_mapped is not None:
        ip = ip.ipv4_mapped
    # To connect to "any address" is to connect to this machine.
    if ip.is_loopback or ip.is_unspecified:
        return _THIS_MACHINE
    # A link-local address is another machine at each network interface, whose number comes last.
    interface = address[3] if isinstance(ip, IPv6Address) else 0
    return f"{ip}%{interface}" if interface else str(ip)


def check_controllers_apart(settings: ServerSettings, source: str) -> None:
    """Refuse two cells that drive one controller, by whatever names.

    Args:
        source: file name for the message.

    Raises:
        ConfigurationError: two cells would be two masters of one robot.
    """
    addresses = cache(addresses_of)
    for number, cell in enumerate(settings.cells):
        for owner in settings.cells[:number]:
            _check_pair(cell, owner, addresses, source)


def _check_pair(
    cell: CellSettings,
    owner: CellSettings,
    addresses: Callable[[str], frozenset[str]],
    source: str,
) -> None:
    """Refuse a cell with the controller of one before it, by whatever name.

    Raises:
        ConfigurationError: they would be two masters of one robot.
    """
    link, taken = cell.controller, owner.controller
    for key, port in (("motion_port", link.motion_port), ("state_port", link.state_port)):
        # Only where it matters is the name service asked, which may take long.
        if port not in (taken.motion_port, taken.state_port):
            continue
        shared = addresses(link.host) & addresses(taken.host)
        if not shared:
            continue
        problem = f"{link.host} port {port} is the controller of cell {owner.name!r} already"
        if link.host != taken.host:
            problem += f", where it is called {taken.host}; both are {min(shared)}"
        raise ConfigurationError(source, f"controller.{key} of cell {cell.name!r}", problem)
