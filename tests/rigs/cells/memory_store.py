"""A store of documents in memory, by the rules of the real one, for tests without a disk."""

from collections.abc import Iterator
from contextlib import contextmanager

from openpendant.server.store.documents import (
    Document,
    DocumentKind,
    Extent,
    Heading,
    check_author,
    check_body,
    check_name,
    check_new_name,
)
from openpendant.server.store.store_errors import Conflict, NotFound, OutOfSequence, StoreError

_SAVED_AT = "2026-01-01T00:00:00+00:00"


class MemoryStore:
    """Every revision of every document; `failure` is raised instead of saving where it is set."""

    def __init__(self) -> None:
        self.failure: StoreError | None = None
        self._revisions: dict[tuple[DocumentKind, str], list[tuple[Heading, str]]] = {}
        self._chunks: dict[str, list[bytes]] = {}

    def load(self, kind: DocumentKind, name: str, revision: int | None = None) -> Document:
        check_name(name)
        kept = self._revisions.get((kind, name), [])
        wanted = kept[-1:] if revision is None else [e for e in kept if e[0].revision == revision]
        if not wanted or wanted[0][0].deleted:
            raise NotFound(kind, name, revision)
        return Document(*wanted[0])

    def headings(self, kind: DocumentKind | None = None) -> tuple[Heading, ...]:
        latest = (kept[-1][0] for _, kept in sorted(self._revisions.items()))
        return tuple(h for h in latest if not h.deleted and kind in (None, h.kind))

    def history(self, kind: DocumentKind, name: str) -> tuple[Heading, ...]:
        kept = self._revisions.get((kind, name))
        if not kept:
            raise NotFound(kind, name)
        return tuple(heading for heading, _ in kept)

    def save(
        self, kind: DocumentKind, name: str, body: str, *, expected_revision: int, author: str
    ) -> Heading:
        if expected_revision:
            check_name(name)
        else:
            check_new_name(name)
        size = check_body(kind, name, body)
        return self._add(kind, name, body, size, expected_revision, author, deleted=False)

    def delete(
        self, kind: DocumentKind, name: str, *, expected_revision: int, author: str
    ) -> Heading:
        self.load(kind, name)
        return self._add(kind, name, "", 0, expected_revision, author, deleted=True)

    def _add(
        self,
        kind: DocumentKind,
        name: str,
        body: str,
        size: int,
        expected: int,
        author: str,
        *,
        deleted: bool,
    ) -> Heading:
        check_author(author)
        if self.failure is not None:
            raise self.failure
        kept = self._revisions.setdefault((kind, name), [])
        last = kept[-1][0] if kept else None
        current = 0 if last is None or last.deleted else last.revision
        if current != expected:
            raise Conflict(kind, name, expected, current, last.saved_by if last else "", _SAVED_AT)
        number = 1 if last is None else last.revision + 1
        heading = Heading(kind, name, number, size, author, _SAVED_AT, deleted)
        kept.append((heading, body))
        return heading

    def append_chunk(self, name: str, sequence: int, data: bytes) -> Extent:
        chunks = self._chunks.setdefault(name, [])
        if sequence != len(chunks):
            raise OutOfSequence(name, sequence, len(chunks))
        chunks.append(data)
        return self.extent(name)

    def load_chunks(self, name: str, first: int, most: int) -> tuple[bytes, ...]:
        return tuple(self._chunks.get(name, [])[first : first + most])

    def extent(self, name: str) -> Extent:
        chunks = self._chunks.get(name, [])
        return Extent(len(chunks), sum(map(len, chunks)))

    @contextmanager
    def together(self) -> Iterator[None]:
        yield

    def close(self) -> None:
        """Nothing to let go of."""
