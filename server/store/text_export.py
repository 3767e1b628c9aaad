"""Documents as text: JSON of format `openpendant-store/1`, and back.

Owns the layout, the bounds and the wording of what is wrong with a file. Nothing is saved before
the whole file was found good, and then all of it or nothing. CSV is in `csv_export.py`.

    {"format": "openpendant-store/1", "documents": [
    {"kind": "program", "name": "weld", "revision": 7, "saved_by": "ann", "saved_at": "…",
     "body": {…}},
    {"kind": "recording", …, "body": {"columns": ["t", "j1"]}, "samples": [[0.0, 0.1], …]}
    ]}

On import `revision`, `saved_by` and `saved_at` may be left out; they are for the reader.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from .documents import DocumentKind, Heading, check_body, check_name
from .errors import BadDocument, BadName, NotFound, StoreError, StoreFailed, TooLarge
from .samples import Row, columns_of, pack_rows, rows_in_a_chunk, unpack_rows
from .store import Store

FORMAT = "openpendant-store/1"
"""Name and version of the format, in its first field."""

MOST_FILE_BYTES = 16 << 20
"""Largest file of JSON [bytes]: read into memory, it takes some 25 times as much at worst."""

DEEPEST = 64
"""Most brackets inside each other."""

_MOST_DIGITS = 19
_NOT_ASCII = re.compile(r"[^\x00-\x7f]+")
_CHUNKS_AT_ONCE = 16
_USE_BACKUP = "export the recording as CSV, or make a backup"


@dataclass(frozen=True, slots=True)
class Entry:
    """A document as a file holds it.

    Attributes:
        kind: its kind.
        name: its name.
        body: JSON text.
        rows: samples, of a recording.
    """

    kind: DocumentKind
    name: str
    body: str
    rows: tuple[Row, ...] = ()


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


def read_file(path: Path) -> str:
    """Return the text of a file that is small enough to be parsed.

    Raises:
        TooLarge: it is larger; no more than the limit was read.
        BadDocument: it is not UTF-8.
        StoreFailed: it cannot be read.
    """
    try:
        with path.open("rb") as stream:
            raw = stream.read(MOST_FILE_BYTES + 1)
    except (OSError, ValueError) as error:
        raise StoreFailed(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    if len(raw) > MOST_FILE_BYTES:
        raise TooLarge(str(path), len(raw), MOST_FILE_BYTES)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise BadDocument(str(path), "is not UTF-8 text", line=line) from None


def documents_from_json(text: str, file: str) -> tuple[Entry, ...]:
    """Return the documents in the text of a file.

    Args:
        text: as `documents_to_json` made it, or written by hand.
        file: its name, for the error.

    Raises:
        BadDocument: it is not JSON, not of this format, or holds something that is no document.
        BadName: a document's name cannot be.
        TooLarge: a document's body.
    """
    content = _parsed(text, file)
    if not isinstance(content, dict):
        _refuse(file, "", f'accepted: an object with "format": "{FORMAT}"')
    if content.get("format") != FORMAT:
        _refuse(file, "format", f"accepted: {FORMAT!r}, and nothing else")
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
    store: Store, entries: Sequence[Entry], author: str, *, replace: bool
) -> tuple[Heading, ...]:
    """Save imported documents, all or none, and return their new revisions.

    Args:
        store: where to.
        entries: the documents.
        author: who imports them.
        replace: save over documents of the same names, whose revisions go on; else refuse.
    """
    with store.together():
        return tuple(_save(store, entry, author, replace) for entry in entries)


def _save(store: Store, entry: Entry, author: str, replace: bool) -> Heading:
    expected = current_revision(store, entry.kind, entry.name) if replace else 0
    if expected and entry.kind is DocumentKind.RECORDING:
        store.delete(entry.kind, entry.name, expected_revision=expected, author=author)
        expected = 0
    saved = store.save(
        entry.kind, entry.name, entry.body, expected_revision=expected, author=author
    )
    if entry.rows:
        append_rows(store, entry.name, entry.rows, len(entry.rows[0]))
    return saved


def current_revision(store: Store, kind: DocumentKind, name: str) -> int:
    """Return the revision to expect when saving; 0 where there is no such document."""
    try:
        return store.load(kind, name).heading.revision
    except NotFound:
        return 0


def _entry(document: Any, file: str, where: str) -> Entry:
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
        return Entry(kind, name, body)
    if kind is not DocumentKind.RECORDING:
        _refuse(file, f"{where}.samples", f"only a {DocumentKind.RECORDING} has samples")
    return Entry(kind, name, body, _rows(document["samples"], name, body, file, where))


def _rows(samples: Any, name: str, body: str, file: str, where: str) -> tuple[Row, ...]:
    try:
        width = len(columns_of(name, body))
    except StoreError:
        _refuse(file, f"{where}.body.columns", "accepted: the names of the samples' columns")
    if not isinstance(samples, list):
        _refuse(file, f"{where}.samples", "accepted: a list")
    for index, sample in enumerate(samples):
        if (
            not isinstance(sample, list)
            or len(sample) != width
            or not all(type(value) in (int, float) for value in sample)
        ):
            _refuse(file, f"{where}.samples[{index}]", f"accepted: a list of {width} numbers")
    return tuple(tuple(map(float, sample)) for sample in samples)


def _parsed(text: str, file: str) -> Any:
    def integer(digits: str) -> int:
        count = len(digits.removeprefix("-"))
        if count > _MOST_DIGITS:
            problem = f"has an integer of {count} digits; accepted: {_MOST_DIGITS}"
            raise BadDocument(file, problem)
        return int(digits)

    def constant(word: str) -> NoReturn:
        raise BadDocument(file, f"has {word}; accepted: finite numbers")

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        fields: dict[str, Any] = {}
        for key, value in pairs:
            if key in fields:
                raise BadDocument(file, f"has the key {key[:80]!a} twice in one object")
            fields[key] = value
        return fields

    try:
        content = json.loads(
            text, parse_int=integer, parse_constant=constant, object_pairs_hook=once
        )
    except json.JSONDecodeError as error:
        place = f"column {error.colno}"
        raise BadDocument(
            file, f"is not JSON: {error.msg}", line=error.lineno, place=place
        ) from None
    except RecursionError:
        raise BadDocument(file, f"nests too deeply; accepted: {DEEPEST} levels") from None
    _check_values(content, file)
    return content


def _check_values(content: Any, file: str) -> None:
    """Refuse what nests too deeply and reals that are too large to be finite."""
    # By hand, not by recursion, and with the place named only where it is needed: a file may hold
    # millions of values.
    places: list[int | str] = []
    inside: list[Iterator[tuple[int | str, Any]]] = [iter([("", content)])]
    while inside:
        place, value = next(inside[-1], (None, None))
        if place is None:
            inside.pop()
            if places:
                places.pop()
        elif isinstance(value, dict | list):
            places.append(place)
            inside.append(iter(value.items() if isinstance(value, dict) else enumerate(value)))
            if len(inside) > DEEPEST + 1:
                _refuse(file, _path(places), f"nests too deeply; accepted: {DEEPEST} levels")
        elif isinstance(value, float) and not math.isfinite(value):
            _refuse(file, _path([*places, place]), "the number is too large")


def _path(places: Sequence[int | str]) -> str:
    parts = [
        f"[{part}]" if isinstance(part, int) else f".{part[:80]}" for part in places if part != ""
    ]
    return "".join(parts).removeprefix(".")[:400]


def _only(given: dict[str, Any], known: set[str], file: str, where: str) -> None:
    unknown = sorted(set(given) - known)
    if unknown:
        place = f"{where}.{unknown[0][:80]}".removeprefix(".")
        _refuse(file, place, f"unknown; known here: {', '.join(sorted(known))}")


def _refuse(file: str, place: str, problem: str) -> NoReturn:
    raise BadDocument(file, problem, place=place)
