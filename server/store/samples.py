"""The samples of a recording as chunks of bytes.

A chunk is rows of 8-byte little-endian reals, one row a sample, one column after the other. The
recording's document names them in `columns`, the time first: `{"columns": ["t", "j1", …]}`.
"""

from __future__ import annotations

import itertools
import json
import struct
from collections.abc import Iterable, Iterator, Sequence

from ..recording.document import TIME
from .documents import LONGEST_NAME, MOST_CHUNK_BYTES
from .errors import BadDocument

MOST_COLUMNS = 256

_REAL_BYTES = 8

Row = tuple[float, ...]


def time_first(columns: Sequence[str]) -> tuple[int, ...]:
    """Return the places of the columns with the time before the others, which stay in order."""
    at = columns.index(TIME) if TIME in columns else 0
    return (at, *(place for place in range(len(columns)) if place != at))


def time_fault(before: float | None, time: float) -> str:
    """Return what is wrong with the time of a row; empty where it goes on.

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
        data: a chunk.
        columns: how many reals a row has.

    Raises:
        BadDocument: the chunk does not hold whole rows.
    """
    if len(data) % (columns * _REAL_BYTES):
        problem = f"has {len(data)} bytes; accepted: a multiple of {columns} x {_REAL_BYTES}"
        raise BadDocument("a chunk of a recording", problem)
    return struct.iter_unpack(f"<{columns}d", data)


def rows_in_a_chunk(columns: int) -> int:
    """Return how many rows fit into the largest chunk."""
    return MOST_CHUNK_BYTES // (columns * _REAL_BYTES)


def columns_of(name: str, body: str) -> tuple[str, ...]:
    """Return the names of a recording's columns.

    Args:
        name: of the recording, for the error.
        body: of its document.

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
