"""One recording while it is made: its rows, and who is told of its end. Plain data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

from ..outgoing import Outgoing
from ..refusal import Refusal
from ..store.samples import Row, pack_rows, rows_in_a_chunk
from .document import RecordingDocument
from .row_count import RowCount

Told: TypeAlias = Callable[[RecordingDocument | Refusal, int], list[Outgoing]]
"""Takes how a request about the recording ended, and the time."""

Lost: TypeAlias = Callable[[Refusal, int], list[Outgoing]]
"""Takes why a recording ended by itself, and the time."""

_SECOND_NS = 1_000_000_000


@dataclass(slots=True)
class Run:
    """One recording under way.

    Attributes:
        name: of its document.
        author: who records.
        document: its description as saved.
        lost: is told if it ends by itself.
        revision: of the document; 0 until it is saved.
        waiting: rows that no chunk holds yet.
        chunk: the next chunk for the disk; empty where there is none.
        chunk_rows: how many rows it has.
        is_asked: the store was asked to keep something and has not answered yet.
        chunks: how many are kept.
        kept: rows in them.
        count: what was counted of all rows, kept or not.
        first: time of the first row [ns]; None before it.
        last: time of the last row [ns].
        told: who waits for the end; None while it goes on.
        busy_since: since when the disk has been busy, where the end waits for it [ns]; else None.
    """

    name: str
    author: str
    document: RecordingDocument
    lost: Lost
    revision: int = 0
    waiting: list[Row] = field(default_factory=list)
    chunk: bytes = b""
    chunk_rows: int = 0
    is_asked: bool = False
    chunks: int = 0
    kept: int = 0
    count: RowCount = field(default_factory=RowCount)
    first: int | None = None
    last: int = 0
    told: Told | None = None
    busy_since: int | None = None

    @property
    def waits_since(self) -> int:
        """Time of the oldest row that waits [ns]; only where one does."""
        assert self.first is not None
        return self.first + round(self.waiting[0][0] * _SECOND_NS)

    def take(self, position: tuple[float, ...], received: int, gap_ns: int) -> None:
        """Let the next row wait for its chunk.

        Args:
            position: (n,) of the joints [rad or m].
            received: when it was reported [ns].
            gap_ns: reports further apart have a gap between them.
        """
        after_gap = False
        if self.first is None:
            self.first = received
        else:
            after_gap = received - self.last > gap_ns
        self.last = received
        time = (received - self.first) / _SECOND_NS
        self.count.take(time, after_gap=after_gap)
        self.waiting.append((time, *position, float(after_gap)))

    def next_chunk(self) -> None:
        """Make the next chunk of the oldest rows that wait, as many as it may have."""
        most = rows_in_a_chunk(len(self.document.columns))
        rows, self.waiting = self.waiting[:most], self.waiting[most:]
        self.chunk, self.chunk_rows = pack_rows(rows), len(rows)


@dataclass(frozen=True, slots=True)
class RecordingStatus:
    """What is told of a recording under way.

    Attributes:
        name: of its document.
        duration: from the first to the last row [s].
        samples: rows so far.
        kept: rows that are on the disk.
        gaps: between rows, so far.
    """

    name: str
    duration: float
    samples: int
    kept: int
    gaps: int


@dataclass(frozen=True, slots=True)
class BrokenOff:
    """A recording that ended by itself; what is kept of it stays.

    Attributes:
        name: of its document.
        refusal: why, naming the recording.
    """

    name: str
    refusal: Refusal
