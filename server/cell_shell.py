"""The shell round one cell's core: carries out what it asks for, and decides nothing itself.

Owns the connections to the cell's controller, and that a fault of the cell stays with the cell.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from traceback import extract_tb

from openpendant.motion.robot import SerialRobot
from openpendant.simplemsg import ByteOrder, Message, Received
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode

from .access.account_changes import AccountChange
from .access.admission import VerifyJob
from .access.door import AccessDoor
from .access.record import outcome_to_json
from .client_connection import ClientConnection
from .controller_connection import ControllerConnection
from .controller_path import ControllerPath
from .core import ServerCore
from .errand_record import answer_to_json, request_to_bytes
from .outgoing import (
    Answer,
    ChangeAccount,
    CheckPassword,
    Close,
    DropLink,
    Errand,
    Forward,
    ForwardStop,
    Keep,
    Outgoing,
    Plan,
    Query,
    Send,
    Spread,
    Warn,
    Withdraw,
)
from .planning.jobs import Planned
from .planning.plan_record import plan_to_json
from .planning.plan_store import PlanStore
from .planning.task import Planner
from .refusal import Refusal
from .settings import CellSettings
from .store.door import StoreDoor
from .store.requests import Answer as StoreAnswer

log = logging.getLogger("openpendant.server")


@dataclass(frozen=True, slots=True)
class ServedCell:
    """A cell that a server is to serve.

    Attributes:
        settings: its configuration.
        robot: its robot.
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
        core: its pure core.
        journal: tells the time of the event at hand.
        label: begins the names of its links, so that those of several cells differ; empty for the
            only cell.
        links: the connections to the controller.
    """

    def __init__(
        self,
        served: ServedCell,
        core: ServerCore,
        planner: Planner,
        journal: Journal,
        clients: Mapping[int, ClientConnection],
        store: StoreDoor,
        access: AccessDoor,
        label: str = "",
    ) -> None:
        """Join the parts of a cell.

        Args:
            served: the cell.
            core: its core.
            planner: who plans for it.
            journal: the time and the record.
            clients: all clients of the server by their numbers, as they come and go.
            store: keeps the documents of all cells.
            access: checks passwords and changes accounts.
            label: see the attribute.
        """
        self.core = core
        self.journal = journal
        self.label = label
        self._planner = planner
        self._plans = served.plans
        self._clients = clients
        self._store = store
        self._access = access
        link = served.settings.controller
        paths = [ControllerPath.MOTION, ControllerPath.STATE]
        if link.stop_connection:
            paths.append(ControllerPath.STOP)
        self.links = {path: ControllerConnection(self, path, link) for path in paths}
        self._motion_link = self.links[ControllerPath.MOTION]

    def perform(self, outgoing: list[Outgoing]) -> None:
        """Carry out what the core asked for, in order."""
        for item in outgoing:
            match item:
                case Forward(message=message):
                    self._motion_link.send(message)
                case Spread(sessions=sessions, message=message):
                    self._spread(sessions, message)
                case Send(session=session, message=message):
                    client = self._clients.get(session)
                    if client is not None:
                        client.send(message)
                case ForwardStop(message=message):
                    for path in (ControllerPath.STOP, ControllerPath.MOTION):
                        if path in self.links:
                            self.links[path].send(message)
                case Answer(path=path, message=message):
                    self.links[path].send(message)
                case Close(session=session, reason=reason):
                    client = self._clients.get(session)
                    if client is not None:
                        client.close(reason)
                case DropLink(reason=reason):
                    self._motion_link.drop(reason)
                case Plan(job=job):
                    if self.journal.is_kept:
                        self.journal.out(f"{self.label}planner", repr(job).encode())
                    self._planner.submit(job, self.take_plan)
                case Withdraw(job_id=job_id):
                    # Not in the journal: whether an answer came on its way is noted there.
                    self._planner.withdraw(job_id)
                case Errand(errand_id=errand_id, request=request):
                    if self.journal.is_kept:
                        self.journal.out(f"{self.label}store", request_to_bytes(request))
                    self._store.submit(request, partial(self.take_answer, errand_id))
                case Query(message=message):
                    self.links[ControllerPath.STATE].send(message)
                case CheckPassword(job=job):
                    if self.journal.is_kept:
                        self.journal.out(f"{self.label}passwords", repr(job).encode())
                    self._access.check(job, self.take_password_check)
                case ChangeAccount(change=change):
                    if self.journal.is_kept:
                        self.journal.out(f"{self.label}accounts", repr(change).encode())
                    self._access.change(change, self.take_account_change)
                case Warn(text=text):
                    log.warning("cell %s: %s", self.core.name, text)
                case Keep(motion=motion):
                    if self._plans is not None:
                        self._plans.keep(motion)

    def _spread(self, sessions: tuple[int, ...], message: Message) -> None:
        """Write to all, encoded once for those in a row that speak alike; skip who reads slowly."""
        frame: bytes | None = None
        order: ByteOrder | None = None
        for session in sessions:
            client = self._clients.get(session)
            if client is None:
                continue
            if client.is_clogged():
                self.core.skipped(session)
                continue
            wire = client.wire
            if frame is None or wire.byte_order is not order:
                frame, order = wire.send(message), wire.byte_order
            client.write(frame)

    # Events; what goes wrong in one ends this cell and no other.

    def tick(self, now: int) -> None:
        """Run one control tick."""
        try:
            self.perform(self.core.tick(now))
        except Exception as error:
            self._fail(error, now)

    def hear(self, path: ControllerPath, received: Received, pending: int, now: int) -> None:
        """Hand a message of the controller to the core."""
        try:
            out = self.core.on_controller(path, received, pending, now)
            if out:
                self.perform(out)
        except Exception as error:
            self._fail(error, now)

    def garbled(self, path: ControllerPath, problem: str, now: int) -> None:
        """Tell the core that a controller's bytes make no sense any more."""
        try:
            self.perform(self.core.controller_fault(path, problem, now))
        except Exception as error:
            self._fail(error, now)

    def path_changed(self, path: ControllerPath, up: bool, now: int) -> None:
        """Tell the core that a connection to the controller came or went."""
        try:
            self.perform(self.core.controller_path(path, up, now))
        except Exception as error:
            self._fail(error, now)

    def take_answer(self, errand_id: int, answer: StoreAnswer) -> None:
        """Hand the store's answer to the core."""
        record = answer_to_json(answer) if self.journal.is_kept else {}
        now = self.journal.begin("stored", f"{self.label}{errand_id}", **record)
        try:
            self.perform(self.core.errand_done(errand_id, answer, now))
        except Exception as error:
            self._fail(error, now)

    def take_password_check(self, job: VerifyJob, is_right: bool | None) -> None:
        """Hand the outcome of a password check to the core."""
        now = self.journal.begin("checked", f"{self.label}{job.job_id}", right=is_right)
        try:
            self.perform(self.core.password_checked(job.job_id, is_right, now))
        except Exception as error:
            self._fail(error, now)

    def take_account_change(self, change: AccountChange, refusal: Refusal | None) -> None:
        """Hand the outcome of a change of an account to the core."""
        link, record = f"{self.label}{change.number}", outcome_to_json(refusal)
        now = self.journal.begin("account", link, **record)
        try:
            self.perform(self.core.account_changed(change.number, refusal, now))
        except Exception as error:
            self._fail(error, now)

    def regrant(self, session: int, now: int) -> None:
        """Tell the core that a connection may do other things from now on."""
        try:
            self.perform(self.core.regranted(session, now))
        except Exception as error:
            self._fail(error, now)

    def take_plan(self, planned: Planned) -> None:
        """Hand the planner's answer to the core."""
        record = plan_to_json(planned) if self.journal.is_kept else {}
        now = self.journal.begin("planned", f"{self.label}{planned.job_id}", **record)
        try:
            self.perform(self.core.planned(planned, now))
        except Exception as error:
            self._fail(error, now)

    def shut_down(self, now: int) -> None:
        """Have the robot stopped because the server is going down."""
        try:
            self.perform(self.core.shut_down(now))
        except Exception as error:
            self._fail(error, now)

    def misheard(self, session: int, error: Exception, now: int) -> None:
        """Stop the robot and part with a client whose message we failed on; say so in one line."""
        incident = f"{session}-{now // 1_000_000}"
        log.error(
            "incident %s: cell %s stopped, session %d closed: %s: %s (%s)",
            *(incident, self.core.name, session, type(error).__name__),
            *(" ".join(str(error).split()), _place_of(error)),
        )
        try:
            self.perform(self.core.misheard(session, incident, now))
        except Exception as further:
            self._fail(further, now)

    def _fail(self, error: Exception, now: int) -> None:
        """Stop the robot and part with everybody; say so once."""
        problem = f"{type(error).__name__}: {error}"
        entry = CATALOGUE[VerdictCode.CELL_FAULTED]
        log.error("cell %s: %s %s (%s)", self.core.name, entry.cause, entry.remedy, problem)
        log.info("cell %s: where it went wrong", self.core.name, exc_info=error)
        self.perform(self.core.fail(problem, now))

    def hang_up(self) -> None:
        """Close the connections to the controller because the server is going down."""
        for link in self.links.values():
            link.end()


def _place_of(error: Exception) -> str:
    """Return file and line where an error was raised; a user is shown no more of it."""
    frames = extract_tb(error.__traceback__)
    return f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "nowhere"
