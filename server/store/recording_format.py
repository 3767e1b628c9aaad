"""The stored form of a recording: its description, its columns, their chunks, and their edits.

Owns the columns, the definition of a gap between two reports, how a description is read, and the
count of rows (`RowCount`): how many, how long, at which rate, with which gaps. Duration and rate
are defined there; whoever passes rows on, while they are recorded or afterwards, counts by it. A
gap is marked in the row that ends it and never filled. A file without the column of that mark may
have gaps too; there only the times show them. Knows no robot and no clock.

A chunk is rows of 8-byte little-endian reals, one row a sample, one column after the other. The
recording's document names them in `columns`, the time first: `{"columns": ["t", "j1", …]}`. The
samples of a kept recording are read as rows, whatever chunks they lie in.

A recording is cut and renamed by a copy of rows under another name, all or nothing: chunk by chunk,
so that its length costs time and no memory. That blocks, as all of the store does.
"""

from __future__ import annotations

import itertools
import json
import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from openpendant.simplemsg.names import LONGEST_NAME
from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal, field_fault
from .documents import MOST_CHUNK_BYTES, DocumentKind, Heading, Store
from .store_errors import BadDocument

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from openpendant.motion.pose import Array

TIME, GAP = "t", "gap"

GAP_PERIODS = 2.5
"""Number of reporting periods; two reports further apart have a gap between them."""


class RecordingDocument(BaseModel):
    """The body of a recording's document.

    What was counted is of a recording that was stopped; of one that was cut off, and of most that
    come from a file, it is not known before the samples are read.
    """

    model_config = ConfigDict(extra="ignore", frozen=True)

    columns: tuple[str, ...] = Field(min_length=2, max_length=256)
    """Names of the values of a row: the time [s], each joint [rad or m], and the mark of a gap; see
    `column_fault` for which there are."""
    robot: str = ""
    """The robot; empty where a file did not say."""
    joints: tuple[str, ...] = ()
    """Names of the joints."""
    period: float = Field(0.01, gt=0, le=10)
    """How often the controller was expected to report [s]."""
    finished: bool = True
    """It was stopped, not cut off; of a file that does not say so it is believed."""
    problem: str = ""
    """Why it ended by itself, where that could be kept; empty where it was stopped."""
    samples: int = 0
    """Rows."""
    duration: float = 0.0
    """From the first to the last row [s]."""
    rate: float = 0.0
    """Rows a second, gaps left out [Hz]."""
    gaps: int = 0
    """Gaps between rows."""
    longest_gap: float = 0.0
    """The longest of them [s]."""


@dataclass(frozen=True, slots=True)
class Extract:
    """The facts of a recording's rows that its description holds.

    Attributes:
        width: values of a row.
        joints: places of the joints in a row, the first joint first.
    """

    width: int
    joints: tuple[int, ...]


def _joint_columns(joints: int) -> tuple[str, ...]:
    return tuple(f"j{number}" for number in range(1, joints + 1))


class ColumnFault(NamedTuple):
    """Fault in the columns of a recording.

    Attributes:
        place: of the column at fault, from 0; None where one is missing.
    """

    place: int | None
    problem: str


def column_fault(columns: Sequence[str], joints: int | None = None) -> ColumnFault | None:
    """Return what is wrong with the columns of a row; None where each is there that has to be.

    The name of a column states its content, so their order is free and any other name is refused.

    Args:
        joints: how many joints the robot has; None for as many as there are columns for.
    """
    if joints is None:
        joints = max(1, len(columns) - (TIME in columns) - (GAP in columns))
    needed = (TIME, *_joint_columns(joints))
    named = f"{TIME}, j1" if joints == 1 else f"{TIME}, j1 to j{joints}"
    accepted = f"accepted: {named}, and {GAP} if you like, each once"
    for place, column in enumerate(columns):
        if column not in needed and column != GAP:
            return ColumnFault(place, f"is {column[:80]!r}; {accepted}")
        if column in columns[:place]:
            return ColumnFault(place, f"is {column!r} once more; {accepted}")
    missing = [name for name in needed if name not in columns]
    return ColumnFault(None, f"no column is {missing[0]!r}; {accepted}") if missing else None


def new_document(robot: str, joints: Sequence[str], period: float) -> RecordingDocument:
    """Return the description of a new recording."""
    return RecordingDocument(
        columns=(TIME, *_joint_columns(len(joints)), GAP),
        robot=robot,
        joints=tuple(joints),
        period=period,
        finished=False,
    )


def read_document(name: str, body: str) -> RecordingDocument | Refusal:
    """Return a recording's description."""
    try:
        return RecordingDocument.model_validate_json(body)
    except ValidationError as error:
        text = f"recording {name!r}: {field_fault(error)}"
        return Refusal(VerdictCode.BAD_DOCUMENT, text[:400])


def write_document(document: RecordingDocument) -> str:
    """Return the body of a recording's document."""
    return json.dumps(document.model_dump(), ensure_ascii=False)


def extract_for(name: str, document: RecordingDocument, robot: str, dof: int) -> Extract | Refusal:
    """Return where the joints are in the rows, if the recording is one of this robot."""
    if not document.robot:
        text = (
            f"recording {name!r} does not say of which robot it is; this robot is {robot!r}: if it"
            f" is of this one, import it again with --robot {robot}"
        )
        return Refusal(VerdictCode.RECORDING_WRONG_ROBOT, text)
    if document.robot != robot:
        text = f"recording {name!r} was made with {document.robot!r}; this robot is {robot!r}"
        return Refusal(VerdictCode.RECORDING_WRONG_ROBOT, text)
    columns = document.columns
    if column_fault(columns) is not None or columns[0] != TIME:
        fault = column_fault(columns, dof)
        place, problem = fault or ColumnFault(0, f"is {columns[0]!r}; accepted: {TIME!r} first")
        where = "columns" if place is None else f"columns[{place}]"
        return Refusal(VerdictCode.BAD_DOCUMENT, f"recording {name!r}: {where}: {problem}")
    joints = tuple(map(columns.index, _joint_columns(len(columns) - 1 - (GAP in columns))))
    if len(joints) != dof:
        text = (
            f"recording {name!r} has the columns {', '.join(columns)[:120]}; accepted:"
            f" {TIME}, then one for each of {dof} joints"
        )
        return Refusal(VerdictCode.RECORDING_WRONG_ROBOT, text, value=len(joints), limit=dof)
    return Extract(len(columns), joints)


@dataclass(slots=True)
class RowCount:
    """Count of the rows so far, taken in order.

    Attributes:
        first: time of the first [s].
        last: time of the last [s].
        gaps: between rows.
        longest_gap: the longest of them [s].
        in_gaps: time spent in them [s].
    """

    rows: int = 0
    first: float = 0.0
    last: float = 0.0
    gaps: int = 0
    longest_gap: float = 0.0
    in_gaps: float = 0.0

    @property
    def duration(self) -> float:
        """From the first to the last row [s]."""
        return self.last - self.first

    @property
    def rate(self) -> float:
        """Rows a second, gaps left out [Hz]; 0 where there are too few rows."""
        steps = self.rows - 1 - self.gaps
        covered = self.duration - self.in_gaps
        return steps / covered if steps > 0 and covered > 0.0 else 0.0

    @property
    def fields(self) -> dict[str, Any]:
        """The fields of a recording's description that say it."""
        return {
            "samples": self.rows,
            "duration": self.duration,
            "rate": self.rate,
            "gaps": self.gaps,
            "longest_gap": self.longest_gap,
        }

    def take(self, time: float, *, after_gap: bool = False) -> None:
        """Count the next row.

        Args:
            time: of the row [s].
            after_gap: True if a gap lies before it; before the first row there is none.
        """
        if not self.rows:
            self.first = time
        elif after_gap:
            gap = time - self.last
            self.gaps += 1
            self.longest_gap = max(self.longest_gap, gap)
            self.in_gaps += gap
        self.rows += 1
        self.last = time

    def take_many(self, times: Array, after_gap: NDArray[np.bool_]) -> None:
        """Count the next rows at once, as `take` counts each of them.

        Args:
            times: (m,) of the rows, 1 or more [s].
            after_gap: (m,) True for a row that a gap lies before.
        """
        steps = times.copy()
        steps[1:] -= times[:-1]
        steps[0] -= self.last
        if not self.rows:
            self.first = float(times[0])
            steps, after_gap = steps[1:], after_gap[1:]
        gaps = steps[after_gap]
        if len(gaps):
            self.gaps += len(gaps)
            self.longest_gap = max(self.longest_gap, float(gaps.max()))
            # Summed in their order, so that it is to the last bit what `take` makes of them.
            gaps[0] += self.in_gaps
            self.in_gaps = float(gaps.cumsum()[-1])
        self.rows += len(times)
        self.last = float(times[-1])


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
