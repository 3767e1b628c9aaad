"""The process log on standard error: at most 100 lines in any second, and only printable text.

Owns the limit of promise 30 for what `logging` writes: entries beyond it are counted, and the count
is written. Half of the lines are reserved: entries that anybody can cause without a login, and
refusals, get only the other half, so that a flood of them hides no motion. `LineLimit` and
`LineBudget` are pure: time comes with the entries.

Owns how a line is written: control characters are escaped and a traceback is indented, so that no
text of a peer can look like a line of ours or command a terminal. Must not know what is logged.
"""

from __future__ import annotations

import logging
import time
from collections import Counter, deque
from collections.abc import Callable
from typing import TextIO

from ..background_writer import LogStream
from .audit import AuditEntry, AuditEvent
from .lockout import SECOND_NS

MOST_LINES = 100
"""Lines in any second, the summary included."""

MOST_NOISE = 49

NOISE = frozenset(
    {
        AuditEvent.CONNECTED,
        AuditEvent.DECLARED,
        AuditEvent.DISCONNECTED,
        AuditEvent.LOGIN_FAILED,
        AuditEvent.LOCKED_OUT,
        AuditEvent.LOGINS_SLOWED,
        AuditEvent.REFUSED,
    }
)
"""Events that anybody who reaches the port can cause, and refusals, which moved nothing."""

_MOST_NAMED = 6
_MOST_COUNTED = 1_000


class LineLimit:
    """Decides which entries are written, and counts the others."""

    def __init__(self) -> None:
        self._all: deque[int] = deque(maxlen=MOST_LINES - 1)
        self._noise: deque[int] = deque(maxlen=MOST_NOISE)
        self._events: Counter[str] = Counter()
        self._names: Counter[str] = Counter()
        self._since = 0

    def take(self, entry: AuditEntry) -> bool:
        """Return True if an entry is to be written; count it otherwise."""
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


FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"


class LineBudget:
    """Limit on the lines written in any second; the others are counted. Pure."""

    def __init__(self) -> None:
        self._written: deque[tuple[int, int]] = deque()
        self._lines = 0
        self._suppressed = 0
        self._since = 0

    def take(self, lines: int, now: int) -> bool:
        """Return True if an entry of so many lines is to be written; count it otherwise.

        Args:
            lines: how many it has; one entry beyond any limit is written where nothing else was.
        """
        while self._written and now - self._written[0][0] >= SECOND_NS:
            self._lines -= self._written.popleft()[1]
        # One line is kept for the summary.
        if self._written and self._lines + lines > MOST_LINES - 1:
            if not self._suppressed:
                self._since = now
            self._suppressed += lines
            return False
        self._written.append((now, lines))
        self._lines += lines
        return True

    def summary(self, now: int) -> int:
        """Return how many lines were left out, once a second has passed since the first."""
        if now - self._since < SECOND_NS:
            return 0
        suppressed, self._suppressed = self._suppressed, 0
        return suppressed


class SafeFormatter(logging.Formatter):
    """Writes an entry so that it cannot be mistaken for two."""

    def __init__(self) -> None:
        super().__init__(FORMAT)

    def formatMessage(self, record: logging.LogRecord) -> str:
        """Return the first line."""
        return printable(super().formatMessage(record))

    def formatException(self, ei: logging._SysExcInfoType) -> str:
        """Return a traceback, each line of it indented."""
        lines = super().formatException(ei).split("\n")
        return "\n".join(f"    {printable(line)}" for line in lines)


class LimitedHandler(logging.StreamHandler[TextIO | LogStream]):
    """Writes entries to a stream; a flood of them is summed up."""

    def __init__(
        self, stream: TextIO | LogStream, clock: Callable[[], int] = time.monotonic_ns
    ) -> None:
        """Make a handler of safe lines.

        Args:
            stream: where they go; a `LogStream` where the writer must not wait for the reader.
            clock: monotonic time, ns.
        """
        super().__init__(stream)
        self.setFormatter(SafeFormatter())
        self._clock = clock
        self._budget = LineBudget()

    def emit(self, record: logging.LogRecord) -> None:
        """Write an entry, or count it."""
        lines = 1 if record.exc_info is None else self.format(record).count("\n") + 1
        now = self._clock()
        self._tell_suppressed(now)
        if self._budget.take(lines, now):
            super().emit(record)

    def close(self) -> None:
        """Write the last count of entries left out, and close the stream."""
        self._tell_suppressed(self._clock() + SECOND_NS)
        super().close()
        if isinstance(self.stream, LogStream):
            self.stream.close()

    def _tell_suppressed(self, now: int) -> None:
        count = self._budget.summary(now)
        if count:
            text = f"{count} lines were left out: more than {MOST_LINES} a second"
            name, level = "openpendant.server", logging.WARNING
            super().emit(logging.LogRecord(name, level, "", 0, text, None, None))


def printable(text: str) -> str:
    """Return a text with escapes for what a terminal would execute or reverse."""
    return "".join(
        sign if sign.isprintable() else sign.encode("unicode_escape").decode() for sign in text
    )
