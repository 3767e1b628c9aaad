"""Counting the rows of a recording that is kept, some chunks at a time.

For recordings whose description does not say it: of one that was cut off nobody could write it,
and an imported one may come without. Between two portions the event loop does other things.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from ..outgoing import Outgoing
from ..refusal import Refusal
from ..store.errors import BadDocument
from ..store.questions import AskStore
from ..store.requests import Answer, LoadChunks
from .document import GAP
from .row_count import RowCount
from .store_refusal import store_refusal

_CHUNKS_AT_ONCE = 256
_REAL_BYTES = 8

Counted: TypeAlias = Callable[[RowCount | Refusal, int], list[Outgoing]]
"""Takes what was counted, or why it could not be, and the time."""


def count_rows(
    ask: AskStore, name: str, columns: tuple[str, ...], counted: Counted
) -> list[Outgoing]:
    """Count the rows of a recording.

    Args:
        ask: the way to the store.
        name: of the recording.
        columns: of its rows, the time first.
        counted: is told once.
    """
    return _count_from(ask, name, columns, counted, RowCount(), 0)


def _count_from(
    ask: AskStore,
    name: str,
    columns: tuple[str, ...],
    counted: Counted,
    count: RowCount,
    first: int,
) -> list[Outgoing]:
    def loaded(answer: Answer, now: int) -> list[Outgoing]:
        if not isinstance(answer, tuple):
            return counted(store_refusal(answer), now)
        chunks = [each for each in answer if isinstance(each, bytes)]
        for chunk in chunks:
            if len(chunk) % (_REAL_BYTES * len(columns)):
                problem = f"has {len(chunk)} bytes, no whole rows of {len(columns)} reals"
                fault = BadDocument(f"a chunk of recording {name!r}", problem)
                return counted(fault.refusal(), now)
            _take_chunk(count, columns, chunk)
        if not chunks:
            return counted(count, now)
        return _count_from(ask, name, columns, counted, count, first + len(chunks))

    return ask(LoadChunks(name, first, _CHUNKS_AT_ONCE), loaded)


def _take_chunk(count: RowCount, columns: tuple[str, ...], chunk: bytes) -> None:
    """Count a chunk's rows; row by row only those that a gap precedes."""
    table = np.frombuffer(chunk, "<f8").reshape(-1, len(columns))
    times = table[:, 0]
    marked = np.flatnonzero(table[:, columns.index(GAP)]).tolist() if GAP in columns else []
    edges = marked if marked and marked[0] == 0 else [0, *marked]
    gaps = frozenset(marked)
    for edge, following in zip(edges, [*edges[1:], len(times)], strict=True):
        count.take(float(times[edge]), after_gap=edge in gaps)
        count.take_more(following - edge - 1, float(times[following - 1]))
