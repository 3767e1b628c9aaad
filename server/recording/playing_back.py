"""Playing recordings back: asked for, loaded, planned and answered.

Owns that nothing moves that was asked for before a stop, a change of mode or of the motion
authority: the samples take their time to be loaded, and what is still being loaded by then is
dropped and refused at once. So it is where any condition of motion fails meanwhile. How samples
become a motion is `recording_planning`'s, whether the robot may move the cell's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass

from openpendant.simplemsg.verdicts import VerdictCode

from ..authority import Holder
from ..news import Begun, Ended, News, Refused, Request
from ..operating_mode import MotionKind
from ..outgoing import Outgoing
from ..planning.jobs import Planned
from ..planning.pose_goal import PoseGoal
from ..planning.recording_job import PlaybackAccount, RecordingJob
from ..playback.operations import Asker
from ..playback.run_endings import ending
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..store.documents import Document, DocumentKind
from ..store.errors import Conflict
from ..store.questions import AskStore
from ..store.requests import Answer, Load
from . import operations as op
from .document import Extract, RecordingDocument, extract_for, read_document
from .part_loading import PartLoading, Pieces
from .store_refusal import store_refusal


@dataclass(eq=False, slots=True)
class _Playback:
    """One playback until its motion begins.

    Attributes:
        asked: what was asked.
        asker: who asked.
        by: who that is as the holder of the motion authority.
        part: its samples on their way; None before the recording was found.
    """

    asked: op.PlayRecording
    asker: Asker
    by: Holder
    part: PartLoading | None = None


class PlayingBack:
    """The playbacks of one cell, one at a time."""

    def __init__(
        self, cell: RobotCell, ask: AskStore, tool: Callable[[], PoseGoal | None], robot_name: str
    ) -> None:
        """Make one that plays nothing.

        Args:
            cell: the cell.
            ask: asks the store.
            tool: returns the centre point of the selected tool in the flange.
            robot_name: name of the robot.
        """
        self._cell = cell
        self._ask = ask
        self._tool = tool
        self._robot_name = robot_name
        self._loading: _Playback | None = None
        self._planning: tuple[int, Request, Asker] | None = None
        self._account: PlaybackAccount | None = None

    # Loading.

    def play(self, asked: op.PlayRecording, asker: Asker, by: Holder) -> list[Outgoing]:
        """Load a recording, and have the motion planned; the answer comes once that is done.

        Args:
            asked: what is asked.
            asker: who asks, who may move the robot.
            by: the same as the holder of the motion authority.
        """
        if self._loading is not None:
            text = f"{self._loading.asked.name!r} is being loaded to be played"
            return asker.refuse(Refusal(VerdictCode.PLANNING, text))
        playback = self._loading = _Playback(asked, asker, by)

        def loaded(answer: Answer, at: int) -> list[Outgoing]:
            return [] if self._loading is not playback else self._read(playback, answer)

        return self._ask(Load(DocumentKind.RECORDING, asked.name), loaded)

    def dropped_by(self, news: News) -> list[Outgoing]:
        """Drop what is being loaded where news ends it as it ends a program that waits."""
        refusal = None if self._loading is None else ending(news, self._loading.by)
        return [] if refusal is None else self.drop(refusal)

    def tick(self, now: int) -> list[Outgoing]:
        """Drop what is being loaded where the robot may not move any more."""
        if self._loading is None:
            return []
        refusal = self._cell.check(self._loading.asker.session, now)
        return [] if refusal is None else self.drop(refusal)

    def drop(self, refusal: Refusal) -> list[Outgoing]:
        """Play nothing of what is being loaded, and tell who asked; nothing where nothing is."""
        playback, self._loading = self._loading, None
        if playback is None:
            return []
        if playback.part is not None:
            playback.part.drop()
        return playback.asker.refuse(refusal)

    def _read(self, playback: _Playback, answer: Answer) -> list[Outgoing]:
        """Read the description, and ask for the samples."""
        asked = playback.asked
        if not isinstance(answer, Document):
            return self.drop(store_refusal(answer))
        document = read_document(asked.name, answer.body)
        if isinstance(document, Refusal):
            return self.drop(document)
        extract = extract_for(asked.name, document, self._robot_name, self._cell.limits.dof)
        if isinstance(extract, Refusal):
            return self.drop(extract)
        revision = answer.heading.revision

        def told(pieces: Pieces | Refusal, now: int) -> list[Outgoing]:
            if isinstance(pieces, Refusal):
                return self.drop(pieces)

            def looked(latest: Answer, at: int) -> list[Outgoing]:
                if self._loading is not playback:
                    return []
                refusal = _changed_since(latest, revision)
                if refusal is not None:
                    return self.drop(refusal)
                return self._plan(playback, document, extract, pieces, at)

            # It comes in portions: they might be of two recordings of this name.
            return self._ask(Load(DocumentKind.RECORDING, asked.name), looked)

        playback.part = PartLoading(
            self._ask, asked.name, extract.width, asked.begins, asked.ends, told
        )
        return playback.part.begin()

    # Planning.

    def _plan(
        self,
        playback: _Playback,
        document: RecordingDocument,
        extract: Extract,
        samples: Pieces,
        now: int,
    ) -> list[Outgoing]:
        cell, asked, asker = self._cell, playback.asked, playback.asker
        refusal = cell.check(asker.session, now)
        if refusal is not None:
            return self.drop(refusal)
        self._loading = None
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


def _changed_since(latest: Answer, revision: int) -> Refusal | None:
    """Return why samples that were loaded are not those of a recording any more."""
    if not isinstance(latest, Document):
        return store_refusal(latest)
    heading = latest.heading
    if heading.revision == revision:
        return None
    changed = Conflict(
        heading.kind, heading.name, revision, heading.revision, heading.saved_by, heading.saved_at
    )
    return changed.refusal()
