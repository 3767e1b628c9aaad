"""Playback of recordings: requests, loading of the samples, planning and answers.

Owns the rule that no motion starts whose request came before a stop, a change of mode or of the
motion authority. Loading the samples takes time: a playback that is still being loaded then, or
while an interlock is open, is dropped and refused at once. `recording_planning` owns how samples
become a motion, the cell whether the robot may move.

Owns how much of a recording is held in memory. No turn of the event loop handles more bytes than
one chunk may have, however long the recording is: its extent is asked for first, and only chunks
with rows of the requested part are kept.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from math import inf
from typing import TypeAlias, cast

import numpy as np

from openpendant.simplemsg.pendant.management.recordings import PlaybackAccount as PlaybackTold
from openpendant.simplemsg.pendant.management.recordings import PlayRecording
from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.interlocks import check_interlocks, ending
from ..cell.robot_cell import RobotCell
from ..control import Holder, MotionKind
from ..events.cell_events import (
    CellEvent,
    MotionEnded,
    MotionEvent,
    MotionOwner,
    MotionRefused,
    MotionRequest,
)
from ..events.effects import Effect, Send
from ..events.management_requests import ReplyTo
from ..events.pending import Pending, Steps
from ..events.replies import outcome
from ..planning.jobs import PoseGoal, RecordingJob
from ..refusal import Refusal
from ..store.documents import Document, DocumentKind, Extent
from ..store.recording_format import Extract, RecordingDocument, extract_for, read_document
from ..store.requests import Answer, Load, LoadChunks, MeasureRecording
from ..store.store_errors import BadDocument, Conflict
from .recorder import store_refusal

MOST_PLAYED_BYTES = 64 << 20
"""Largest part that is played in one piece [bytes]: an hour of seven joints at 250 Hz."""

_CHUNKS_AT_ONCE = 128
_REAL_BYTES = 8

Pieces: TypeAlias = tuple[bytes, ...]
"""Rows in pieces, each no larger than a chunk."""


def part_samples(
    name: str, columns: int, begins: float, ends: float | None
) -> Steps[Pieces | Refusal]:
    """Load the samples of a part of one recording: first its extent, then the rows.

    Args:
        columns: how many reals a row has, the time first.
        begins: first time of the part [s].
        ends: last time [s]; None for the end.

    Returns:
        The rows, of which the first and last may lie outside the part; or why there are none.
    """
    last = inf if ends is None else ends
    extent = yield MeasureRecording(name)
    if not isinstance(extent, Extent):
        return store_refusal(extent)
    if begins <= 0.0 and last == inf and extent.size > MOST_PLAYED_BYTES:
        return _too_large(name, extent.size)
    pieces: list[bytes] = []
    at = size = 0
    chunks = extent.chunks
    while at < chunks:
        answer = yield LoadChunks(name, at, min(_CHUNKS_AT_ONCE, chunks - at))
        if not isinstance(answer, tuple):
            return store_refusal(answer)
        wanted: list[bytes] = []
        # Chunks follow each other in time, so the first one after the part ends the loading.
        for chunk in answer:
            times = _times(name, chunk, columns)
            if isinstance(times, Refusal):
                return times
            if times[0] > last:
                chunks = at
                break
            at += 1
            if times[1] >= begins:
                wanted.append(chunk)
        if not answer:
            chunks = at  # the recording shrank: it was replaced by another of its name
        if wanted:
            pieces.append(b"".join(wanted))
            size += len(pieces[-1])
        if size > MOST_PLAYED_BYTES:
            return _too_large(name, size)
    return tuple(pieces)


def _times(name: str, chunk: bytes, columns: int) -> tuple[float, float] | Refusal:
    """Return the least and the greatest time of a chunk's rows [s]."""
    if len(chunk) % (_REAL_BYTES * columns):
        problem = f"has {len(chunk)} bytes, no whole rows of {columns} reals"
        return BadDocument(f"a chunk of recording {name!r}", problem).refusal()
    times = np.frombuffer(chunk, "<f8")[::columns]
    return float(times.min()), float(times.max())


def _too_large(name: str, size: int) -> Refusal:
    text = (
        f"{name!r} has {size} bytes or more to be played; accepted: at most"
        f" {MOST_PLAYED_BYTES}, so play a part of it, with begins and ends"
    )
    return Refusal(VerdictCode.TOO_LARGE, text, value=size, limit=MOST_PLAYED_BYTES)


@dataclass(frozen=True, slots=True)
class _Loaded:
    """A loaded recording."""

    document: RecordingDocument
    extract: Extract
    samples: Pieces


@dataclass(frozen=True, eq=False, slots=True)
class _Playback:
    """Playback until its motion starts."""

    asked: PlayRecording
    reply_to: ReplyTo[PlaybackTold]
    by: Holder
    steps: Steps[_Loaded | Refusal]


class RecordingPlayback:
    """The playbacks of one cell, one at a time."""

    def __init__(
        self,
        cell: RobotCell,
        pending: Pending,
        tool: Callable[[], PoseGoal | None],
        robot_name: str,
    ) -> None:
        """Make one that plays nothing.

        Args:
            tool: returns the centre point of the selected tool in the flange.
        """
        self._cell = cell
        self._pending = pending
        self._tool = tool
        self._robot_name = robot_name
        self._loading: _Playback | None = None
        self._planning: tuple[MotionRequest, ReplyTo[PlaybackTold]] | None = None

    def play(
        self, asked: PlayRecording, reply_to: ReplyTo[PlaybackTold], by: Holder, now: int
    ) -> list[Effect]:
        """Load a recording and request its motion; the answer follows once it is planned."""
        if self._loading is not None:
            text = f"{self._loading.asked.name!r} is being loaded to be played"
            return reply_to.refuse(Refusal(VerdictCode.PLANNING, text))
        steps = self._load(asked)
        self._loading = _Playback(asked, reply_to, by, steps)
        return self._pending.run(steps, self._loaded, now)

    def _load(self, asked: PlayRecording) -> Steps[_Loaded | Refusal]:
        """Load the description of a recording, and the samples of a part of it."""
        answer = yield Load(DocumentKind.RECORDING, asked.name)
        if not isinstance(answer, Document):
            return store_refusal(answer)
        document = read_document(asked.name, answer.body)
        if isinstance(document, Refusal):
            return document
        extract = extract_for(asked.name, document, self._robot_name, self._cell.limits.dof)
        if isinstance(extract, Refusal):
            return extract
        samples = yield from part_samples(asked.name, extract.width, asked.begins, asked.ends)
        if isinstance(samples, Refusal):
            return samples
        # The portions may be of two recordings of this name, so the revision is checked again.
        latest = yield Load(DocumentKind.RECORDING, asked.name)
        refusal = _changed_since(latest, answer.heading.revision)
        return _Loaded(document, extract, samples) if refusal is None else refusal

    def on_cell_event(self, event: CellEvent, now: int) -> list[Effect]:
        """Answer a request whose motion started or was refused, and report its end.

        Whatever ends a waiting program also drops a playback that is being loaded.
        """
        if isinstance(event, MotionEvent):
            return self._notify(event)
        refusal = None if self._loading is None else ending(event, self._loading.by)
        return [] if refusal is None else self.drop(refusal)

    def tick(self, now: int) -> list[Effect]:
        """Drop a playback that is being loaded once the robot may not move any more."""
        if self._loading is None:
            return []
        refusal = check_interlocks(self._cell, self._loading.reply_to.session, now)
        return [] if refusal is None else self.drop(refusal)

    def drop(self, refusal: Refusal) -> list[Effect]:
        """Drop the playback that is being loaded, if any, and refuse its request."""
        playback, self._loading = self._loading, None
        if playback is None:
            return []
        self._pending.drop(playback.steps)
        return playback.reply_to.refuse(refusal)

    def _loaded(self, found: _Loaded | Refusal, now: int) -> list[Effect]:
        """Request the motion if the robot may move now; that may have changed while loading."""
        playback, cell = self._loading, self._cell
        assert playback is not None
        asked, reply_to = playback.asked, playback.reply_to
        refusal = (
            found if isinstance(found, Refusal) else check_interlocks(cell, reply_to.session, now)
        )
        if isinstance(found, Refusal) or refusal is not None:
            assert refusal is not None
            return self.drop(refusal)
        self._loading = None
        job = RecordingJob(
            cell.motions.new_job_id(),
            cell.feedback.standing_at,
            asked.name,
            found.samples,
            found.extract,
            found.document.period,
            asked.factor,
            asked.tolerance,
            asked.begins,
            asked.ends,
            asked.repeats,
            asked.bridge,
            cell.modes.tool_speed_cap(cell.feedback.mode),
            self._tool(),
        )
        request = MotionRequest(reply_to.session, reply_to.request_id, owner=MotionOwner.RECORDING)
        self._planning = request, reply_to
        return cell.motions.ask(request, job, MotionKind.MOVE)

    def _notify(self, event: MotionEvent) -> list[Effect]:
        if isinstance(event, MotionEnded):
            return [Send(event.request.session, outcome(event))]
        if self._planning is None or event.request is not self._planning[0]:
            return []
        _, reply_to = self._planning
        self._planning = None
        if isinstance(event, MotionRefused):
            return reply_to.refuse(event.refusal)
        account = event.playback
        about = {} if account is None else asdict(account) | {"factor": account.factor}
        return reply_to.answer(cast(PlaybackTold, about))


def _changed_since(latest: Answer, revision: int) -> Refusal | None:
    """Return why loaded samples are not those of the present recording; None if they are."""
    if not isinstance(latest, Document):
        return store_refusal(latest)
    heading = latest.heading
    if heading.revision == revision:
        return None
    changed = Conflict(
        heading.kind, heading.name, revision, heading.revision, heading.saved_by, heading.saved_at
    )
    return changed.refusal()
