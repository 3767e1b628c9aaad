"""How fast connections are taken and how many there may be, as pure rules (promises 20 and 21).

Owns the rate, the burst and the number of places. Who waits meanwhile, and where, is `listening`'s
business; what a connection may do once it has a place is the core's.
"""

from __future__ import annotations

PER_SECOND = 50
"""Connections taken in one second, all ports together."""

BURST = 20
"""Connections taken at once after a quiet time."""

MOST_STRANGERS = 64
"""Pendants that have not said hello, at once."""

STOP_PLACES = 8
"""Places that only pendants get: whoever wants to stop a robot finds one free of ROS-I clients."""

_INTERVAL_NS = 1_000_000_000 // PER_SECOND


class AcceptRate:
    """A token bucket: `BURST` connections at once, one more each 20 ms.

    It is kept as one number, the time at which the bucket would be full again.
    """

    def __init__(self) -> None:
        """Make a full bucket."""
        self._full_at = 0

    def take(self, now: int) -> int:
        """Take a connection if one may be taken.

        Args:
            now: monotonic time, ns.

        Returns:
            0 where it is taken; else how long to wait before asking again [ns].
        """
        begin = max(self._full_at, now)
        wait = begin - now - (BURST - 1) * _INTERVAL_NS
        if wait > 0:
            return wait
        self._full_at = begin + _INTERVAL_NS
        return 0


def place_fault(
    connections: int, strangers: int, max_connections: int, *, is_pendant: bool
) -> str | None:
    """Return why there is no place for one more connection; None where there is.

    Args:
        connections: how many there are.
        strangers: pendants among them that have not said hello.
        max_connections: how many there may be, as configured.
        is_pendant: whether the new one came to the pendant port.
    """
    if connections >= max_connections:
        return f"more than {max_connections} connections"
    places = max(max_connections - STOP_PLACES, 1)
    if not is_pendant and connections >= places:
        return f"more than {places} connections; the last {STOP_PLACES} are for pendants"
    if is_pendant and strangers >= MOST_STRANGERS:
        return f"more than {MOST_STRANGERS} pendants that did not say hello yet"
    return None
