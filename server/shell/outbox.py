"""The outbox of one cell: carries out the effects of its core, and notes them in the journal.

Owns who answers which class of questions. Bytes are noted where they are written, behind the secret
mask of their connection: `SentFrames`.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Protocol, TypeAlias, get_args

from openpendant.simplemsg import ByteOrder, Message
from openpendant.simplemsg.journal import Journal

from ..access.access_backend import AccessBackend
from ..access.accounts import AccountChange
from ..access.admission import VerifyJob
from ..events.effects import (
    AnswerController,
    Ask,
    Broadcast,
    Cancel,
    Close,
    Effect,
    LogLine,
    QueryController,
    Question,
    ReconnectController,
    Send,
    SendStop,
    SendToController,
    StorePlan,
)
from ..journal.event_records import question_to_bytes
from ..planning.jobs import Job, Planner
from ..planning.plan_store import PlanStore
from ..settings.cell_settings import ControllerPath
from ..store.requests import Request
from ..store.store_client import StoreClient
from .client import Client

log = logging.getLogger("openpendant.server")

Submit: TypeAlias = Callable[[Any, Callable[[Any], None]], None]
"""Takes a question, and who is to be told the answer."""


class SentFrames:
    """Notes the frames that leave."""

    def __init__(self, journal: Journal) -> None:
        """Note them in a journal."""
        self._journal = journal

    @property
    def are_noted(self) -> bool:
        """Whether they are written down, so that it pays to mask their secrets."""
        return self._journal.is_kept

    def note(self, link: str | int, frame: bytes) -> None:
        """Note a frame that leaves on a connection, without its secrets."""
        self._journal.out(link, frame)


class ControllerWriter(Protocol):
    """A connection to the controller; a `ControllerConnection` is one."""

    def send(self, message: Message) -> bool:
        """Write a message in one piece; tell whether there was a connection to write to."""

    def drop(self, reason: str) -> None:
        """Close the connection; it connects anew."""


def backends(
    planner: Planner, store: StoreClient, access: AccessBackend
) -> Mapping[type[Question], Submit]:
    """Return who answers which class of questions."""
    return {
        **dict.fromkeys(get_args(Job), planner.submit),
        **dict.fromkeys(get_args(Request), store.submit),
        VerifyJob: access.check,
        AccountChange: access.change,
    }


class Outbox:
    """What leaves a cell.

    Attributes:
        is_watched: the watchdog knows that this robot may move.
    """

    def __init__(
        self,
        journal: Journal,
        name: str,
        label: str,
        links: Mapping[ControllerPath, ControllerWriter],
        clients: Mapping[int, Client],
        planner: Planner,
        submit: Mapping[type[Question], Submit],
        answered: Callable[[Ask, object], None],
        plans: PlanStore | None,
        watch: Callable[[], None],
    ) -> None:
        """Join what effects are carried out with.

        Args:
            journal: the record.
            name: of the cell, for the log.
            label: begins the names of its links; empty for the only cell.
            links: the connections to the controller.
            clients: all clients of the server by their numbers, as they come and go.
            planner: is told what nobody waits for any more.
            submit: who answers which class of questions.
            answered: is told each question with its answer.
            plans: where motions are kept; None for nowhere.
            watch: tells the watchdog what may move now.
        """
        self.is_watched = False
        self._journal = journal
        self._name = name
        self._label = label
        self._links = links
        self._motion_link = links[ControllerPath.MOTION]
        self._clients = clients
        self._planner = planner
        self._submit = submit
        self._answered = answered
        self._plans = plans
        self._watch = watch

    def perform(self, outgoing: Sequence[Effect]) -> list[int]:
        """Carry out what the core asked for, in order.

        Returns:
            The connections that were too slow for a state message, once for each.
        """
        skipped: list[int] = []
        for item in outgoing:
            match item:
                case SendToController(message=message):
                    if not self.is_watched:
                        # Before the first point leaves, lest the loop hang behind it.
                        self._watch()
                        self.is_watched = True
                    self._motion_link.send(message)
                case Broadcast(sessions=sessions, message=message):
                    self._broadcast(sessions, message, skipped)
                case Send(session=session, message=message):
                    client = self._clients.get(session)
                    if client is not None:
                        client.send(message)
                case SendStop(message=message):
                    for path in (ControllerPath.STOP, ControllerPath.MOTION):
                        if path in self._links:
                            self._links[path].send(message)
                case AnswerController(path=path, message=message):
                    self._links[path].send(message)
                case Close(session=session, reason=reason):
                    client = self._clients.get(session)
                    if client is not None:
                        client.close(reason)
                case ReconnectController(reason=reason):
                    self._motion_link.drop(reason)
                case Ask(question=question):
                    if self._journal.is_kept:
                        noted = question_to_bytes(question)
                        self._journal.out(f"{self._label}{item.backend.value}", noted)
                    self._submit[type(question)](question, partial(self._answered, item))
                case Cancel(id=number):
                    # Not in the journal: whether an answer came on its way is noted there.
                    self._planner.withdraw(number)
                case QueryController(message=message):
                    self._links[ControllerPath.STATE].send(message)
                case StorePlan(motion=motion):
                    if self._plans is not None:
                        self._plans.keep(motion)
                case LogLine(text=text):
                    log.warning("cell %s: %s", self._name, text)
        return skipped

    def _broadcast(self, sessions: tuple[int, ...], message: Message, skipped: list[int]) -> None:
        """Write to all, encoded once for those in a row that speak alike; skip who reads slowly."""
        frame: bytes | None = None
        order: ByteOrder | None = None
        for session in sessions:
            client = self._clients.get(session)
            if client is None:
                continue
            if client.is_clogged():
                skipped.append(session)
                continue
            wire = client.wire
            if frame is None or wire.byte_order is not order:
                frame, order = wire.send(message), wire.byte_order
            client.write(frame)
