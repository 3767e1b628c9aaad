"""Recordings as pendants ask for them: begun, ended, listed, cut, played back.

Owns the order in which a request is examined and how it is answered. Which samples are kept is
`recorder`'s business, how they are played `playing_back`'s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial

from openpendant.simplemsg.verdicts import VerdictCode

from ..news import Ended, News, Request
from ..outgoing import Outgoing, Send
from ..pendant.replies import outcome
from ..planning.jobs import Planned
from ..planning.pose_goal import PoseGoal
from ..playback.operations import Asker
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..store.documents import DocumentKind, Heading
from ..store.questions import AskStore
from ..store.requests import (
    Answer,
    Delete,
    ListHeadings,
    RenameRecording,
    TrimRecording,
)
from . import operations as op
from .descriptions import Fields, RecordingDescriptions
from .document import RecordingDocument
from .playing_back import PlayingBack
from .recorder import Recorder
from .run import Lost, Told
from .store_refusal import store_refusal

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
        self._playing = PlayingBack(cell, ask, tool, robot_name)
        self._cell = cell
        self._ask = ask

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
        by = self._cell.authority.holder
        assert by is not None, "checked above"
        return self._keep(asked.name, asker) or self._playing.play(asked, asker, by)

    def planned(self, planned: Planned) -> None:
        """Take note of what the plan of a playback says; the cell begins it."""
        self._playing.planned(planned)

    def news(self, news: News) -> list[Outgoing] | None:
        """Answer the request of a playback that began or was refused; see `PlayingBack.news`."""
        return self._playing.news(news)

    def dropped_by(self, news: News) -> list[Outgoing]:
        """Drop what is loaded to be played where news ends that; see `PlayingBack.dropped_by`."""
        return self._playing.dropped_by(news)

    def drop(self, refusal: Refusal) -> list[Outgoing]:
        """Drop what is loaded to be played, and tell who asked; nothing where nothing is."""
        return self._playing.drop(refusal)

    def tick(self, now: int) -> list[Outgoing]:
        """Go on with what waits for the store, and drop what may not be played any more."""
        return self._playing.tick(now) + self.recorder.tick(now)

    def shut_down(self) -> list[Outgoing]:
        """Have written what is recorded, and play nothing any more."""
        return self.drop(Refusal(VerdictCode.SHUTTING_DOWN)) + self.recorder.flush()


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
