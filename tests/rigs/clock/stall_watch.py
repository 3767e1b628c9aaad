"""How long the machine let a process wait that wanted nothing but to be woken."""

import os
import subprocess
import sys
import time

NOTED = 0.02
"""Lateness from which on it is told, unless a watch is asked for less [s]."""

_WATCH = """
import sys, time
noted = float(sys.argv[1])
asleep = 0.01
last = time.monotonic()
while True:
    time.sleep(asleep)
    now = time.monotonic()
    if now - last - asleep >= noted:
        print(last + asleep, now, flush=True)
    last = now
"""

_TELLING = 0.03
"""What holds the process up at this moment it can only tell afterwards [s]."""


class StallWatch:
    """An idle control beside tests on the real clock: a process that sleeps 10 ms at a time.

    It has the priority of whoever starts it.

    Attributes:
        pid: its process id.
    """

    def __init__(self, noted: float = NOTED) -> None:
        """Start it.

        Args:
            noted: lateness from which on it is told [s].
        """
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-S", "-c", _WATCH, str(noted)], stdout=subprocess.PIPE
        )
        assert self._process.stdout is not None
        self.pid = self._process.pid
        self._told = self._process.stdout.fileno()
        os.set_blocking(self._told, False)
        self._rest = b""
        self._stalls: list[tuple[float, float]] = []

    def now(self) -> float:
        """Return the time of the clock that it goes by [s]."""
        return time.monotonic()

    def stalls(self, more_than: float) -> list[tuple[float, float]]:
        """Return when it was due and when it was woken [s], each time it was later than so much."""
        time.sleep(_TELLING)
        while chunk := self._read():
            *lines, self._rest = (self._rest + chunk).split(b"\n")
            for line in lines:
                due, woke = map(float, line.split())
                self._stalls.append((due, woke))
        return [(due, woke) for due, woke in self._stalls if woke - due > more_than]

    def worst_since(self, began: float) -> float:
        """Return by how much the latest wake-up since a time of the clock was late [s].

        Lateness that is not told is none.
        """
        return max((woke - due for due, woke in self.stalls(0.0) if woke >= began), default=0.0)

    def _read(self) -> bytes:
        try:
            return os.read(self._told, 65_536)
        except BlockingIOError:
            return b""

    def end(self) -> None:
        self._process.kill()
        self._process.communicate()
