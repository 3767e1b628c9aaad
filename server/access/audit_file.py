"""The audit log's files: one that grows, older ones under numbers, nothing ever overwritten.

Owns opening, rotation, what a crash or a full disk left behind, and that one process writes. Blocks
on the disk, so only the thread of `audit_writer` calls it while a server runs.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from .audit import (
    LONGEST_LINE,
    AuditEntry,
    AuditEvent,
    Link,
    read_line,
    torn_detail,
    write_line,
)

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
    """An entry with its wall-clock time.

    Attributes:
        entry: the entry.
        time: ISO 8601 in UTC.
    """

    entry: AuditEntry
    time: str


class AuditFile:
    """A log that lines are appended to.

    Attributes:
        path: the file that grows; the older ones are beside it.
    """

    def __init__(self, path: Path, most_bytes: int = MOST_BYTES, opener: Opener = open_raw) -> None:
        """Take the log for this process; the file is opened with the first line.

        Args:
            path: the file that grows, such as `audit.jsonl`.
            most_bytes: size beyond which it is put aside.
            opener: opens a file for appending.

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
        """Return once the disk has everything.

        Raises:
            OSError: it could not be brought there.
        """
        if self._raw is not None:
            with self._closed_on_error():
                os.fsync(self._raw.fileno())

    def close(self) -> None:
        """Let go of the file and of the log."""
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
                with contextlib.suppress(OSError):  # the first error is the one to tell
                    raw.close()
            raise

    def _open(self, stamped: Stamped) -> RawFile:
        """Open the file and go on where its chain ends; a torn end is closed off and told of."""
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
        """Put the file aside under the next number and begin another; the chain goes on."""
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
        with file.open("rb") as stream:
            while line := stream.readline(LONGEST_LINE):
                yield line.removesuffix(b"\n")


@dataclass(frozen=True, slots=True)
class _End:
    """How a file ends.

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
        with path.open("rb") as file:
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
