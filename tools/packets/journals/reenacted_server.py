"""Reenacted pendant server: the real application, fed from its journal, with no I/O."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pydantic import ValidationError

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import MotionError
from openpendant.server.access.access_backend import DeliverChange, DeliverCheck
from openpendant.server.access.accounts import AccountBook, AccountChange
from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.audit import AuditEntry
from openpendant.server.endpoints.pendant.management import snapshot
from openpendant.server.events.effects import Ask, Backend
from openpendant.server.events.events import Port
from openpendant.server.journal.event_records import (
    ANSWERED,
    AnswerRecordError,
    answer_from_record,
    book_from_json,
)
from openpendant.server.planning.jobs import Deliver, Job
from openpendant.server.settings.cell_settings import CellSettings
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts, CellShell
from openpendant.server.shell.client_connection import ClientConnection
from openpendant.server.store.requests import Answer, Request

from .journal_file import Header, JournalError, JournalEvent
from .reenactment import (
    NullTransport,
    ReplayedJournal,
    is_number,
    unknown_event,
    unusable_settings,
)

_BACKENDS = {event: backend for backend, event in ANSWERED.items()}


class _NotedPlanner:
    """Plans nothing: the answers are in the journal."""

    def __init__(self) -> None:
        self.jobs: dict[str, Job] = {}

    def submit(self, job: Job, deliver: Deliver) -> None:
        self.jobs[str(job.job_id)] = job

    def withdraw(self, job_id: int) -> None:
        """Keep the job: journals of older servers have answers to such jobs, too."""


class _NotedStore:
    """Keeps nothing: the answers are in the journal."""

    def submit(self, request: Request, on_done: Callable[[Answer], None]) -> None:
        """Leave the request unanswered."""


class _NotedAccess:
    """Checks no password and changes no account: what came of it is in the journal."""

    def __init__(self) -> None:
        self.single_user = True
        self.book = AccountBook()

    def record(self, entry: AuditEntry) -> None:
        """Forget an entry."""

    def check(self, job: VerifyJob, deliver: DeliverCheck) -> None:
        """Leave the password unchecked."""

    def withdraw(self, job_id: int) -> None:
        """Take nothing back: what came of it is in the journal."""

    def change(self, change: AccountChange, deliver: DeliverChange) -> None:
        """Leave the account as it is."""

    async def keep_up(self, on_change: Callable[[], None]) -> None:
        """Read nothing: what is in force is in the journal."""


class ReenactedServer:
    """The server of a journal; needs a running loop, which never gets to run anything."""

    def __init__(self, header: Header, replayed: ReplayedJournal) -> None:
        """Build the server that wrote the journal; JournalError where it cannot be had here."""
        about = header.settings.get("cells", [header.settings])
        if not isinstance(about, list) or not about:
            raise JournalError("its settings: cells: expected a list of cells")
        try:
            self._settings = [CellSettings.model_validate(cell) for cell in about]
            robots = [serial_robot(cell.robot) for cell in self._settings]
        except ValidationError as error:
            raise unusable_settings(error) from None
        except MotionError as error:
            raise JournalError(f"its robot: {error}") from None
        self._journal = replayed
        self._planners = [_NotedPlanner() for _ in robots]
        parts = zip(self._settings, robots, self._planners, strict=True)
        self._access = _NotedAccess()
        served = [CellParts(*each) for each in parts]
        self._app = App(served, replayed, _NotedStore(), self._access, clock=lambda: replayed.now)
        self._clients: dict[str, ClientConnection] = {}
        self._links = {link.link: link for cell in self._app.cells for link in cell.links.values()}

    def play(self, happening: JournalEvent) -> None:
        """Let an event happen."""
        app, link = self._app, happening.link
        match happening.event:
            case "tick":
                app.tick()
            case "in" if link in self._links:
                self._links[link].data_received(happening.data)
            case "in":
                self._client(happening).data_received(happening.data)
            case "opened":
                self._open(happening)
            case "closed":
                self._client(happening).connection_lost(None)
                del self._clients[link]
            case "up" if link in self._links:
                self._links[link].connection_made(NullTransport())
            case "down" if link in self._links:
                self._links[link].connection_lost(None)
            case "accounts":
                self._take_accounts(happening)
            case event if event in _BACKENDS:
                self._take_answer(happening)
            case "shut-down":
                app.shut_down()
            case "hang-up":
                app.hang_up()
            case _:
                raise unknown_event(happening)

    def _open(self, happening: JournalEvent) -> None:
        try:
            port = Port[happening.more["port"]]
            address = str(happening.more["address"])
            cell = happening.more.get("cell")
        except (KeyError, TypeError):
            raise unknown_event(happening) from None
        if cell is not None and (type(cell) is not int or not 0 <= cell < len(self._settings)):
            raise JournalError(f"event {happening.number}: there is no such cell")
        client = self._clients[happening.link] = self._app.connect(port, cell)
        client.connection_made(NullTransport(address))

    def _client(self, happening: JournalEvent) -> ClientConnection:
        client = self._clients.get(happening.link)
        if client is None:
            raise JournalError(f"event {happening.number}: link {happening.link} was never opened")
        return client

    def _take_accounts(self, happening: JournalEvent) -> None:
        access = self._access
        try:
            access.book, access.single_user = book_from_json(happening.more)
        except AnswerRecordError as error:
            raise JournalError(f"event {happening.number}: {error}") from None
        self._app.take_accounts()

    def _take_answer(self, happening: JournalEvent) -> None:
        found = self._asked(happening)
        if found is None:
            raise JournalError(f"event {happening.number}: an answer that nobody waits for")
        number, asked = found
        limits = self._app.cells[number].core.cell.limits
        try:
            answer = answer_from_record(asked, happening.more, limits)
        except AnswerRecordError as error:
            raise JournalError(f"event {happening.number}: {error}") from None
        self._app.inbox.answered(number, asked, answer)

    def _asked(self, happening: JournalEvent) -> tuple[int, Ask] | None:
        """Return the question that an answer is to, and whose it is."""
        backend, link = _BACKENDS[happening.event], happening.link
        for at, (cell, planner) in enumerate(zip(self._app.cells, self._planners, strict=True)):
            number = link.removeprefix(cell.label)
            if not link.startswith(cell.label) or not is_number(number):
                continue
            asked = cell.core.asked(backend, int(number))
            if asked is None and backend is Backend.PLANNER and number in planner.jobs:
                asked = Ask(int(number), planner.jobs[number])
            return None if asked is None else (at, asked)
        return None

    def state(self) -> dict[str, Any]:
        """Return what the server knows of its cell, or of each of several, and its clients."""
        cells = [
            self._cell_state(cell, settings)
            for cell, settings in zip(self._app.cells, self._settings, strict=True)
        ]
        about = cells[0] if len(cells) == 1 else {"cells": cells}
        clients = {
            link: f"{client.port.value} from {client.address}"
            for link, client in self._clients.items()
        }
        return {**about, "clients": clients}

    def _cell_state(self, shell: CellShell, settings: CellSettings) -> dict[str, Any]:
        """Return the snapshot of a cell, and its controller's report."""
        cell, now = shell.core.cell, self._journal.now
        feedback = cell.feedback
        status = feedback.status
        request = cell.driving.request
        return {
            **snapshot(cell, settings, now).model_dump(mode="json", exclude={"joints"}),
            "joint_position": None if feedback.position is None else list(feedback.position),
            "controller_status": None
            if status is None
            else {name: int(getattr(status, name)) for name in status.FIELDS},
            "request": None
            if request is None
            else {name: getattr(request, name) for name in ("session", "request_id", "program")},
        }
