"""Recorder of a cell's motion: every fresh report of the controller, kept in chunks.

Owns which reports are taken, when a chunk is due, and the end of a recording when the disk is too
slow or refuses: the notification, and the refusal with the store's reason. Samples that are
acknowledged are on the disk: after a kill of the server at most the last 0.5 s is missing, besides
the rows that wait for the disk. Knows no socket, file or clock, and nothing of playback.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.execution.feedback import Feedback
from ..events.effects import Effect
from ..events.pending import AskStore
from ..refusal import Refusal
from ..store.documents import DocumentKind, Extent, Heading
from ..store.recording_format import (
    GAP_PERIODS,
    RecordingDocument,
    Row,
    RowCount,
    new_document,
    pack_rows,
    rows_in_a_chunk,
    write_document,
)
from ..store.requests import Answer, AppendChunk, Save
from ..store.store_errors import StoreBusy, StoreError

OnResult: TypeAlias = Callable[[RecordingDocument | Refusal, int], list[Effect]]
"""Takes the result of a request about the recording, and the time."""

Lost: TypeAlias = Callable[[Refusal, int], list[Effect]]
"""Takes the reason why a recording ended by itself, and the time."""

_SECOND_NS = 1_000_000_000

_ROWS_AT_ONCE = 1_000
"""Rows packed in one turn of the event loop, in about 0.5 ms, where the disk was slow."""


@dataclass(slots=True)
class RecordingRun:
    """One recording under way.

    Attributes:
        session: connection of the author, 0 for the server.
        revision: of the document; 0 until it is saved.
        waiting: rows that no chunk holds yet.
        chunk: the next chunk for the disk; empty where there is none.
        kept: rows in them.
        count: what was counted of all rows, kept or not.
        first: time of the first row [ns]; None before it.
        last: time of the last row [ns].
        on_result: called at the end; None until the end was requested.
        busy_since: start of the disk's busy time while the end waits for it [ns]; else None.
    """

    name: str
    author: str
    session: int
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
    on_result: OnResult | None = None
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
        most = min(_ROWS_AT_ONCE, rows_in_a_chunk(len(self.document.columns)))
        rows, self.waiting = self.waiting[:most], self.waiting[most:]
        self.chunk, self.chunk_rows = pack_rows(rows), len(rows)


@dataclass(frozen=True, slots=True)
class RecordingStatus:
    """Published status of a recording in progress.

    Attributes:
        duration: from the first to the last row [s].
        kept: rows that are on the disk.
    """

    name: str
    duration: float
    samples: int
    kept: int
    gaps: int


@dataclass(frozen=True, slots=True)
class RecordingBrokenOff:
    """Recording that ended by itself; its kept rows stay."""

    name: str
    refusal: Refusal


def store_refusal(answer: Answer) -> Refusal:
    """Return the refusal for a store's answer that is not the expected one."""
    if isinstance(answer, StoreError):
        return answer.refusal()
    text = f"the store answered with a {type(answer).__name__}"
    return Refusal(VerdictCode.STORE_FAILED, text)


CHUNK_NS = 500_000_000
"""Time that rows wait before they are written together [ns]."""

MOST_WAITING_ROWS = 30_000
"""Greatest number of rows that wait for a slow disk: 5 min at 100 Hz."""

LONGEST_BUSY_NS = 30_000_000_000
"""Longest time that a stopped recording waits for a busy disk [ns]."""


class Recorder:
    """Recorder of one cell, one recording at a time.

    Attributes:
        broken_off: the last recording, if it ended by itself; None where it did not.
        run: the recording under way; None where there is none.
    """

    def __init__(self, robot: str, joints: Sequence[str], period: float, ask: AskStore) -> None:
        """Make a recorder without a recording.

        Args:
            period: how often the controller reports [s].
        """
        self.broken_off: RecordingBrokenOff | None = None
        self._robot = robot
        self._joints = tuple(joints)
        self._period = period
        self._gap_ns = round(GAP_PERIODS * period * _SECOND_NS)
        self._ask = ask
        self.run: RecordingRun | None = None

    @property
    def status(self) -> RecordingStatus | None:
        """The recording under way; None where there is none."""
        run = self.run
        if run is None:
            return None
        count = run.count
        return RecordingStatus(run.name, count.duration, count.rows, run.kept, count.gaps)

    def count_of(self, name: str) -> RowCount | None:
        """Return what was counted of the recording under way; None if it is not of this name."""
        run = self.run
        return None if run is None or run.name != name else run.count

    def start(
        self, name: str, author: str, on_result: OnResult, lost: Lost, session: int = 0
    ) -> Refusal | list[Effect]:
        """Start a recording; samples are taken once its document is saved.

        Args:
            on_result: called with the description once it is saved, or with why it is not.
            lost: called with the reason if the recording ends by itself afterwards.
            session: connection of the author, 0 for the server.
        """
        if self.run is not None:
            return Refusal(VerdictCode.RECORDING_RUNNING, f"{self.run.name!r} is being recorded")
        document = new_document(self._robot, self._joints, self._period)
        run = self.run = RecordingRun(name, author, session, document, lost)
        self.broken_off = None

        def saved(answer: Answer, now: int) -> list[Effect]:
            if isinstance(answer, Heading):
                run.revision = answer.revision
                return on_result(document, now)
            self.run = None
            return on_result(store_refusal(answer), now)

        body = write_document(document)
        return self._ask(Save(DocumentKind.RECORDING, name, body, 0, author, session), saved)

    def reported(self, feedback: Feedback, now: int) -> list[Effect]:
        """Take the controller's last report, unless it was taken already."""
        run = self.run
        if run is None or not run.revision or run.on_result is not None:
            return []
        if feedback.position is None or (run.first is not None and feedback.received <= run.last):
            return []
        run.take(feedback.position, feedback.received, self._gap_ns)
        if len(run.waiting) > MOST_WAITING_ROWS:
            return self._break_off(run, _fallen_behind(run), now)
        return self._write(run)

    def stop(self, on_result: OnResult) -> Refusal | list[Effect]:
        """End the recording; `on_result` gets its description once all of it is on the disk.

        Returns:
            Why there is nothing to end, or why it ended by itself before; or what follows.
        """
        run = self.run
        if run is None and self.broken_off is not None:
            return self.broken_off.refusal
        if run is None or not run.revision or run.on_result is not None:
            return Refusal(VerdictCode.NOT_RECORDING)
        run.on_result = on_result
        return self._finish(run)

    def tick(self, now: int) -> list[Effect]:
        """Try the disk again if it was busy when the rest of a recording was due."""
        run = self.run
        if run is None or run.busy_since is None:
            return []
        return self._finish(run)

    def flush(self) -> list[Effect]:
        """Write the waiting rows and end the recording, because the server is going down.

        A stopped recording that still waited for the disk keeps its rows but gets no final
        description, as if nobody had stopped it: there is no time to try again.
        """
        run = self.run
        if run is None or not run.revision:
            return []
        if run.on_result is not None and run.is_asked and not run.chunk and not run.waiting:
            return []  # the description is on its way, behind all rows
        self.run = None
        out: list[Effect] = []
        # A pending chunk is sent again without harm: the store accepts a repeated last chunk.
        while run.chunk or run.waiting:
            if run.chunk:
                chunk = AppendChunk(run.name, run.chunks, run.chunk)
                out += self._ask(chunk, lambda answer, at: [])
                run.chunks += 1
            run.next_chunk()
        if run.on_result is None:
            return out
        text = f"recording {run.name!r} was stopped, and the disk was still busy with its end"
        return out + run.on_result(Refusal(VerdictCode.SHUTTING_DOWN, text), run.last)

    def _write(self, run: RecordingRun) -> list[Effect]:
        """Write the chunk that the disk did not take, or one that is due."""
        if run.is_asked:
            return []
        is_due = run.waiting and run.last - run.waits_since >= CHUNK_NS
        return self._append(run) if run.chunk or is_due else []

    def _append(self, run: RecordingRun) -> list[Effect]:
        if not run.chunk:
            run.next_chunk()
        run.is_asked = True

        def kept(answer: Answer, now: int) -> list[Effect]:
            return self._kept(run, answer, now)

        return self._ask(AppendChunk(run.name, run.chunks, run.chunk), kept)

    def _kept(self, run: RecordingRun, answer: Answer, now: int) -> list[Effect]:
        if self.run is not run:
            return []
        run.is_asked = False
        if isinstance(answer, Extent):
            run.chunks = answer.chunks
            run.kept += run.chunk_rows
            run.chunk, run.chunk_rows = b"", 0
            run.busy_since = None
            return self._write(run) if run.on_result is None else self._finish(run)
        if self._may_wait(run, answer, now):
            return []
        return self._break_off(run, store_refusal(answer), now)

    @staticmethod
    def _may_wait(run: RecordingRun, answer: Answer, now: int) -> bool:
        """Return True if a refused chunk is tried again by the next report or tick."""
        if not isinstance(answer, StoreBusy):
            return False
        if run.on_result is None:
            return True  # until too many rows wait
        if run.busy_since is None:
            run.busy_since = now
        return now - run.busy_since < LONGEST_BUSY_NS

    def _finish(self, run: RecordingRun) -> list[Effect]:
        """Write what is left, then the description with what was counted."""
        if run.is_asked:
            return []
        if run.chunk or run.waiting:
            return self._append(run)
        run.is_asked = True
        document = run.document.model_copy(update={"finished": True} | run.count.fields)

        def saved(answer: Answer, now: int) -> list[Effect]:
            run.is_asked = False
            if self._may_wait(run, answer, now):
                return []
            if not isinstance(answer, Heading):
                return self._break_off(run, store_refusal(answer), now)
            self.run = None
            return [] if run.on_result is None else run.on_result(document, now)

        return self._ask(_save(run, document), saved)

    def _break_off(self, run: RecordingRun, cause: Refusal, now: int) -> list[Effect]:
        """End a recording that cannot continue; kept rows stay, and its client is notified."""
        self.run = None
        text = f"recording {run.name!r} ended by itself, {run.kept} samples kept: {cause.sentence}"
        refusal = replace(cause, text=text)
        self.broken_off = RecordingBrokenOff(run.name, refusal)
        out = run.lost(refusal, now)
        if run.on_result is not None:
            out += run.on_result(refusal, now)
        # A full disk refuses this, too; then the reason is known until the next recording starts.
        noted = run.document.model_copy(update={"problem": text})
        return out + self._ask(_save(run, noted), lambda answer, at: [])


def _save(run: RecordingRun, document: RecordingDocument) -> Save:
    body = write_document(document)
    return Save(DocumentKind.RECORDING, run.name, body, run.revision, run.author, run.session)


def _fallen_behind(run: RecordingRun) -> Refusal:
    lost = len(run.waiting) + run.chunk_rows
    text = f"{lost} samples wait for the disk, at most {MOST_WAITING_ROWS}"
    return Refusal(VerdictCode.RECORDING_FELL_BEHIND, text, value=lost, limit=MOST_WAITING_ROWS)
