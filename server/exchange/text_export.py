"""Documents as text: JSON of format `openpendant-store/1`.

Owns the layout and its bounds; `text_import` is the way back. CSV is in `csv_format`.

    {"format": "openpendant-store/1", "documents": [
    {"kind": "program", "name": "weld", "revision": 7, "saved_by": "ann", "saved_at": "…",
     "body": {…}},
    {"kind": "recording", …, "body": {"columns": ["t", "j1"]}, "samples": [[0.0, 0.1], …]}
    ]}

On import `revision`, `saved_by` and `saved_at` may be left out; they are for the reader.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator

from ..store.documents import DocumentKind, Heading, Store
from ..store.recording_format import columns_of, recording_rows
from ..store.store_errors import TooLarge

FORMAT = "openpendant-store/1"
"""Name and version of the format, in its first field."""

MOST_FILE_BYTES = 16 << 20
"""Largest file of JSON [bytes]: read into memory, it takes some 25 times as much at worst."""

_NOT_ASCII = re.compile(r"[^\x00-\x7f]+")
_USE_BACKUP = "export the recording as CSV, or make a backup"


def documents_to_json(store: Store, headings: Iterable[Heading]) -> Iterator[str]:
    """Return documents as the text of a file, in pieces.

    Raises:
        TooLarge: the file would be larger than what can be imported again.
        StoreError: a document cannot be read.
    """
    size = 0
    for piece in _pieces(store, headings):
        size += len(piece)  # ASCII throughout
        if size > MOST_FILE_BYTES:
            raise TooLarge("the export", size, MOST_FILE_BYTES, _USE_BACKUP)
        yield piece


def _pieces(store: Store, headings: Iterable[Heading]) -> Iterator[str]:
    separator = f'{{"format": "{FORMAT}", "documents": [\n'
    for heading in headings:
        document = store.load(heading.kind, heading.name, heading.revision)
        about = {
            "kind": heading.kind,
            "name": heading.name,
            "revision": heading.revision,
            "saved_by": heading.saved_by,
            "saved_at": heading.saved_at,
        }
        yield f'{separator}{json.dumps(about)[:-1]}, "body": {_ascii(document.body)}'
        if heading.kind is DocumentKind.RECORDING:
            yield from _samples(store, heading.name, document.body)
        yield "}"
        separator = ",\n"
    yield "\n]}\n" if separator == ",\n" else separator + "]}\n"


def _samples(store: Store, name: str, body: str) -> Iterator[str]:
    if not store.extent(name).chunks:
        return
    separator = ', "samples": ['
    for row in recording_rows(store, name, len(columns_of(name, body))):
        yield separator + json.dumps(row, allow_nan=False)
        separator = ", "
    yield "]"


def _ascii(body: str) -> str:
    # Outside of its strings JSON is ASCII, and inside them an escape means the same.
    return _NOT_ASCII.sub(lambda found: json.dumps(found[0])[1:-1], body)
