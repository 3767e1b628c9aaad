"""The watchdog process: stops the robots when the server's event loop stands still (promise 26).

A process and no thread, because a loop that hangs may hold the interpreter. The server writes a
beat into its standard input each tick. Owns the server's end: the process, its life and the pipe to
it. Must not know how a robot is stopped; that is what the process itself does, `child`.
"""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import time
from collections.abc import Sequence

from .pipe import BEAT, IS_BEAT, IS_FAREWELL, StopTarget, orders
from .watchdog import LagLog

log = logging.getLogger("openpendant.server")

_RESTART_NS = 1_000_000_000


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
        self._orders = orders(deadline, targets)
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
        self._write(process, BEAT.pack(0, IS_FAREWELL))
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
        if not self._write(process, BEAT.pack(cells, IS_BEAT)):
            log.error("the watchdog process is gone or does not read; starting another")
            self.process = None
            _close(process)
            process.kill()
            process.wait()

    def _start(self, now: int) -> None:
        self._started = now
        try:
            process = subprocess.Popen(
                [sys.executable, "-m", f"{__package__}.child"],
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
