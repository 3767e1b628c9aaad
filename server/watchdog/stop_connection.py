"""Stop connection of the watchdog to one controller: sends STOP until it has been answered.

Owns the socket, and when STOP is sent again. It is no proof of delivery that the kernel took the
bytes: the connection to a controller without power still looks sound. So an answer is expected, and
without one STOP is sent on a new connection.

Owns the numeric addresses of the controller's name. A name server that does not answer delays a
thread of its own and no STOP: the last good addresses are used meanwhile. An address in digits
needs no thread. Imports the standard library only; never waits.
"""

from __future__ import annotations

import errno
import selectors
import socket
import threading
from collections.abc import Callable
from typing import Any

from .watchdog_protocol import StopTarget

_RETRY = 0.5
_RENEWAL = 5.0

LookUp = Callable[..., list[Any]]
"""`socket.getaddrinfo`, or a replacement in a test."""


class ControllerAddress:
    """The addresses of one controller, one of which is used until it fails."""

    def __init__(
        self,
        host: str,
        port: int,
        look_up: LookUp = socket.getaddrinfo,
        renewal: float = _RENEWAL,
    ) -> None:
        """Take an address in digits, or start to look a name up.

        Args:
            look_up: finds the addresses of a name; may take its time.
            renewal: a name that is known is looked up again no sooner [s].
        """
        self._host = host
        self._port = port
        self._look_up = look_up
        self._renewal = renewal
        self._known: list[tuple[int, Any]] = []
        self._turn = 0
        self._has_failed = threading.Event()
        try:
            self._known = _numeric(host, port)
        except OSError:
            threading.Thread(target=self._follow, name="look-up", daemon=True).start()

    @property
    def current(self) -> tuple[int, Any] | None:
        """Family and address to connect to; None while none is known. Never waits."""
        known = self._known
        return known[self._turn % len(known)] if known else None

    def failed(self) -> None:
        """Select the next address and look the name up again, because this address failed."""
        self._turn += 1
        self._has_failed.set()

    def _follow(self) -> None:
        rest = threading.Event()  # never set
        while True:
            try:
                found = self._look_up(self._host, self._port, type=socket.SOCK_STREAM)
            except (OSError, UnicodeError):  # the last good ones stay
                found = []
            if found:
                self._known = [(family, address) for family, _, _, _, address in found]
            if not self._known:
                rest.wait(_RETRY)
                continue
            # After a failure, but not after each of them.
            rest.wait(self._renewal)
            self._has_failed.clear()
            self._has_failed.wait()


def _numeric(host: str, port: int) -> list[tuple[int, Any]]:
    flags = socket.AI_NUMERICHOST | socket.AI_NUMERICSERV
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=flags)
    return [(family, address) for family, _, _, _, address in found]


_MS = 1_000_000
_RECONNECT_NS = 500 * _MS
_REPEAT_NS = 50 * _MS
_CONNECT_NS = 1_000 * _MS
_ANSWER_NS = 100 * _MS
_MOST_PATIENCE_NS = 1_000 * _MS
_UNANSWERED_MS = 2_500
_LONGEST_FRAME = 65_536


class StopConnection:
    """The child's connection to one controller."""

    def __init__(
        self, target: StopTarget, selector: selectors.BaseSelector, say: Callable[[str], None]
    ) -> None:
        """Prepare a connection; `keep_up` starts it.

        Args:
            selector: calls `ready`, with the connection as its data.
        """
        self._target = target
        self._stop = bytes.fromhex(target.stop)
        self._answer = bytes.fromhex(target.answer)
        self._address = ControllerAddress(target.host, target.port)
        self._selector = selector
        self._say = say
        self._socket: socket.socket | None = None
        self._is_up = False
        self._connecting_since = 0
        self._next_attempt = 0
        self._received = b""
        self._owed = False
        self._owed_until: int | None = None
        self._sent_at: int | None = None
        self._patience = _ANSWER_NS
        self._was_told = False

    @property
    def is_done(self) -> bool:
        """True if no STOP waits for its connection or for its answer."""
        return not self._owed

    def stop(self, now: int) -> None:
        """Send STOP, now or as soon as there is a connection, until it is answered."""
        self._owed, self._owed_until = True, None
        self._patience = _ANSWER_NS
        self._was_told = False
        # A pending attempt may hang in the kernel, as for a controller that had no power.
        if not self._is_up:
            self._drop()
        self._next_attempt = 0
        self._connect(now)
        self._send(now)

    def limit(self, until: int) -> None:
        """Set the time to give up an unanswered STOP: the server has returned, or has ended."""
        self._owed_until = until

    def keep_up(self, now: int) -> None:
        """Do what is due by the clock: connect, send again, give up."""
        if self._owed and self._owed_until is not None and now >= self._owed_until:
            self._say(f"cell {self._target.cell}: STOP was not answered")
            self._settle()
        if self._socket is not None:
            if not self._is_up and now - self._connecting_since >= _CONNECT_NS:
                self._fail()
            elif self._owed and self._is_silent(now):
                # A controller may answer only once its robot is at rest, so each try waits longer.
                self._patience = min(2 * self._patience, _MOST_PATIENCE_NS)
                self._fail()
        self._connect(now)

    def ready(self, events: int, now: int) -> None:
        """Take what the selector found: a connection, an answer, or the end."""
        if events & selectors.EVENT_WRITE and self._socket is not None:
            if self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
                self._fail()
                return
            self._is_up = True
            self._selector.modify(self._socket, selectors.EVENT_READ, self)
            self._send(now)
        if events & selectors.EVENT_READ and self._socket is not None:
            self._receive()

    def _is_silent(self, now: int) -> bool:
        return self._sent_at is not None and now - self._sent_at >= self._patience

    def _connect(self, now: int) -> None:
        is_wanted = self._target.is_kept or self._owed
        if self._socket is not None or not is_wanted or now < self._next_attempt:
            return
        self._next_attempt = now + (_REPEAT_NS if self._owed else _RECONNECT_NS)
        where = self._address.current
        if where is None:
            return
        family, address = where
        try:
            self._socket = connection = socket.socket(family, socket.SOCK_STREAM)
            connection.setblocking(False)
            _find_dead_peers(connection)
            code = connection.connect_ex(address)
        except OSError:
            self._fail()
            return
        if code not in (0, errno.EINPROGRESS):
            self._fail()
            return
        self._connecting_since = now
        # Writable means connected, or failed; the socket's error shows which.
        events = selectors.EVENT_READ | selectors.EVENT_WRITE
        self._selector.register(connection, events, self)

    def _send(self, now: int) -> None:
        if not self._owed or not self._is_up or self._socket is None:
            return
        try:
            sent = self._socket.send(self._stop)
        except OSError:
            sent = 0
        # The controller does not act on a part of a frame; a new connection sends it whole.
        if sent < len(self._stop):
            self._fail()
            self._connect(now)
            return
        self._sent_at = now
        if not self._was_told:
            self._was_told = True
            self._say(f"cell {self._target.cell}: STOP sent to the controller")

    def _receive(self) -> None:
        assert self._socket is not None
        try:
            data = self._socket.recv(65_536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._fail()
            return
        self._received += data
        while len(self._received) >= 4:
            end = 4 + int.from_bytes(self._received[:4], self._target.order)
            if end > _LONGEST_FRAME:
                self._fail()
                return
            if len(self._received) < end:
                return
            frame, self._received = self._received[4:end], self._received[end:]
            if self._sent_at is not None and frame.startswith(self._answer):
                self._say(f"cell {self._target.cell}: the controller answered STOP")
                self._settle()

    def _settle(self) -> None:
        """End the pending STOP."""
        self._owed, self._owed_until, self._sent_at = False, None, None
        if not self._target.is_kept:
            self._drop()

    def _fail(self) -> None:
        """Drop a failed connection; try the controller's next address if it was never up."""
        if not self._is_up:
            self._address.failed()
        self._drop()

    def _drop(self) -> None:
        connection, self._socket, self._is_up = self._socket, None, False
        self._received, self._sent_at = b"", None
        if connection is None:
            return
        if connection.fileno() in self._selector.get_map():
            self._selector.unregister(connection)
        connection.close()


def _find_dead_peers(connection: socket.socket) -> None:
    """Send at once, and find a peer without power within seconds, as the server's own links do."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in (
        ("TCP_KEEPIDLE", 1),
        ("TCP_KEEPINTVL", 1),
        ("TCP_KEEPCNT", 2),
        ("TCP_USER_TIMEOUT", _UNANSWERED_MS),
    ):
        number = getattr(socket, option, None)
        if number is not None:
            connection.setsockopt(socket.IPPROTO_TCP, number, value)
