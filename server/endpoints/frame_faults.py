"""Frame faults: the unknown and malformed frames that a connection may send (promise 7)."""

from __future__ import annotations

MOST_FAULTS = 10
"""So many within `FAULT_WINDOW_NS` end the connection."""

FAULT_WINDOW_NS = 10_000_000_000


class PeerFaults:
    """The recent faults of one connection."""

    def __init__(self) -> None:
        """Make a record without faults."""
        self._times: tuple[int, ...] = ()

    def add(self, now: int) -> bool:
        """Count one fault at `now` [ns]; return True if the connection must be closed."""
        recent = tuple(time for time in self._times if now - time < FAULT_WINDOW_NS)
        self._times = (*recent, now)
        return len(self._times) >= MOST_FAULTS
