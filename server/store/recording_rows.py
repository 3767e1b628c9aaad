"""The samples of a kept recording as rows, whatever chunks they lie in."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

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


def append_rows(store: Store, name: str, rows: Iterable[Row], columns: int) -> None:
    """Append samples to a recording that has none yet."""
    most = rows_in_a_chunk(columns)
    sequence = 0
    waiting: list[Row] = []
    for row in rows:
        waiting.append(row)
        if len(waiting) == most:
            store.append_chunk(name, sequence, pack_rows(waiting))
            sequence += 1
            waiting.clear()
    if waiting:
        store.append_chunk(name, sequence, pack_rows(waiting))
