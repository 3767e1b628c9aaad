"""A pendant server that lives through its journal again: the real application, nothing outside."""

from __future__ import annotations

import dataclasses
from typing import Any

from pydantic import ValidationError

from openpendant.motion.errors import MotionError
from openpendant.motion.robot import serial_robot
from openpendant.server.app import App
from openpendant.server.client_connection import ClientConnection
from openpendant.server.controller_path import ControllerPath
from openpendant.server.core import Port
from openpendant.server.jobs import Job
from openpendant.server.management import snapshot
from openpendant.server.plan_record import PlanRecordError, plan_from_json
from openpendant.server.planning_process import Deliver
from openpendant.server.settings import CellSettings

from .journal_file import Happening, Header, JournalError
from .reenactment import DeadEnd, Prompter, unknown_event


class _NotedPlanner:
    """Plans nothing: the answers are in the journal."""

    def __init__(self) -> None:
        self.jobs: dict[int, Job] = {}

    def submit(self, job: Job, deliver: Deliver) -> None:
        self.jobs[job.job_id] = job


class ReenactedServer:
    """The server of a journal; needs a running loop, which never gets to run anything."""

    def __init__(self, header: Header, prompter: Prompter) -> None:
        """Build the server that wrote the journal.

        Raises:
            JournalError: its settings or its robot cannot be used here.
        """
        try:
            settings = CellSettings.model_validate(header.settings)
            robot = serial_robot(settings.robot)
        except ValidationError as error:
            first = error.errors(include_url=False, include_context=False)[0]
            where = ".".join(str(part) for part in first["loc"])
            raise JournalError(f"its settings: {where}: {first['msg']}") from None
        except MotionError as error:
            raise JournalError(f"its robot: {error}") from None
        self._settings = settings
        self._prompter = prompter
        self._planner = _NotedPlanner()
        self._app = App(settings, robot, planner=self._planner, journal=prompter)
        self._clients: dict[str, ClientConnection] = {}
        self._paths = {path.name.lower(): path for path in ControllerPath}

    def play(self, happening: Happening) -> None:
        """Let an event happen."""
        app, link = self._app, happening.link
        match happening.event:
            case "tick":
                app.tick()
            case "in" if link in self._paths:
                app.links[self._paths[link]].data_received(happening.data)
            case "in":
                self._client(happening).data_received(happening.data)
            case "opened":
                self._open(happening)
            case "closed":
                self._client(happening).connection_lost(None)
                del self._clients[link]
            case "up" if link in self._paths:
                app.links[self._paths[link]].connection_made(DeadEnd())
            case "down" if link in self._paths:
                app.links[self._paths[link]].connection_lost(None)
            case "planned":
                self._take_plan(happening)
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
        except KeyError:
            raise unknown_event(happening) from None
        client = self._clients[happening.link] = ClientConnection(self._app, port)
        client.connection_made(DeadEnd(address))

    def _client(self, happening: Happening) -> ClientConnection:
        client = self._clients.get(happening.link)
        if client is None:
            raise JournalError(f"event {happening.number}: link {happening.link} was never opened")
        return client

    def _take_plan(self, happening: Happening) -> None:
        job = self._planner.jobs.get(int(happening.link)) if happening.link.isdigit() else None
        if job is None:
            raise JournalError(f"event {happening.number}: an answer to no planning job")
        limits = self._app.core.cell.limits
        try:
            planned = plan_from_json(job.job_id, happening.more, limits, job.start)
        except PlanRecordError as error:
            raise JournalError(f"event {happening.number}: {error}") from None
        self._app.take_plan(planned)

    def state(self) -> dict[str, Any]:
        """Return what the server knows: the snapshot of its cell, and the controller's report."""
        cell, now = self._app.core.cell, self._prompter.now
        feedback = cell.feedback
        status = feedback.status
        request = cell.request
        return {
            **snapshot(cell, self._settings, now).model_dump(mode="json", exclude={"joints"}),
            "joint_position": None if feedback.position is None else list(feedback.position),
            "controller_status": None
            if status is None
            else {name: int(getattr(status, name)) for name in status.FIELDS},
            "request": None if request is None else dataclasses.asdict(request),
            "clients": {
                link: f"{client.port.value} from {client.address}"
                for link, client in self._clients.items()
            },
        }
