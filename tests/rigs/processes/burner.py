"""A process that burns one core in bursts, and the rule of which samples beside it are void.

A sample is void, and told as such, where an idle timer of the same priority was late by more than
50 ms meanwhile: then the machine itself was late, and nothing on it could have been in time. A run
of which more than a tenth of the time was void is repeated.
"""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from promises.promise_table import COMMON, figure
from rigs.clock.stall_watch import StallWatch

BURST = 0.3
"""How long it burns, and how long it sleeps between two bursts [s]."""

VOID_OVER = figure(COMMON, "idle").seconds
"""An idle timer that is later than this says that the machine was late [s]."""

MOST_VOID = figure(COMMON, "void_share").bound / 100.0
"""A run with a greater share of void time is repeated."""

_BURN = """
import sys, time
burst = float(sys.argv[1])
while True:
    ends = time.monotonic() + burst
    while time.monotonic() < ends:
        pass
    time.sleep(burst)
"""


@contextmanager
def burner(burst: float = BURST) -> Iterator[None]:
    """Burn one core in bursts while the context lasts, at the priority of whoever asks for it."""
    process = subprocess.Popen([sys.executable, "-I", "-S", "-c", _BURN, str(burst)])
    try:
        yield
    finally:
        process.kill()
        process.wait()


class VoidTime:
    """Tells which time is void, by an idle timer of the priority of whoever made it."""

    def __init__(self) -> None:
        """Start the timer, in a process of its own."""
        self._watch = StallWatch()

    def within(self, began: float, ended: float) -> float:
        """Return how much of a time was void [s]; times are of the monotonic clock."""
        waits = self._touching(began, ended)
        return sum(min(end, ended) - max(begin, began) for begin, end in waits)

    def is_void(self, began: float, ended: float) -> bool:
        """Tell whether a sample between two times is void."""
        return bool(self._touching(began, ended))

    def _touching(self, began: float, ended: float) -> list[tuple[float, float]]:
        waits = self._watch.stalls(VOID_OVER)
        return [(due, woke) for due, woke in waits if due <= ended and woke >= began]

    def end(self) -> None:
        """End the timer."""
        self._watch.end()
