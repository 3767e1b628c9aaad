"""Lock-out: the limit on failed attempts to log in or to pair (promise 29).

Owns counting and locking. 5 failures of one source at one account within 60 s lock that pair for
60 s; each further lock lasts twice as long, up to 15 min. One source may fail 30 times in 60 s over
all names; without this limit one password could be tried at many names. A STOP is never checked
here. Pure: `now` is an argument, and memory is bounded whatever is tried.

An attempt is charged when it is made, not when it has failed: hashing takes time, and a hundred
attempts sent at once would otherwise all pass before the first has failed.
"""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass, field

SECOND_NS = 1_000_000_000
WINDOW_NS = 60 * SECOND_NS
FIRST_LOCK_NS = 60 * SECOND_NS
LONGEST_LOCK_NS = 15 * 60 * SECOND_NS
FORGET_NS = 15 * 60 * SECOND_NS
"""Time without an attempt and without a lock after which the lock time starts from the first."""

PAIR_FAILURES = 5
SOURCE_FAILURES = 30

MOST_RECORDS = 8_192
"""Pairs and sources remembered; a record is about 300 bytes."""

_V6_NETWORK_BITS = 64


def ip_of(address: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """Return an address without its zone, an IPv4 address written in IPv6 as the IPv4 address."""
    try:
        ip = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return None
    return getattr(ip, "ipv4_mapped", None) or ip


def source_of(address: str) -> str:
    """Return the source that the attempts of an address are charged to.

    An IPv6 host can choose any of the 2⁶⁴ addresses of its network, so the network is charged.
    """
    ip = ip_of(address)
    if ip is None:
        return address
    if isinstance(ip, ipaddress.IPv4Address) or ip.is_loopback:
        return str(ip)
    return str(ipaddress.ip_network((ip, _V6_NETWORK_BITS), strict=False))


@dataclass(slots=True)
class _Record:
    """Record of a pair or a source.

    Attributes:
        most: charges that may be open within the window.
        charges: when attempts were made that did not succeed, or are being checked [ns].
        locked_until: end of the present or last lock [ns].
        touched: last attempt [ns].
    """

    most: int
    charges: list[int] = field(default_factory=list)
    locked_until: int = 0
    locks: int = 0
    touched: int = 0

    def free_from(self, now: int) -> int:
        """Return the time of the next allowed attempt; `now` or earlier if it is allowed now."""
        self.charges = [at for at in self.charges if now - at < WINDOW_NS]
        if len(self.charges) >= self.most:
            return max(self.locked_until, self.charges[0] + WINDOW_NS)
        return self.locked_until

    def fail(self, now: int) -> None:
        if len(self.charges) < self.most:
            return
        self.locked_until = now + min(FIRST_LOCK_NS << self.locks, LONGEST_LOCK_NS)
        # From 2⁴ on the longest lock applies; the number need not grow for ever.
        self.locks = min(self.locks + 1, 4)
        self.charges.clear()

    def is_forgotten(self, now: int) -> bool:
        return now - max(self.touched, self.locked_until) >= FORGET_NS


@dataclass(frozen=True, slots=True)
class Charge:
    """An attempt that was let through, to be settled by its outcome.

    Attributes:
        source: who made it, as `source_of` says.
        account: key of the account that was tried; any text for other secrets.
        at: when [ns].
    """

    source: str
    account: str
    at: int


class Lockout:
    """Lock-out of sources and accounts by their failed attempts."""

    def __init__(self, most_records: int = MOST_RECORDS) -> None:
        """Remember nothing yet, and never more than `most_records` pairs and sources."""
        self._most_records = most_records
        # In order of the last attempt, so that the oldest are found without a search.
        self._records: dict[tuple[str, str | None], _Record] = {}

    def __len__(self) -> int:
        """Return how many pairs and sources are remembered."""
        return len(self._records)

    def attempt(self, address: str, account: str, now: int) -> Charge | int:
        """Charge an attempt if it is allowed.

        Returns:
            The charge; or for how long the attempts are refused [ns], where it was not charged.
        """
        source = source_of(address)
        # The source is checked first: a locked source must not fill the memory with names.
        whole = self._record((source, None), SOURCE_FAILURES, now)
        wait = whole.free_from(now) - now
        if wait > 0:
            return wait
        pair = self._record((source, account), PAIR_FAILURES, now)
        wait = pair.free_from(now) - now
        if wait > 0:
            return wait
        whole.charges.append(now)
        pair.charges.append(now)
        return Charge(source, account, now)

    def failed(self, charge: Charge, now: int) -> None:
        """Settle an attempt that failed: its charge stays, and may start a lock."""
        for key in ((charge.source, charge.account), (charge.source, None)):
            record = self._records.get(key)
            if record is not None:
                record.fail(now)

    def succeeded(self, charge: Charge) -> None:
        """Settle an attempt that succeeded: clear the pair, keep the source's other failures."""
        self._records.pop((charge.source, charge.account), None)
        self._refund((charge.source, None), charge.at)

    def withdrawn(self, charge: Charge) -> None:
        """Settle an attempt that was never checked, as if it had not been made."""
        self._refund((charge.source, charge.account), charge.at)
        self._refund((charge.source, None), charge.at)

    def _refund(self, key: tuple[str, str | None], at: int) -> None:
        record = self._records.get(key)
        if record is not None and at in record.charges:
            record.charges.remove(at)

    def _record(self, key: tuple[str, str | None], most: int, now: int) -> _Record:
        record = self._records.pop(key, None)
        if record is None or record.is_forgotten(now):
            record = _Record(most)
            self._make_room(now)
        record.touched = max(record.touched, now)
        self._records[key] = record
        return record

    def _make_room(self, now: int) -> None:
        """Drop expired records, and the oldest one where that does not suffice.

        One source cannot push out its own locks: it is itself locked after 30 names.
        """
        while self._records:
            oldest = next(iter(self._records))
            is_full = len(self._records) >= self._most_records
            if not is_full and not self._records[oldest].is_forgotten(now):
                return
            del self._records[oldest]
