"""Documents as text: JSON of format `openpendant-store/1`, written, and read again.

Owns the layout and its bounds. CSV is in `csv_format`.

    {"format": "openpendant-store/1", "documents": [
    {"kind": "program", "name": "weld", "revision": 7, "saved_by": "ann", "saved_at": "…",
     "body": {…}},
    {"kind": "recording", …, "body": {"columns": ["t", "j1"]}, "samples": [[0.0, 0.1], …]}
    ]}

On import `revision`, `saved_by` and `saved_at` may be left out; they are for the reader.

Owns the messages on faults of a file that is imported. Nothing is saved before the whole file was
checked, and then all of it or nothing. Chunks of a recording wait in a `ChunkSpool` until then: a
server waits for the lock of the store as well, so it is held for the inserts only, not while a long
file is read.
"""

from __future__ import annotations

import contextlib
import json
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

from openpendant.motion.bounded_file import beginning_of

from ..store.documents import DocumentKind, Heading, Store, check_body, check_name
from ..store.recording_format import (
    Row,
    append_rows,
    columns_of,
    recording_rows,
    time_fault,
    time_first,
)
from ..store.store_errors import BadDocument, BadName, NotFound, StoreError, StoreFailed, TooLarge
from ..store.strict_json import parse

_MOST_IN_MEMORY = 16 << 20


class ChunkSpool(contextlib.AbstractContextManager["ChunkSpool"]):
    """Chunks in order; a temporary file holds them where they are many."""

    def __init__(self) -> None:
        """Start without chunks; close it, as the end of a `with` does."""
        self._file = tempfile.SpooledTemporaryFile(_MOST_IN_MEMORY)
        self._sizes: list[int] = []

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def take(self, chunks: Iterable[bytes]) -> None:
        """Keep the next chunks.

        Raises:
            StoreFailed: the temporary file cannot be written.
        """
        for chunk in chunks:
            with _failures_told():
                self._file.write(chunk)
            self._sizes.append(len(chunk))

    def __iter__(self) -> Iterator[bytes]:
        """Yield all chunks again, from the first.

        Raises:
            StoreFailed: the temporary file cannot be read.
        """
        with _failures_told():
            self._file.seek(0)
        for size in self._sizes:
            with _failures_told():
                chunk = self._file.read(size)
            yield chunk


@contextlib.contextmanager
def _failures_told() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        folder = tempfile.gettempdir()
        raise StoreFailed(f"the temporary file in {folder}: {error.strerror or error}") from None


@dataclass(frozen=True, slots=True)
class ImportedDocument:
    """A document as a file holds it.

    Attributes:
        rows: samples, of a recording.
        where: its place in the file, for errors; empty where it is the whole file.
    """

    kind: DocumentKind
    name: str
    body: str
    rows: tuple[Row, ...] = ()
    where: str = ""


def named(entry: ImportedDocument, name: str) -> ImportedDocument:
    """Return a document under another name; a program says its own in its body, too."""
    if entry.kind is not DocumentKind.PROGRAM:
        return replace(entry, name=name)
    body = json.dumps(json.loads(entry.body) | {"name": name}, ensure_ascii=False)
    return replace(entry, name=name, body=body)


def read_file(path: Path) -> str:
    """Return the text of a file that is small enough to be parsed.

    Raises:
        TooLarge: it is larger; no more than the limit was read.
        BadDocument: it is not UTF-8.
        StoreFailed: it cannot be read.
    """
    try:
        raw = beginning_of(path, MOST_FILE_BYTES + 1)
    except (OSError, ValueError) as error:
        raise StoreFailed(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    if len(raw) > MOST_FILE_BYTES:
        raise TooLarge(str(path), len(raw), MOST_FILE_BYTES)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise BadDocument(str(path), "is not UTF-8 text", line=line) from None


def documents_from_json(
    text: str,
    file: str,
    others: Mapping[str, Callable[[], tuple[ImportedDocument, ...]]] | None = None,
) -> tuple[ImportedDocument, ...]:
    """Return the documents in the text of a file.

    Args:
        text: as `documents_to_json` made it, or written by hand.
        others: what reads the text where its format is another than ours, by format.

    Raises:
        BadDocument: it is not JSON, not of this format, or holds something that is no document.
        BadName: a document's name cannot be.
        TooLarge: a document's body.
    """
    content = parse(text, file)
    if not isinstance(content, dict):
        _refuse(file, "", f'accepted: an object with "format": "{FORMAT}"')
    others = others or {}
    form = content.get("format")
    if isinstance(form, str) and form in others:
        return others[form]()
    if form != FORMAT:
        accepted = " or ".join(repr(each) for each in (FORMAT, *others))
        _refuse(file, "format", f"accepted: {accepted}, and nothing else")
    _only(content, {"format", "documents"}, file, "")
    documents = content.get("documents")
    if not isinstance(documents, list):
        _refuse(file, "documents", "accepted: a list")
    entries = tuple(
        _entry(document, file, f"documents[{index}]") for index, document in enumerate(documents)
    )
    seen: set[tuple[DocumentKind, str]] = set()
    for index, entry in enumerate(entries):
        if (entry.kind, entry.name) in seen:
            _refuse(file, f"documents[{index}]", f"{entry.kind} {entry.name!r} is there twice")
        seen.add((entry.kind, entry.name))
    return entries


def save_entries(
    store: Store, entries: Sequence[ImportedDocument], author: str, *, replace: bool
) -> tuple[Heading, ...]:
    """Save imported documents, all or none, and return their new revisions.

    Args:
        replace: save over documents of the same names, whose revisions go on; else refuse.
    """
    with store.together():
        return tuple(_save(store, entry, author, replace) for entry in entries)


def _save(store: Store, entry: ImportedDocument, author: str, replace: bool) -> Heading:
    expected = _current_revision(store, entry.kind, entry.name) if replace else 0
    if expected and entry.kind is DocumentKind.RECORDING:
        store.delete(entry.kind, entry.name, expected_revision=expected, author=author)
        expected = 0
    saved = store.save(
        entry.kind, entry.name, entry.body, expected_revision=expected, author=author
    )
    if entry.rows:
        append_rows(store, entry.name, entry.rows, len(entry.rows[0]))
    return saved


def _current_revision(store: Store, kind: DocumentKind, name: str) -> int:
    """Return the revision to expect when saving; 0 where there is no such document."""
    try:
        return store.load(kind, name).heading.revision
    except NotFound:
        return 0


def _entry(document: Any, file: str, where: str) -> ImportedDocument:
    if not isinstance(document, dict):
        _refuse(file, where, "accepted: an object")
    known = {"kind", "name", "revision", "saved_by", "saved_at", "body", "samples"}
    _only(document, known, file, where)
    try:
        kind = DocumentKind(str(document.get("kind")))
    except ValueError:
        _refuse(file, f"{where}.kind", f"accepted: {', '.join(DocumentKind)}")
    name = document.get("name")
    if not isinstance(name, str):
        _refuse(file, f"{where}.name", "accepted: a text")
    try:
        check_name(name)
    except BadName as error:
        raise BadName(name, f"{error.problem} ({file}, {where}.name)") from None
    if not isinstance(document.get("body"), dict):
        _refuse(file, f"{where}.body", "accepted: an object")
    body = json.dumps(document["body"], ensure_ascii=False, allow_nan=False)
    check_body(kind, name, body)
    if "samples" not in document:
        return ImportedDocument(kind, name, body, where=where)
    if kind is not DocumentKind.RECORDING:
        _refuse(file, f"{where}.samples", f"only a {DocumentKind.RECORDING} has samples")
    try:
        columns = columns_of(name, body)
    except StoreError:
        _refuse(file, f"{where}.body.columns", "accepted: the names of the samples' columns")
    rows = _rows(document["samples"], columns, file, where)
    order = time_first(columns)
    if order[0] != 0:
        ordered = {"columns": [columns[place] for place in order]}
        body = json.dumps(document["body"] | ordered, ensure_ascii=False)
        rows = tuple(tuple(row[place] for place in order) for row in rows)
    return ImportedDocument(kind, name, body, rows, where)


def _rows(samples: Any, columns: Sequence[str], file: str, where: str) -> tuple[Row, ...]:
    width, at = len(columns), time_first(columns)[0]
    if not isinstance(samples, list):
        _refuse(file, f"{where}.samples", "accepted: a list")
    for index, sample in enumerate(samples):
        if (
            not isinstance(sample, list)
            or len(sample) != width
            or not all(type(value) in (int, float) for value in sample)
        ):
            _refuse(file, f"{where}.samples[{index}]", f"accepted: a list of {width} numbers")
        fault = time_fault(samples[index - 1][at] if index else None, sample[at])
        if fault:
            _refuse(file, f"{where}.samples[{index}][{at}]", fault)
    return tuple(tuple(map(float, sample)) for sample in samples)


def _only(given: dict[str, Any], known: set[str], file: str, where: str) -> None:
    unknown = sorted(set(given) - known)
    if unknown:
        place = f"{where}.{unknown[0][:80]}".removeprefix(".")
        _refuse(file, place, f"unknown; known here: {', '.join(sorted(known))}")


def _refuse(file: str, place: str, problem: str) -> NoReturn:
    raise BadDocument(file, problem, place=place)


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
