"""Main program of the watchdog process: beats in on standard input, STOPs out to the controllers.

Keeps a connection of its own to each controller and sends the controller's STOP on it when no beat
comes in time or the server is gone; reports on standard output that it is alive. Owns pipe and
clock; `watchdog_protocol` owns when a robot is stopped. Imports the standard library and modules
that import no more, so that it starts at once; it gets the bytes of a STOP from the server.
"""

from __future__ import annotations

import os
import selectors
import signal
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress

from ..background_writer import LogStream
from .stop_connection import StopConnection
from .watchdog_protocol import (
    ALIVE_NS,
    ANSWER,
    BEAT,
    IS_FAREWELL,
    IS_UPDATE,
    BeatWatch,
    Deadlines,
    StopTarget,
    read_orders,
)

_PREFIX = "openpendant watchdog: "
_GAP = "{} lines were left out: nobody read them\n"

_OWING = 0.02
_DELIVERY_NS = 3_000_000_000
"""Longest time that an unanswered STOP is repeated after the server returned or ended [ns]."""


class _Child:
    """The process: beats in, stops out."""

    def __init__(
        self,
        deadlines: Deadlines,
        targets: Sequence[StopTarget],
        rest: bytes,
        say: Callable[[str], None],
    ) -> None:
        self._selector = selectors.DefaultSelector()
        self._selector.register(0, selectors.EVENT_READ, None)
        self._say = say
        self._connections = [StopConnection(target, self._selector, say) for target in targets]
        real, emulated = (round(deadline * 1e9) for deadline in deadlines)
        self._watch = BeatWatch(real, emulated, time.monotonic_ns())
        self._buffer = rest
        self._told_alive = 0

    def run(self) -> None:
        """Watch until the server ends; then deliver the last STOPs."""
        while True:
            now = time.monotonic_ns()
            self._keep_up(now)
            self._tell_alive(now)
            events = self._selector.select(self._pause(now))
            now = time.monotonic_ns()
            alive = True
            # Beats before deadlines: a watchdog that was late itself must not stop a live server.
            for key, mask in events:
                if key.data is None:
                    alive = self._take_beats(now)
                else:
                    key.data.ready(mask, now)
                if not alive:
                    return
            self._stop(self._watch.overdue(now), "no beat of the server in time", now)

    def _pause(self, now: int) -> float:
        """Return the longest time to wait for events [s]."""
        is_owing = any(not connection.is_done for connection in self._connections)
        pause = _OWING if is_owing else ALIVE_NS / 1e9
        remaining = self._watch.remaining(now)
        return pause if remaining is None else min(pause, remaining)

    def _keep_up(self, now: int) -> None:
        for connection in self._connections:
            connection.keep_up(now)

    def _tell_alive(self, now: int) -> None:
        if now - self._told_alive < ALIVE_NS:
            return
        self._told_alive = now
        _tell(0)

    def _take_beats(self, now: int) -> bool:
        """Read the server's beats; return False once the server is gone."""
        data = os.read(0, 65_536)
        if not data:
            self._stop(self._watch.lost(), "the server is gone", now)
            self._deliver(now + _DELIVERY_NS)
            return False
        self._buffer += data
        whole = len(self._buffer) - len(self._buffer) % BEAT.size
        frames, self._buffer = self._buffer[:whole], self._buffer[whole:]
        for moving, emulated, kind in BEAT.iter_unpack(frames):
            if kind == IS_FAREWELL:
                return False
            if kind == IS_UPDATE:
                self._watch.update(moving, emulated)
                continue
            silence = self._watch.beat(moving, emulated, now)
            if silence is not None:
                self._limit(now + _DELIVERY_NS)
                self._say(f"the server is back after {silence / 1e6:.0f} ms")
        return True

    def _stop(self, cells: int, why: str, now: int) -> None:
        if not cells:
            return
        for number, connection in enumerate(self._connections):
            if cells >> number & 1:
                connection.stop(now)
        _tell(cells)
        self._say(f"{why}: stopping")

    def _limit(self, until: int) -> None:
        for connection in self._connections:
            connection.limit(until)

    def _deliver(self, until: int) -> None:
        """Wait until each STOP was sent and answered, or its time is up."""
        self._selector.unregister(0)
        self._limit(until)
        while not all(connection.is_done for connection in self._connections):
            for key, mask in self._selector.select(_OWING):
                key.data.ready(mask, time.monotonic_ns())
            self._keep_up(time.monotonic_ns())


def _tell(stopped: int) -> None:
    """Report to the server, as far as it reads; a frozen server reads nothing."""
    with suppress(OSError):
        os.write(1, ANSWER.pack(stopped))  # so few bytes are written whole or not at all


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
    os.set_blocking(1, False)
    line, rest = _first_line()
    if not line:
        return 0
    deadlines, targets = read_orders(line)
    # Standard error is shared with the server, so it must stay blocking. If its reader has stopped,
    # the thread of the stream waits, not the watchdog.
    stream = LogStream(2, most_waiting=100, farewell=0.3, gap=_PREFIX + _GAP)

    def say(text: str) -> None:
        stream.write(f"{_PREFIX}{text}\n")

    _Child(deadlines, targets, rest, say).run()
    stream.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
