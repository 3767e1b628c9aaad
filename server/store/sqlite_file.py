"""The SQLite file of the store: its schema, opening, check, upgrade and copy, and its faults.

Owns what a file must be before its documents are touched. A broken file is set aside: renamed,
never overwritten, and that is logged. A file that is a sound database of somebody else's, or of a
later version, is refused and left alone.

Owns the tables of each version. The version stands in the file's header (`user_version`). A version
once released keeps its statements; a change appends a migration, and a test upgrades a file of
every older version. A new kind of document is a new version too, perhaps without any statement,
because an older program must not meet it.

Owns how a fault of SQLite or of the system is named as a typed error of the store; its words stay
the system's own.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import logging
import os
import shutil
import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from .database_file import APPLICATION_ID, RESERVE_BYTES, atomic_file, check_is_file, sync_folder
from .store_errors import (
    DiskFull,
    ForeignFile,
    ReadOnly,
    StoreBusy,
    StoreError,
    StoreFailed,
    StoreTooNew,
)


@dataclass(frozen=True, slots=True)
class Migration:
    """The way from one version to the next.

    Attributes:
        version: the version that it leads to.
        statements: SQL, run in order inside one transaction.
    """

    version: int
    statements: tuple[str, ...]


MIGRATIONS: Sequence[Migration] = (
    Migration(
        1,
        (
            # Revisions are only ever inserted; a deletion is one without a body. Sizes stand
            # apart because measuring a text would read it; `total` is the size of a chunk and of
            # all before it, so that appending to a long recording costs what the first chunk did.
            """
            CREATE TABLE revision (
                kind TEXT NOT NULL,
                name TEXT NOT NULL,
                revision INTEGER NOT NULL CHECK (revision > 0),
                size INTEGER NOT NULL,
                saved_by TEXT NOT NULL,
                saved_at TEXT NOT NULL,
                body TEXT,
                PRIMARY KEY (kind, name, revision)
            )
            """,
            """
            CREATE TABLE recording_chunk (
                name TEXT NOT NULL,
                sequence INTEGER NOT NULL CHECK (sequence >= 0),
                total INTEGER NOT NULL,
                data BLOB NOT NULL,
                PRIMARY KEY (name, sequence)
            )
            """,
        ),
    ),
    # Documents of named positions.
    Migration(2, ()),
)


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


log = logging.getLogger("openpendant.server")

_BUSY_TIMEOUT = 2.0
"""Longest time that a change waits for another process that holds the file [s]."""

_LONGEST_NAME = 80
"""Characters of a name in a file's schema that are shown."""

_MOST_KEPT = 10_000
_PAGE_BYTES = 4_096

# Full sync: what is acknowledged is on the disk, not in its cache. Secure delete: a page that is
# written anyhow keeps nothing of what was deleted, but none is written only for that, for which a
# full disk has no room. Automatic checkpoints: the log never holds more than finds its place in the
# file once the reserve is given back. The last two: distrust the file.
_SETTINGS = (
    "PRAGMA journal_mode = WAL",
    "PRAGMA synchronous = FULL",
    "PRAGMA fullfsync = ON",
    "PRAGMA journal_size_limit = 16777216",
    "PRAGMA secure_delete = FAST",
    f"PRAGMA wal_autocheckpoint = {RESERVE_BYTES // _PAGE_BYTES}",
    "PRAGMA trusted_schema = OFF",
    "PRAGMA cell_size_check = ON",
)


@dataclass(frozen=True, slots=True)
class OpenFile:
    """A file that is sound and has the latest schema.

    Attributes:
        is_read_only: nothing can be saved; the medium or the permissions forbid it.
        set_aside: where a broken file of that name was moved; None where it was sound.
        before_upgrade: the copy made before an older file was upgraded; None if it was not.
    """

    connection: sqlite3.Connection
    is_read_only: bool = False
    set_aside: Path | None = None
    before_upgrade: Path | None = None


def open_file(path: Path, migrations: Sequence[Migration]) -> OpenFile:
    """Open a file for reading and writing; make it, upgrade it, or set it aside where needed.

    Raises:
        StoreError: it cannot be opened, belongs to another program, or is of a later version.
    """
    set_aside = None
    while True:
        with translated(path):
            check_is_file(path)
            _make(path)
        try:
            _check_writable(path)
            opened = _open_writable(path, migrations)
            break
        except BrokenFile as error:
            if set_aside is not None:
                raise
            set_aside = _set_aside(path)
            log.error(
                "the store is broken: %s; it is kept as %s, an empty one begins", error, set_aside
            )
        except ReadOnly as error:
            log.error("the store can be read, but nothing can be saved: %s", error)
            opened = OpenFile(open_read_only(path, migrations), is_read_only=True)
            break
    return OpenFile(opened.connection, opened.is_read_only, set_aside, opened.before_upgrade)


def open_read_only(path: Path, migrations: Sequence[Migration]) -> sqlite3.Connection:
    """Open a file for reading, whether or not a server has it open, too; nothing is changed.

    Raises:
        StoreError: it cannot be read, is broken, belongs to another program, or has another
            version.
    """
    with translated(path):
        check_is_file(path)
        if not path.exists():
            raise StoreFailed(f"{path}: there is no such file")
        _check_size(path)
        try:
            return _opened_read_only(path, "mode=ro", migrations)
        except sqlite3.OperationalError:
            # On a read-only medium there is no room for the index of the write-ahead log; where
            # there is nothing in the log, nobody can be writing there.
            if _has_log(path):
                raise
            return _opened_read_only(path, "mode=ro&immutable=1", migrations)


def integrity(connection: sqlite3.Connection, *, thorough: bool) -> list[str]:
    """Return what SQLite finds wrong with a file, at most 20 lines; empty where it is sound."""
    pragma = "integrity_check" if thorough else "quick_check"
    found = [str(row[0]) for row in connection.execute(f"PRAGMA {pragma}(20)")]
    return [] if found == ["ok"] else found


def copy(source: sqlite3.Connection, target: Path, *, replace: bool = False) -> None:
    """Copy a file to another, whole or not at all, also where a kill ends it; others may write.

    Args:
        target: the copy; it must not exist yet.
        replace: it may exist, and is then replaced when the copy is whole.

    Raises:
        StoreError: the target exists or cannot be written.
    """
    with translated(target), atomic_file(target, replace=replace) as beside:
        with contextlib.closing(_connect(beside, "mode=rw")) as connection:
            connection.execute("PRAGMA synchronous = FULL")
            source.backup(connection)
            # One file to carry away, without a log beside it.
            connection.execute("PRAGMA journal_mode = DELETE")
            problems = integrity(connection, thorough=False)
        if problems:
            raise BrokenFile(f"{target}: the copy is damaged: {problems[0]}")


def _check_writable(path: Path) -> None:
    # Asked of the system, because SQLite only says that it is unable to open the file.
    for needed in (path, path.parent):
        if not os.access(needed, os.W_OK):
            raise ReadOnly(f"{path}: {needed} may not be written")


def _open_writable(path: Path, migrations: Sequence[Migration]) -> OpenFile:
    with translated(path):
        _check_size(path)
        if _has_log(path):
            _check_beside_its_log(path)
        connection = _connect(path, "mode=rw")
    try:
        with translated(path):
            version = _version(connection, path)
            _check_version(path, version, migrations)
            problems = integrity(connection, thorough=False)
            if problems:
                raise BrokenFile(f"{path}: {problems[0]}")
            for statement in _SETTINGS:
                connection.execute(statement)
            # A file that may only be read fails here, not at the first save.
            connection.execute("BEGIN IMMEDIATE")
            connection.execute("ROLLBACK")
            before_upgrade = _upgrade(connection, path, version, migrations)
    except BaseException:
        connection.close()
        raise
    return OpenFile(connection, before_upgrade=before_upgrade)


def _check_beside_its_log(path: Path) -> None:
    """Look at a file and its log while nothing can write yet.

    A connection that may write merges the log into the file when it is closed, whatever is wrong
    with either, and removes it; a broken pair would be kept neither whole nor as it was.

    Raises:
        BrokenFile: the file is damaged, with what its log holds.
    """
    try:
        with translated(path), contextlib.closing(_connect(path, "mode=ro")) as connection:
            # A log that was left behind may be of another file than the one that is there now,
            # which only the thorough check finds.
            problems = integrity(connection, thorough=True)
    except BrokenFile:
        raise
    except StoreError:
        return  # opening it for writing says what is wrong
    if problems:
        raise BrokenFile(f"{path}: {problems[0]}")


def _opened_read_only(path: Path, mode: str, migrations: Sequence[Migration]) -> sqlite3.Connection:
    connection = _connect(path, mode)
    try:
        version = _version(connection, path)
        _check_version(path, version, migrations)
        # Without statements there are only kinds of documents that the older file cannot have.
        if any(each.statements for each in migrations if each.version > version):
            raise ReadOnly(f"{path}: has schema version {version} and must be upgraded first")
    except BaseException:
        connection.close()
        raise
    return connection


def _connect(path: Path, mode: str) -> sqlite3.Connection:
    return sqlite3.connect(
        f"{path.absolute().as_uri()}?{mode}",
        uri=True,
        timeout=_BUSY_TIMEOUT,
        isolation_level=None,  # no transactions of Python's own: this package starts and ends them
    )


def _version(connection: sqlite3.Connection, path: Path) -> int:
    """Return the schema version, 0 for a new file.

    Raises:
        ForeignFile: another program's tables are in it.
    """
    # One statement sees one state of the file, also while another process makes the tables.
    application_id, version, tables = connection.execute(
        "SELECT application_id, user_version, (SELECT count(*) FROM sqlite_schema)"
        " FROM pragma_application_id, pragma_user_version"
    ).fetchone()
    if tables and application_id != APPLICATION_ID:
        raise ForeignFile(f"{path}: is a database of another program; choose another file")
    _check_schema(connection, path)
    return int(version)


def _check_schema(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a file with code in it: a trigger would change what is saved, a view never end.

    Raises:
        ForeignFile: something is in it that no migration has made.
    """
    found = connection.execute(
        "SELECT type, name FROM sqlite_schema WHERE type NOT IN ('table', 'index')"
        " OR type = 'table' AND rootpage = 0 LIMIT 1"  # a virtual table
    ).fetchone()
    if found is not None:
        kind = found[0] if found[0] in ("trigger", "view") else "virtual table"
        name = repr(str(found[1])[:_LONGEST_NAME])
        raise ForeignFile(f"{path}: has the {kind} {name}, which no store has; choose another file")


def _check_version(path: Path, version: int, migrations: Sequence[Migration]) -> None:
    latest = migrations[-1].version
    if version > latest:
        raise StoreTooNew(str(path), version, latest)


def _upgrade(
    connection: sqlite3.Connection, path: Path, version: int, migrations: Sequence[Migration]
) -> Path | None:
    """Bring a file to the latest version inside one transaction; return the copy made before."""
    if version == migrations[-1].version:
        return None
    kept = None
    if version:
        kept = _free_name(path, f"version-{version}")
        copy(connection, kept)
        log.warning("the store is upgraded from version %d; kept before: %s", version, kept)
    connection.execute("BEGIN IMMEDIATE")
    try:
        # Another process may have been faster while this one waited for its turn.
        version = _version(connection, path)
        for migration in migrations:
            if migration.version > version:
                for statement in migration.statements:
                    connection.execute(statement)
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        connection.execute(f"PRAGMA user_version = {migrations[-1].version}")
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise
    return kept


def _make(path: Path) -> None:
    """Make the file of a first start; it is a database at once, so that no store is ever empty."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.exists():
        return
    with _one_at_a_time(path.parent):
        if path.exists():  # another process was faster
            return
        # The log of a deleted file: SQLite would take it for that of the new one.
        set_log_aside(path)
        with atomic_file(path) as beside, contextlib.closing(_connect(beside, "mode=rw")) as new:
            new.execute(f"PRAGMA application_id = {APPLICATION_ID}")


@contextlib.contextmanager
def _one_at_a_time(folder: Path) -> Iterator[None]:
    """Keep other processes waiting that make a file in a folder."""
    opened = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(opened, fcntl.LOCK_EX)
        yield
    finally:
        os.close(opened)


def set_log_aside(path: Path) -> None:
    """Keep the log that a file left behind under another name, where it belongs to it no more."""
    log_file = _log_of(path)
    if log_file.exists() and log_file.stat().st_size:
        kept = _free_name(path, "lost", "-wal")
        log_file.rename(kept)
        log.error("the log of a store that is there no more is kept as %s", kept)
    path.with_name(path.name + "-shm").unlink(missing_ok=True)
    sync_folder(path)


def let_go_of_lost(path: Path) -> None:
    """Keep the log of an open file away from the one that has its name now; then it is closed.

    SQLite would move the log into a file that was written over, as that is still the one it opened;
    so it gets another place on the disk first, and SQLite leaves alone what was moved.

    Raises:
        OSError: the folder cannot be changed.
    """
    set_log_aside(path)
    if path.is_file():
        with atomic_file(path.resolve(), replace=True) as beside:
            shutil.copyfile(path, beside)


def _check_size(path: Path) -> None:
    # SQLite takes an empty file for a new database. It may be a restored copy that was cut short: a
    # store that had accounts must not come up as one without any.
    if not path.stat().st_size:
        raise BrokenFile(f"{path}: has 0 bytes, which neither a store nor a copy of one has")


def _log_of(path: Path) -> Path:
    return path.with_name(path.name + "-wal")


def _has_log(path: Path) -> bool:
    return _log_of(path).exists() and _log_of(path).stat().st_size > 0


def _set_aside(path: Path) -> Path:
    """Rename a file with its log, so that both still belong together; return the new name."""
    with translated(path):
        kept = _free_name(path, "broken")
        path.rename(kept)
        if _log_of(path).exists():
            _log_of(path).rename(_log_of(kept))
        path.with_name(path.name + "-shm").unlink(missing_ok=True)
        sync_folder(path)
    return kept


def _free_name(path: Path, what: str, ending: str = "") -> Path:
    for number in range(1, _MOST_KEPT):
        free = path.with_name(f"{path.name}.{what}-{number}{ending}")
        if not free.exists():
            return free
    raise StoreFailed(f"{path}: {_MOST_KEPT} files {path.name}.{what}-* are kept already")
