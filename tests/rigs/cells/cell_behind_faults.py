"""An emulator, a fault proxy in front of both its ports, a server and a pendant on one loop."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from rigs.cells.journalled_cell import ROBOT, PlannerInLine
from rigs.processes.bare_app import bare_app

from openpendant.controller_emulator.shell.build import build_controller
from openpendant.controller_emulator.shell.service import Service, loop_time
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.motion.description.robot import serial_robot
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.shell.cell_shell import CellParts
from openpendant.tools.packets.faults import FaultProxy
from openpendant.tools.packets.faulty.fault_script import load_script
from openpendant.tools.packets.live.endpoints import Endpoint
from openpendant.tools.packets.live.proxy import Pair
from openpendant.tools.pendants.client import PendantClient

HOST = "127.0.0.1"
_ANY_PORTS = {"pendant_port": 0, "ros_motion_port": 0, "ros_state_port": 0}


@dataclass
class FaultedCell:
    """A cell whose controller is behind a line that does what a script says.

    Attributes:
        proxy: counts the faults that were done.
    """

    service: Service
    proxy: FaultProxy
    pendant_port: int

    def violations(self) -> dict[str, int]:
        counts = self.service.controller.referee.counts
        return {kind.value: count for kind, count in counts.items()}

    async def pendant(self) -> PendantClient:
        pendant = await PendantClient.connect(HOST, self.pendant_port, state_rate=50)
        await pendant.wait_until(lambda state: state.motion_possible == 1, within=20.0)
        return pendant


@asynccontextmanager
async def cell_behind_faults(script: Path, **link: object) -> AsyncIterator[FaultedCell]:
    loop = asyncio.get_running_loop()
    emulator = EmulatorSettings.model_validate({"motion_port": 0, "state_port": 0})
    service = Service(build_controller(emulator, loop_time(loop)), emulator)
    ports = await service.start()
    pairs = [Pair(Endpoint(HOST, 0), Endpoint(HOST, port)) for port in ports]
    proxy = FaultProxy(pairs, load_script(script))
    try:
        motion, state = await proxy.start()
        controller = {"host": HOST, "motion_port": motion, "state_port": state, **link}
        values = {"robot": ROBOT, "controller": controller, "listen": _ANY_PORTS}
        served = CellParts(make_settings(values, "test"), serial_robot(ROBOT), PlannerInLine())
        app = bare_app([served])
        async with app.running() as listening:
            yield FaultedCell(service, proxy, listening.pendant)
    finally:
        await proxy.close()
        await service.close()
        await asyncio.sleep(0.01)
