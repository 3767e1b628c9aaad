"""How much of a flood is written down: at most 100 lines in any second, then a count (promise 30).

Pure: time comes with the entries. Half of the lines are kept free of what anybody can cause without
having logged in, and of refusals, so that no flood of them hides a motion.
"""

from __future__ import annotations

from collections import Counter, deque

from .audit import AuditEntry, AuditEvent
from .lockout import SECOND_NS

MOST_LINES = 100
"""Lines in any second, the summary included."""

MOST_NOISE = 49

NOISE = frozenset(
    {
        AuditEvent.CONNECTED,
        AuditEvent.DISCONNECTED,
        AuditEvent.LOGIN_FAILED,
        AuditEvent.LOCKED_OUT,
        AuditEvent.REFUSED,
    }
)
"""What anybody who reaches the port can cause, and what moved nothing."""

_MOST_NAMED = 6
_MOST_COUNTED = 1_000


class LineLimit:
    """Decides which entries are written, and counts the others."""

    def __init__(self) -> None:
        """Begin with an empty second."""
        self._all: deque[int] = deque(maxlen=MOST_LINES - 1)
        self._noise: deque[int] = deque(maxlen=MOST_NOISE)
        self._events: Counter[str] = Counter()
        self._names: Counter[str] = Counter()
        self._since = 0

    def take(self, entry: AuditEntry) -> bool:
        """Tell whether an entry is written; one that is not is counted."""
        is_noise = entry.event in NOISE
        if _has_room(self._all, entry.at) and (not is_noise or _has_room(self._noise, entry.at)):
            self._all.append(entry.at)
            if is_noise:
                self._noise.append(entry.at)
            return True
        if not self._events:
            self._since = entry.at
        self._events[entry.event] += 1
        name = entry.who or entry.source
        if name in self._names or len(self._names) < _MOST_COUNTED:
            self._names[name] += 1
        return False

    def summary(self, now: int) -> AuditEntry | None:
        """Return the count of what was not written, once a second has passed since the first."""
        if not self._events or now - self._since < SECOND_NS:
            return None
        by_event = {f"event {event}": count for event, count in self._events.most_common(8)}
        by_name = {f"of {who}": count for who, count in self._names.most_common(_MOST_NAMED)}
        detail = {"lines": self._events.total(), **by_event, **by_name}
        self._events.clear()
        self._names.clear()
        return AuditEntry(AuditEvent.SUPPRESSED, now, detail=detail)


def _has_room(passed: deque[int], now: int) -> bool:
    return len(passed) < (passed.maxlen or 0) or now - passed[0] >= SECOND_NS
