"""The watchdog process: stops the robots when the server's event loop stands still (promise 26).

A process and no thread, because a loop that hangs may hold the interpreter. The server writes a
beat into its standard input each tick; it keeps a connection of its own to each controller, and
sends the controller's STOP there when the beats stay away or the server is gone. Owns pipe, sockets
and clock; the rules are `watchdog`'s. The child imports the standard library and `watchdog` only,
so it starts in an instant; what a STOP looks like it is told in bytes.
"""

from __future__ import annotations

import errno
import json
import logging
import os
import selectors
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from .watchdog import BeatWatch, LagLog

log = logging.getLogger("openpendant.server")

_BEAT = struct.Struct("<QB")
_IS_BEAT, _IS_FAREWELL = 0, 1
_RECONNECT_NS = 500_000_000
_RESTART_NS = 1_000_000_000
_DELIVERY_NS = 1_000_000_000
"""A server that is gone leaves the watchdog this long to get its stops out."""


@dataclass(frozen=True, slots=True)
class StopTarget:
    """Where and how one cell's robot is stopped.

    Attributes:
        cell: name of the cell, for the log.
        host: address of its controller.
        port: its motion port.
        stop: the bytes of its STOP, hexadecimal.
        is_kept: keep a connection up; else one is made when it is needed, because the controller
            takes only one at a time.
    """

    cell: str
    host: str
    port: int
    stop: str
    is_kept: bool


class Watchdog:
    """The server's end: starts the process, beats, and starts it again if it dies.

    Attributes:
        process: the process, None while there is none.
    """

    def __init__(self, targets: Sequence[StopTarget], deadline: float, period: float) -> None:
        """Prepare a watchdog.

        Args:
            targets: one for each cell, in their order.
            deadline: it stops the robots when no beat came for so long [s].
            period: between two ticks of the server [s].
        """
        self.process: subprocess.Popen[bytes] | None = None
        told = {"deadline": deadline, "targets": [asdict(target) for target in targets]}
        self._orders = json.dumps(told).encode() + b"\n"
        self._lags = LagLog(round(period * 1e9))
        self._started = 0

    def __enter__(self) -> Watchdog:
        """Start the process."""
        self._start(time.monotonic_ns())
        return self

    def __exit__(self, *_: object) -> None:
        """Let it go: the server ends in good order, with every robot at rest."""
        process = self.process
        self.process = None
        if process is None:
            return
        self._write(process, _BEAT.pack(0, _IS_FAREWELL))
        _close(process)
        try:
            process.wait(2.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def beat(self, moving: Sequence[bool]) -> None:
        """Say that the loop is alive; to be called each tick.

        Args:
            moving: for each cell whether its robot may move before the next tick.
        """
        now = time.monotonic_ns()
        line = self._lags.tick(now)
        if line:
            log.warning("%s", line)
        process = self.process
        if process is None:
            if now - self._started >= _RESTART_NS:
                self._start(now)
            return
        cells = sum(1 << number for number, moves in enumerate(moving) if moves)
        if not self._write(process, _BEAT.pack(cells, _IS_BEAT)):
            log.error("the watchdog process is gone or does not read; starting another")
            self.process = None
            _close(process)
            process.kill()
            process.wait()

    def _start(self, now: int) -> None:
        self._started = now
        try:
            process = subprocess.Popen(
                [sys.executable, "-m", __name__],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                # A signal for the server's terminal is none for its watchdog.
                start_new_session=True,
            )
        except OSError as error:
            log.error("no watchdog process: %s", error.strerror or error)
            return
        assert process.stdin is not None
        os.set_blocking(process.stdin.fileno(), False)
        self._write(process, self._orders)
        self.process = process

    @staticmethod
    def _write(process: subprocess.Popen[bytes], data: bytes) -> bool:
        """Write to the process, all or nothing; tell whether that worked. Never waits."""
        assert process.stdin is not None
        try:
            return os.write(process.stdin.fileno(), data) == len(data)
        except OSError:  # it ended, or its pipe is full
            return False


def _close(process: subprocess.Popen[bytes]) -> None:
    assert process.stdin is not None
    process.stdin.close()


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
        whole = len(self._buffer) - len(self._buffer) % _BEAT.size
        frames, self._buffer = self._buffer[:whole], self._buffer[whole:]
        for moving, kind in _BEAT.iter_unpack(frames):
            if kind == _IS_FAREWELL:
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


def _read_orders() -> tuple[bytes, bytes]:
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
    line, rest = _read_orders()
    if not line:
        return 0
    orders = json.loads(line)
    targets = [StopTarget(**target) for target in orders["targets"]]
    _Child(orders["deadline"], targets, rest).run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
