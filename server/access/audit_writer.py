"""The audit log of a running server: takes entries at once, and a thread writes them soon.

Owns the thread and the bounded queue. A disk that is slow, full or gone never holds up a motion:
entries wait, the ones that find no more room are counted, and once the disk takes lines again a
LOG_GAP line says from when to when, how many are missing and why.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from datetime import UTC, datetime
from pathlib import Path

from .audit import AuditEntry, AuditEvent, Detail
from .audit_file import MOST_BYTES, AuditFile, Opener, Stamped, open_raw
from .line_limit import LineLimit
from .lockout import SECOND_NS

log = logging.getLogger("openpendant.server")

MOST_WAITING = 10_000
"""Entries that may wait for the disk."""

_RETRY = 1.0
_IDLE = 1.0
_FAREWELL = 2.0


class AuditLog:
    """An append-only log of who did what."""

    def __init__(
        self,
        path: Path,
        *,
        most_waiting: int = MOST_WAITING,
        most_bytes: int = MOST_BYTES,
        retry: float = _RETRY,
        opener: Opener = open_raw,
    ) -> None:
        """Take the log and start its thread.

        Args:
            path: the file that grows; older ones are kept beside it.
            most_waiting: entries that may wait for the disk.
            most_bytes: size beyond which a file is put aside.
            retry: pause before a disk that refused is tried again [s].
            opener: opens a file for appending.

        Raises:
            OSError: the folder cannot be written, or another process writes this log.
        """
        self._file = AuditFile(path, most_bytes, opener)
        self._most_waiting = most_waiting
        self._retry = retry
        self._limit = LineLimit()
        self._turn = threading.Condition()
        self._ending = threading.Event()
        self._waiting: deque[Stamped] = deque()
        self._lost = 0
        self._fault = ""
        # The thread's own: what passed the limit and is not on the disk.
        self._ready: deque[Stamped] = deque()
        self._troubled_since = ""
        self._thread = threading.Thread(target=self._run, name="audit", daemon=True)
        self._thread.start()

    @property
    def fault(self) -> str:
        """Why nothing is being written, in the system's words; empty while all is well."""
        with self._turn:
            return self._fault

    def record(self, entry: AuditEntry) -> None:
        """Take an entry to be written; returns at once, whatever the disk does."""
        stamped = Stamped(entry, _utc_now())
        with self._turn:
            if len(self._waiting) >= self._most_waiting:
                self._lost += 1
                return
            self._waiting.append(stamped)
            self._turn.notify()

    def close(self) -> None:
        """Write what is left, for at most two seconds, and end."""
        self._ending.set()
        with self._turn:
            self._turn.notify()
        self._thread.join(_FAREWELL)
        if self._thread.is_alive():
            log.error("the audit log is incomplete: the disk did not take the rest in time")

    def _run(self) -> None:
        at = 0
        is_ending = False
        while not is_ending:
            batch, is_ending = self._next()
            for stamped in batch:
                at = stamped.entry.at
                self._choose(stamped)
            if not batch or is_ending:
                # Nothing came for a second, or nothing will: a count does not wait for more.
                self._summarize(at + SECOND_NS, _utc_now())
            self._write_ready(at)
        self._file.close()

    def _next(self) -> tuple[list[Stamped], bool]:
        """Wait for entries, but not for long; return them, and whether the log is to end."""
        with self._turn:
            is_ending = self._ending.is_set()
            if self._ready and not is_ending:
                return [], False  # the disk refuses: entries stay where they are bounded
            if not self._waiting and not is_ending:
                self._turn.wait(_IDLE)
            batch = list(self._waiting)
            self._waiting.clear()
            return batch, self._ending.is_set()

    def _choose(self, stamped: Stamped) -> None:
        """Pass an entry to the disk if the limit lets it."""
        self._summarize(stamped.entry.at, stamped.time)
        if self._limit.take(stamped.entry):
            self._ready.append(stamped)

    def _summarize(self, now: int, time: str) -> None:
        summary = self._limit.summary(now)
        if summary is not None:
            self._ready.append(Stamped(summary, time))

    def _write_ready(self, at: int) -> None:
        """Write what passed the limit; what the disk does not take is kept for another try."""
        try:
            while self._ready:
                self._file.append(self._ready[0])
                self._ready.popleft()
            self._tell_gap(at)
            self._file.sync()
        except OSError as error:
            self._troubled(error)

    def _tell_gap(self, at: int) -> None:
        with self._turn:
            lost, fault = self._lost, self._fault
        if not lost and not fault:
            return
        now = _utc_now()
        detail: dict[str, Detail] = {
            "lost": lost,
            "from": self._troubled_since or now,
            "to": now,
            "reason": fault or "the disk is too slow",
        }
        self._file.append(Stamped(AuditEntry(AuditEvent.LOG_GAP, at, detail=detail), now))
        with self._turn:
            self._lost -= lost
            self._fault = ""
        self._troubled_since = ""
        log.warning("the audit log is written again; %d entries are missing", lost)

    def _troubled(self, error: OSError) -> None:
        reason = error.strerror or str(error)
        if not self._troubled_since:
            self._troubled_since = _utc_now()
            log.error("the audit log is not written: %s", reason)
        with self._turn:
            self._fault = reason
        self._ending.wait(self._retry)


def _utc_now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")
