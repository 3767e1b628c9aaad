"""A pendant server that lives through its journal again: the real application, nothing outside."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial
from typing import Any

from pydantic import ValidationError

from openpendant.motion.errors import MotionError
from openpendant.motion.robot import serial_robot
from openpendant.server.access.account_changes import AccountChange
from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.door import AbsentAccess, DeliverChange
from openpendant.server.access.password_worker import Deliver as DeliverCheck
from openpendant.server.access.record import (
    AccessRecordError,
    book_from_json,
    check_from_json,
    outcome_from_json,
)
from openpendant.server.app import App
from openpendant.server.cell_shell import CellShell, ServedCell
from openpendant.server.client_connection import ClientConnection
from openpendant.server.core import Port
from openpendant.server.errand_record import ErrandRecordError, answer_from_json
from openpendant.server.pendant.snapshot import snapshot
from openpendant.server.planning.jobs import Job
from openpendant.server.planning.plan_record import PlanRecordError, plan_from_json
from openpendant.server.planning.task import Deliver
from openpendant.server.refusal import Refusal
from openpendant.server.settings import CellSettings
from openpendant.server.store.requests import Answer, Request

from .journal_file import Happening, Header, JournalError
from .reenactment import DeadEnd, Prompter, unknown_event, unusable_settings


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


class _NotedAccess(AbsentAccess):
    """Checks no password and changes no account: what came of it is in the journal."""

    def __init__(self) -> None:
        super().__init__()
        self.checks: dict[str, Callable[[bool | None], None]] = {}
        self.changes: dict[str, Callable[[Refusal | None], None]] = {}

    def check(self, job: VerifyJob, deliver: DeliverCheck) -> None:
        """Keep who waits for the outcome."""
        self.checks[str(job.job_id)] = partial(deliver, job)

    def change(self, change: AccountChange, deliver: DeliverChange) -> None:
        """Keep who waits for the outcome."""
        self.changes[str(change.number)] = partial(deliver, change)

    def play(self, app: App, happening: Happening) -> None:
        """Let one of the events happen that come from here.

        Raises:
            JournalError: nobody waits for it, or it is damaged.
        """
        number = happening.link.rpartition("/")[2]
        try:
            match happening.event:
                case "accounts":
                    self.book, self.single_user = book_from_json(happening.more)
                    app.take_accounts()
                case "checked":
                    self.checks.pop(number)(check_from_json(happening.more))
                case "account":
                    self.changes.pop(number)(outcome_from_json(happening.more))
        except AccessRecordError as error:
            raise JournalError(f"event {happening.number}: {error}") from None
        except KeyError:
            raise JournalError(f"event {happening.number}: nobody waits for it") from None


class ReenactedServer:
    """The server of a journal; needs a running loop, which never gets to run anything."""

    def __init__(self, header: Header, prompter: Prompter) -> None:
        """Build the server that wrote the journal.

        Raises:
            JournalError: its settings or its robot cannot be used here.
        """
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
        self._prompter = prompter
        self._planners = [_NotedPlanner() for _ in robots]
        parts = zip(self._settings, robots, self._planners, strict=True)
        self._access = _NotedAccess()
        served = [ServedCell(*each) for each in parts]
        self._app = App(served, prompter, _NotedStore(), access=self._access)
        self._clients: dict[str, ClientConnection] = {}
        self._links = {link.link: link for cell in self._app.cells for link in cell.links.values()}

    def play(self, happening: Happening) -> None:
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
                self._links[link].connection_made(DeadEnd())
            case "down" if link in self._links:
                self._links[link].connection_lost(None)
            case "planned":
                self._take_plan(happening)
            case "stored":
                self._take_answer(happening)
            case "accounts" | "checked" | "account":
                self._access.play(app, happening)
            case "shut-down":
                app.shut_down()
            case "hang-up":
                app.hang_up()
            case _:
                raise unknown_event(happening)

    def _open(self, happening: Happening) -> None:
        try:
            port = Port[happening.more["port"]]
            address = str(happening.more["address"])
            cell = happening.more.get("cell")
        except KeyError:
            raise unknown_event(happening) from None
        client = self._clients[happening.link] = ClientConnection(self._app.clients, port, cell)
        client.connection_made(DeadEnd(address))

    def _client(self, happening: Happening) -> ClientConnection:
        client = self._clients.get(happening.link)
        if client is None:
            raise JournalError(f"event {happening.number}: link {happening.link} was never opened")
        return client

    def _take_plan(self, happening: Happening) -> None:
        cell, job = self._planned_for(happening.link)
        if cell is None or job is None:
            raise JournalError(f"event {happening.number}: an answer to no planning job")
        limits = cell.core.cell.limits
        try:
            planned = plan_from_json(job.job_id, happening.more, limits, job.start)
        except PlanRecordError as error:
            raise JournalError(f"event {happening.number}: {error}") from None
        cell.take_plan(planned)

    def _take_answer(self, happening: Happening) -> None:
        for cell in self._app.cells:
            number = happening.link.removeprefix(cell.label)
            if happening.link.startswith(cell.label) and number.isdigit():
                break
        else:
            raise JournalError(f"event {happening.number}: an answer to no question to the store")
        try:
            answer = answer_from_json(happening.more)
        except ErrandRecordError as error:
            raise JournalError(f"event {happening.number}: {error}") from None
        cell.take_answer(int(number), answer)

    def _planned_for(self, link: str) -> tuple[CellShell | None, Job | None]:
        """Return whose job an answer is for, and the job."""
        for cell, planner in zip(self._app.cells, self._planners, strict=True):
            if link.startswith(cell.label) and link.removeprefix(cell.label) in planner.jobs:
                return cell, planner.jobs[link.removeprefix(cell.label)]
        return None, None

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
        cell, now = shell.core.cell, self._prompter.now
        feedback = cell.feedback
        status = feedback.status
        request = cell.request
        return {
            **snapshot(cell, settings, now).model_dump(mode="json", exclude={"joints"}),
            "joint_position": None if feedback.position is None else list(feedback.position),
            "controller_status": None
            if status is None
            else {name: int(getattr(status, name)) for name in status.FIELDS},
            "request": None if request is None else dataclasses.asdict(request),
        }
