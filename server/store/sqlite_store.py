"""The store in one SQLite file: write-ahead log, full sync, one change after the other.

Owns the statements, and that a change is compared with the kept revision (`documents`) inside the
transaction that saves it, so that neither two pendants nor two processes overwrite each other.
Blocks until the disk has answered; used by one thread at a time, the one that opened it.

Owns also the thorough check of a file: more than at its opening, every body is parsed and every
chunk counted. That changes nothing.
"""

from __future__ import annotations

import contextlib
import json
import logging
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from .database_file import IN_MEMORY, FileIdentity, ReservedSpace
from .documents import (
    KEPT_REVISIONS,
    Document,
    DocumentKind,
    Extent,
    Heading,
    check_author,
    check_body,
    check_chunk,
    check_name,
    check_new_name,
    check_revision,
    revision_after,
)
from .sqlite_file import (
    MIGRATIONS,
    Migration,
    OpenFile,
    integrity,
    let_go_of_lost,
    open_file,
    open_read_only,
    translated,
)
from .store_errors import BadDocument, DiskFull, NotFound, OutOfSequence, ReadOnly, StoreError

log = logging.getLogger("openpendant.server")

_HEADING = "kind, name, revision, size, saved_by, saved_at, body IS NULL"
_LARGEST_INTEGER = 2**63 - 1


def utc_now() -> str:
    """Return the wall-clock time, for display only."""
    return datetime.now(UTC).isoformat(timespec="seconds")


class SqliteStore:
    """Documents and recordings in one file; see `Store` for what each call promises."""

    def __init__(self, path: Path, opened: OpenFile, wall_clock: Callable[[], str]) -> None:
        """Make a store of an open file; `open_store` and `open_for_reading` do both."""
        self.path = path
        self.is_read_only = opened.is_read_only
        self.set_aside = opened.set_aside
        self.before_upgrade = opened.before_upgrade
        self.connection = opened.connection
        self._reserve = ReservedSpace(path)
        self._identity: FileIdentity | None = None
        if not self.is_read_only:
            self._reserve.fill()
            if str(path) != IN_MEMORY:
                self._identity = FileIdentity(path)
        self._wall_clock = wall_clock

    def load(self, kind: DocumentKind, name: str, revision: int | None = None) -> Document:
        """Return a document, the latest revision if none is named."""
        check_name(name)
        wanted = _LARGEST_INTEGER if revision is None else revision
        if not 0 < wanted <= _LARGEST_INTEGER:
            raise NotFound(kind, name, revision)
        with translated(self.path):
            row = self.connection.execute(
                f"SELECT {_HEADING}, body FROM revision"
                " WHERE kind = ? AND name = ? AND revision <= ? ORDER BY revision DESC LIMIT 1",
                (kind, name, wanted),
            ).fetchone()
        heading = None if row is None else _heading(row)
        if heading is None or heading.deleted or revision not in (None, heading.revision):
            raise NotFound(kind, name, revision)
        return Document(heading, row[-1])

    def headings(self, kind: DocumentKind | None = None) -> tuple[Heading, ...]:
        """Return the latest revision of every document, by kind and name; deleted ones not."""
        with translated(self.path):
            rows = self.connection.execute(
                # With max() alone, SQLite takes the other columns from the row of the maximum.
                "SELECT kind, name, max(revision), size, saved_by, saved_at, body IS NULL"
                " FROM revision WHERE ?1 IS NULL OR kind = ?1"
                " GROUP BY kind, name ORDER BY kind, name",
                (kind,),
            ).fetchall()
        return tuple(heading for heading in map(_heading, rows) if not heading.deleted)

    def history(self, kind: DocumentKind, name: str) -> tuple[Heading, ...]:
        """Return the revisions of a document that are kept, deletions included, oldest first."""
        check_name(name)
        with translated(self.path):
            rows = self.connection.execute(
                f"SELECT {_HEADING} FROM revision WHERE kind = ? AND name = ? ORDER BY revision",
                (kind, name),
            ).fetchall()
        if not rows:
            raise NotFound(kind, name)
        return tuple(map(_heading, rows))

    def save(
        self, kind: DocumentKind, name: str, body: str, *, expected_revision: int, author: str
    ) -> Heading:
        """Save a document and return its new revision."""
        if expected_revision:
            check_name(name)
        else:
            check_new_name(name)
        check_author(author)
        size = check_body(kind, name, body)
        self._check_json(kind, name, body)
        with self._change():
            current = self._latest(kind, name)
            check_revision(kind, name, expected_revision, current)
            at = self._wall_clock()
            saved = Heading(kind, name, revision_after(current), size, author, at)
            self._insert(saved, body)
        return saved

    def delete(
        self, kind: DocumentKind, name: str, *, expected_revision: int, author: str
    ) -> Heading:
        """Delete a document and return the revision that is its deletion."""
        check_name(name)
        check_author(author)
        if self.connection.in_transaction:  # of `together`, whose other changes need room anyhow
            return self._delete(kind, name, expected_revision, author)
        while True:
            try:
                return self._delete(kind, name, expected_revision, author)
            except DiskFull:
                if not self._reserve.give_back():
                    raise
                # The log can move into the file now, which makes more room.
                self._merge_log()

    def _delete(
        self, kind: DocumentKind, name: str, expected_revision: int, author: str
    ) -> Heading:
        with self._change():
            current = self._latest(kind, name)
            if current is None or (current.deleted and not expected_revision):
                raise NotFound(kind, name)
            check_revision(kind, name, expected_revision, current)
            revision, at = revision_after(current), self._wall_clock()
            deleted = Heading(kind, name, revision, 0, author, at, deleted=True)
            self._insert(deleted, None)
            if kind is DocumentKind.RECORDING:
                self.connection.execute("DELETE FROM recording_chunk WHERE name = ?", (name,))
        return deleted

    def append_chunk(self, name: str, sequence: int, data: bytes) -> Extent:
        """Append to a recording; return how much it holds now."""
        check_name(name)
        check_chunk(name, data)
        with self._change():
            extent = self._extent(name)
            if sequence == extent.chunks - 1 and self._chunk(name, sequence) == data:
                return extent
            if sequence != extent.chunks:
                raise OutOfSequence(name, sequence, extent.chunks)
            self.connection.execute(
                "INSERT INTO recording_chunk (name, sequence, total, data) VALUES (?, ?, ?, ?)",
                (name, sequence, extent.size + len(data), data),
            )
        return Extent(sequence + 1, extent.size + len(data))

    def load_chunks(self, name: str, first: int, most: int) -> tuple[bytes, ...]:
        """Return up to `most` chunks of a recording, from number `first` on."""
        check_name(name)
        with translated(self.path):
            self._check_recording(name)
            rows = self.connection.execute(
                "SELECT data FROM recording_chunk"
                " WHERE name = ? AND sequence >= ? ORDER BY sequence LIMIT ?",
                (name, min(first, _LARGEST_INTEGER), min(most, _LARGEST_INTEGER)),
            ).fetchall()
        return tuple(row[0] for row in rows)

    def extent(self, name: str) -> Extent:
        """Return how much of a recording is kept."""
        check_name(name)
        with translated(self.path):
            return self._extent(name)

    @contextlib.contextmanager
    def together(self) -> Iterator[None]:
        """Keep all changes made inside the context or, if it raises, none of them."""
        with self._change():
            yield

    def close(self) -> None:
        """Close the file; its log is merged into it, unless another file has its name."""
        with translated(self.path):
            if self._identity is not None and self._identity.is_lost():
                try:
                    let_go_of_lost(self.path)
                except OSError as error:
                    log.error("the log of a store that is there no more stays: %s", error)
            self.connection.close()

    @contextlib.contextmanager
    def _change(self) -> Iterator[None]:
        """Run a transaction that is on the disk when the context ends, or undone if it raises."""
        if self.is_read_only:
            raise ReadOnly(f"{self.path}: was opened for reading only")
        if self.connection.in_transaction:  # of `together`
            yield
            return
        try:
            with translated(self.path):
                self._check_identity()
                self.connection.execute("BEGIN IMMEDIATE")
                yield
                self.connection.execute("COMMIT")
                # Checked again before the acknowledgement: a change written into a file that lost
                # its name meanwhile is lost with it, so it must not count as saved.
                self._check_identity()
        except BaseException as error:
            self._undo()
            if isinstance(error, DiskFull):
                self._merge_log()
            raise
        if not self._reserve.is_whole:
            self._merge_log()
            self._reserve.fill()

    def _check_identity(self) -> None:
        if self._identity is not None:
            self._identity.check()

    def _undo(self) -> None:
        # The first fault of a failing disk is raised; those of the rollback add nothing.
        with contextlib.suppress(sqlite3.Error):
            if self.connection.in_transaction:
                self.connection.execute("ROLLBACK")

    def _merge_log(self) -> None:
        """Give back the room that the log takes, as far as there is room for what it holds."""
        with contextlib.suppress(sqlite3.Error):
            self.connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")

    def _check_json(self, kind: DocumentKind, name: str, body: str) -> None:
        # By SQLite, which lets other threads run meanwhile; Python's parser would not.
        with translated(self.path):
            (is_json,) = self.connection.execute("SELECT json_valid(?)", (body,)).fetchone()
        if not is_json:
            problem = "the body is not JSON, or nested too deeply; accepted: up to 1000 levels"
            raise BadDocument(f"{kind} {name!r}", problem)

    def _latest(self, kind: DocumentKind, name: str) -> Heading | None:
        row = self.connection.execute(
            f"SELECT {_HEADING} FROM revision"
            " WHERE kind = ? AND name = ? ORDER BY revision DESC LIMIT 1",
            (kind, name),
        ).fetchone()
        return None if row is None else _heading(row)

    def _insert(self, heading: Heading, body: str | None) -> None:
        values = (heading.kind, heading.name, heading.revision)
        self.connection.execute(
            "INSERT INTO revision (kind, name, revision, size, saved_by, saved_at, body)"
            " VALUES (?, ?, ?, ?, ?, ?, ?)",
            (*values, heading.size, heading.saved_by, heading.saved_at, body),
        )
        self.connection.execute(
            "DELETE FROM revision WHERE kind = ? AND name = ? AND revision <= ?",
            (*values[:2], heading.revision - KEPT_REVISIONS[heading.kind]),
        )

    def _check_recording(self, name: str) -> None:
        heading = self._latest(DocumentKind.RECORDING, name)
        if heading is None or heading.deleted:
            raise NotFound(DocumentKind.RECORDING, name)

    def _extent(self, name: str) -> Extent:
        self._check_recording(name)
        row = self.connection.execute(
            "SELECT sequence + 1, total FROM recording_chunk"
            " WHERE name = ? ORDER BY sequence DESC LIMIT 1",
            (name,),
        ).fetchone()
        return Extent(0, 0) if row is None else Extent(*row)

    def _chunk(self, name: str, sequence: int) -> bytes | None:
        row = self.connection.execute(
            "SELECT data FROM recording_chunk WHERE name = ? AND sequence = ?", (name, sequence)
        ).fetchone()
        return None if row is None else bytes(row[0])


def open_store(
    path: Path,
    *,
    wall_clock: Callable[[], str] = utc_now,
    migrations: Sequence[Migration] = MIGRATIONS,
) -> SqliteStore:
    """Open the store of a server; make its file, upgrade it, or set a broken one aside.

    Args:
        wall_clock: the time as text, for display only.

    Raises:
        StoreError: it cannot be opened, belongs to another program, or is of a later version.
    """
    reserve = ReservedSpace(path)
    while True:
        try:
            return SqliteStore(path, open_file(path, migrations), wall_clock)
        except DiskFull:
            if not reserve.give_back():
                raise


def open_for_reading(path: Path, *, migrations: Sequence[Migration] = MIGRATIONS) -> SqliteStore:
    """Open a store whose file must not be changed, whether or not a server has it open.

    Raises:
        StoreError: it is not there, broken, of another program or of another version.
    """
    opened = OpenFile(open_read_only(path, migrations), is_read_only=True)
    return SqliteStore(path, opened, utc_now)


def _heading(row: Sequence[Any]) -> Heading:
    kind, name, revision, size, saved_by, saved_at, deleted = row[:7]
    return Heading(
        DocumentKind(kind), name, revision, size, saved_by, saved_at, deleted=bool(deleted)
    )


_MOST_PROBLEMS = 100


@dataclass(frozen=True, slots=True)
class FileReport:
    """Result of a check.

    Attributes:
        documents: number of documents, deleted ones not counted.
        problems: one line each; at most a hundred.
    """

    documents: int
    revisions: int
    chunks: int
    problems: tuple[str, ...]

    @property
    def is_sound(self) -> bool:
        """True if the check found no problem."""
        return not self.problems


def check_store(path: Path) -> FileReport:
    """Check a store's file, whether or not a server has it open.

    Raises:
        StoreError: it is not there, of another program or of another version.
    """
    with contextlib.closing(open_read_only(path, MIGRATIONS)) as connection:
        problems: list[str] = []
        counts = (0, 0, 0)
        try:
            with translated(path):
                problems += integrity(connection, thorough=True)
                problems += _unreadable(connection)
                problems += _incomplete(connection)
                counts = _counts(connection)
        except StoreError as error:
            problems.append(str(error))
    return FileReport(*counts, tuple(problems[:_MOST_PROBLEMS]))


def _unreadable(connection: sqlite3.Connection) -> list[str]:
    problems = []
    rows = connection.execute(
        "SELECT kind, name, revision, size, body FROM revision ORDER BY kind, name, revision"
    )
    for kind, name, revision, size, body in rows:
        what = f"{kind} {name!r}, revision {revision}"
        if kind not in list(DocumentKind):
            problems.append(f"{what}: unknown kind")
        if body is None:
            continue
        if len(body.encode()) != size:
            problems.append(f"{what}: has {len(body.encode())} bytes, not {size}")
        try:
            json.loads(body)
        except (ValueError, RecursionError) as error:
            problems.append(f"{what}: is not JSON: {error}")
    return problems


def _incomplete(connection: sqlite3.Connection) -> list[str]:
    rows = connection.execute(
        "SELECT name, count(*), max(sequence) + 1, max(total), sum(length(data))"
        " FROM recording_chunk GROUP BY name"
    )
    problems = []
    for name, count, following, total, size in rows:
        if (count, total) != (following, size):
            problems.append(
                f"recording {name!r}: {count} chunks of {size} bytes are there,"
                f" {following} of {total} bytes were saved"
            )
    return problems


def _counts(connection: sqlite3.Connection) -> tuple[int, int, int]:
    (documents,) = connection.execute(
        "SELECT count(*) FROM (SELECT max(revision), body IS NULL AS gone FROM revision"
        " GROUP BY kind, name) WHERE NOT gone"
    ).fetchone()
    (revisions,) = connection.execute("SELECT count(*) FROM revision").fetchone()
    (chunks,) = connection.execute("SELECT count(*) FROM recording_chunk").fetchone()
    return documents, revisions, chunks
