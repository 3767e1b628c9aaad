"""Samples of a recording: rows of numbers, packed into chunks of bytes.

A chunk is rows of 8-byte little-endian reals, one row a sample, one column after the other. The
recording's document names them in `columns`, the time first: `{"columns": ["t", "j1", …]}`. The
samples of a kept recording are read as rows, whatever chunks they lie in.
"""

from __future__ import annotations

import itertools
import json
import struct
from collections.abc import Iterable, Iterator, Sequence

from .documents import LONGEST_NAME, MOST_CHUNK_BYTES
from .recording_format import TIME
from .store_errors import BadDocument
from .store_interface import Store

MOST_COLUMNS = 256

_REAL_BYTES = 8

Row = tuple[float, ...]


def time_first(columns: Sequence[str]) -> tuple[int, ...]:
    """Return the places of the columns with the time before the others, which stay in order."""
    at = columns.index(TIME) if TIME in columns else 0
    return (at, *(place for place in range(len(columns)) if place != at))


def time_fault(before: float | None, time: float) -> str:
    """Return the fault in the time of a row; empty if it advances.

    Args:
        before: the time of the row before [s]; None for the first row.
        time: the time of the row [s].
    """
    if before is None or time > before:
        return ""
    return f"is {time} s, after {before} s in the row before; accepted: times that advance"


def pack_rows(rows: Iterable[Sequence[float]]) -> bytes:
    """Return the bytes of rows, to the last bit.

    Args:
        rows: reals; all rows of one recording have as many columns as its document names.
    """
    values = list(itertools.chain.from_iterable(rows))
    return struct.pack(f"<{len(values)}d", *values)


def unpack_rows(data: bytes, columns: int) -> Iterator[Row]:
    """Return the rows in a chunk's bytes.

    Args:
        columns: how many reals a row has.

    Raises:
        BadDocument: the chunk does not hold whole rows.
    """
    if len(data) % (columns * _REAL_BYTES):
        problem = f"has {len(data)} bytes; accepted: a multiple of {columns} x {_REAL_BYTES}"
        raise BadDocument("a chunk of a recording", problem)
    return struct.iter_unpack(f"<{columns}d", data)


def rows_in_a_chunk(columns: int) -> int:
    """Return the greatest number of rows in a chunk."""
    return MOST_CHUNK_BYTES // (columns * _REAL_BYTES)


def columns_of(name: str, body: str) -> tuple[str, ...]:
    """Return the names of a recording's columns.

    Raises:
        BadDocument: the body does not name them.
    """
    data = json.loads(body)
    columns = data.get("columns") if isinstance(data, dict) else None
    if not (
        isinstance(columns, list)
        and 1 <= len(columns) <= MOST_COLUMNS
        and all(isinstance(column, str) and 1 <= len(column) <= LONGEST_NAME for column in columns)
        and len(set(columns)) == len(columns)
    ):
        accepted = f"1 to {MOST_COLUMNS} different names, of the time and of each joint"
        raise BadDocument(f"recording {name!r}", f"accepted: {accepted}", place="columns")
    return tuple(columns)


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
