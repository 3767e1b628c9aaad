"""Survey of kept recordings for pendants: the robot, the duration, the end of each.

Owns the source of these facts. A description states the size only if its recording was stopped: a
recording that was cut off has none, and an imported one may lack it. The rows of such a recording
are counted once, because kept rows never change. They are counted some chunks at a time; between
two portions the event loop does other work.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np

from ..events.effects import Effect
from ..events.pending import AskStore
from ..refusal import Refusal
from ..store.documents import Document, DocumentKind, Extent, Heading
from ..store.recording_format import GAP, RecordingDocument, RowCount, read_document
from ..store.requests import Answer, Load, LoadChunks, MeasureRecording
from ..store.store_errors import BadDocument
from .recorder import Recorder, store_refusal

_CHUNKS_AT_ONCE = 256
_REAL_BYTES = 8

Counted: TypeAlias = Callable[[RowCount | Refusal, int], list[Effect]]
"""Takes the count, or the reason why there is none, and the time."""


def count_rows(
    ask: AskStore, name: str, columns: tuple[str, ...], counted: Counted
) -> list[Effect]:
    """Count the rows of a recording.

    Args:
        columns: of its rows, the time first.
        counted: called once.
    """
    return _count_from(ask, name, columns, counted, RowCount(), 0)


def _count_from(
    ask: AskStore,
    name: str,
    columns: tuple[str, ...],
    counted: Counted,
    count: RowCount,
    first: int,
) -> list[Effect]:
    def loaded(answer: Answer, now: int) -> list[Effect]:
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


CUT_OFF = (
    "its end is not kept: the server ended before it was stopped, the disk was full, or another"
    " cell is recording it still"
)
"""Text about a recording that was not stopped, where nothing else is known of its end."""

_MOST_COUNTED = 256

_IN_LIST = ("robot", "finished", "samples", "duration", "rate", "problem")

Fields: TypeAlias = dict[str, Any]
Described: TypeAlias = Callable[[Fields | Refusal, int], list[Effect]]
"""Takes the description of a recording, or why there is none, and the time."""
Lines: TypeAlias = Callable[[list[Fields], int], list[Effect]]
"""Takes a line for each recording, and the time."""


class RecordingDescriptions:
    """Descriptions of the recordings of a store as one cell sees them."""

    def __init__(self, ask: AskStore, recorder: Recorder) -> None:
        self._ask = ask
        self._recorder = recorder
        self._counts: dict[tuple[str, int, int], RowCount] = {}

    def describe(self, name: str, told: Described) -> list[Effect]:
        """Load and measure the description of a recording.

        Args:
            told: called once.
        """

        def loaded(answer: Answer, now: int) -> list[Effect]:
            if not isinstance(answer, Document):
                return told(store_refusal(answer), now)
            document = read_document(name, answer.body)
            if isinstance(document, Refusal):
                return told(document, now)
            return self._measure(answer.heading, document, told)

        return self._ask(Load(DocumentKind.RECORDING, name), loaded)

    def lines(self, headings: Sequence[Heading], told: Lines, now: int) -> list[Effect]:
        """Make a line for each recording, one after the other.

        Args:
            told: called once.
        """
        return self._next_line(headings, [], told, now)

    def _next_line(
        self, headings: Sequence[Heading], lines: list[Fields], told: Lines, now: int
    ) -> list[Effect]:
        if len(lines) == len(headings):
            return told(lines, now)
        heading = headings[len(lines)]

        def described(about: Fields | Refusal, at: int) -> list[Effect]:
            # A recording that is damaged or was just deleted must not hide the others.
            told_of_it: Fields
            if isinstance(about, Refusal):
                told_of_it = {"problem": about.sentence}
            else:
                told_of_it = {key: about[key] for key in _IN_LIST}
            line = {"name": heading.name, "revision": heading.revision}
            line |= {"saved_by": heading.saved_by} | told_of_it
            return self._next_line(headings, [*lines, line], told, at)

        return self.describe(heading.name, described)

    def _measure(
        self, heading: Heading, document: RecordingDocument, told: Described
    ) -> list[Effect]:
        """Return the size: as described, as counted while it is made, or counted now."""

        def tell(counted: Fields, now: int) -> list[Effect]:
            about = document.model_dump() | counted | {"problem": self._problem(heading, document)}
            return told({"name": heading.name, "revision": heading.revision} | about, now)

        def measured(extent: Answer, now: int) -> list[Effect]:
            if not isinstance(extent, Extent):
                return told(store_refusal(extent), now)
            if extent.size == document.samples * len(document.columns) * _REAL_BYTES:
                return tell({}, now)
            under_way = self._recorder.count_of(heading.name)
            if under_way is not None:
                return tell(under_way.fields, now)
            which = (heading.name, heading.revision, extent.size)
            known = self._counts.get(which)
            if known is not None:
                return tell(known.fields, now)

            def counted(count: RowCount | Refusal, at: int) -> list[Effect]:
                if isinstance(count, Refusal):
                    return told(count, at)
                if len(self._counts) == _MOST_COUNTED:
                    self._counts.clear()
                self._counts[which] = count
                return tell(count.fields, at)

            return count_rows(self._ask, heading.name, document.columns, counted)

        return self._ask(MeasureRecording(heading.name), measured)

    def _problem(self, heading: Heading, document: RecordingDocument) -> str:
        """Return why a recording ended without a stop; empty for any other."""
        if document.finished or self._recorder.count_of(heading.name) is not None:
            return ""
        broken_off = self._recorder.broken_off
        if document.problem or broken_off is None or broken_off.name != heading.name:
            return document.problem or CUT_OFF
        return broken_off.refusal.sentence
