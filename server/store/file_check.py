"""The thorough check of a store's file: pages, documents, revisions and recordings.

More than opening does: every body is parsed and every chunk is counted. Changes nothing.
"""

from __future__ import annotations

import contextlib
import json
import sqlite3
from dataclasses import dataclass
from pathlib import Path

from .documents import DocumentKind
from .errors import StoreError
from .schema import MIGRATIONS
from .sqlite_faults import translated
from .sqlite_file import integrity, open_read_only

_MOST_PROBLEMS = 100


@dataclass(frozen=True, slots=True)
class Report:
    """What a check found.

    Attributes:
        documents: how many there are, deleted ones not counted.
        revisions: how many are kept, of all documents.
        chunks: how many chunks of recordings.
        problems: what is wrong, one line each; at most a hundred.
    """

    documents: int
    revisions: int
    chunks: int
    problems: tuple[str, ...]

    @property
    def is_sound(self) -> bool:
        """Whether nothing is wrong."""
        return not self.problems


def check_store(path: Path) -> Report:
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
    return Report(*counts, tuple(problems[:_MOST_PROBLEMS]))


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
