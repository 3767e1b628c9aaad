"""An emulator, a server and a pendant on one virtual loop, both processes keeping a journal."""

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from rigs.processes.judged_server import served_cell

from openpendant.controller_emulator.shell import cli as emulator_cli
from openpendant.controller_emulator.shell.build import build_controller
from openpendant.controller_emulator.shell.service import Service, loop_time
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.server.cli import serve as server_cli
from openpendant.server.settings.server_settings import ServerSettings
from openpendant.server.shell.app import App
from openpendant.simplemsg import Ping, codec_for
from openpendant.simplemsg.journal import Journal
from openpendant.tools.pendants.client import PendantClient

PINGS = codec_for().encode(Ping()) * 20_000
"""More than any connection takes whose answers nobody reads."""


@dataclass
class JournalledCell:
    """Both processes and their journals."""

    service: Service
    app: App
    pendant_port: int
    motion_ports: tuple[int, int]
    state_ports: tuple[int, int]

    async def pendant(self) -> PendantClient:
        pendant = await PendantClient.connect("127.0.0.1", self.pendant_port, state_rate=50)
        await pendant.wait_until(lambda state: state.motion_possible == 1)
        return pendant


@asynccontextmanager
async def journalled_cell(emulator_file: Path, server_file: Path) -> AsyncIterator[JournalledCell]:
    """Run a cell and keep both journals until the context is left."""
    emulator = EmulatorSettings.model_validate({"motion_port": 0, "state_port": 0})
    first, now = Journal(), loop_time(asyncio.get_running_loop())
    with emulator_cli.kept_journal(first, emulator_file, emulator, now):
        service = Service(build_controller(emulator, now), emulator, journal=first)
        ports = await service.start()
        link = {"host": "127.0.0.1", "motion_port": ports.motion, "state_port": ports.state}
        second = Journal()
        app, settings = served_cell(second, controller=link)
        with server_cli.kept_journal(second, server_file, ServerSettings((settings,))):
            async with app.running() as listening:
                ros = listening.ros[settings.name]
                assert ros.motion is not None
                assert ros.state is not None
                yield JournalledCell(
                    service,
                    app,
                    listening.pendant,
                    (ports.motion, ros.motion),
                    (ports.state, ros.state),
                )
        await service.close()
        await asyncio.sleep(0.01)


@asynccontextmanager
async def deaf_peers(cell: JournalledCell) -> AsyncIterator[None]:
    """Connect peers that never read: listeners on the state ports, and clients that ask and ask."""
    loop = asyncio.get_running_loop()
    peers = [_connected(port) for port in (*cell.state_ports, *cell.motion_ports)]
    asking = [asyncio.ensure_future(loop.sock_sendall(peer, PINGS)) for peer in peers[2:]]
    try:
        yield
    finally:
        for each in asking:
            each.cancel()
        # They were cut off long ago, as they should.
        await asyncio.gather(*asking, return_exceptions=True)
        for peer in peers:
            peer.close()


def _connected(port: int) -> socket.socket:
    peer = socket.socket()
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1_024)
    peer.connect(("127.0.0.1", port))
    peer.setblocking(False)
    return peer
