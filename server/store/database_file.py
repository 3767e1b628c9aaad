"""Database file on the disk: created in one step, with reserved space, still that of its name.

Owns that a file's name appears in one step, which fails where it is taken, and after the disk has
the file. A write that was killed leaves a temporary file `NAME.partial-…` beside the target, which
nothing uses again; it may be removed.

Owns the space reserved for deletions when the disk is full, in the file `store.db-reserve` beside
the store. SQLite writes every change behind the others before it finds room for it in its file,
also a deletion; without a reserve a disk that is full to the last byte could never be emptied from
a pendant. The space is given back in pieces, so that several deletions are possible even where none
of them frees any.

Owns the proof that an open store is still the file of its name. SQLite keeps using the file that it
opened, whatever becomes of its name: a change saved into one that was deleted, moved away or
replaced is lost with it, and a write into one that a copy was written over damages both. Owns the
detection, and the sentence about it; the store checks before a change, before it acknowledges one,
and before it closes.
"""

from __future__ import annotations

import contextlib
import errno
import os
import sqlite3
import stat
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Literal

from .store_errors import StoreFailed

APPLICATION_ID = 0x4F50656E
"""Application id in the header of a store's file: the letters `OPen`."""

_BESIDE = ("-wal", "-shm")
"""Suffixes of the files beside an open file: its log and the index of that."""

_CONSEQUENCE = "nothing is saved until it is back, or the server is started anew"


class NotOurFile(StoreFailed):
    """Refusal: the open file is no longer the one of its name, and the request was not saved."""


@dataclass(frozen=True, slots=True)
class _Place:
    """Name with the device and inode of its file; a link differs from its target."""

    name: tuple[int, int]
    target: tuple[int, int]


@dataclass(frozen=True, slots=True)
class _Progress:
    """Newest rows of a file's documents; they never go back in a file that is only changed.

    Attributes:
        chunk: row of the newest chunk of a recording; only a new revision takes chunks away.
    """

    revision: int
    chunk: int

    def is_before(self, other: _Progress) -> bool:
        return (self.revision, self.chunk) < (other.revision, other.chunk)


def check_is_file(path: Path) -> None:
    """Refuse a name that no store can have; one that is not in use is accepted.

    Raises:
        StoreFailed: it is a directory, a device, or a link to nothing.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        if path.is_symlink():
            there = os.readlink(path)
            raise StoreFailed(f"{path}: is a link to {there}, which is not there") from None
        return
    if not stat.S_ISREG(mode):
        raise StoreFailed(f"{path}: is {_kind(mode)}; a store is a file")


class FileIdentity:
    """Identity of a file when it was opened, and the present state of its name."""

    def __init__(self, path: Path) -> None:
        """Record a file, its log and the index of that; SQLite has them open.

        Raises:
            NotOurFile: the name has gone already.
        """
        self._path = path
        self._place = self._placed(path)
        beside = (path.with_name(path.name + ending) for ending in _BESIDE)
        self._beside = {name: self._placed(name) for name in beside if name.exists()}
        self._seen: tuple[int, int] | None = None
        self._progress = _Progress(0, 0)
        self._check_content()

    def check(self) -> None:
        """Check the names, and the content of the file if it was written to.

        Raises:
            NotOurFile: it is another one now; the sentence says what.
        """
        for path, place in ((self._path, self._place), *self._beside.items()):
            if self._placed(path) != place:
                raise NotOurFile(f"{path}: {self._what_it_is(path)}; {_CONSEQUENCE}")
        self._check_content()

    def is_lost(self) -> bool:
        """Return True if the name stands for another file, or for another one's content."""
        if self._placed(self._path) != self._place:
            return True
        try:
            self._check_content()
        except (NotOurFile, OSError):
            return True
        return False

    def _check_content(self) -> None:
        """Refuse a file that somebody wrote something else over, which keeps its inode.

        Where a full disk ended the move of the log into the file, or another process is at it just
        now, the content is torn; SQLite mends that, and it is no reason to refuse.
        """
        now = self._path.stat()
        written = (now.st_mtime_ns, now.st_size)
        if written == self._seen:
            return
        with contextlib.closing(self._plain()) as plain:
            content = _content(plain)
            if content is _Content.FOREIGN:
                raise NotOurFile(
                    f"{self._path}: is no store any more, something else was written over it;"
                    f" {_CONSEQUENCE}"
                )
            if content is _Content.TORN:
                return
            if content.is_before(self._progress):
                if not _is_whole(plain):
                    return
                raise NotOurFile(
                    f"{self._path}: holds an older state than was saved in it, as of a copy that"
                    f" was written over it; {_CONSEQUENCE}"
                )
        self._seen, self._progress = written, content

    def _plain(self) -> sqlite3.Connection:
        """Open the file itself, without its log and without what SQLite remembers of it."""
        uri = f"{self._path.absolute().as_uri()}?mode=ro&immutable=1"
        return sqlite3.connect(uri, uri=True)

    def _placed(self, path: Path) -> _Place | None:
        try:
            name, target = path.lstat(), path.stat()
        except OSError:
            return None
        return _Place((name.st_dev, name.st_ino), (target.st_dev, target.st_ino))

    def _what_it_is(self, path: Path) -> str:
        try:
            mode = path.lstat().st_mode
        except OSError:
            return "is not there any more; it was deleted or moved away"
        if stat.S_ISLNK(mode):
            return f"is a link to {os.readlink(path)} now, which is not the file that was opened"
        if not stat.S_ISREG(mode):
            return f"is {_kind(mode)} now, and not the file that was opened"
        return "is another file now than the one that was opened"


class _Content(Enum):
    """Content for which no progress can be read."""

    FOREIGN = "foreign"
    TORN = "torn"


def _content(plain: sqlite3.Connection) -> _Progress | Literal[_Content.FOREIGN, _Content.TORN]:
    try:
        (application,) = plain.execute("PRAGMA application_id").fetchone()
    except sqlite3.DatabaseError as error:
        is_none = error.sqlite_errorcode & 0xFF == sqlite3.SQLITE_NOTADB
        return _Content.FOREIGN if is_none else _Content.TORN
    if application != APPLICATION_ID:
        return _Content.FOREIGN
    try:
        found = plain.execute(
            "SELECT (SELECT max(rowid) FROM revision), (SELECT max(rowid) FROM recording_chunk)"
        ).fetchone()
    except sqlite3.OperationalError as error:
        # Tables are made in the log; a file whose first log is not moved yet has none.
        return _Progress(0, 0) if "no such table" in str(error) else _Content.TORN
    except sqlite3.DatabaseError:
        return _Content.TORN
    return _Progress(*(row or 0 for row in found))


def _is_whole(plain: sqlite3.Connection) -> bool:
    try:
        return [row[0] for row in plain.execute("PRAGMA quick_check(1)")] == ["ok"]
    except sqlite3.DatabaseError:
        return False


def _kind(mode: int) -> str:
    for is_kind, name in (
        (stat.S_ISDIR, "a directory"),
        (stat.S_ISFIFO, "a pipe"),
        (stat.S_ISSOCK, "a socket"),
    ):
        if is_kind(mode):
            return name
    return "a device"


_OF_SQLITE = ("", "-journal", "-wal", "-shm")
"""Suffixes of the files that SQLite keeps beside a file."""

_OWNER_ONLY = 0o600


@contextlib.contextmanager
def atomic_file(target: Path, *, replace: bool = False) -> Iterator[Path]:
    """Yield an empty file, its owner's only, that becomes `target` if the context ends well.

    Args:
        replace: True if the name may be in use, and is then taken from the file that has it.

    Yields:
        The file, beside the target; the files that SQLite keeps beside it are removed with it.

    Raises:
        FileExistsError: the name is in use.
        OSError: the disk or the folder refuses it.
    """
    if not replace and os.path.lexists(target):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target))
    beside = _new_file(target)
    try:
        yield beside
        _sync(beside)
        if replace:
            os.replace(beside, target)
        else:
            _give_name(beside, target)
        sync_folder(target)
    finally:
        for ending in _OF_SQLITE:
            beside.with_name(beside.name + ending).unlink(missing_ok=True)


def sync_folder(path: Path) -> None:
    """Fsync the folder of a file, so that the disk has the names in it."""
    _sync(path.parent)


def _new_file(target: Path) -> Path:
    # A separate name for each: two processes may make the same file at once.
    try:
        opened, name = tempfile.mkstemp(prefix=f"{target.name}.partial-", dir=target.parent)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(target)) from None
    os.close(opened)
    return Path(name)


def _give_name(whole: Path, target: Path) -> None:
    with contextlib.suppress(OSError):
        os.link(whole, target)
        return
    # Either the name is taken, which the next call reports, or the file system has no links, as on
    # many USB sticks. Then a kill between the next two steps leaves an empty file, which no store
    # accepts.
    os.close(os.open(target, os.O_CREAT | os.O_EXCL | os.O_WRONLY, _OWNER_ONLY))
    try:
        os.replace(whole, target)
    except OSError:
        target.unlink(missing_ok=True)
        raise


def _sync(path: Path) -> None:
    opened = os.open(path, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


RESERVE_BYTES = 256 << 10
"""Reserved bytes: a deletion takes about 30 KiB, of a recording 4 KiB for each 4 MiB."""

_PIECE = 64 << 10
IN_MEMORY = ":memory:"


class ReservedSpace:
    """File that only reserves disk space; a store in memory has none.

    Attributes:
        is_whole: it has its full size, as far as it needs any.
    """

    def __init__(self, store: Path) -> None:
        """Take the store's file; nothing is made before `fill`."""
        self.is_whole = True
        self._needed = 0 if str(store) == IN_MEMORY else RESERVE_BYTES
        self._path = store.with_name(store.name + "-reserve")

    def fill(self) -> None:
        """Reserve the space again; without room, it is tried again after the next change."""
        self.is_whole = self._size() >= self._needed
        if self.is_whole:
            return
        with contextlib.suppress(OSError):
            self._extend()
            self.is_whole = True

    def give_back(self) -> bool:
        """Free a piece of the space for a change that needs it; return True if there was any."""
        size = self._size()
        if not size:
            return False
        try:
            os.truncate(self._path, max(0, size - _PIECE))
        except OSError:
            return False
        self.is_whole = False
        return True

    def _size(self) -> int:
        try:
            return self._path.stat().st_size
        except OSError:
            return 0

    def _extend(self) -> None:
        before = self._size()
        file = os.open(self._path, os.O_CREAT | os.O_WRONLY, _OWNER_ONLY)
        try:
            if sys.platform == "linux":
                # Not zeros: some file systems compress them to nothing.
                os.posix_fallocate(file, 0, RESERVE_BYTES)
            else:
                os.pwrite(file, bytes(RESERVE_BYTES), 0)
        except OSError:
            os.ftruncate(file, before)
            raise
        finally:
            os.close(file)
