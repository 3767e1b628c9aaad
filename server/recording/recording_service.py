"""Recording service for pendants: start, stop, list, trim, play.

Owns the order of the checks of a request and its answers. `recorder` owns the kept samples,
`recording_playback` their playback.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from typing import Any, cast

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
from ..store.documents import DocumentKind, Heading
from ..store.recording_format import RecordingDocument
from ..store.requests import (
    Answer,
    Delete,
    ListHeadings,
    RenameRecording,
    TrimRecording,
)
from .recorder import Lost, Recorder, Told, store_refusal
from .recording_playback import RecordingPlayback
from .recording_survey import Fields, RecordingDescriptions

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
        begun = self.recorder.start(asked.name, reply.name, _tell(reply), _tell_loss(reply))
        return reply.refuse(begun) if isinstance(begun, Refusal) else begun

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

        def told(lines: list[Fields], at: int) -> list[Effect]:
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

        return self._descriptions.lines(headings[first : first + _MOST_LISTED], told, now)

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


def _tell(reply: ReplyTo[op.RecordingMade]) -> Told:
    def told(ended: RecordingDocument | Refusal, now: int) -> list[Effect]:
        if isinstance(ended, Refusal):
            return reply.refuse(ended)
        return reply.answer(cast(op.RecordingMade, ended.model_dump()))

    return told


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
