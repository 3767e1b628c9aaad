"""Faults of SQLite and of the system as the store's typed errors.

Owns how a fault is named; its words stay the system's own.
"""

from __future__ import annotations

import contextlib
import errno
import sqlite3
from collections.abc import Iterator
from pathlib import Path

from .errors import DiskFull, ReadOnly, StoreBusy, StoreError, StoreFailed

_PRIMARY = 0xFF  # the lower byte of SQLite's extended codes is the kind of fault

_NO_ROOM_FOR_INDEX = sqlite3.SQLITE_IOERR_SHMSIZE

_KINDS: dict[int, type[StoreError]] = {
    sqlite3.SQLITE_FULL: DiskFull,
    sqlite3.SQLITE_READONLY: ReadOnly,
    sqlite3.SQLITE_PERM: ReadOnly,
    sqlite3.SQLITE_BUSY: StoreBusy,
    sqlite3.SQLITE_LOCKED: StoreBusy,
}
_BROKEN = {sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB}


class BrokenFile(StoreFailed):
    """The file is no database, or a damaged one."""


@contextlib.contextmanager
def translated(path: Path) -> Iterator[None]:
    """Turn the faults of SQLite and of the system inside the context into a `StoreError`."""
    try:
        yield
    except sqlite3.Error as error:
        raise _store_error(error, path) from error
    except OSError as error:
        raise _os_error(error, path) from error


def _store_error(error: sqlite3.Error, path: Path) -> StoreError:
    """Return the typed error for one of SQLite's, with its words and the name of its code."""
    extended = getattr(error, "sqlite_errorcode", 0)
    # No room for the index of the log; SQLite counts it among the faults of input and output.
    code = sqlite3.SQLITE_FULL if extended == _NO_ROOM_FOR_INDEX else extended & _PRIMARY
    name = getattr(error, "sqlite_errorname", type(error).__name__)
    kind = BrokenFile if code in _BROKEN else _KINDS.get(code, StoreFailed)
    return kind(f"{path}: {error} ({name})")


def _os_error(error: OSError, path: Path) -> StoreError:
    """Return the typed error for one of the system's, with its words."""
    text = f"{error.filename or path}: {error.strerror or error}"
    match error.errno:
        case errno.ENOSPC | errno.EDQUOT | errno.EFBIG:
            return DiskFull(text)
        case errno.EROFS | errno.EACCES | errno.EPERM:
            return ReadOnly(text)
    return StoreFailed(text)
