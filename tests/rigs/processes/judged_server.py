"""A pendant server on the loop of the test, with an emulator behind it, ready to be judged."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from rigs.processes.bare_app import bare_app

from openpendant.controller_emulator.shell.build import build_controller
from openpendant.controller_emulator.shell.service import Service
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.motion.description.robot import serial_robot
from openpendant.server.planning.jobs import Deliver, Job
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.settings.cell_settings import CellSettings, make_settings
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.watchdog.watchdog_process import Watchdog
from openpendant.simplemsg.journal import Journal
from openpendant.tools.packets.conformance.check import Profile, Section
from openpendant.tools.packets.conformance.server.target import Options

ROBOT = "ur5"
HOST = "127.0.0.1"
_PLANNING = 0.02

USUAL_RATE = 100
"""Reports of an emulator and ticks of a server as they come [1/s]."""

HALF_RATE = USUAL_RATE // 2
"""Enough to judge by, at less work."""

PARTS = (
    (Section.FRAMING, Section.HEADER, Section.BYTE_ORDER, Section.REPLIES),
    (Section.TOPICS, Section.STATUS),
    # What is asked beyond the limits is asked only of a robot that was seen to move slowly.
    (Section.MOTION, Section.LIMITS),
    (Section.STOP, Section.LINK),
    (Section.PENDANT,),
)
"""Sections of the standard dialect that are judged together; none of these parts takes long."""


class LoopPlanner:
    """Plans on the loop and answers a little later, as the planning process would."""

    def __init__(self) -> None:
        self._deliveries: dict[int, asyncio.TimerHandle] = {}

    def submit(self, job: Job, deliver: Deliver) -> None:
        planned, loop = answer(ROBOT, job), asyncio.get_running_loop()
        self._deliveries[job.job_id] = loop.call_later(_PLANNING, deliver, planned)

    def withdraw(self, job_id: int) -> None:
        self._deliveries[job_id].cancel()


def served_cell(
    journal: Journal | None = None, watchdog: Watchdog | None = None, **tables: Any
) -> tuple[App, CellSettings]:
    """Return a server of one cell and its settings; on free ports unless `listen` says others."""
    ports = {"pendant_port": 0, "ros_motion_port": 0, "ros_state_port": 0}
    tables["listen"] = {**ports, **tables.get("listen", {})}
    settings = make_settings({"robot": ROBOT, **tables}, "test")
    cell = CellParts(settings, serial_robot(ROBOT), LoopPlanner())
    return bare_app([cell], journal, watchdog=watchdog), settings


@asynccontextmanager
async def running_emulator(**settings: object) -> AsyncIterator[Options]:
    """Run an emulated robot; yields how to judge it."""
    values = {"robot": ROBOT, "motion_port": 0, "state_port": 0, **settings}
    checked = EmulatorSettings.model_validate(values)
    now = round(asyncio.get_running_loop().time() * 1e9)
    service = Service(build_controller(checked, now), checked)
    ports = await service.start()
    try:
        yield Options(
            HOST,
            ports.motion,
            ports.state,
            real_size=checked.real_size,
            may_move=True,
            limits=serial_robot(ROBOT).limits,
        )
    finally:
        await service.close()
        await asyncio.sleep(0)


@asynccontextmanager
async def running_server(rate: int = USUAL_RATE) -> AsyncIterator[Options]:
    """Run a server with an emulated robot behind it; yields how to judge its three ports.

    Args:
        rate: reports of the emulator and ticks of the server [1/s].
    """
    async with running_emulator(rate=rate) as emulator:
        link = {"motion_port": emulator.motion_port, "state_port": emulator.state_port}
        app, settings = served_cell(tick_rate=rate, controller=link)
        async with app.running() as ports:
            await asyncio.sleep(0.5)
            ros = ports.ros[settings.name]
            assert ros.motion is not None
            assert ros.state is not None
            yield Options(
                HOST,
                ros.motion,
                ros.state,
                ports.pendant,
                profile=Profile.GENERIC,
                may_move=True,
                limits=emulator.limits,
            )
