"""The queue for the password worker: whose password is checked next, and who finds no room.

Owns the order (promise 29), which nobody can bend by asking more often. Addresses take turns,
within one the accounts do, and one check is under way at a time. At an address the accounts without
a failure there go first, so that whoever guesses at a pupil's name, or at thirty of his own, waits
behind a class that logs in. An address whose checks found 60 wrong passwords within a minute, at
whatever names, goes behind all others and is checked once a second; it is never locked.

Owns who is turned away where too many wait: of the address with the most waiting, from the account
with the most, who came last. So no address keeps the login of another out.

Pure: `now` is an argument, and memory is bounded whatever is tried. Must not know what a check is;
`lockout` owns how often an account may be tried at an address.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import count

from .lockout import SECOND_NS, WINDOW_NS

MOST_WAITING = 256
"""Checks that may wait, as many as there are connections by default: a minute's work where one
takes 0.25 s."""

SLOWED_FROM = 60
"""Wrong passwords of one address within a minute from which on its checks go last and slowly."""

SLOW_NS = SECOND_NS
"""Time between the beginnings of two checks of such an address."""

FRESH_IN_A_ROW = 11
"""Checks of accounts without a failure after which one with a failure at that address has a turn,
where both wait. Without it new names, one after the other, would keep out whoever mistyped once."""


@dataclass(frozen=True, slots=True)
class QueuedCheck:
    """A check in the queue.

    Attributes:
        number: unlike that of any other.
        source: address that asks, as `lockout.source_of` says.
        account: key of the account; never shown, it may be a password in the wrong field.
        has_failed: an attempt at this account failed from there, and none succeeded since.
    """

    number: int
    source: str
    account: str = field(repr=False)
    has_failed: bool = False


@dataclass(slots=True)
class _Account:
    """What waits for one account at one address, the longest first.

    Attributes:
        turn: accounts of one address have their turns in this order.
    """

    turn: int
    has_failed: bool = False
    waiting: deque[QueuedCheck] = field(default_factory=deque)


@dataclass(slots=True)
class _Source:
    """What waits at one address.

    Attributes:
        turn: addresses have their turns in this order.
        fresh: checks of accounts without a failure since one with a failure had its turn.
    """

    turn: int
    accounts: dict[str, _Account] = field(default_factory=dict, repr=False)
    fresh: int = 0

    @property
    def waiting(self) -> int:
        return sum(len(account.waiting) for account in self.accounts.values())


@dataclass(slots=True)
class _Failures:
    """The last wrong passwords of one address.

    Attributes:
        at: when they were found wrong [ns].
        began: when its last check began [ns].
        is_told: that it goes slowly, once until a minute passes without any.
    """

    at: deque[int] = field(default_factory=lambda: deque(maxlen=SLOWED_FROM))
    began: int = 0
    is_told: bool = False

    def are_many(self, now: int) -> bool:
        return len(self.at) == SLOWED_FROM and now - self.at[0] < WINDOW_NS


class LoginQueue:
    """The checks that wait, and the one that is under way."""

    def __init__(self, most_waiting: int = MOST_WAITING) -> None:
        """Make an empty queue; never more than `most_waiting` checks wait."""
        self._most_waiting = most_waiting
        self._sources: dict[str, _Source] = {}
        self._waiting: dict[int, QueuedCheck] = {}
        self._under_way: QueuedCheck | None = None
        # In order of the last wrong password.
        self._failures: dict[str, _Failures] = {}
        self._turns = count(1)

    def __len__(self) -> int:
        """Return how many checks wait; the one under way does not."""
        return len(self._waiting)

    @property
    def under_way(self) -> QueuedCheck | None:
        """The check that `take` gave out and that is not settled; None where there is none."""
        return self._under_way

    def remembered(self) -> int:
        """Return of how many addresses wrong passwords are remembered."""
        return len(self._failures)

    def put(self, check: QueuedCheck) -> QueuedCheck | None:
        """Take a check into the queue.

        Returns:
            The one for which there is no room now, perhaps this; None where there is room for all.
        """
        source = self._sources.get(check.source)
        if source is None:
            source = self._sources[check.source] = _Source(next(self._turns))
        account = source.accounts.get(check.account)
        if account is None:
            account = source.accounts[check.account] = _Account(next(self._turns))
        account.has_failed |= check.has_failed
        account.waiting.append(check)
        self._waiting[check.number] = check
        if len(self._waiting) <= self._most_waiting:
            return None
        return self._turn_away()

    def _turn_away(self) -> QueuedCheck:
        """Take out who came last for the account with the most waiting, of the fullest address."""
        fullest = max(self._sources.values(), key=lambda each: (each.waiting, each.turn))
        account = max(
            fullest.accounts.values(),
            key=lambda each: (len(each.waiting), each.has_failed, each.turn),
        )
        check = account.waiting[-1]
        self.withdraw(check.number)
        return check

    def withdraw(self, number: int) -> bool:
        """Take a check out; return False where it does not wait: it is under way, or settled."""
        check = self._waiting.pop(number, None)
        if check is None:
            return False
        self._sources[check.source].accounts[check.account].waiting.remove(check)
        self._drop_idle(check)
        return True

    def take(self, now: int) -> QueuedCheck | int | None:
        """Begin the next check; nothing else may be under way.

        Returns:
            The check; how long to wait before asking again [ns], where all that wait go slowly;
            None where nothing waits.
        """
        assert self._under_way is None, "one check at a time is under way"
        waiting = {name: each for name, each in self._sources.items() if each.waiting}
        if not waiting:
            return None
        slow = {name for name in waiting if self._goes_slowly(name, now)}
        allowed = waiting.keys() - slow
        if not allowed:
            free_from = {name: self._failures[name].began + SLOW_NS for name in slow}
            allowed = {name for name in slow if free_from[name] <= now}
            if not allowed:
                return min(free_from.values()) - now
        name = min(allowed, key=lambda each: waiting[each].turn)
        return self._begin(name, waiting[name], now)

    def _goes_slowly(self, name: str, now: int) -> bool:
        failures = self._failures.get(name)
        return failures is not None and failures.are_many(now)

    def _begin(self, name: str, source: _Source, now: int) -> QueuedCheck:
        account = _next_account(source)
        check = self._under_way = account.waiting.popleft()
        del self._waiting[check.number]
        if name in self._failures:
            self._failures[name].began = now
        return check

    def settle(self, is_right: bool | None, now: int) -> bool:
        """Take the outcome of the check under way; None for one that was no check of a password.

        Returns:
            True if its address goes slowly from now on; once until it is quiet for a minute.
        """
        check, self._under_way = self._under_way, None
        assert check is not None, "a check is under way"
        source = self._sources[check.source]
        account = source.accounts[check.account]
        # Whoever came meanwhile has his turn first.
        source.turn, account.turn = next(self._turns), next(self._turns)
        if is_right is not None:
            account.has_failed = not is_right
        self._drop_idle(check)
        return is_right is False and self._note_failure(check.source, now)

    def _note_failure(self, name: str, now: int) -> bool:
        """Count a wrong password; return True if its address goes slowly from now on."""
        for oldest in _expired(self._failures.items(), now):
            del self._failures[oldest]
        failures = self._failures.pop(name, None) or _Failures()
        self._failures[name] = failures
        failures.at.append(now)
        was_told, failures.is_told = failures.is_told, failures.is_told or failures.are_many(now)
        return failures.is_told and not was_told

    def _drop_idle(self, check: QueuedCheck) -> None:
        """Forget an account and an address for which nothing waits and nothing is under way."""
        source, busy = self._sources[check.source], self._under_way
        is_busy = busy is not None and (busy.source, busy.account) == (check.source, check.account)
        if not source.accounts[check.account].waiting and not is_busy:
            del source.accounts[check.account]
        if not source.accounts:
            del self._sources[check.source]


def _next_account(source: _Source) -> _Account:
    """Return the account whose turn it is at an address, and count that it has it."""
    waiting = [account for account in source.accounts.values() if account.waiting]
    failed = [account for account in waiting if account.has_failed]
    fresh = [account for account in waiting if not account.has_failed]
    if failed and (not fresh or source.fresh >= FRESH_IN_A_ROW):
        source.fresh = 0
        chosen = failed
    else:
        source.fresh += 1
        chosen = fresh
    return min(chosen, key=lambda account: account.turn)


def _expired(failures: Iterable[tuple[str, _Failures]], now: int) -> list[str]:
    """Return the addresses whose last wrong password is more than a minute old: they come first."""
    found: list[str] = []
    for name, each in failures:
        if now - each.at[-1] < WINDOW_NS:
            break
        found.append(name)
    return found
