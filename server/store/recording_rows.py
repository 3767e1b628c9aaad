"""The samples of a kept recording as rows, whatever chunks they lie in."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from .documents import MOST_CHUNK_BYTES
from .samples import Row, pack_rows, rows_in_a_chunk, unpack_rows
from .store import Store

_CHUNKS_AT_ONCE = 16


def recording_rows(store: Store, name: str, columns: int) -> Iterator[Row]:
    """Return the samples of a recording, some chunks at a time."""
    first = 0
    while chunks := store.load_chunks(name, first, _CHUNKS_AT_ONCE):
        for chunk in chunks:
            yield from unpack_rows(chunk, columns)
        first += len(chunks)


def chunks_together(store: Store, name: str, first: int, most: int) -> tuple[bytes, ...]:
    """Return chunks of a recording that are together no larger than one may be.

    Args:
        store: where it is.
        name: of the recording.
        first: number of the first of them.
        most: how many at most.

    Raises:
        StoreError: it is not there.
    """
    found: list[bytes] = []
    room = MOST_CHUNK_BYTES
    while len(found) < most:
        chunks = store.load_chunks(name, first + len(found), 1)
        if not chunks or (found and len(chunks[0]) > room):
            break
        found.append(chunks[0])
        room -= len(chunks[0])
    return tuple(found)


def append_chunks(store: Store, name: str, chunks: Iterable[bytes]) -> None:
    """Append chunks to a recording that has none yet."""
    for sequence, chunk in enumerate(chunks):
        store.append_chunk(name, sequence, chunk)


def append_rows(store: Store, name: str, rows: Iterable[Row], columns: int) -> None:
    """Append samples to a recording that has none yet."""
    append_chunks(store, name, packed(rows, columns))


def packed(rows: Iterable[Row], columns: int) -> Iterator[bytes]:
    """Return samples in as few chunks as hold them."""
    most = rows_in_a_chunk(columns)
    waiting: list[Row] = []
    for row in rows:
        waiting.append(row)
        if len(waiting) == most:
            yield pack_rows(waiting)
            waiting.clear()
    if waiting:
        yield pack_rows(waiting)
