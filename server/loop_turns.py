"""How much of the event loop the requests of pendants take, and which of them goes first.

Owns the time that all pendants together may have in one turn of the loop, the queue of those who
have to go on in the next one, and that a stop overtakes what its own connection sent before it. The
control ticks, the controllers and every other connection come between the turns, so that no number
of requests holds up a stop or the watchdog's beat. What a request does is nobody's business here.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable, Iterable

from openpendant.simplemsg import Malformed, Received
from openpendant.simplemsg.pendant import (
    AuthorityBeat,
    Enabling,
    Hello,
    JogBeat,
    JogRelease,
    ResetStop,
    SoftwareStop,
)

BUDGET_NS = 5_000_000
"""How long requests may take in one turn of the loop; the last one may take longer.

A twentieth of what the watchdog allows, and more than any single request of an able client takes.
"""

_PROMPT = (SoftwareStop, JogRelease, JogBeat, Enabling, AuthorityBeat)
"""What waits for no turn: each takes microseconds, and a robot stops by it or for want of it."""

_NOT_OVERTAKEN = (SoftwareStop, ResetStop, Hello, Malformed)
"""Behind these a stop stays: a reset must not undo it, and a conversation begins with its hello."""


class LoopTurns:
    """The turns of the event loop, as far as pendants' requests use them up."""

    def __init__(self, clock: Callable[[], int] = time.perf_counter_ns) -> None:
        """Have nobody wait.

        Args:
            clock: a monotonic time [ns] that goes on while a request is handled.
        """
        self._clock = clock
        self._spent = 0
        self._ended = clock()
        self._waiting: deque[Callable[[], None]] = deque()
        self._is_set = False

    def is_spent(self) -> bool:
        """Tell whether requests had their time in this turn.

        Nobody counts the turns while nobody waits; a pause as long as the budget says as well that
        the others had theirs.
        """
        if not self._waiting and self._clock() - self._ended > BUDGET_NS:
            self._spent = 0
        return self._spent >= BUDGET_NS

    def handle(self, request: Callable[[], None]) -> None:
        """Have a request handled, and count the time that it takes."""
        begun = self._clock()
        try:
            request()
        finally:
            self._ended = self._clock()
            self._spent += self._ended - begun

    def wait(self, go_on: Callable[[], None]) -> None:
        """Have somebody go on in the next turn, behind all who wait already."""
        self._waiting.append(go_on)
        self._set_next()

    def _set_next(self) -> None:
        if not self._is_set:
            self._is_set = True
            asyncio.get_running_loop().call_soon(self._begin)

    def _begin(self) -> None:
        """Begin a turn: who waited longest goes first."""
        self._is_set = False
        self._spent = 0
        try:
            # Whoever is put back into the queue meanwhile waits for the turn after this one.
            for _ in range(len(self._waiting)):
                if self.is_spent():
                    break
                self._waiting.popleft()()
        finally:
            if self._waiting:
                self._set_next()


def is_prompt(received: Received) -> bool:
    """Tell whether something is taken at once, however much the turn was used."""
    return isinstance(received, _PROMPT)


def stops_first(frames: Iterable[Received]) -> deque[Received]:
    """Return a connection's frames with each software stop as far to the front as is safe.

    What it overtakes finds the robot stopped and the stop latched. All others keep their order.
    """
    ordered: deque[Received] = deque()
    overtaken: list[Received] = []
    for frame in frames:
        if isinstance(frame, SoftwareStop):
            ordered.append(frame)
        elif isinstance(frame, _NOT_OVERTAKEN):
            ordered.extend(overtaken)
            overtaken.clear()
            ordered.append(frame)
        else:
            overtaken.append(frame)
    ordered.extend(overtaken)
    return ordered
