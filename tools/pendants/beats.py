"""The beats of one press, as whoever sends them sees them."""

from __future__ import annotations


class Beats:
    """How often a press was beaten, and whether always in time.

    The server ends a press once no beat came within the deadline. Where none left in time, none
    came in time; so the press is over, though the server's word on it may still be on its way.
    """

    def __init__(self, deadline: float, now: float) -> None:
        """Begin with the press itself, which counts as a beat.

        Args:
            deadline: the longest gap that the server takes [s].
            now: when the press leaves [s].
        """
        self._deadline = deadline
        self._count = 0
        self._latest = now
        self._longest = 0.0

    def next(self, now: float) -> int:
        """Return the number of the beat that leaves now."""
        self._longest = self.longest_gap(now)
        self._latest = now
        self._count += 1
        return self._count

    def longest_gap(self, now: float) -> float:
        """Return the longest time between two beats so far, the one since the latest too [s]."""
        return max(self._longest, now - self._latest)

    def are_late(self, now: float) -> bool:
        """Tell whether a beat ever left too late, or is too late by now."""
        return self.longest_gap(now) >= self._deadline
