"""Recording edits: cutting and renaming by a copy of rows under another name, all or nothing.

Owns which rows are copied and the description of the copy. Works chunk by chunk, so that the length
of a recording costs time and no memory. Blocks, as all of the store does.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Iterator

from .documents import DocumentKind, Heading
from .recording_format import GAP, TIME, RowCount
from .samples import Row, append_rows, columns_of, recording_rows
from .store_errors import BadDocument
from .store_interface import Store

_RECORDING = DocumentKind.RECORDING


def trim_recording(
    store: Store, name: str, new_name: str, begins: float, ends: float | None, author: str
) -> Heading:
    """Save a part of a recording as a new one, its time counted from the first row kept.

    Args:
        name: of the recording; it stays as it is.
        begins: first time that is kept [s].
        ends: last time that is kept [s]; None for the end.

    Raises:
        BadDocument: no row lies in the part, or the recording has no time.
        StoreError: it is not there, or the new name is taken.
    """
    body = store.load(_RECORDING, name).body
    columns = columns_of(name, body)
    if columns[0] != TIME:
        raise BadDocument(f"recording {name!r}", f"accepted: {TIME!r} first", place="columns")
    gap = columns.index(GAP) if GAP in columns else None
    counted = RowCount()
    with store.together():
        saved = store.save(_RECORDING, new_name, body, expected_revision=0, author=author)
        rows = _part(recording_rows(store, name, len(columns)), begins, ends)
        append_rows(store, new_name, _from_zero(rows, gap, counted), len(columns))
        if not counted.rows:
            until = "the end" if ends is None else f"{ends:g} s"
            raise BadDocument(f"recording {name!r}", f"has no sample from {begins:g} s to {until}")
        # A part is complete, however its recording ended.
        whole = {"finished": True, "problem": ""} | counted.fields
        described = json.dumps(json.loads(body) | whole, ensure_ascii=False)
        return store.save(
            _RECORDING,
            new_name,
            described,
            expected_revision=saved.revision,
            author=author,
        )


def rename_recording(
    store: Store, name: str, new_name: str, expected_revision: int, author: str
) -> Heading:
    """Give a recording another name.

    Args:
        expected_revision: the one that whoever renames has seen.

    Raises:
        StoreError: it is not there, was changed since, or the new name is taken.
    """
    document = store.load(_RECORDING, name)
    with store.together():
        body = document.body
        renamed = store.save(_RECORDING, new_name, body, expected_revision=0, author=author)
        for number in itertools.count():
            chunk = store.load_chunks(name, number, 1)
            if not chunk:
                break
            store.append_chunk(new_name, number, chunk[0])
        store.delete(_RECORDING, name, expected_revision=expected_revision, author=author)
    return renamed


def _part(rows: Iterable[Row], begins: float, ends: float | None) -> Iterator[Row]:
    for row in rows:
        if row[0] >= begins and (ends is None or row[0] <= ends):
            yield row


def _from_zero(rows: Iterator[Row], gap: int | None, counted: RowCount) -> Iterator[Row]:
    """Count time from the first row, in front of which no gap is left."""
    zero = 0.0
    for row in rows:
        if not counted.rows:
            zero = row[0]
            marked = False
        else:
            marked = gap is not None and row[gap] != 0.0
        time = row[0] - zero
        counted.take(time, after_gap=marked)
        values = [time, *row[1:]]
        if gap is not None:
            values[gap] = float(marked)
        yield tuple(values)
