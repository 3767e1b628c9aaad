"""Arrival of connections: how many are let in a second, of each address and in all, and in turn.

Owns the two rates and the order. Where accounts exist, what an address opens beyond its own rate is
closed at once, so that a flood of one host costs the others nothing but the time for that (promise
54). What is within it is let in at the rate of all (promise 20); meanwhile it waits in a short
queue in which the address goes first that was let in longest ago.

Pure: `now` is an argument, and memory is bounded whoever comes. Decides before a connection has a
number, so that no journal notes it.
"""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

from .exposure import is_loopback
from .lockout import SECOND_NS
from .token_bucket import TokenBucket

PER_SECOND = 50
"""Connections let in in one second, all ports together."""

BURST = 20
"""Connections let in at once after a quiet time."""

OF_ADDRESS_PER_SECOND = 10
"""Connections of one address in one second."""

OF_ADDRESS_BURST = 20
"""Connections of one address at once after a quiet time."""

SPARE = 5
"""The last of a burst are for addresses of which nobody was let in during the last second, so that
others who come all the time delay none of them."""

MOST_ADDRESSES = 4_096
"""Addresses whose rate is remembered; of more the one that came longest ago is forgotten."""

MOST_WAITING = 64
"""Connections that wait to be let in, of all addresses; of more the address with most loses one."""

_HEAD_START_NS = SECOND_NS
"""An address that was not let in for so long is as good as one that never was: if it were better,
ever new addresses would keep one out that waits."""


class AddressRates:
    """The rate of each address."""

    def __init__(self, most_addresses: int = MOST_ADDRESSES) -> None:
        """Remember no address yet."""
        self._most = most_addresses
        # In the order in which they came last.
        self._rates: dict[str, TokenBucket] = {}

    def __len__(self) -> int:
        """Return how many addresses are remembered."""
        return len(self._rates)

    def is_within(self, source: str, now: int) -> bool:
        """Return True if one more connection of an address may be looked at; it is counted then."""
        rate = self._rates.pop(source, None)
        if rate is None:
            rate = TokenBucket(OF_ADDRESS_PER_SECOND, OF_ADDRESS_BURST)
            if len(self._rates) >= self._most:
                del self._rates[next(iter(self._rates))]
        self._rates[source] = rate
        return not rate.take(now)


_T = TypeVar("_T")


class FairQueue(Generic[_T]):
    """What waits to be let in: in turn by address, within one in the order of arrival.

    What comes from this machine itself is never sent away for its number; whoever adds it has to
    stop where enough of it waits.

    Attributes:
        own: how many of this machine wait.
    """

    def __init__(self, most: int = MOST_WAITING, most_addresses: int = MOST_ADDRESSES) -> None:
        """Make an empty queue."""
        self.own = 0
        self._others = 0
        self._most = most
        self._most_addresses = most_addresses
        self._waiting: dict[str, deque[tuple[int, _T]]] = {}
        # When each address was let in last [ns], in that order.
        self._let_in: dict[str, int] = {}

    def __len__(self) -> int:
        """Return how many wait."""
        return self.own + self._others

    def add(self, source: str, item: _T, now: int) -> _T | None:
        """Have somebody wait; return who has to go for it, which may be himself."""
        self._waiting.setdefault(source, deque()).append((now, item))
        self._count(source, 1)
        if self._others <= self._most:
            return None
        others = (each for each in self._waiting if not is_loopback(each))
        fullest = max(others, key=lambda each: (len(self._waiting[each]), each == source))
        _, gone = self._waiting[fullest].pop()
        self._count(fullest, -1)
        return gone

    def _count(self, source: str, change: int) -> None:
        """Take note that of an address one more waits, or one less."""
        if is_loopback(source):
            self.own += change
        else:
            self._others += change
        if not self._waiting[source]:
            del self._waiting[source]

    def next_spare(self, now: int) -> int:
        """Return how much of a burst the next of a queue that is not empty has to leave."""
        let_in = self._let_in.get(self._next())
        return 0 if let_in is None or now - let_in >= SECOND_NS else SPARE

    def take(self, now: int) -> _T:
        """Take the next of a queue that is not empty."""
        source = self._next()
        _, item = self._waiting[source].popleft()
        self._count(source, -1)
        self._let_in.pop(source, None)
        self._let_in[source] = now
        if len(self._let_in) > self._most_addresses:
            del self._let_in[next(iter(self._let_in))]
        return item

    def clear(self) -> list[_T]:
        """Return all that wait, which do so no more."""
        left = [item for waiting in self._waiting.values() for _, item in waiting]
        self._waiting.clear()
        self.own = self._others = 0
        return left

    def _next(self) -> str:
        """Return the address that was let in longest ago."""

        def age(source: str) -> int:
            came, _ = self._waiting[source][0]
            return max(self._let_in.get(source, 0), came - _HEAD_START_NS)

        return min(self._waiting, key=age)
