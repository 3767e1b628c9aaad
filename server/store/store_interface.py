"""Store interface: the calls of every store of documents; SQLite today, PostgreSQL perhaps.

All calls block until the disk has answered, so none belongs on an event loop: `writer.py` makes
them from a thread. A change that was acknowledged survives a crash.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Protocol

from .documents import Document, DocumentKind, Extent, Heading


class Store(Protocol):
    """Documents with revisions, and recordings in chunks.

    Every call raises a `StoreError` where it fails, and then has changed nothing: `BadName`,
    `NotFound`, `Conflict`, `TooLarge`, `BadDocument`, `OutOfSequence`; `DiskFull`, `ReadOnly`,
    `StoreBusy` or `StoreFailed` with the system's words.
    """

    def load(self, kind: DocumentKind, name: str, revision: int | None = None) -> Document:
        """Return a document.

        Args:
            revision: an older one, if it is still kept; the latest if None.
        """

    def headings(self, kind: DocumentKind | None = None) -> tuple[Heading, ...]:
        """Return the latest revision of every document, by kind and name; deleted ones not."""

    def history(self, kind: DocumentKind, name: str) -> tuple[Heading, ...]:
        """Return the revisions of a document that are kept, deletions included, oldest first."""

    def save(
        self, kind: DocumentKind, name: str, body: str, *, expected_revision: int, author: str
    ) -> Heading:
        """Save a document and return its new revision.

        Args:
            expected_revision: the one that the change was made from; 0 for a new document.
        """

    def delete(
        self, kind: DocumentKind, name: str, *, expected_revision: int, author: str
    ) -> Heading:
        """Delete a document and return the revision that is its deletion.

        Its older revisions stay in its history; the chunks of a recording go at once.
        """

    def append_chunk(self, name: str, sequence: int, data: bytes) -> Extent:
        """Append to a recording whose document is there; return how much it holds now.

        Repeating the last chunk, because its acknowledgement was lost, changes nothing.
        """

    def load_chunks(self, name: str, first: int, most: int) -> tuple[bytes, ...]:
        """Return up to `most` chunks of a recording, from number `first` on."""

    def extent(self, name: str) -> Extent:
        """Return how much of a recording is kept."""

    def together(self) -> AbstractContextManager[None]:
        """Return a context whose changes are kept all or, if it raises, not at all."""

    def close(self) -> None:
        """Close the store."""
