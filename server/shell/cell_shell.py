"""Shell of one cell's core: hands it events, and carries out the effects that follow.

Owns the connections to the cell's controller, and that a fault of the cell stays with the cell:
the only `try` round a core (`CellShell`). Decides nothing itself.

Owns who answers which class of questions (`Outbox`), and notes the questions in the journal. Bytes
are noted where they are written, behind the secret mask of their connection.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from traceback import extract_tb
from typing import Any, TypeAlias, get_args

from openpendant.motion.description.robot import SerialRobot
from openpendant.simplemsg import ByteOrder, Message
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode

from ..access.access_backend import AccessBackend
from ..access.accounts import AccountChange
from ..access.admission import VerifyJob
from ..access.connection_loads import LoadQuestion
from ..core.cell_core import CellCore
from ..events.effects import (
    AnswerController,
    Ask,
    Broadcast,
    Cancel,
    Close,
    CutOff,
    Effect,
    HoldClient,
    LogLine,
    Notify,
    QueryController,
    Question,
    ReconnectController,
    ReleaseClient,
    Send,
    SendStop,
    SendToController,
    StorePlan,
    Then,
    WithdrawCheck,
)
from ..events.events import ClientEvent, ClientFailed, Event, NoticesMissed, Skipped
from ..journal.event_records import question_to_record
from ..planning.jobs import Job, Planner
from ..planning.plan_store import PlanStore
from ..settings.cell_settings import CellSettings, ControllerPath
from ..store.requests import Request
from ..store.store_client import StoreClient
from .client import Client
from .controller_connection import ControllerConnection

log = logging.getLogger("openpendant.server")


@dataclass(frozen=True, slots=True)
class CellParts:
    """A cell that a server is to serve.

    Attributes:
        planner: who plans for it; the server's planning processes where left out.
        plans: where its motions are kept; nowhere where left out.
    """

    settings: CellSettings
    robot: SerialRobot
    planner: Planner | None = None
    plans: PlanStore | None = None


class CellShell:
    """One cell of a running server.

    Attributes:
        label: begins the names of its links, so that those of several cells differ; empty for the
            only cell.
    """

    def __init__(
        self,
        core: CellCore,
        label: str,
        links: Mapping[ControllerPath, ControllerConnection],
        outbox: Outbox,
    ) -> None:
        """Join the parts of a cell; they are described above."""
        self.core = core
        self.label = label
        self.links = links
        self.outbox = outbox

    def deliver(self, event: Event, now: int) -> None:
        """Hand an event to the core, and carry out what follows."""
        skipped: list[int] = []
        try:
            out = self.core.handle(event, now)
            if out:
                skipped = self.outbox.perform(out)
        except Exception as error:
            if isinstance(event, ClientEvent):
                self.client_failed(event.session, error, now)
            else:
                self._fail(error, now)
        if skipped:
            self.deliver(Skipped(tuple(skipped)), now)
        if self.outbox.unnoticed:
            missed = tuple(self.outbox.unnoticed)
            self.outbox.unnoticed.clear()
            self.deliver(NoticesMissed(missed), now)

    def client_failed(self, session: int, error: Exception, now: int) -> None:
        """Stop the robot and part with a client that we failed on; say so in one line."""
        incident = f"{session}-{now // 1_000_000}"
        log.error(
            "incident %s: cell %s stopped, session %d closed: %s: %s (%s)",
            *(incident, self.core.name, session, type(error).__name__),
            *(" ".join(str(error).split()), _place_of(error)),
        )
        self.deliver(ClientFailed(session, incident), now)

    def _fail(self, error: Exception, now: int) -> None:
        """Stop the robot and part with everybody; say so once."""
        problem = f"{type(error).__name__}: {error}"
        entry = CATALOGUE[VerdictCode.CELL_FAULTED]
        log.error("cell %s: %s %s (%s)", self.core.name, entry.cause, entry.remedy, problem)
        log.info("cell %s: where it went wrong", self.core.name, exc_info=error)
        self.outbox.perform(self.core.fail(problem, now))

    def hang_up(self) -> None:
        """Close the connections to the controller because the server is going down."""
        for link in self.links.values():
            link.end()


def _place_of(error: Exception) -> str:
    """Return file and line where an error was raised; a user is shown no more of it."""
    frames = extract_tb(error.__traceback__)
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "nowhere"


Submit: TypeAlias = Callable[[Any, Callable[[Any], None]], None]
"""Takes a question, and who is to be told the answer."""


def backends(
    planner: Planner,
    store: StoreClient,
    access: AccessBackend,
    measure: Callable[[LoadQuestion, Callable[[Any], None]], None],
) -> Mapping[type[Question], Submit]:
    """Return who answers which class of questions."""
    return {
        **dict.fromkeys(get_args(Job), planner.submit),
        **dict.fromkeys(get_args(Request), store.submit),
        VerifyJob: access.check,
        AccountChange: access.change,
        LoadQuestion: measure,
    }


class Outbox:
    """The way out of a cell: messages to pendants, ROS-I clients and controller.

    Attributes:
        is_watched: the watchdog knows that this robot may move.
        unnoticed: connections that were too slow for a notice, until the core is told.
    """

    def __init__(
        self,
        journal: Journal,
        name: str,
        label: str,
        links: Mapping[ControllerPath, ControllerConnection],
        clients: Mapping[int, Client],
        planner: Planner,
        access: AccessBackend,
        submit: Mapping[type[Question], Submit],
        answered: Callable[[Ask, object], None],
        plans: PlanStore | None,
        watch: Callable[[], None] | None,
    ) -> None:
        """Join what effects are carried out with.

        Args:
            label: begins the names of its links; empty for the only cell.
            clients: all clients of the server by their numbers, as they come and go.
            planner: is told what nobody waits for any more.
            access: is told which password nobody waits for any more.
            answered: is told each question with its answer.
            plans: where motions are kept; None for nowhere.
            watch: tells the watchdog what may move now; None where there is none.
        """
        self.is_watched = False
        self.unnoticed: list[int] = []
        self._journal = journal
        self._name = name
        self._label = label
        self._links = links
        self._motion_link = links[ControllerPath.MOTION]
        self._clients = clients
        self._planner = planner
        self._access = access
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
                    if not self.is_watched and self._watch is not None:
                        # Before the first point leaves, lest the loop hang behind it.
                        self._watch()
                        self.is_watched = True
                    self._motion_link.send(message)
                case Broadcast(sessions=sessions, message=message):
                    self._broadcast(sessions, message, skipped)
                case Notify(sessions=sessions, message=message):
                    self._broadcast(sessions, message, self.unnoticed)
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
                case CutOff(session=session, reason=reason):
                    client = self._clients.get(session)
                    if client is not None:
                        client.abort(reason)
                case HoldClient(session=session):
                    client = self._clients.get(session)
                    if client is not None:
                        client.hold()
                case ReleaseClient(session=session):
                    client = self._clients.get(session)
                    if client is not None:
                        client.release()
                case ReconnectController(reason=reason):
                    self._motion_link.drop(reason)
                case Ask(question=question):
                    if self._journal.is_kept:
                        noted = question_to_record(question)
                        self._journal.out(f"{self._label}{item.backend.value}", noted)
                    self._submit[type(question)](question, partial(self._answered, item))
                case Cancel(id=number):
                    # Not in the journal: whether an answer came on its way is noted there.
                    self._planner.withdraw(number)
                case WithdrawCheck(id=number):
                    # Not in the journal either: what came of the check is noted there.
                    self._access.withdraw(number)
                case QueryController(message=message):
                    self._links[ControllerPath.STATE].send(message)
                case StorePlan(motion=motion):
                    if self._plans is not None:
                        self._plans.keep(motion)
                case Then(step=step):
                    skipped += self.perform(step())
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
            try:
                if client.is_clogged():
                    skipped.append(session)
                    continue
                wire = client.wire
                if frame is None or wire.byte_order is not order:
                    frame, order = wire.send(message), wire.byte_order
                client.write(frame)
            except Exception as error:
                client.failed(error)  # everybody else is told all the same
