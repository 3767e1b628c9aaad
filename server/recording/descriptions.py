"""What pendants are told of recordings that are kept: of which robot, how long, how they ended.

Owns where these facts come from. A description says how much there is only where its recording was
stopped; of any other its rows are counted, once, because rows that are kept never change.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from ..outgoing import Outgoing
from ..refusal import Refusal
from ..store.documents import Document, DocumentKind, Extent, Heading
from ..store.questions import AskStore
from ..store.requests import Answer, Load, MeasureRecording
from .document import RecordingDocument, read_document
from .recorder import Recorder
from .row_count import RowCount
from .store_refusal import store_refusal
from .survey import count_rows

CUT_OFF = (
    "its end is not kept: the server ended before it was stopped, the disk was full, or another"
    " cell is recording it still"
)
"""Said of a recording that was not stopped where nothing else is known of its end."""

_MOST_COUNTED = 256
_REAL_BYTES = 8
_IN_LIST = ("robot", "finished", "samples", "duration", "rate", "problem")

Fields: TypeAlias = dict[str, Any]
Described: TypeAlias = Callable[[Fields | Refusal, int], list[Outgoing]]
"""Takes the description of a recording, or why there is none, and the time."""
Lines: TypeAlias = Callable[[list[Fields], int], list[Outgoing]]
"""Takes a line for each recording, and the time."""


class RecordingDescriptions:
    """Describes the recordings of a store as one cell sees them."""

    def __init__(self, ask: AskStore, recorder: Recorder) -> None:
        """Make one that has counted nothing yet.

        Args:
            ask: the way to the store.
            recorder: what records, and knows why it did not go on.
        """
        self._ask = ask
        self._recorder = recorder
        self._counts: dict[tuple[str, int, int], RowCount] = {}

    def describe(self, name: str, told: Described) -> list[Outgoing]:
        """Have a recording described.

        Args:
            name: of the recording.
            told: is told once.
        """

        def loaded(answer: Answer, now: int) -> list[Outgoing]:
            if not isinstance(answer, Document):
                return told(store_refusal(answer), now)
            document = read_document(name, answer.body)
            if isinstance(document, Refusal):
                return told(document, now)
            return self._measure(answer.heading, document, told)

        return self._ask(Load(DocumentKind.RECORDING, name), loaded)

    def lines(self, headings: Sequence[Heading], told: Lines, now: int) -> list[Outgoing]:
        """Have a line made for each recording, one after the other.

        Args:
            headings: of the recordings.
            told: is told once.
            now: the time [ns].
        """
        return self._next_line(headings, [], told, now)

    def _next_line(
        self, headings: Sequence[Heading], lines: list[Fields], told: Lines, now: int
    ) -> list[Outgoing]:
        if len(lines) == len(headings):
            return told(lines, now)
        heading = headings[len(lines)]

        def described(about: Fields | Refusal, at: int) -> list[Outgoing]:
            # A recording that is damaged, or was deleted just now, hides no other.
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
    ) -> list[Outgoing]:
        """Say how much there is: as described, as counted while it is made, or counted now."""

        def tell(counted: Fields, now: int) -> list[Outgoing]:
            about = document.model_dump() | counted | {"problem": self._problem(heading, document)}
            return told({"name": heading.name, "revision": heading.revision} | about, now)

        def measured(extent: Answer, now: int) -> list[Outgoing]:
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

            def counted(count: RowCount | Refusal, at: int) -> list[Outgoing]:
                if isinstance(count, Refusal):
                    return told(count, at)
                if len(self._counts) == _MOST_COUNTED:
                    self._counts.clear()
                self._counts[which] = count
                return tell(count.fields, at)

            return count_rows(self._ask, heading.name, document.columns, counted)

        return self._ask(MeasureRecording(heading.name), measured)

    def _problem(self, heading: Heading, document: RecordingDocument) -> str:
        """Return why a recording that nobody stopped goes on no more; empty for any other."""
        if document.finished or self._recorder.count_of(heading.name) is not None:
            return ""
        broken_off = self._recorder.broken_off
        if document.problem or broken_off is None or broken_off.name != heading.name:
            return document.problem or CUT_OFF
        return broken_off.refusal.sentence
