"""Lock-out: the limit on failed attempts of one address at one account (promise 29).

Owns counting and locking. 5 failures of one source at one account within 60 s lock that pair for
60 s; each further lock lasts twice as long, up to 15 min. Nothing else is locked: whoever guesses
at many names is checked behind all others (`login_queue`), and keeps nobody out. A STOP is never
checked here. Pure: `now` is an argument, and memory is bounded whatever is tried.

An attempt is charged when it is made, not when it has failed: it waits for its turn, hashing takes
time, and a hundred attempts sent at once would otherwise all pass before the first has failed. A
lock counts from the last attempt that led to it, so that whoever is refused is told at once how
long it lasts if all that are still to be checked are wrong.
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

MOST_RECORDS = 8_192
"""Pairs remembered; a record is about 400 bytes."""

MOST_ACCOUNTS = 1_024
"""Pairs of one source among them. A source that guesses at many names is checked once a second, so
that what it makes forgotten of itself is 17 minutes old: no lock lasts that long."""

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
    """Record of a pair.

    Attributes:
        waiting: when the attempts were made that are not settled [ns].
        failures: when those were made that failed since the last lock [ns].
        has_failed: an attempt failed since one succeeded.
        locked_until: end of the present or last lock [ns].
        touched: last attempt [ns].
    """

    waiting: list[int] = field(default_factory=list)
    failures: list[int] = field(default_factory=list)
    has_failed: bool = False
    locked_until: int = 0
    locks: int = 0
    touched: int = 0

    def free_from(self, now: int) -> int:
        """Return the time of the next allowed attempt; `now` or earlier if it is allowed now."""
        if not self.waiting:
            self.failures = [at for at in self.failures if now - at < WINDOW_NS]
        # Whatever waits counts as wrong, for as long as the lock would last that it leads to: a
        # queue that is longer keeps nobody out, and lets nobody guess more often.
        charged = sorted(self.waiting + self.failures)
        if not _are_many(charged):
            return self.locked_until
        return max(self.locked_until, charged[-1] + self._next_lock())

    def fail(self, at: int) -> None:
        self.waiting.remove(at)
        self.has_failed = True
        self.failures = sorted([*self.failures, at])
        if _are_many(self.failures):
            self.locked_until = max(self.locked_until, self.failures[-1] + self._next_lock())
            # From 2⁴ on the longest lock applies; the number need not grow for ever.
            self.locks = min(self.locks + 1, 4)
            self.failures.clear()
        del self.failures[: -(PAIR_FAILURES - 1)]

    def _next_lock(self) -> int:
        return min(FIRST_LOCK_NS << self.locks, LONGEST_LOCK_NS)

    def is_forgotten(self, now: int) -> bool:
        return not self.waiting and now - max(self.touched, self.locked_until) >= FORGET_NS


def _are_many(times: list[int]) -> bool:
    """Return True if the last attempts are as many within a minute as lead to a lock.

    Args:
        times: when they were made, in order [ns].
    """
    return len(times) >= PAIR_FAILURES and times[-1] - times[-PAIR_FAILURES] < WINDOW_NS


@dataclass(frozen=True, slots=True)
class Charge:
    """An attempt that was let through, to be settled by its outcome.

    Attributes:
        source: who made it, as `source_of` says.
        account: key of the account that was tried, never shown: it may be a password in the wrong
            field; any text for other secrets.
        at: when [ns].
        has_failed: an earlier attempt of the pair failed, and none succeeded since.
    """

    source: str
    account: str = field(repr=False)
    at: int
    has_failed: bool


class Lockout:
    """Lock-out of accounts, each at one source, by the failed attempts there."""

    def __init__(
        self, most_records: int = MOST_RECORDS, most_accounts: int = MOST_ACCOUNTS
    ) -> None:
        """Remember nothing yet.

        Args:
            most_records: never more than so many pairs.
            most_accounts: of these never more of one source.
        """
        self._most_records = most_records
        self._most_accounts = most_accounts
        # In order of the last attempt, so that the oldest are found without a search; of each
        # source the accounts in that order, too.
        self._records: dict[tuple[str, str], _Record] = {}
        self._accounts: dict[str, dict[str, None]] = {}

    def __len__(self) -> int:
        """Return how many pairs are remembered."""
        return len(self._records)

    def attempt(self, address: str, account: str, now: int) -> Charge | int:
        """Charge an attempt if it is allowed.

        Returns:
            The charge; or for how long the attempts are refused [ns], where it was not charged.
        """
        source = source_of(address)
        pair = self._record(source, account, now)
        wait = pair.free_from(now) - now
        if wait > 0:
            return wait
        pair.waiting.append(now)
        return Charge(source, account, now, pair.has_failed)

    def failed(self, charge: Charge) -> None:
        """Settle an attempt that failed: it may start a lock."""
        record = self._records.get((charge.source, charge.account))
        if record is not None and charge.at in record.waiting:
            record.fail(charge.at)

    def succeeded(self, charge: Charge) -> None:
        """Settle an attempt that succeeded: the pair starts afresh."""
        self._forget(charge.source, charge.account)

    def withdrawn(self, charge: Charge) -> None:
        """Settle an attempt that was never checked, as if it had not been made."""
        record = self._records.get((charge.source, charge.account))
        if record is not None and charge.at in record.waiting:
            record.waiting.remove(charge.at)
            if not (record.waiting or record.has_failed):
                self._forget(charge.source, charge.account)

    def _record(self, source: str, account: str, now: int) -> _Record:
        record = self._records.get((source, account))
        self._forget(source, account)
        if record is None or record.is_forgotten(now):
            record = _Record()
            self._make_room(source, now)
        record.touched = max(record.touched, now)
        self._records[source, account] = record
        self._accounts.setdefault(source, {})[account] = None
        return record

    def _make_room(self, source: str, now: int) -> None:
        """Drop expired records, and the oldest one where that does not suffice."""
        while self._records:
            oldest = next(iter(self._records))
            is_full = len(self._records) >= self._most_records
            if not is_full and not self._records[oldest].is_forgotten(now):
                break
            self._forget(*oldest)
        accounts = self._accounts.get(source, {})
        if len(accounts) >= self._most_accounts:
            self._forget(source, next(iter(accounts)))

    def _forget(self, source: str, account: str) -> None:
        if self._records.pop((source, account), None) is not None:
            del self._accounts[source][account]
            if not self._accounts[source]:
                del self._accounts[source]
