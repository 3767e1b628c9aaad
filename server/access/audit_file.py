"""The audit log's files, and the thread that writes entries to them while a server runs.

One file grows, older files stand beside it under numbers, and nothing is ever overwritten. Owns
opening, rotation, what a crash or a full disk left behind, and that one process writes. `AuditFile`
blocks on the disk, so only the thread of `AuditLog` calls it while a server runs.

`AuditLog` takes entries at once, and a disk that is slow, full or gone never holds up a motion: a
`BackgroundWriter` keeps the entries, counts those that find no more room, and once the disk takes
lines again a LOG_GAP line says from when to when, how many are missing and why.
"""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import re
import sys
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol

from openpendant.motion.bounded_file import open_regular

from ..background_writer import BackgroundWriter
from .audit import (
    LONGEST_LINE,
    AuditEntry,
    AuditEvent,
    Detail,
    Link,
    read_line,
    torn_detail,
    write_line,
)
from .lockout import SECOND_NS
from .process_log import LineLimit

MOST_BYTES = 16 * 1024 * 1024
"""A file is put aside once it is larger; about 50,000 lines."""

_MODE = 0o600


class RawFile(Protocol):
    """An unbuffered file opened for appending."""

    def write(self, data: bytes, /) -> int | None:
        """Append; return how many bytes were taken."""

    def fileno(self) -> int:
        """Return the descriptor."""

    def close(self) -> None:
        """Close it."""


Opener = Callable[[Path], RawFile]


def open_raw(path: Path) -> RawFile:
    """Open a file for appending, readable by its owner only."""
    descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, _MODE)
    return os.fdopen(descriptor, "ab", buffering=0)


@dataclass(frozen=True, slots=True)
class Stamped:
    """An entry with its wall-clock time."""

    entry: AuditEntry
    time: str


class AuditFile:
    """A log that lines are appended to."""

    def __init__(self, path: Path, most_bytes: int = MOST_BYTES, opener: Opener = open_raw) -> None:
        """Take the log for this process; the file is opened with the first line.

        Raises:
            OSError: the folder cannot be written, this is no regular file, or another process
                writes this log.
        """
        if path.exists() and not path.is_file():
            # A device or a pipe may be read or written for ever.
            raise OSError(errno.EINVAL, "is no regular file", str(path))
        self.path = path
        self._most_bytes = most_bytes
        self._opener = opener
        self._raw: RawFile | None = None
        self._size = 0
        self._last = Link()
        self._lock = _locked(path.with_name(f"{path.name}.lock"))

    def append(self, stamped: Stamped) -> None:
        """Append an entry; it is on the disk after `sync`.

        Raises:
            OSError: the disk did not take all of it. The next call looks at what is there.
        """
        with self._closed_on_error():
            raw = self._raw or self._open(stamped)
            if self._size >= self._most_bytes:
                raw = self._rotate()
            self._write(raw, stamped.entry, stamped.time)

    def sync(self) -> None:
        """Fsync the file.

        Raises:
            OSError: it could not be brought there.
        """
        if self._raw is not None:
            with self._closed_on_error():
                os.fsync(self._raw.fileno())

    def close(self) -> None:
        """Close the file and release the lock of the log."""
        if self._raw is not None:
            self._raw.close()
            self._raw = None
        self._lock.close()

    @contextlib.contextmanager
    def _closed_on_error(self) -> Iterator[None]:
        try:
            yield
        except OSError:
            raw, self._raw = self._raw, None
            if raw is not None:
                with contextlib.suppress(OSError):  # the first error is the one to report
                    raw.close()
            raise

    def _open(self, stamped: Stamped) -> RawFile:
        """Open the file and continue its chain; a torn end is closed off and noted."""
        end = _end_of(self.path)
        self._last = end.last
        if self._last.number == 0:
            older = older_files(self.path)
            if older:
                self._last = _end_of(older[-1]).last
        raw = self._raw = self._opener(self.path)
        self._size = self.path.stat().st_size
        if end.damaged:
            if not end.is_closed:
                self._take(raw, b"\n")
            entry = AuditEntry(
                AuditEvent.LOG_RECOVERED, stamped.entry.at, detail=torn_detail(end.damaged)
            )
            self._write(raw, entry, stamped.time)
        return raw

    def _rotate(self) -> RawFile:
        """Put the file aside under the next number and start another; the chain continues."""
        if self._raw is not None:
            os.fsync(self._raw.fileno())
            self._raw.close()
            self._raw = None
        older = older_files(self.path)
        number = _number_of(older[-1], self.path) + 1 if older else 1
        os.rename(self.path, self.path.with_name(f"{_stem(self.path)}.{number:06d}.jsonl"))
        raw = self._raw = self._opener(self.path)
        self._size = 0
        return raw

    def _write(self, raw: RawFile, entry: AuditEntry, time: str) -> None:
        line, last = write_line(entry, time, self._last)
        self._take(raw, line)
        self._last = last

    def _take(self, raw: RawFile, data: bytes) -> None:
        taken = raw.write(data) or 0
        self._size += taken
        if taken < len(data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self.path))


def _stem(path: Path) -> str:
    return path.name.removesuffix(".jsonl")


def _number_of(older: Path, path: Path) -> int:
    found = re.fullmatch(rf"{re.escape(_stem(path))}\.(\d{{6,}})\.jsonl", older.name)
    return int(found[1]) if found else 0


def older_files(path: Path) -> list[Path]:
    """Return the files that were put aside, oldest first."""
    beside = path.parent.glob("*.jsonl")
    return sorted(
        (file for file in beside if _number_of(file, path)), key=lambda file: _number_of(file, path)
    )


def all_files(path: Path) -> list[Path]:
    """Return every file of a log, oldest first."""
    return [*older_files(path), *([path] if path.exists() else [])]


def read_lines(path: Path) -> Iterator[bytes]:
    """Yield the lines of all files of a log, without their line feeds; a huge one in pieces.

    Raises:
        OSError: a file cannot be read.
    """
    for file in all_files(path):
        with open_regular(file) as stream:
            while line := stream.readline(LONGEST_LINE):
                yield line.removesuffix(b"\n")


@dataclass(frozen=True, slots=True)
class _End:
    """End of a file.

    Attributes:
        last: where the chain stands after its last whole line.
        damaged: what stands behind that line; empty for nothing.
        is_closed: whether that ends in a line feed.
    """

    last: Link
    damaged: bytes = b""
    is_closed: bool = True


def _end_of(path: Path) -> _End:
    try:
        with open_regular(path) as file:
            file.seek(max(0, file.seek(0, os.SEEK_END) - 2 * LONGEST_LINE))
            tail = file.read()
    except FileNotFoundError:
        return _End(Link())
    is_closed = tail.endswith(b"\n")
    lines = tail.removesuffix(b"\n").split(b"\n") if tail else []
    for index in reversed(range(len(lines))):
        record = read_line(lines[index])
        if record is not None:
            last = Link(record["n"], record["hash"])
            return _End(last, b"\n".join(lines[index + 1 :]), is_closed)
    return _End(Link(), b"\n".join(lines), is_closed)


def _locked(path: Path) -> RawFile:
    file = open_raw(path)
    if sys.platform != "win32":
        import fcntl

        try:
            fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            file.close()
            if error.errno not in (errno.EAGAIN, errno.EACCES):
                raise
            reason = "another process writes this audit log"
            raise OSError(errno.EBUSY, reason, str(path)) from None
    return file


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
            retry: pause before a disk that refused is tried again [s].

        Raises:
            OSError: the folder cannot be written, or another process writes this log.
        """
        self._file = AuditFile(path, most_bytes, opener)
        self._retry = retry
        self._fault = ""
        self._limit = LineLimit()
        # The thread's own: what passed the limit and is not on the disk.
        self._ready: deque[Stamped] = deque()
        self._troubled_since = ""
        self._writer = BackgroundWriter(
            "audit", self._run, most_waiting=most_waiting, farewell=_FAREWELL
        )

    @property
    def fault(self) -> str:
        """Reason why nothing is being written, in the system's words; empty without a fault."""
        return self._fault

    def record(self, entry: AuditEntry) -> None:
        """Queue an entry to be written; return at once, whatever the disk does."""
        self._writer.put(Stamped(entry, _utc_now()))

    def close(self) -> None:
        """Write what is left, for at most two seconds, and end."""
        if not self._writer.close():
            log.error("the audit log is incomplete: the disk did not take the rest in time")

    def _run(self, writer: BackgroundWriter[Stamped]) -> None:
        at = 0
        is_last = False
        while not is_last:
            batch: list[Stamped] = []
            # While the disk refuses, entries stay where they are bounded.
            if not self._ready or writer.is_ending:
                batch, is_last = writer.take(patience=_IDLE)
            for stamped in batch:
                at = stamped.entry.at
                self._choose(stamped)
            if not batch or is_last:
                # Nothing came for a second, or nothing will: a count does not wait for more.
                self._summarize(at + SECOND_NS, _utc_now())
            self._write_ready(at, writer)
        self._file.close()

    def _choose(self, stamped: Stamped) -> None:
        """Pass an entry to the disk if the limit lets it."""
        self._summarize(stamped.entry.at, stamped.time)
        if self._limit.take(stamped.entry):
            self._ready.append(stamped)

    def _summarize(self, now: int, time: str) -> None:
        summary = self._limit.summary(now)
        if summary is not None:
            self._ready.append(Stamped(summary, time))

    def _write_ready(self, at: int, writer: BackgroundWriter[Stamped]) -> None:
        """Write what passed the limit; what the disk does not take is kept for another try."""
        try:
            while self._ready:
                self._file.append(self._ready[0])
                self._ready.popleft()
            self._tell_gap(at, writer)
            self._file.sync()
        except OSError as error:
            self._troubled(error)
            writer.pause(self._retry)

    def _tell_gap(self, at: int, writer: BackgroundWriter[Stamped]) -> None:
        lost, fault = writer.lost(), self._fault
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
        writer.told(lost)
        self._fault = ""
        self._troubled_since = ""
        log.warning("the audit log is written again; %d entries are missing", lost)

    def _troubled(self, error: OSError) -> None:
        reason = error.strerror or str(error)
        if not self._troubled_since:
            self._troubled_since = _utc_now()
            log.error("the audit log is not written: %s", reason)
        self._fault = reason


def _utc_now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")
