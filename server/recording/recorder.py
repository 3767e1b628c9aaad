"""Recording a motion: every fresh report of the controller, kept in chunks while it goes on.

Owns which reports are taken, when a chunk is due, and what becomes of a recording that the disk
does not keep up with. Samples that are acknowledged are on the disk: of a server that is killed at
most the last half second is missing, beside what waits for the disk. Knows no socket, file or
clock, and nothing of playing back.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from openpendant.simplemsg.verdicts import VerdictCode

from ..driving.feedback import Feedback
from ..outgoing import Outgoing
from ..refusal import Refusal
from ..store.documents import DocumentKind, Extent, Heading
from ..store.errors import StoreBusy, StoreError
from ..store.questions import AskStore
from ..store.requests import Answer, AppendChunk, Save
from ..store.samples import pack_rows
from .document import (
    GAP_PERIODS,
    RecordingDocument,
    new_document,
    write_document,
)

CHUNK_NS = 500_000_000
"""Rows wait for so long before they are written together."""

MOST_WAITING_ROWS = 30_000
"""Rows that wait for a disk that does not keep up: five minutes at 100 Hz."""

_SECOND_NS = 1_000_000_000

Row = tuple[float, ...]
Told = Callable[[RecordingDocument | Refusal, int], list[Outgoing]]
"""Takes how a request about the recording ended, and the time."""


@dataclass(slots=True)
class _Run:
    """One recording under way.

    Attributes:
        name: of its document.
        author: who records.
        document: its description as saved.
        revision: of the document; 0 until it is saved.
        waiting: rows that no chunk holds yet.
        underway: rows of the chunk that the disk is being asked to keep.
        chunks: how many are kept.
        kept: rows in them.
        first: time of the first row [ns].
        last: time of the last row [ns].
        waits_since: time of the oldest row that waits [ns].
        gaps: between rows, so far.
        longest_gap: the longest [ns].
        in_gaps: time spent in gaps [ns].
        told: who waits for the end; None while it goes on.
    """

    name: str
    author: str
    document: RecordingDocument
    revision: int = 0
    waiting: list[Row] = field(default_factory=list)
    underway: list[Row] = field(default_factory=list)
    chunks: int = 0
    kept: int = 0
    first: int | None = None
    last: int = 0
    waits_since: int = 0
    gaps: int = 0
    longest_gap: int = 0
    in_gaps: int = 0
    told: Told | None = None

    @property
    def rows(self) -> int:
        """Rows so far, kept or not."""
        return self.kept + len(self.underway) + len(self.waiting)

    @property
    def duration(self) -> float:
        """From the first to the last row [s]."""
        return 0.0 if self.first is None else (self.last - self.first) / _SECOND_NS


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


class Recorder:
    """Records the motion of one cell, one recording at a time.

    Attributes:
        problem: why the last recording ended by itself; None where it did not.
    """

    def __init__(self, robot: str, joints: Sequence[str], period: float, ask: AskStore) -> None:
        """Make a recorder that is not recording.

        Args:
            robot: name of the robot.
            joints: names of its joints.
            period: how often the controller reports [s].
            ask: the way to the store.
        """
        self.problem: Refusal | None = None
        self._robot = robot
        self._joints = tuple(joints)
        self._period = period
        self._gap_ns = round(GAP_PERIODS * period * _SECOND_NS)
        self._ask = ask
        self._run: _Run | None = None

    @property
    def status(self) -> RecordingStatus | None:
        """The recording under way; None where there is none."""
        run = self._run
        if run is None:
            return None
        return RecordingStatus(run.name, run.duration, run.rows, run.kept, run.gaps)

    def start(self, name: str, author: str, told: Told) -> Refusal | list[Outgoing]:
        """Begin a recording; samples are taken from when its document is saved.

        Args:
            name: of the new document.
            author: who records.
            told: is told the description once it is saved, or why it is not.

        Returns:
            Why it may not begin, or what follows.
        """
        if self._run is not None:
            return Refusal(VerdictCode.RECORDING_RUNNING, f"{self._run.name!r} is being recorded")
        document = new_document(self._robot, self._joints, self._period)
        run = self._run = _Run(name, author, document)
        self.problem = None

        def saved(answer: Answer, now: int) -> list[Outgoing]:
            if isinstance(answer, Heading):
                run.revision = answer.revision
                return told(document, now)
            self._run = None
            return told(_refusal(answer), now)

        body = write_document(document)
        return self._ask(Save(DocumentKind.RECORDING, name, body, 0, author), saved)

    def reported(self, feedback: Feedback, now: int) -> list[Outgoing]:
        """Take the controller's last report, if it was not taken yet."""
        run = self._run
        if run is None or not run.revision or run.told is not None:
            return []
        if feedback.position is None or (run.first is not None and feedback.received <= run.last):
            return []
        self._take(run, feedback.position, feedback.received)
        if len(run.waiting) > MOST_WAITING_ROWS:
            return self._end(run, self._fallen_behind(run), now)
        return self._write(run)

    def stop(self, told: Told) -> Refusal | list[Outgoing]:
        """End the recording; `told` is told its description once all of it is on the disk.

        Returns:
            Why there is nothing to end, or what follows.
        """
        run = self._run
        if run is None or not run.revision or run.told is not None:
            return Refusal(VerdictCode.NOT_RECORDING)
        run.told = told
        return self._finish(run)

    def flush(self) -> list[Outgoing]:
        """Have written what waits, because the server is going down."""
        run = self._run
        if run is None or not run.revision or run.underway or not run.waiting:
            return []
        return self._append(run)

    # Rows.

    def _take(self, run: _Run, position: tuple[float, ...], received: int) -> None:
        mark = 0.0
        if run.first is None:
            run.first = received
        elif received - run.last > self._gap_ns:
            mark = 1.0
            run.gaps += 1
            run.longest_gap = max(run.longest_gap, received - run.last)
            run.in_gaps += received - run.last
        run.last = received
        if not run.waiting:
            run.waits_since = received
        run.waiting.append(((received - run.first) / _SECOND_NS, *position, mark))

    def _write(self, run: _Run) -> list[Outgoing]:
        """Write a chunk where one is due and the last one is kept."""
        if run.underway or not run.waiting or run.last - run.waits_since < CHUNK_NS:
            return []
        return self._append(run)

    def _append(self, run: _Run) -> list[Outgoing]:
        run.underway, run.waiting = run.waiting, []

        def kept(answer: Answer, now: int) -> list[Outgoing]:
            return self._kept(run, answer, now)

        return self._ask(AppendChunk(run.name, run.chunks, pack_rows(run.underway)), kept)

    def _kept(self, run: _Run, answer: Answer, now: int) -> list[Outgoing]:
        if self._run is not run:
            return []
        if isinstance(answer, Extent):
            run.chunks = answer.chunks
            run.kept += len(run.underway)
            run.underway = []
            return self._write(run) if run.told is None else self._finish(run)
        if isinstance(answer, StoreBusy) and run.told is None:
            # They stay first in line; the next report tries again.
            run.waiting, run.underway = run.underway + run.waiting, []
            return []
        return self._end(run, _refusal(answer), now)

    # The end.

    def _finish(self, run: _Run) -> list[Outgoing]:
        """Write what is left, then the description with what was counted."""
        if run.underway:
            return []
        if run.waiting:
            return self._append(run)
        steps = run.kept - 1 - run.gaps
        covered = run.duration - run.in_gaps / _SECOND_NS
        document = run.document.model_copy(
            update={
                "finished": True,
                "samples": run.kept,
                "duration": run.duration,
                "rate": steps / covered if steps > 0 and covered > 0 else 0.0,
                "gaps": run.gaps,
                "longest_gap": run.longest_gap / _SECOND_NS,
            }
        )

        def saved(answer: Answer, now: int) -> list[Outgoing]:
            self._run = None
            told = run.told
            if told is None:
                return []
            return told(document if isinstance(answer, Heading) else _refusal(answer), now)

        body = write_document(document)
        save = Save(DocumentKind.RECORDING, run.name, body, run.revision, run.author)
        return self._ask(save, saved)

    def _end(self, run: _Run, refusal: Refusal, now: int) -> list[Outgoing]:
        """End a recording that cannot go on; what is kept stays."""
        self._run = None
        self.problem = refusal
        return [] if run.told is None else run.told(refusal, now)

    def _fallen_behind(self, run: _Run) -> Refusal:
        lost = len(run.waiting) + len(run.underway)
        text = (
            f"recording {run.name!r} ended: {lost} samples wait for the disk, at most"
            f" {MOST_WAITING_ROWS}; {run.kept} are kept"
        )
        return Refusal(VerdictCode.RECORDING_FELL_BEHIND, text, value=lost, limit=MOST_WAITING_ROWS)


def _refusal(answer: Answer) -> Refusal:
    if isinstance(answer, StoreError):
        return answer.refusal()
    text = f"the store answered with a {type(answer).__name__}"
    return Refusal(VerdictCode.STORE_FAILED, text)
