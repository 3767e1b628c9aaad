"""Token bucket: a rate with a burst, kept as one number.

Pure: `now` is an argument.
"""

from __future__ import annotations

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
