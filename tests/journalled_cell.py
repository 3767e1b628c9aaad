"""An emulator, a server and a pendant on one virtual loop, both processes keeping a journal."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from openpendant.controller_emulator import cli as emulator_cli
from openpendant.controller_emulator.assembly import build_controller
from openpendant.controller_emulator.service import Service, loop_time
from openpendant.controller_emulator.settings import EmulatorSettings
from openpendant.motion.robot import serial_robot
from openpendant.server import app as server_app
from openpendant.server import cli as server_cli
from openpendant.server.app import App
from openpendant.server.jobs import Job
from openpendant.server.planning import answer
from openpendant.server.planning_process import Deliver
from openpendant.server.settings import make_settings
from openpendant.simplemsg.journal import Journal
from openpendant.tools.pendants.client import PendantClient

ROBOT = "ur5"


class PlannerInLine:
    """Plans at once, and delivers as late as a real planner would."""

    def submit(self, job: Job, deliver: Deliver) -> None:
        planned = answer(ROBOT, job)
        asyncio.get_running_loop().call_later(0.03, deliver, planned)


@dataclass
class JournalledCell:
    """Both processes and their journals.

    Attributes:
        service: the emulator.
        app: the server.
        pendant_port: where the server listens for pendants.
    """

    service: Service
    app: App
    pendant_port: int

    async def pendant(self) -> PendantClient:
        pendant = await PendantClient.connect("127.0.0.1", self.pendant_port, state_rate=50)
        await pendant.wait_until(lambda state: state.motion_possible == 1)
        return pendant


@asynccontextmanager
async def journalled_cell(emulator_file: Path, server_file: Path) -> AsyncIterator[JournalledCell]:
    """Run a cell and keep both journals until the context is left."""
    loop = asyncio.get_running_loop()
    emulator = EmulatorSettings.model_validate({"motion_port": 0, "state_port": 0})
    first = Journal(lambda: loop_time(loop))
    with emulator_cli.kept_journal(first, emulator_file, emulator):
        service = Service(build_controller(emulator, first.now), emulator, journal=first)
        ports = await service.start()
        link = {"host": "127.0.0.1", "motion_port": ports.motion, "state_port": ports.state}
        listen = {"pendant_port": 0, "ros_motion_port": 0, "ros_state_port": 0}
        values = {"robot": ROBOT, "controller": link, "listen": listen}
        settings = make_settings(values, "test")
        second = Journal(server_app.loop_time)
        app = App(settings, serial_robot(ROBOT), planner=PlannerInLine(), journal=second)
        with server_cli.kept_journal(second, server_file, settings):
            async with app.running() as listening:
                yield JournalledCell(service, app, listening.pendant)
        await service.close()
        await asyncio.sleep(0.01)
