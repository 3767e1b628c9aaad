"""How long the machine let a process wait that wanted nothing but to be woken."""

from __future__ import annotations

import os
import subprocess
import sys
import time

_WATCH = """
import time
last = time.monotonic()
while True:
    time.sleep(0.01)
    now = time.monotonic()
    if now - last >= 0.03:
        print(now, now - last, flush=True)
    last = now
"""


class StallWatch:
    """An idle control beside tests on the real clock: a process that sleeps 10 ms at a time."""

    def __init__(self) -> None:
        """Start it."""
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-S", "-c", _WATCH], stdout=subprocess.PIPE
        )
        assert self._process.stdout is not None
        self._told = self._process.stdout.fileno()
        os.set_blocking(self._told, False)
        self._rest = b""
        self._stalls: list[tuple[float, float]] = []

    def worst_since(self, began: float) -> float:
        """Return the longest wait that ended after a time of the monotonic clock [s].

        Waits of less than 30 ms are not counted.
        """
        now = time.monotonic()
        self._take()
        return max((took for ended, took in self._stalls if began <= ended <= now), default=0.0)

    def stalls(self, began: float, ended: float, over: float) -> list[tuple[float, float]]:
        """Return when each wait longer than `over` [s] began and ended, where it touches a time.

        Args:
            began: beginning of that time, by the monotonic clock [s].
            ended: its end.
            over: shorter ones are left out; 30 ms at least.
        """
        self._take()
        waits = [(end - took, end) for end, took in self._stalls if took > over]
        return [wait for wait in waits if wait[0] <= ended and wait[1] >= began]

    def _take(self) -> None:
        while chunk := self._read():
            *lines, self._rest = (self._rest + chunk).split(b"\n")
            for line in lines:
                ended, took = map(float, line.split())
                self._stalls.append((ended, took))

    def _read(self) -> bytes:
        try:
            return os.read(self._told, 65_536)
        except BlockingIOError:
            return b""

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()
