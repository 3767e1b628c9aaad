"""Token bucket: a rate with a burst, kept as one number; one for each connection, and its refusal.

Pure: `now` is an argument.
"""

from __future__ import annotations

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .lockout import SECOND_NS


class TokenBucket:
    """So many tokens at once, one more each interval.

    It is kept as the time at which the bucket would be full again.
    """

    __slots__ = ("_burst", "_full_at", "_interval")

    def __init__(self, per_second: int, burst: int) -> None:
        """Make a full bucket."""
        self._full_at = 0
        self._interval = SECOND_NS // per_second
        self._burst = burst

    def wait(self, now: int, spare: int = 0, tokens: int = 1) -> int:
        """Return how long to wait before so many tokens may be taken [ns]; 0 for not at all.

        Args:
            spare: so many of the burst have to be left; negative where some may be owed.
            tokens: at most the burst.
        """
        begin = max(self._full_at, now)
        return max(0, begin - now - (self._burst - tokens - spare) * self._interval)

    def take(self, now: int, spare: int = 0, tokens: int = 1) -> int:
        """Take tokens if that many may be taken.

        Returns:
            0 where they are taken; else how long to wait before asking again [ns].
        """
        wait = self.wait(now, spare, tokens)
        if not wait:
            self._full_at = max(self._full_at, now) + tokens * self._interval
        return wait


class SessionRates:
    """The same rate for each connection by itself."""

    def __init__(self, per_second: int, burst: int) -> None:
        """Know no connection yet."""
        self._rate = per_second, burst
        self._buckets: dict[int, TokenBucket] = {}

    def of(self, session: int) -> TokenBucket:
        """Return the bucket of a connection, a full one where it is new."""
        bucket = self._buckets.get(session)
        if bucket is None:
            bucket = self._buckets[session] = TokenBucket(*self._rate)
        return bucket

    def take(self, session: int, what: str, now: int) -> Refusal | None:
        """Count a question of a connection, or say why it is refused; such a one counts nothing.

        Args:
            what: is asked too often, in the plural.
        """
        per_second, _ = self._rate
        wait = self.of(session).take(now)
        if not wait:
            return None
        return too_often(f"{per_second} {what} a second and connection", wait, per_second)

    def forget(self, session: int) -> None:
        """Forget a connection that ended."""
        self._buckets.pop(session, None)


def too_often(bound: str, wait: int, limit: int) -> Refusal:
    """Return why a question is refused that came too soon.

    Args:
        bound: of what there may not be more, in words.
        wait: until it may be asked again [ns].
        limit: questions in one second.
    """
    seconds = wait / SECOND_NS
    text = f"more than {bound}; ask again in {seconds:.3f} s"
    return Refusal(VerdictCode.TOO_OFTEN, text, value=seconds, limit=float(limit))
