"""How fast connections are taken and how many there may be, as pure rules (promises 20 and 21).

Owns the rate, the burst and the number of places. Who waits meanwhile, and where, is `listening`'s
business; what a connection may do once it has a place is the core's.
"""

from __future__ import annotations

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal

PER_SECOND = 50
"""Connections taken in one second, all ports together."""

BURST = 20
"""Connections taken at once after a quiet time."""

MOST_STRANGERS = 64
"""Pendants that have not said hello, at once."""

STOP_PLACES = 8
"""Places that only pendants get: whoever wants to stop a robot finds one free of ROS-I clients."""

_AGAIN_WHEN_FULL = 5
"""Advice to whom all places are taken [s]: some may have left by then."""

_AGAIN_WHEN_STRANGE = 2
"""Advice to whom strangers take the places [s]: by then these have said hello, or are gone."""

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


def place_refusal(
    connections: int, strangers: int, max_connections: int, *, is_pendant: bool
) -> Refusal | None:
    """Return why there is no place for one more connection; None where there is.

    Its value is how long to wait before coming again [s].

    Args:
        connections: how many there are.
        strangers: pendants among them that have not said hello.
        max_connections: how many there may be, as configured.
        is_pendant: whether the new one came to the pendant port.
    """
    if connections >= max_connections:
        return _no_place(f"more than {max_connections} connections", _AGAIN_WHEN_FULL)
    places = max(max_connections - STOP_PLACES, 1)
    if not is_pendant and connections >= places:
        text = f"more than {places} connections; the last {STOP_PLACES} are for pendants"
        return _no_place(text, _AGAIN_WHEN_FULL)
    if is_pendant and strangers >= MOST_STRANGERS:
        text = f"more than {MOST_STRANGERS} pendants that did not say hello yet"
        return _no_place(text, _AGAIN_WHEN_STRANGE)
    return None


def _no_place(why: str, again: int) -> Refusal:
    return Refusal(VerdictCode.NO_PLACE, f"{why}; come again in {again} s", value=again)
