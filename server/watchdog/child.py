"""The watchdog process itself: beats in through its standard input, stops out to the controllers.

Keeps a connection of its own to each controller, and sends the controller's STOP there when the
beats stay away or the server is gone. Owns pipe, sockets and clock; when a robot is to be stopped
is `watchdog`'s rule. Imports the standard library, `pipe` and `watchdog` only, so it starts in an
instant; what a STOP looks like it is told in bytes.
"""

from __future__ import annotations

import errno
import os
import selectors
import signal
import socket
import sys
import time
from collections.abc import Sequence

from .pipe import BEAT, IS_FAREWELL, StopTarget, read_orders
from .watchdog import BeatWatch

_RECONNECT_NS = 500_000_000
_DELIVERY_NS = 1_000_000_000
"""A server that is gone leaves the watchdog this long to get its stops out."""


class _StopConnection:
    """The child's connection to one controller."""

    def __init__(self, target: StopTarget, selector: selectors.BaseSelector) -> None:
        self._target = target
        self._selector = selector
        self._socket: socket.socket | None = None
        self._is_up = False
        self._next_attempt = 0
        self._unsent = b""

    @property
    def is_done(self) -> bool:
        """Whether no stop waits for its connection."""
        return not self._unsent

    def stop(self, now: int) -> None:
        """Send the STOP, now or as soon as there is a connection."""
        self._unsent = bytes.fromhex(self._target.stop)
        self._next_attempt = 0
        self.keep_up(now)
        self._flush()

    def keep_up(self, now: int) -> None:
        """Begin to connect where that is due."""
        is_wanted = self._target.is_kept or bool(self._unsent)
        if self._socket is not None or not is_wanted or now < self._next_attempt:
            return
        self._next_attempt = now + _RECONNECT_NS
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(
                self._target.host, self._target.port, type=socket.SOCK_STREAM
            )[0]
            self._socket = connection = socket.socket(family, kind, protocol)
            connection.setblocking(False)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            code = connection.connect_ex(address)
        except OSError:
            self._drop()
            return
        if code not in (0, errno.EINPROGRESS):
            self._drop()
            return
        # Writable means connected, or failed; both are found out by writing.
        events = selectors.EVENT_READ | selectors.EVENT_WRITE
        self._selector.register(connection, events, self)

    def ready(self, events: int) -> None:
        """Take what the selector found: a connection, answers nobody waits for, or the end."""
        assert self._socket is not None
        if events & selectors.EVENT_WRITE:
            if self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
                self._drop()
                return
            self._is_up = True
            self._selector.modify(self._socket, selectors.EVENT_READ, self)
            self._flush()
        if events & selectors.EVENT_READ and self._socket is not None:
            try:
                if not self._socket.recv(65_536):
                    self._drop()
            except BlockingIOError:
                return
            except OSError:
                self._drop()

    def _flush(self) -> None:
        if not self._unsent or not self._is_up or self._socket is None:
            return
        try:
            sent = self._socket.send(self._unsent)
        except OSError:
            self._drop()
            return
        # A frame in parts would be no stop; a new connection begins it anew.
        if sent < len(self._unsent):
            self._drop()
            return
        self._unsent = b""
        _say(f"cell {self._target.cell}: STOP sent to the controller")

    def _drop(self) -> None:
        connection, self._socket, self._is_up = self._socket, None, False
        if connection is None:
            return
        if connection.fileno() in self._selector.get_map():
            self._selector.unregister(connection)
        connection.close()


class _Child:
    """The process: beats in, stops out."""

    def __init__(self, deadline: float, targets: Sequence[StopTarget], rest: bytes) -> None:
        self._selector = selectors.DefaultSelector()
        self._selector.register(0, selectors.EVENT_READ, None)
        self._connections = [_StopConnection(target, self._selector) for target in targets]
        self._watch = BeatWatch(round(deadline * 1e9), time.monotonic_ns())
        self._buffer = rest

    def run(self) -> None:
        """Watch until the server ends; then see its last stops out."""
        while True:
            now = time.monotonic_ns()
            for connection in self._connections:
                connection.keep_up(now)
            remaining = self._watch.remaining(now)
            pause = _RECONNECT_NS / 1e9 if remaining is None else remaining
            events = self._selector.select(pause)
            now = time.monotonic_ns()
            alive = True
            # Beats before deadlines: a watchdog that was late itself must not blame the server.
            for key, mask in events:
                if key.data is None:
                    alive = self._take_beats(now)
                else:
                    key.data.ready(mask)
            if not alive:
                return
            self._stop(self._watch.overdue(now), "no beat of the server in time", now)

    def _take_beats(self, now: int) -> bool:
        """Read what the server wrote; tell whether it is still there."""
        data = os.read(0, 65_536)
        if not data:
            self._stop(self._watch.lost(), "the server is gone", now)
            self._deliver(now + _DELIVERY_NS)
            return False
        self._buffer += data
        whole = len(self._buffer) - len(self._buffer) % BEAT.size
        frames, self._buffer = self._buffer[:whole], self._buffer[whole:]
        for moving, kind in BEAT.iter_unpack(frames):
            if kind == IS_FAREWELL:
                return False
            silence = self._watch.beat(moving, now)
            if silence is not None:
                _say(f"the server is back after {silence / 1e6:.0f} ms")
        return True

    def _stop(self, cells: int, why: str, now: int) -> None:
        if not cells:
            return
        _say(f"{why}: stopping")
        for number, connection in enumerate(self._connections):
            if cells >> number & 1:
                connection.stop(now)

    def _deliver(self, until: int) -> None:
        """Wait for stops that still look for a connection."""
        self._selector.unregister(0)
        while (now := time.monotonic_ns()) < until:
            if all(connection.is_done for connection in self._connections):
                return
            for connection in self._connections:
                connection.keep_up(now)
            for key, mask in self._selector.select(0.05):
                key.data.ready(mask)


def _say(text: str) -> None:
    """Write a line into the server's log stream; one that nobody reads must not matter."""
    try:
        os.write(2, f"openpendant watchdog: {text}\n".encode())
    except OSError:
        return


def _first_line() -> tuple[bytes, bytes]:
    """Return the first line of standard input, and what came behind it."""
    data = b""
    while b"\n" not in data:
        more = os.read(0, 65_536)
        if not more:
            return b"", b""
        data += more
    line, _, rest = data.partition(b"\n")
    return line, rest


def main() -> int:
    """Run as the child of a server."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    line, rest = _first_line()
    if not line:
        return 0
    deadline, targets = read_orders(line)
    _Child(deadline, targets, rest).run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
