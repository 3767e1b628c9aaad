"""Recording service for pendants: start, stop, list, trim, play; and the survey of what is kept.

Owns the order of the checks of a request and its answers. `recorder` owns the kept samples,
`recording_playback` their playback.

Owns the source of what is said of a kept recording: the robot, the duration, the end. A description
states the size only if its recording was stopped: a recording that was cut off has none, and an
imported one may lack it. The rows of such a recording are counted once, because kept rows never
change. They are counted some chunks at a time; between two portions the event loop does other work.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any, TypeAlias, cast

import numpy as np

from openpendant.simplemsg.pendant.management import recordings as op
from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.robot_cell import RobotCell
from ..events.cell_events import CellEvent, MotionEnded, MotionRequest
from ..events.effects import Effect, Send
from ..events.management_handlers import handles
from ..events.pending import AskStore, Pending
from ..events.replies import outcome
from ..events.reply_to import ReplyTo
from ..planning.jobs import PoseGoal
from ..refusal import Refusal
from ..store.documents import Document, DocumentKind, Extent, Heading
from ..store.recording_format import GAP, RecordingDocument, RowCount, read_document
from ..store.requests import (
    Answer,
    Delete,
    ListHeadings,
    Load,
    LoadChunks,
    MeasureRecording,
    RenameRecording,
    TrimRecording,
)
from ..store.store_errors import BadDocument
from .recorder import Lost, OnResult, Recorder, store_refusal
from .recording_playback import RecordingPlayback

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

    def describe(self, name: str, on_result: Described) -> list[Effect]:
        """Load and measure the description of a recording."""

        def loaded(answer: Answer, now: int) -> list[Effect]:
            if not isinstance(answer, Document):
                return on_result(store_refusal(answer), now)
            document = read_document(name, answer.body)
            if isinstance(document, Refusal):
                return on_result(document, now)
            return self._measure(answer.heading, document, on_result)

        return self._ask(Load(DocumentKind.RECORDING, name), loaded)

    def lines(self, headings: Sequence[Heading], on_result: Lines, now: int) -> list[Effect]:
        """Make a line for each recording, one after the other."""
        return self._next_line(headings, [], on_result, now)

    def _next_line(
        self, headings: Sequence[Heading], lines: list[Fields], on_result: Lines, now: int
    ) -> list[Effect]:
        if len(lines) == len(headings):
            return on_result(lines, now)
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
            return self._next_line(headings, [*lines, line], on_result, at)

        return self.describe(heading.name, described)

    def _measure(
        self, heading: Heading, document: RecordingDocument, on_result: Described
    ) -> list[Effect]:
        """Return the size: as described, as counted while it is made, or counted now."""

        def tell(counted: Fields, now: int) -> list[Effect]:
            about = document.model_dump() | counted | {"problem": self._problem(heading, document)}
            return on_result({"name": heading.name, "revision": heading.revision} | about, now)

        def measured(extent: Answer, now: int) -> list[Effect]:
            if not isinstance(extent, Extent):
                return on_result(store_refusal(extent), now)
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
                    return on_result(count, at)
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


_MOST_LISTED = 100


class RecordingService:
    """Recording service of one cell."""

    def __init__(
        self,
        cell: RobotCell,
        pending: Pending,
        tool: Callable[[], PoseGoal | None],
        *,
        robot_name: str,
        state_period: float,
    ) -> None:
        """Make a service that records and plays nothing.

        Args:
            tool: returns the centre point of the selected tool in the flange.
            state_period: how often the controller reports [s].
        """
        ask: AskStore = pending.ask
        self.recorder = Recorder(robot_name, cell.limits.names, state_period, ask)
        self._descriptions = RecordingDescriptions(ask, self.recorder)
        self._playing = RecordingPlayback(cell, pending, tool, robot_name)
        self._cell = cell
        self._ask = ask

    @handles(op.ListRecordings)
    def _list(
        self, asked: op.ListRecordings, reply: ReplyTo[op.Recordings], now: int
    ) -> list[Effect]:
        return self._ask(
            ListHeadings(DocumentKind.RECORDING), partial(self._listed, asked.first, reply)
        )

    @handles(op.DescribeRecording)
    def _describe(
        self, asked: op.DescribeRecording, reply: ReplyTo[op.RecordingDescription], now: int
    ) -> list[Effect]:
        def described(about: Fields | Refusal, now: int) -> list[Effect]:
            if isinstance(about, Refusal):
                return reply.refuse(about)
            return reply.answer(cast(op.RecordingDescription, about))

        return self._descriptions.describe(asked.name, described)

    @handles(op.StartRecording)
    def _start(
        self, asked: op.StartRecording, reply: ReplyTo[op.RecordingMade], now: int
    ) -> list[Effect]:
        started = self.recorder.start(asked.name, reply.name, _tell(reply), _tell_loss(reply))
        return reply.refuse(started) if isinstance(started, Refusal) else started

    @handles(op.StopRecording)
    def _stop(
        self, asked: op.StopRecording, reply: ReplyTo[op.RecordingMade], now: int
    ) -> list[Effect]:
        ended = self.recorder.stop(_tell(reply))
        return reply.refuse(ended) if isinstance(ended, Refusal) else ended

    @handles(op.TrimRecordingPart)
    def _trim(
        self, asked: op.TrimRecordingPart, reply: ReplyTo[op.ChangedRecording], now: int
    ) -> list[Effect]:
        trim = TrimRecording(asked.name, asked.new_name, asked.begins, asked.ends, reply.name)
        return self._ask(trim, partial(_changed, reply))

    @handles(op.RenameARecording)
    def _rename(
        self, asked: op.RenameARecording, reply: ReplyTo[op.ChangedRecording], now: int
    ) -> list[Effect]:
        name, new, expected = asked.name, asked.new_name, asked.expected_revision
        rename = RenameRecording(name, new, expected, reply.name)
        return self._keep(name, reply) or self._ask(rename, partial(_changed, reply))

    @handles(op.DeleteRecording)
    def _delete(
        self, asked: op.DeleteRecording, reply: ReplyTo[op.ChangedRecording], now: int
    ) -> list[Effect]:
        name, expected = asked.name, asked.expected_revision
        delete = Delete(DocumentKind.RECORDING, name, expected, reply.name)
        return self._keep(name, reply) or self._ask(delete, partial(_changed, reply))

    def _keep(self, name: str, reply: ReplyTo[Any]) -> list[Effect]:
        """Refuse to touch what is being recorded; nothing where it is not."""
        status = self.recorder.status
        if status is None or status.name != name:
            return []
        text = f"{name!r} is still being recorded; accepted: once its recording was stopped"
        return reply.refuse(Refusal(VerdictCode.RECORDING_RUNNING, text))

    def _listed(
        self, first: int, reply: ReplyTo[op.Recordings], answer: Answer, now: int
    ) -> list[Effect]:
        if not isinstance(answer, tuple):
            return reply.refuse(store_refusal(answer))
        headings = [heading for heading in answer if isinstance(heading, Heading)]

        def on_result(lines: list[Fields], at: int) -> list[Effect]:
            status, broken_off = self.recorder.status, self.recorder.broken_off
            progress = None if status is None else asdict(status)
            return reply.answer(
                {
                    "recordings": cast(list[op.RecordingHeading], lines),
                    "total": len(headings),
                    "recording": cast(op.RecordingProgress | None, progress),
                    "problem": "" if broken_off is None else broken_off.refusal.sentence,
                }
            )

        return self._descriptions.lines(headings[first : first + _MOST_LISTED], on_result, now)

    # Playing back.

    @handles(op.PlayRecording)
    def _play(
        self, asked: op.PlayRecording, reply: ReplyTo[op.PlaybackAccount], now: int
    ) -> list[Effect]:
        refusal = self._cell.check(reply.session, now)
        if refusal is not None:
            return reply.refuse(refusal)
        self._cell.authority.beat(reply.session, now)
        by = self._cell.authority.holder
        assert by is not None, "checked above"
        return self._keep(asked.name, reply) or self._playing.play(asked, reply, by, now)

    def on_cell_event(self, news: CellEvent, now: int) -> list[Effect]:
        """Pass an event to the playback; see `RecordingPlayback.on_cell_event`."""
        return self._playing.on_cell_event(news, now)

    def drop(self, refusal: Refusal) -> list[Effect]:
        """Drop the playback that is being loaded, if any, and refuse its request."""
        return self._playing.drop(refusal)

    @property
    def ticked(self) -> tuple[Callable[[int], list[Effect]], ...]:
        """Callbacks of each tick, in this order."""
        return self._playing.tick, self.recorder.tick

    def shut_down(self) -> list[Effect]:
        """Write what is recorded and drop the playback."""
        return self.drop(Refusal(VerdictCode.SHUTTING_DOWN)) + self.recorder.flush()


def _tell(reply: ReplyTo[op.RecordingMade]) -> OnResult:
    def on_result(ended: RecordingDocument | Refusal, now: int) -> list[Effect]:
        if isinstance(ended, Refusal):
            return reply.refuse(ended)
        return reply.answer(cast(op.RecordingMade, ended.model_dump()))

    return on_result


def _tell_loss(reply: ReplyTo[op.RecordingMade]) -> Lost:
    """Return the callback that reports to its client a recording that ended by itself."""

    def lost(refusal: Refusal, now: int) -> list[Effect]:
        request = MotionRequest(reply.session, reply.request_id)
        return [Send(reply.session, outcome(MotionEnded(request, refusal, 0.0, 0.0)))]

    return lost


def _changed(reply: ReplyTo[op.ChangedRecording], answer: Answer, now: int) -> list[Effect]:
    if isinstance(answer, Heading):
        return reply.answer({"name": answer.name, "revision": answer.revision})
    return reply.refuse(store_refusal(answer))
