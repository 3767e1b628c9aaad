"""The process log on standard error: at most 100 lines a second, and nothing in it but text.

Owns the limit of promise 30 for what `logging` writes, and how a line is written: control
characters stand escaped, and a traceback is indented, so that no text of a peer can look like a
line of ours or command a terminal. What is logged is everybody else's business.
"""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable
from typing import TextIO

from ..printable import printable
from .line_limit import MOST_LINES
from .lockout import SECOND_NS
from .log_queue import LogQueue

FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"


class LineBudget:
    """How many lines of any second are written; the others are counted. Pure."""

    def __init__(self) -> None:
        """Begin with an empty second."""
        self._written: deque[tuple[int, int]] = deque()
        self._lines = 0
        self._suppressed = 0
        self._since = 0

    def take(self, lines: int, now: int) -> bool:
        """Tell whether an entry of so many lines is written; one that is not is counted.

        Args:
            lines: how many it has; one entry beyond any limit is written where nothing else was.
            now: monotonic time, ns.
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


class LimitedHandler(logging.StreamHandler[TextIO | LogQueue]):
    """Writes entries to a stream; a flood of them is summed up."""

    def __init__(
        self, stream: TextIO | LogQueue, clock: Callable[[], int] = time.monotonic_ns
    ) -> None:
        """Make a handler of safe lines.

        Args:
            stream: where they go; a queue where the writer must not wait for the reader.
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
        """Say how much was left out at the end."""
        self._tell_suppressed(self._clock() + SECOND_NS)
        super().close()
        if isinstance(self.stream, LogQueue):
            self.stream.close()

    def _tell_suppressed(self, now: int) -> None:
        count = self._budget.summary(now)
        if count:
            text = f"{count} lines were left out: more than {MOST_LINES} a second"
            name, level = "openpendant.server", logging.WARNING
            super().emit(logging.LogRecord(name, level, "", 0, text, None, None))
