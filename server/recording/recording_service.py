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

from ..cell.interlocks import check_interlocks
from ..cell.robot_cell import RobotCell
from ..events.cell_events import CellEvent, MotionEnded, MotionRequest
from ..events.effects import Effect, Send
from ..events.management_requests import ReplyTo, handles
from ..events.pending import AskStore, Pending, Steps
from ..events.replies import outcome
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


def count_rows(name: str, columns: tuple[str, ...]) -> Steps[RowCount | Refusal]:
    """Count the rows of a recording.

    Args:
        columns: of its rows, the time first.
    """
    count, first = RowCount(), 0
    while True:
        chunks = yield LoadChunks(name, first, _CHUNKS_AT_ONCE)
        if not isinstance(chunks, tuple):
            return store_refusal(chunks)
        if not chunks:
            return count
        for chunk in chunks:
            if len(chunk) % (_REAL_BYTES * len(columns)):
                problem = f"has {len(chunk)} bytes, no whole rows of {len(columns)} reals"
                return BadDocument(f"a chunk of recording {name!r}", problem).refusal()
            _take_chunk(count, columns, chunk)
        first += len(chunks)


def _take_chunk(count: RowCount, columns: tuple[str, ...], chunk: bytes) -> None:
    """Count a chunk's rows."""
    table = np.frombuffer(chunk, "<f8").reshape(-1, len(columns))
    times = table[:, 0]
    marks = table[:, columns.index(GAP)] if GAP in columns else np.zeros_like(times)
    count.take_many(times, marks != 0.0)


CUT_OFF = (
    "its end is not kept: the server ended before it was stopped, the disk was full, or another"
    " cell is recording it still"
)
"""Text about a recording that was not stopped, where nothing else is known of its end."""

_MOST_COUNTED = 256

_IN_LIST = ("robot", "finished", "samples", "duration", "rate", "problem")

Fields: TypeAlias = dict[str, Any]


class RecordingDescriptions:
    """Descriptions of the recordings of a store as one cell sees them."""

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._counts: dict[tuple[str, int, int], RowCount] = {}

    def describe(self, name: str) -> Steps[Fields | Refusal]:
        """Load and measure the description of a recording."""
        answer = yield Load(DocumentKind.RECORDING, name)
        if not isinstance(answer, Document):
            return store_refusal(answer)
        document = read_document(name, answer.body)
        if isinstance(document, Refusal):
            return document
        heading = answer.heading
        measured = yield from self._measure(heading, document)
        if isinstance(measured, Refusal):
            return measured
        about = document.model_dump() | measured | {"problem": self._problem(heading, document)}
        return {"name": heading.name, "revision": heading.revision} | about

    def lines(self, headings: Sequence[Heading]) -> Steps[list[Fields]]:
        """Make a line for each recording, one after the other."""
        lines: list[Fields] = []
        for heading in headings:
            about: Fields | Refusal = yield from self.describe(heading.name)
            # A recording that is damaged or was just deleted must not hide the others.
            if isinstance(about, Refusal):
                about = {"problem": about.sentence}
            else:
                about = {key: about[key] for key in _IN_LIST}
            line = {"name": heading.name, "revision": heading.revision}
            lines.append(line | {"saved_by": heading.saved_by} | about)
        return lines

    def _measure(self, heading: Heading, document: RecordingDocument) -> Steps[Fields | Refusal]:
        """Return the size, where the description has another: counted while made, or now."""
        extent = yield MeasureRecording(heading.name)
        if not isinstance(extent, Extent):
            return store_refusal(extent)
        if extent.size == document.samples * len(document.columns) * _REAL_BYTES:
            return {}
        under_way = self._recorder.count_of(heading.name)
        if under_way is not None:
            return under_way.fields
        which = (heading.name, heading.revision, extent.size)
        if which not in self._counts:
            count = yield from count_rows(heading.name, document.columns)
            if isinstance(count, Refusal):
                return count
            if len(self._counts) == _MOST_COUNTED:
                self._counts.clear()
            self._counts[which] = count
        return self._counts[which].fields

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
        self._descriptions = RecordingDescriptions(self.recorder)
        self._playing = RecordingPlayback(cell, pending, tool, robot_name)
        self._cell = cell
        self._ask = ask
        self._pending = pending

    @handles(op.ListRecordings)
    def _list(
        self, asked: op.ListRecordings, reply: ReplyTo[op.Recordings], now: int
    ) -> list[Effect]:
        return self._pending.run(self._recordings(asked.first), partial(_answered, reply), now)

    @handles(op.DescribeRecording)
    def _describe(
        self, asked: op.DescribeRecording, reply: ReplyTo[op.RecordingDescription], now: int
    ) -> list[Effect]:
        described = self._descriptions.describe(asked.name)
        return self._pending.run(described, partial(_answered, reply), now)

    @handles(op.StartRecording)
    def _start(
        self, asked: op.StartRecording, reply: ReplyTo[op.RecordingMade], now: int
    ) -> list[Effect]:
        started = self.recorder.start(
            asked.name, reply.name, _tell(reply), _tell_loss(reply), reply.session
        )
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
        name, new, by = asked.name, asked.new_name, reply
        trim = TrimRecording(name, new, asked.begins, asked.ends, by.name, by.session)
        return self._ask(trim, partial(_changed, reply))

    @handles(op.RenameARecording)
    def _rename(
        self, asked: op.RenameARecording, reply: ReplyTo[op.ChangedRecording], now: int
    ) -> list[Effect]:
        name, new, expected = asked.name, asked.new_name, asked.expected_revision
        rename = RenameRecording(name, new, expected, reply.name, reply.session)
        return self._keep(name, reply) or self._ask(rename, partial(_changed, reply))

    @handles(op.DeleteRecording)
    def _delete(
        self, asked: op.DeleteRecording, reply: ReplyTo[op.ChangedRecording], now: int
    ) -> list[Effect]:
        name, expected = asked.name, asked.expected_revision
        delete = Delete(DocumentKind.RECORDING, name, expected, reply.name, reply.session)
        return self._keep(name, reply) or self._ask(delete, partial(_changed, reply))

    def _keep(self, name: str, reply: ReplyTo[Any]) -> list[Effect]:
        """Refuse to touch what is being recorded; nothing where it is not."""
        status = self.recorder.status
        if status is None or status.name != name:
            return []
        text = f"{name!r} is still being recorded; accepted: once its recording was stopped"
        return reply.refuse(Refusal(VerdictCode.RECORDING_RUNNING, text))

    def _recordings(self, first: int) -> Steps[Fields | Refusal]:
        """List the recordings, from one on."""
        answer = yield ListHeadings(DocumentKind.RECORDING)
        if not isinstance(answer, tuple):
            return store_refusal(answer)
        lines = yield from self._descriptions.lines(answer[first : first + _MOST_LISTED])
        status, broken_off = self.recorder.status, self.recorder.broken_off
        return {
            "recordings": lines,
            "total": len(answer),
            "recording": None if status is None else asdict(status),
            "problem": "" if broken_off is None else broken_off.refusal.sentence,
        }

    @handles(op.PlayRecording)
    def _play(
        self, asked: op.PlayRecording, reply: ReplyTo[op.PlaybackAccount], now: int
    ) -> list[Effect]:
        refusal = check_interlocks(self._cell, reply.session, now)
        if refusal is not None:
            return reply.refuse(refusal)
        self._cell.authority.beat(reply.session, now)
        by = self._cell.authority.holder
        assert by is not None, "checked above"
        return self._keep(asked.name, reply) or self._playing.play(asked, reply, by, now)

    def on_cell_event(self, event: CellEvent, now: int) -> list[Effect]:
        """Pass an event to the playback; see `RecordingPlayback.on_cell_event`."""
        return self._playing.on_cell_event(event, now)

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


def _answered(reply: ReplyTo[Any], found: Fields | Refusal, now: int) -> list[Effect]:
    return reply.refuse(found) if isinstance(found, Refusal) else reply.answer(found)


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
