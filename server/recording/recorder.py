"""Recording a motion: every fresh report of the controller, kept in chunks while it goes on.

Owns which reports are taken, when a chunk is due, and what becomes of a recording that the disk
does not keep up with or refuses. Samples that are acknowledged are on the disk: of a server that is
killed at most the last half second is missing, beside what waits for the disk. Knows no socket,
file or clock, and nothing of playing back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from openpendant.simplemsg.verdicts import VerdictCode

from ..driving.feedback import Feedback
from ..outgoing import Outgoing
from ..refusal import Refusal
from ..store.documents import DocumentKind, Extent, Heading
from ..store.errors import StoreBusy
from ..store.questions import AskStore
from ..store.requests import Answer, AppendChunk, Save
from .document import (
    GAP_PERIODS,
    RecordingDocument,
    new_document,
    write_document,
)
from .row_count import RowCount
from .run import BrokenOff, Lost, RecordingStatus, Run, Told
from .store_refusal import store_refusal

CHUNK_NS = 500_000_000
"""Rows wait for so long before they are written together."""

MOST_WAITING_ROWS = 30_000
"""Rows that wait for a disk that does not keep up: five minutes at 100 Hz."""

LONGEST_BUSY_NS = 30_000_000_000
"""A recording that was stopped waits so long for a disk that is busy all the time."""

_SECOND_NS = 1_000_000_000


class Recorder:
    """Records the motion of one cell, one recording at a time.

    Attributes:
        broken_off: the last recording, if it ended by itself; None where it did not.
    """

    def __init__(self, robot: str, joints: Sequence[str], period: float, ask: AskStore) -> None:
        """Make a recorder that is not recording.

        Args:
            robot: name of the robot.
            joints: names of its joints.
            period: how often the controller reports [s].
            ask: the way to the store.
        """
        self.broken_off: BrokenOff | None = None
        self._robot = robot
        self._joints = tuple(joints)
        self._period = period
        self._gap_ns = round(GAP_PERIODS * period * _SECOND_NS)
        self._ask = ask
        self._run: Run | None = None

    @property
    def status(self) -> RecordingStatus | None:
        """The recording under way; None where there is none."""
        run = self._run
        if run is None:
            return None
        count = run.count
        return RecordingStatus(run.name, count.duration, count.rows, run.kept, count.gaps)

    def count_of(self, name: str) -> RowCount | None:
        """Return what was counted of the recording under way; None if it is not of this name."""
        run = self._run
        return None if run is None or run.name != name else run.count

    def start(self, name: str, author: str, told: Told, lost: Lost) -> Refusal | list[Outgoing]:
        """Begin a recording; samples are taken from when its document is saved.

        Args:
            name: of the new document.
            author: who records.
            told: is told the description once it is saved, or why it is not.
            lost: is told why, if the recording ends by itself afterwards.

        Returns:
            Why it may not begin, or what follows.
        """
        if self._run is not None:
            return Refusal(VerdictCode.RECORDING_RUNNING, f"{self._run.name!r} is being recorded")
        document = new_document(self._robot, self._joints, self._period)
        run = self._run = Run(name, author, document, lost)
        self.broken_off = None

        def saved(answer: Answer, now: int) -> list[Outgoing]:
            if isinstance(answer, Heading):
                run.revision = answer.revision
                return told(document, now)
            self._run = None
            return told(store_refusal(answer), now)

        body = write_document(document)
        return self._ask(Save(DocumentKind.RECORDING, name, body, 0, author), saved)

    def reported(self, feedback: Feedback, now: int) -> list[Outgoing]:
        """Take the controller's last report, if it was not taken yet."""
        run = self._run
        if run is None or not run.revision or run.told is not None:
            return []
        if feedback.position is None or (run.first is not None and feedback.received <= run.last):
            return []
        run.take(feedback.position, feedback.received, self._gap_ns)
        if len(run.waiting) > MOST_WAITING_ROWS:
            return self._break_off(run, _fallen_behind(run), now)
        return self._write(run)

    def stop(self, told: Told) -> Refusal | list[Outgoing]:
        """End the recording; `told` is told its description once all of it is on the disk.

        Returns:
            Why there is nothing to end, or why it ended by itself before; or what follows.
        """
        run = self._run
        if run is None and self.broken_off is not None:
            return self.broken_off.refusal
        if run is None or not run.revision or run.told is not None:
            return Refusal(VerdictCode.NOT_RECORDING)
        run.told = told
        return self._finish(run)

    def tick(self, now: int) -> list[Outgoing]:
        """Try the disk again, where it was busy as the rest of a recording was to be kept."""
        run = self._run
        if run is None or run.busy_since is None:
            return []
        return self._finish(run)

    def flush(self) -> list[Outgoing]:
        """Have written what waits, and record no more, because the server is going down.

        Of one that was stopped, and waited for the disk, the rows are kept without its final
        description, as of one that nobody stopped: there is no time to try again.
        """
        run = self._run
        if run is None or not run.revision:
            return []
        if run.told is not None and run.is_asked and not run.chunk and not run.waiting:
            return []  # the description is on its way, behind all rows
        self._run = None
        out: list[Outgoing] = []
        # A chunk that the store was asked to keep already may be asked for twice.
        while run.chunk or run.waiting:
            if run.chunk:
                chunk = AppendChunk(run.name, run.chunks, run.chunk)
                out += self._ask(chunk, lambda answer, at: [])
                run.chunks += 1
            run.next_chunk()
        if run.told is None:
            return out
        text = f"recording {run.name!r} was stopped, and the disk was still busy with its end"
        return out + run.told(Refusal(VerdictCode.SHUTTING_DOWN, text), run.last)

    # Rows.

    def _write(self, run: Run) -> list[Outgoing]:
        """Write the chunk that the disk did not take, or one that is due."""
        if run.is_asked:
            return []
        is_due = run.waiting and run.last - run.waits_since >= CHUNK_NS
        return self._append(run) if run.chunk or is_due else []

    def _append(self, run: Run) -> list[Outgoing]:
        if not run.chunk:
            run.next_chunk()
        run.is_asked = True

        def kept(answer: Answer, now: int) -> list[Outgoing]:
            return self._kept(run, answer, now)

        return self._ask(AppendChunk(run.name, run.chunks, run.chunk), kept)

    def _kept(self, run: Run, answer: Answer, now: int) -> list[Outgoing]:
        if self._run is not run:
            return []
        run.is_asked = False
        if isinstance(answer, Extent):
            run.chunks = answer.chunks
            run.kept += run.chunk_rows
            run.chunk, run.chunk_rows = b"", 0
            run.busy_since = None
            return self._write(run) if run.told is None else self._finish(run)
        if self._may_wait(run, answer, now):
            return []
        return self._break_off(run, store_refusal(answer), now)

    @staticmethod
    def _may_wait(run: Run, answer: Answer, now: int) -> bool:
        """Tell whether what the disk did not take is tried again: by the next report or tick."""
        if not isinstance(answer, StoreBusy):
            return False
        if run.told is None:
            return True  # until too many rows wait
        if run.busy_since is None:
            run.busy_since = now
        return now - run.busy_since < LONGEST_BUSY_NS

    # The end.

    def _finish(self, run: Run) -> list[Outgoing]:
        """Write what is left, then the description with what was counted."""
        if run.is_asked:
            return []
        if run.chunk or run.waiting:
            return self._append(run)
        run.is_asked = True
        document = run.document.model_copy(update={"finished": True} | run.count.fields)

        def saved(answer: Answer, now: int) -> list[Outgoing]:
            run.is_asked = False
            if self._may_wait(run, answer, now):
                return []
            if not isinstance(answer, Heading):
                return self._break_off(run, store_refusal(answer), now)
            self._run = None
            return [] if run.told is None else run.told(document, now)

        return self._ask(_save(run, document), saved)

    def _break_off(self, run: Run, cause: Refusal, now: int) -> list[Outgoing]:
        """End a recording that cannot go on; what is kept stays, and who records is told."""
        self._run = None
        text = f"recording {run.name!r} ended by itself, {run.kept} samples kept: {cause.sentence}"
        refusal = replace(cause, text=text)
        self.broken_off = BrokenOff(run.name, refusal)
        out = run.lost(refusal, now)
        if run.told is not None:
            out += run.told(refusal, now)
        # A full disk refuses this, too; then the reason is known until the next recording begins.
        noted = run.document.model_copy(update={"problem": text})
        return out + self._ask(_save(run, noted), lambda answer, at: [])


def _save(run: Run, document: RecordingDocument) -> Save:
    body = write_document(document)
    return Save(DocumentKind.RECORDING, run.name, body, run.revision, run.author)


def _fallen_behind(run: Run) -> Refusal:
    lost = len(run.waiting) + run.chunk_rows
    text = f"{lost} samples wait for the disk, at most {MOST_WAITING_ROWS}"
    return Refusal(VerdictCode.RECORDING_FELL_BEHIND, text, value=lost, limit=MOST_WAITING_ROWS)
