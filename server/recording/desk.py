"""Recordings as pendants ask for them: begun, ended, listed, cut, played back.

Owns the order in which a request is examined and how it is answered. Which samples are kept is
`recording`'s business, how they become a motion `recording_planning`'s, whether the robot may move
the cell's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial

from openpendant.simplemsg.verdicts import VerdictCode

from ..news import Begun, Ended, News, Refused, Request
from ..operating_mode import MotionKind
from ..outgoing import Outgoing, Send
from ..pendant.replies import outcome
from ..planning.jobs import Planned
from ..planning.pose_goal import PoseGoal
from ..planning.recording_job import PlaybackAccount, RecordingJob
from ..playback.operations import Asker
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..store.documents import Document, DocumentKind, Heading
from ..store.questions import AskStore
from ..store.requests import (
    Answer,
    Delete,
    ListHeadings,
    Load,
    LoadChunks,
    RenameRecording,
    TrimRecording,
)
from . import operations as op
from .descriptions import Fields, RecordingDescriptions
from .document import (
    Extract,
    RecordingDocument,
    extract_for,
    read_document,
)
from .recorder import Recorder
from .run import Lost, Told
from .store_refusal import store_refusal

MOST_PLAYED_BYTES = 64 << 20
"""Largest recording that is played in one piece: an hour of seven joints at 250 Hz."""

_CHUNKS_AT_ONCE = 256
_MOST_LISTED = 100


class RecordingDesk:
    """All recordings of one cell.

    Attributes:
        recorder: records.
    """

    def __init__(
        self,
        cell: RobotCell,
        ask: AskStore,
        tool: Callable[[], PoseGoal | None],
        *,
        robot_name: str,
        state_period: float,
    ) -> None:
        """Make a desk where nothing is recorded or played.

        Args:
            cell: the cell.
            ask: asks the store.
            tool: returns the centre point of the selected tool in the flange.
            robot_name: name of the robot.
            state_period: how often the controller reports [s].
        """
        self.recorder = Recorder(robot_name, cell.limits.names, state_period, ask)
        self._descriptions = RecordingDescriptions(ask, self.recorder)
        self._cell = cell
        self._ask = ask
        self._tool = tool
        self._robot_name = robot_name
        self._planning: tuple[int, Request, Asker] | None = None
        self._account: PlaybackAccount | None = None

    def handle(self, asked: op.RecordingOperation, asker: Asker, now: int) -> list[Outgoing]:
        """Carry out a request; the answer may come later."""
        match asked:
            case op.ListRecordings():
                request = ListHeadings(DocumentKind.RECORDING)
                return self._ask(request, partial(self._listed, asked, asker))
            case op.DescribeRecording(name=name):
                return self._descriptions.describe(name, partial(_described, asker))
            case op.StartRecording(name=name):
                begun = self.recorder.start(name, asker.name, _tell(asker), _tell_loss(asker))
                return self._record(begun, asker)
            case op.StopRecording():
                return self._record(self.recorder.stop(_tell(asker)), asker)
            case op.TrimRecordingPart():
                trim = TrimRecording(
                    asked.name, asked.new_name, asked.begins, asked.ends, asker.name
                )
                return self._ask(trim, partial(_changed, asker))
            case op.RenameARecording():
                rename = RenameRecording(
                    asked.name, asked.new_name, asked.expected_revision, asker.name
                )
                return self._keep(asked.name, asker) or self._ask(rename, partial(_changed, asker))
            case op.DeleteRecording():
                delete = Delete(
                    DocumentKind.RECORDING, asked.name, asked.expected_revision, asker.name
                )
                return self._keep(asked.name, asker) or self._ask(delete, partial(_changed, asker))
            case op.PlayRecording():
                return self._play(asked, asker, now)

    @staticmethod
    def _record(result: Refusal | list[Outgoing], asker: Asker) -> list[Outgoing]:
        return asker.refuse(result) if isinstance(result, Refusal) else result

    def _keep(self, name: str, asker: Asker) -> list[Outgoing]:
        """Refuse to touch what is being recorded; nothing where it is not."""
        status = self.recorder.status
        if status is None or status.name != name:
            return []
        text = f"{name!r} is still being recorded; accepted: once its recording was stopped"
        return asker.refuse(Refusal(VerdictCode.RECORDING_RUNNING, text))

    def _listed(
        self, asked: op.ListRecordings, asker: Asker, answer: Answer, now: int
    ) -> list[Outgoing]:
        if not isinstance(answer, tuple):
            return _failed(asker, answer)
        headings = [heading for heading in answer if isinstance(heading, Heading)]
        shown = headings[asked.first : asked.first + _MOST_LISTED]

        def told(lines: list[Fields], at: int) -> list[Outgoing]:
            status, broken_off = self.recorder.status, self.recorder.broken_off
            return asker.answer(
                recordings=lines,
                total=len(headings),
                recording=None if status is None else asdict(status),
                problem="" if broken_off is None else broken_off.refusal.sentence,
            )

        return self._descriptions.lines(shown, told, now)

    # Playing back.

    def _play(self, asked: op.PlayRecording, asker: Asker, now: int) -> list[Outgoing]:
        refusal = self._cell.check(asker.session, now)
        if refusal is not None:
            return asker.refuse(refusal)
        self._cell.authority.beat(asker.session, now)
        if running := self._keep(asked.name, asker):
            return running

        def loaded(answer: Answer, at: int) -> list[Outgoing]:
            if not isinstance(answer, Document):
                return _failed(asker, answer)
            document = read_document(asked.name, answer.body)
            if isinstance(document, Refusal):
                return asker.refuse(document)
            dof = self._cell.limits.dof
            extract = extract_for(asked.name, document, self._robot_name, dof)
            if isinstance(extract, Refusal):
                return asker.refuse(extract)
            return self._fetch(asked, asker, document, extract, [])

        return self._ask(Load(DocumentKind.RECORDING, asked.name), loaded)

    def _fetch(
        self,
        asked: op.PlayRecording,
        asker: Asker,
        document: RecordingDocument,
        extract: Extract,
        chunks: list[bytes],
    ) -> list[Outgoing]:
        """Load the samples, some chunks at a time, then have the motion planned."""

        def loaded(answer: Answer, now: int) -> list[Outgoing]:
            if not isinstance(answer, tuple):
                return _failed(asker, answer)
            more = [chunk for chunk in answer if isinstance(chunk, bytes)]
            chunks.extend(more)
            size = sum(map(len, chunks))
            if size > MOST_PLAYED_BYTES:
                text = f"{asked.name!r} has more than {MOST_PLAYED_BYTES} bytes; trim it first"
                refusal = Refusal(VerdictCode.TOO_LARGE, text, value=size, limit=MOST_PLAYED_BYTES)
                return asker.refuse(refusal)
            if len(more) == _CHUNKS_AT_ONCE:
                return self._fetch(asked, asker, document, extract, chunks)
            return self._plan(asked, asker, document, extract, b"".join(chunks), now)

        return self._ask(LoadChunks(asked.name, len(chunks), _CHUNKS_AT_ONCE), loaded)

    def _plan(
        self,
        asked: op.PlayRecording,
        asker: Asker,
        document: RecordingDocument,
        extract: Extract,
        samples: bytes,
        now: int,
    ) -> list[Outgoing]:
        cell = self._cell
        refusal = cell.check(asker.session, now)
        if refusal is not None:
            return asker.refuse(refusal)
        job = RecordingJob(
            cell.motions.new_job_id(),
            cell.standing_at,
            asked.name,
            samples,
            extract,
            document.period,
            asked.factor,
            asked.tolerance,
            asked.begins,
            asked.ends,
            asked.repeats,
            asked.bridge,
            cell.modes.tool_speed_cap(cell.mode),
            self._tool(),
        )
        request = Request(asker.session, asker.request_id)
        self._planning = (job.job_id, request, asker)
        self._account = None
        return cell.motions.ask(request, job, MotionKind.MOVE)

    def planned(self, planned: Planned) -> None:
        """Take note of what the plan of a playback says; the cell begins it."""
        if self._planning is not None and self._planning[0] == planned.job_id:
            self._account = planned.playback

    def news(self, news: News) -> list[Outgoing] | None:
        """Answer the request of a playback that began or was refused.

        Returns:
            The answer; None where the news is about something else, and for the outcome, which is
            told as of any motion.
        """
        if self._planning is None or isinstance(news, Ended):
            return None
        _, request, asker = self._planning
        match news:
            case Begun(request=of) if of is request:
                self._planning = None
                account = self._account
                about = {} if account is None else asdict(account) | {"factor": account.factor}
                return asker.answer(**about)
            case Refused(request=of, refusal=refusal) if of is request:
                self._planning = None
                return asker.refuse(refusal)
        return None


def _tell(asker: Asker) -> Told:
    def told(ended: RecordingDocument | Refusal, now: int) -> list[Outgoing]:
        if isinstance(ended, Refusal):
            return asker.refuse(ended)
        return asker.answer(**ended.model_dump())

    return told


def _tell_loss(asker: Asker) -> Lost:
    """Return what tells whoever records of a recording that ends by itself, as of any work."""

    def lost(refusal: Refusal, now: int) -> list[Outgoing]:
        request = Request(asker.session, asker.request_id)
        return [Send(asker.session, outcome(Ended(request, refusal, 0.0, 0.0)))]

    return lost


def _described(asker: Asker, about: Fields | Refusal, now: int) -> list[Outgoing]:
    return asker.refuse(about) if isinstance(about, Refusal) else asker.answer(**about)


def _changed(asker: Asker, answer: Answer, now: int) -> list[Outgoing]:
    if isinstance(answer, Heading):
        return asker.answer(name=answer.name, revision=answer.revision)
    return _failed(asker, answer)


def _failed(asker: Asker, answer: Answer) -> list[Outgoing]:
    return asker.refuse(store_refusal(answer))
