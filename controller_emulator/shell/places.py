"""Places at an emulator for other machines: how many connections, and how often, by address.

Owns who beyond this machine is let in; whoever is, no newcomer displaces, so that the one whose
motion is streamed keeps its place. Nobody has to log in here, so that an address is all there is to
tell one from another. This machine's own addresses are not counted: a server beside the emulator
always finds its place.

Decides before a connection has a number or stands in a journal. Must not know what is said on one.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import cast

from ..float32 import NANOSECONDS

PER_SECOND = 10
"""Connections of one address that are let in in a second."""

BURST = 20
"""Connections of one address that are let in at once after a quiet time."""

MOST_AN_ADDRESS = 16
"""Connections of one address at a time, both ports together."""

MOST_STRANGERS = 64
"""Connections of all other machines at a time, both ports together."""

MOST_RATES = 1_024
"""Addresses whose rates are kept; of more the one that was seen first goes."""

_INTERVAL = NANOSECONDS // PER_SECOND

_SILENCE = 10 * NANOSECONDS
"""After a refusal was told, none is for so long [ns]."""

log = logging.getLogger("openpendant.emulator")


@lru_cache(maxsize=MOST_RATES)  # asked of every open connection at each new one
def counted_as(address: str) -> str:
    """Return what an address is counted as: itself, an IPv6 address its /64; empty for loopback."""
    if address in ("127.0.0.1", "::1", ""):
        return ""
    import ipaddress  # imported here because most runs need none, and the emulator must start fast

    ip = ipaddress.ip_address(address.partition("%")[0])
    if isinstance(ip, ipaddress.IPv6Address):
        if ip.ipv4_mapped is None:
            return str(ipaddress.IPv6Network((ip, 64), strict=False))
        ip = ip.ipv4_mapped
    return "" if ip.is_loopback else str(ip)


class EmulatorRates:
    """A token bucket for each address, kept as the time at which it would be full again.

    The server's, which knows more, is its own: the two rooms share the wire and the robot files,
    neither of which knows any time.
    """

    def __init__(self) -> None:
        """Make them full."""
        self._full_at: dict[str, int] = {}

    def take(self, address: str, now: int) -> bool:
        """Return True if another connection of an address may be let in now [ns]; count it then."""
        begin = max(self._full_at.get(address, 0), now)
        if begin - now > (BURST - 1) * _INTERVAL:
            return False
        self._full_at.pop(address, None)
        self._full_at[address] = begin + _INTERVAL
        if len(self._full_at) > MOST_RATES:
            del self._full_at[next(iter(self._full_at))]
        return True


class EmulatorPlaces:
    """Places for connections of other machines."""

    def __init__(self, taken: Callable[[], Iterable[str]], clock: Callable[[], int]) -> None:
        """Make a rule under which all places are free.

        Args:
            taken: returns the address of every connection there is.
            clock: the monotonic time [ns].
        """
        self._taken = taken
        self._clock = clock
        self._rates = EmulatorRates()
        self._told: int | None = None

    def lets_in(self, address: str, own: str) -> bool:
        """Return True if there is a place for one more connection; count it against its rate.

        Args:
            address: where it comes from.
            own: the address of this machine that it came to.
        """
        group = "" if address == own else counted_as(address)
        if not group:
            return True
        now = self._clock()
        problem = self._problem(group, own, now)
        if not problem:
            return True
        if self._told is None or now - self._told >= _SILENCE:
            self._told = now
            log.warning("a connection of %s is refused: %s", group, problem)
        return False

    def _problem(self, group: str, own: str, now: int) -> str:
        """Return why there is no place; empty where there is one."""
        taken = Counter(counted_as(each) for each in self._taken() if each != own)
        if taken[group] >= MOST_AN_ADDRESS:
            return f"it has {MOST_AN_ADDRESS} already"
        if taken.total() - taken[""] >= MOST_STRANGERS:
            return f"other machines have {MOST_STRANGERS} already"
        if not self._rates.take(group, now):
            return f"more than {PER_SECOND} a second, and {BURST} at once"
        return ""


class EmulatorNewcomer(asyncio.Protocol):
    """A connection that was just accepted: a link takes it over, or it is closed at once."""

    def __init__(self, places: EmulatorPlaces, link: Callable[[], asyncio.Protocol]) -> None:
        """Make one that is not connected yet; `link` makes the protocol that takes it over."""
        self._places = places
        self._link = link

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Hand the connection on; called by the loop."""
        made = cast(asyncio.Transport, transport)  # uvloop's are none by class
        peer, own = made.get_extra_info("peername"), made.get_extra_info("sockname")
        if peer and not self._places.lets_in(peer[0], own[0] if own else ""):
            made.abort()
            return
        link = self._link()
        made.set_protocol(link)
        link.connection_made(made)
