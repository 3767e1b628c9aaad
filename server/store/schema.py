"""The tables of the store's file, by version.

A version once released keeps its statements; a change appends a migration, and a test upgrades a
file of every older version. A new kind of document is a new version, too, perhaps without any
statement: an older program must not meet it. The version stands in the file's header
(`user_version`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

APPLICATION_ID = 0x4F50656E
"""Marks a file as ours in its header: the letters `OPen`."""


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
)
