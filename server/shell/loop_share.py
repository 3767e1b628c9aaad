"""Share of the event loop that all clients together have in one iteration of it (promise 53).

A turn of one connection is short, but the loop gives one to each connection in every iteration, and
a tick waits until all have had theirs. So turns of clients take no more than a share of processor
time an iteration: what comes beyond it is read, looked through for a STOP, and handled in a later
one. Whoever has cost least goes first (start-time fair queueing, Goyal, Vin, Cheng 1996), so that
the heartbeat of a held key does not wait behind a hundred connections that send all they can.

An iteration may be short: with thirty robots there are hundreds a second, and a share of each adds
up to more than the robots leave. So where a tick was late, clients wait between shares, several
times as long as they have just cost, until one is on time again: robots go first.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from heapq import heappop, heappush
from itertools import count

SHARE_NS = 1_000_000
"""Processor time after which no other turn of a client begins in an iteration: with the dearest
turn, 2 ms, a tick waits 3 ms for clients, however many there are."""

LATE_NS = 3_000_000
"""A tick that is later than this makes clients wait for the robots."""

YIELDS = 5
"""So many times as long as what they have just cost clients wait then: a sixth of the processor is
theirs, twice what thirty pendants need that hold a key each."""

LONGEST_WAIT_NS = 10_000_000
"""They wait no longer than this, an ordinary tick, whatever one turn has cost."""


class LoopShare:
    """The share of one server's clients, and who waits for a turn.

    Attributes:
        spent: processor time of turns since the last iteration that began with a new share [ns].
        served: start tag of the turn that was given last; a newcomer begins here, so that who was
            silent for long has saved up nothing [ns].
    """

    def __init__(self) -> None:
        """Make a share of which nothing is used."""
        self.spent = 0
        self.served = 0
        self._waiting: list[tuple[int, int, Callable[[], None]]] = []
        self._order = count()
        self._is_renewed_next = False
        self._is_late = False

    def ticked(self, late: int) -> None:
        """Take note of how late a tick began [ns]; clients give way to robots while one is late."""
        self._is_late = late > LATE_NS

    def wait(self, tag: int, go_on: Callable[[], None]) -> None:
        """Have a turn begin in a later iteration, the lowest start tag first.

        Args:
            tag: what the turns of the connection have cost so far, from `served` on [ns].
        """
        heappush(self._waiting, (tag, next(self._order), go_on))
        self.renew()

    def renew(self) -> None:
        """Begin the next iteration, or a later one, with a new share, and with those who wait."""
        if self._is_renewed_next:
            return
        self._is_renewed_next = True
        loop = asyncio.get_running_loop()
        if self._is_late:
            loop.call_later(min(YIELDS * self.spent, LONGEST_WAIT_NS) / 1e9, self._begin)
        else:
            loop.call_soon(self._begin)

    def _begin(self) -> None:
        self._is_renewed_next = False
        self.spent = 0
        # Who asks for another turn meanwhile has it in the next iteration, after a look at sockets.
        ready, self._waiting = self._waiting, []
        while ready and self.spent < SHARE_NS:
            tag, _, go_on = heappop(ready)
            self.served = max(self.served, tag)
            go_on()
        for each in ready:
            heappush(self._waiting, each)
        if self._waiting:
            self.renew()
