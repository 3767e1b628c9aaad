"""A terminal pendant's core on a connection to a scripted server, without a screen."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from rigs.cells.panel_rig import snapshot
from rigs.peers.scripted_pendant_server import ScriptedPendantServer, scripted_server

from openpendant.simplemsg.pendant import SoftwareStop
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.terminal import screen_text
from openpendant.tools.pendants.terminal.connection import LogIn, TerminalConnection, as_nobody
from openpendant.tools.pendants.terminal.keyboard import STOP_KEY
from openpendant.tools.pendants.terminal.panel import Panel


def loop_ns() -> int:
    return int(asyncio.get_running_loop().time() * 1e9)


class Driven:
    """A pendant on a connection to a scripted server, on the clock of the loop."""

    ran: asyncio.Task[None]

    def __init__(self, server: ScriptedPendantServer, log_in: LogIn = as_nobody) -> None:
        self.server = server
        self.panel = Panel()
        self.connection = TerminalConnection(self.panel, self.connect, log_in, loop_ns)

    async def connect(self) -> PendantClient:
        return await PendantClient.connect("127.0.0.1", self.server.port, state_rate=25)

    async def tick(self) -> None:
        while True:
            self.connection.perform(self.panel.tick(loop_ns()))
            await asyncio.sleep(0.04)

    def strike(self, key: str) -> None:
        self.connection.perform(self.panel.key(key, loop_ns()))

    @property
    def banner(self) -> str:
        return screen_text.banner(self.panel, loop_ns())

    @property
    def reasons(self) -> list[str]:
        return [stop.reason for stop in self.server.all(SoftwareStop)]

    async def until(self, holds: Callable[[], object], within: float) -> float:
        """Wait until something holds, at most so long; return how long it took [s]."""
        began = asyncio.get_running_loop().time()
        async with asyncio.timeout(within):
            while True:
                if holds():
                    return asyncio.get_running_loop().time() - began
                await asyncio.sleep(0.01)


@asynccontextmanager
async def driven(log_in: LogIn = as_nobody, *, stops_first: bool = False) -> AsyncIterator[Driven]:
    """Yield a pendant that is connected; or one whose stop was pressed before it could be."""
    async with scripted_server() as server:
        server.answers["snapshot"] = {**snapshot()}
        made = Driven(server, log_in)
        if stops_first:
            made.strike(STOP_KEY)
        made.ran = asyncio.create_task(made.connection.run())
        ticking = asyncio.create_task(made.tick())
        try:
            if not stops_first:
                await made.until(lambda: made.panel.cell.state is not None, 5.0)
            yield made
        finally:
            for task in (made.ran, ticking):
                task.cancel()
            await asyncio.gather(made.ran, ticking, return_exceptions=True)
