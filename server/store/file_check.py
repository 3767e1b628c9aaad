"""Store file check: a thorough check of pages, documents, revisions and recordings.

It does more than opening: every body is parsed and every chunk is counted. Changes nothing.
"""

from __future__ import annotations

import contextlib
import json
import sqlite3
from dataclasses import dataclass
from pathlib import Path

from .documents import DocumentKind
from .sqlite_file import MIGRATIONS, integrity, open_read_only, translated
from .store_errors import StoreError

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
