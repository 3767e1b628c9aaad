"""CSV format of point lists and recordings: commas between cells, dots in numbers, always.

Owns the form of a cell. A point list is the list `points` of a document's body: a row for each
point, a column for each value, named by its place: `name`, `joints[0]`, `pose.xyz[2]`. A cell is a
number, true, false, null or text, or empty where a point has no such value. Text that could be read
as another of these is in quotes of its own. Recordings are read and written row by row, however
long they are.
"""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, BinaryIO, NoReturn, TextIO

from ..programs.language.program import MOST_POINTS
from ..store.documents import DocumentKind, Heading, Store
from ..store.recording_format import (
    MOST_COLUMNS,
    Row,
    append_chunks,
    columns_of,
    packed,
    recording_rows,
    time_fault,
    time_first,
)
from ..store.store_errors import BadDocument, TooLarge
from .text_format import MOST_FILE_BYTES, ChunkSpool

POINTS = "points"
"""Field of a body that holds a point list."""

_RECORDING = DocumentKind.RECORDING
_MOST_LINE_BYTES = 64 << 10
_NUMBER = re.compile(r"-?(0|[1-9]\d{0,18})(\.\d+)?([eE][+-]?\d+)?")
_LIKE_A_NUMBER = re.compile(r"[+-]?[\d.,]+([eE][+-]?\d+)?")
_WORDS: dict[str, Any] = {"true": True, "false": False, "null": None, "[]": [], "{}": {}}
_EMPTY: dict[type, type[Any]] = {int: list, str: dict}  # what an index, a key stands in
_PLACE = re.compile(r"[^.\[\]\s]+|\[\d{1,3}\]")
_WHOLE_PLACE = re.compile(r"[^.\[\]\s]+(\.[^.\[\]\s]+|\[\d{1,3}\])*")


def write_points(name: str, body: str, out: TextIO) -> None:
    """Write the point list of a body.

    Raises:
        BadDocument: there is no point list in it.
    """
    data = json.loads(body)
    points = data.get(POINTS) if isinstance(data, dict) else None
    if not isinstance(points, list) or not all(isinstance(point, dict) for point in points):
        raise BadDocument(f"document {name!r}", "has no list of points", place=POINTS)
    rows = [dict(_flat(point, "")) for point in points]
    # A table without rows still has its header, so that it can be read again.
    columns = list(dict.fromkeys(column for row in rows for column in row)) or ["name"]
    for column in columns:
        if not _WHOLE_PLACE.fullmatch(column):
            raise BadDocument(f"document {name!r}", "cannot name a column", place=column[:80])
    writer = csv.writer(_UnixLines(out))
    writer.writerow(columns)
    writer.writerows(
        [_cell(row[column]) if column in row else "" for column in columns] for row in rows
    )


class _UnixLines:
    """Output that ends each row with a line feed.

    The writer ends rows with its own two characters, because it quotes only cells that hold one of
    those: otherwise a text with a carriage return could not be read again.
    """

    def __init__(self, out: TextIO) -> None:
        self._out = out

    def write(self, row: str) -> object:
        return self._out.write(row.removesuffix("\r\n") + "\n")


def read_points(stream: BinaryIO, file: str) -> list[dict[str, Any]]:
    """Return the points in a file.

    Raises:
        BadDocument: it is no such table; the text names line and column.
        TooLarge: the file, or one of its lines.
    """
    rows = _rows(_lines(stream, file, MOST_FILE_BYTES), file)
    columns = _header(rows, file)
    for index, column in enumerate(columns):
        if not _WHOLE_PLACE.fullmatch(column):
            problem = f"{column[:80]!a} names no value; accepted: such as joints[0]"
            raise BadDocument(file, problem, line=1, place=f"column {index + 1}")
    points: list[dict[str, Any]] = []
    for line, row in rows:
        if len(points) == MOST_POINTS:
            raise BadDocument(file, f"accepted: at most {MOST_POINTS} points", line=line)
        point: dict[str, Any] = {}
        for index, (column, cell) in enumerate(zip(columns, row, strict=True)):
            if cell:
                at = f"column {index + 1} ({column})"
                _put(point, column, _value(cell, file, line, at), file, line, at)
        points.append(point)
    return points


def write_recording(store: Store, name: str, out: TextIO) -> None:
    """Write the samples of a recording, a row each."""
    columns = columns_of(name, store.load(_RECORDING, name).body)
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    # Python writes the shortest digits that give the same real again, with a dot.
    writer.writerows(map(repr, row) for row in recording_rows(store, name, len(columns)))


def save_recording(
    store: Store,
    name: str,
    stream: BinaryIO,
    file: str,
    author: str,
    described: Mapping[str, Any] | None = None,
    check: Callable[[Sequence[str]], None] | None = None,
) -> Heading:
    """Save the samples in a file as a new recording, all or none; locks the store once all is read.

    Args:
        described: fields of the recording's body beside its columns, which the file names.
        check: is given the columns, and raises where they are not those of such a recording.

    Raises:
        BadDocument: it is no table of numbers, or its times do not advance; the text names line and
            column.
        TooLarge: one of its lines.
        StoreError: it cannot be saved.
    """
    rows = _rows(_lines(stream, file, None), file)
    columns = _header(rows, file)
    if check is not None:
        check(columns)
    kept = [columns[place] for place in time_first(columns)]
    body = json.dumps({"columns": kept, **(described or {})}, ensure_ascii=False)
    columns_of(name, body)
    with ChunkSpool() as spool:
        spool.take(packed(_samples(rows, columns, file), len(columns)))
        with store.together():
            saved = store.save(_RECORDING, name, body, expected_revision=0, author=author)
            append_chunks(store, name, spool)
    return saved


def _flat(value: Any, place: str) -> Iterator[tuple[str, Any]]:
    match value:
        case dict() if value:
            for key, item in value.items():
                yield from _flat(item, f"{place}.{key}" if place else key)
        case list() if value:
            for index, item in enumerate(value):
                yield from _flat(item, f"{place}[{index}]")
        case _:
            yield place, value


def _cell(value: Any) -> str:
    if not isinstance(value, str):
        return json.dumps(value)
    is_plain = (
        value
        and value == value.strip()
        and value not in _WORDS
        and not value.startswith('"')
        and not _LIKE_A_NUMBER.fullmatch(value)
    )
    return value if is_plain else json.dumps(value, ensure_ascii=False)


def _value(cell: str, file: str, line: int, place: str) -> Any:
    if cell in _WORDS:
        word = _WORDS[cell]
        return word.copy() if isinstance(word, list | dict) else word
    if cell.startswith('"'):
        try:
            return json.loads(cell)
        except ValueError:
            problem = f"{cell[:80]!a} is not text in quotes"
            raise BadDocument(file, problem, line=line, place=place) from None
    if _LIKE_A_NUMBER.fullmatch(cell):
        return _number(cell, file, line, place)
    return cell


def _number(cell: str, file: str, line: int, place: str) -> int | float:
    found = _NUMBER.fullmatch(cell)
    if not found:
        problem = f"{cell[:80]!a} is not a number; accepted: with a dot, as 0.5"
        raise BadDocument(file, problem, line=line, place=place)
    if found[2] is None and found[3] is None:
        return int(cell)
    value = float(cell)
    if not math.isfinite(value):
        raise BadDocument(file, f"{cell[:80]} is too large", line=line, place=place)
    return value


def _samples(rows: Iterable[tuple[int, list[str]]], columns: list[str], file: str) -> Iterator[Row]:
    """Yield the samples in rows, the time first, as long as their times advance."""
    order = [(index, f"column {index + 1} ({columns[index]})") for index in time_first(columns)]
    before: float | None = None
    for line, row in rows:
        sample = tuple(float(_number(row[index], file, line, at)) for index, at in order)
        fault = time_fault(before, sample[0])
        if fault:
            raise BadDocument(file, fault, line=line, place=order[0][1])
        before = sample[0]
        yield sample


def _put(point: dict[str, Any], column: str, value: Any, file: str, line: int, at: str) -> None:
    """Put a value into a point at the place that its column names."""

    def misplaced(problem: str) -> NoReturn:
        raise BadDocument(file, problem, line=line, place=at)

    parts = [int(part[1:-1]) if part[0] == "[" else part for part in _PLACE.findall(column)]
    inside: Any = point
    for part, following in zip(parts, [*parts[1:], None], strict=True):
        made = value if following is None else _EMPTY[type(following)]()
        if type(inside) is not _EMPTY[type(part)]:
            misplaced("another column puts a value of another kind there")
        if isinstance(part, int):
            if part > len(inside):
                misplaced(f"the cell of [{len(inside)}] is empty; accepted: filled from [0] on")
            if part == len(inside):
                inside.append(made)
        else:
            inside.setdefault(part, made)
        inside = inside[part]


def _header(rows: Iterator[tuple[int, list[str]]], file: str) -> list[str]:
    accepted = f"accepted: a first line with 1 to {MOST_COLUMNS} different names"
    _, columns = next(rows, (1, []))
    if len(columns) == 1 and ";" in columns[0]:
        problem = "semicolons stand between the cells; accepted: commas, and dots in numbers"
        raise BadDocument(file, problem, line=1)
    if not 1 <= len(columns) <= MOST_COLUMNS or len(set(columns)) < len(columns):
        raise BadDocument(file, accepted, line=1)
    return columns


def _rows(lines: Iterable[str], file: str) -> Iterator[tuple[int, list[str]]]:
    """Return the number of each row's last line and its cells, as many as the first row has."""
    reader = csv.reader(lines, strict=True)
    width = 0
    try:
        for row in reader:
            if not row:
                continue
            width = width or len(row)
            if len(row) != width:
                problem = f"has {len(row)} cells; accepted: {width}, as in the first line"
                raise BadDocument(file, problem, line=reader.line_num)
            yield reader.line_num, row
    except csv.Error as error:
        raise BadDocument(file, f"is not CSV: {error}", line=reader.line_num) from None


def _lines(stream: BinaryIO, file: str, most_bytes: int | None) -> Iterator[str]:
    size = 0
    number = 0
    while raw := stream.readline(_MOST_LINE_BYTES + 1):
        number += 1
        size += len(raw)
        if len(raw) > _MOST_LINE_BYTES:
            raise TooLarge(f"{file}: line {number}", len(raw), _MOST_LINE_BYTES)
        if most_bytes is not None and size > most_bytes:
            raise TooLarge(file, size, most_bytes)
        try:
            text = raw.decode("utf-8-sig" if number == 1 else "utf-8")
        except UnicodeDecodeError as error:
            problem = f"is not UTF-8 text (byte {error.start + 1} of the line)"
            raise BadDocument(file, problem, line=number) from None
        if "\0" in text:
            raise BadDocument(file, "has a NUL character", line=number)
        yield text
