"""A whole server on the loop of the test, an emulated robot behind it, bare sockets before it."""

import asyncio
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from rigs.peers.server_clients import hello
from rigs.processes.judged_server import HOST, running_emulator, served_cell

from openpendant.server.shell.app import App
from openpendant.server.shell.client_connection import ClientConnection
from openpendant.server.watchdog.watchdog_process import Watchdog
from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Message, Role
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME


@dataclass
class AppOnLoop:
    """A running server."""

    app: App
    pendant: int
    ros_state: int
    _sockets: list[socket.socket] = field(default_factory=list)

    async def visitor(
        self, port: int | None = None, *, window: int | None = None, begin: bytes = b""
    ) -> socket.socket:
        """Connect, and send the first bytes."""
        sock = socket.socket()
        self._sockets.append(sock)
        if window is not None:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, window)
        sock.setblocking(False)
        loop = asyncio.get_running_loop()
        await loop.sock_connect(sock, (HOST, self.pendant if port is None else port))
        if begin:
            await loop.sock_sendall(sock, begin)
        return sock

    def close(self) -> None:
        for sock in self._sockets:
            sock.close()

    @property
    def connections(self) -> int:
        """How many clients the server has."""
        return len(self.app.clients.by_session)


def clients_of(app: App) -> dict[int, ClientConnection]:
    """Return the connections of a server's clients by their numbers."""
    found = {}
    for session, client in app.clients.by_session.items():
        assert isinstance(client, ClientConnection)
        found[session] = client
    return found


@asynccontextmanager
async def app_on_loop(
    *, watchdog: Watchdog | None = None, **listen: object
) -> AsyncIterator[AppOnLoop]:
    """Run a server with one cell; `listen` goes to that table of its settings."""
    async with running_emulator() as emulator:
        link = {"motion_port": emulator.motion_port, "state_port": emulator.state_port}
        ports = {"ros_motion_port": "off", **listen}
        app, settings = served_cell(watchdog=watchdog, controller=link, listen=ports)
        async with app.running() as bound:
            await asyncio.sleep(0.5)
            state = bound.ros[settings.name].state
            assert state is not None
            served = AppOnLoop(app, bound.pendant, state)
            try:
                yield served
            finally:
                served.close()
                await asyncio.sleep(0.05)


def said(*messages: Message) -> bytes:
    """Return the bytes of a pendant that begins a conversation."""
    wire = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)
    return b"".join(wire.send(message) for message in (hello("tester"), *messages))


async def until(holds: Callable[[], bool], within: float) -> float:
    """Wait until something holds; return how long that took by the loop's clock [s]."""
    loop = asyncio.get_running_loop()
    began = loop.time()
    while not holds():
        assert loop.time() - began < within, f"not within {within} s"
        await asyncio.sleep(0.001)
    return loop.time() - began
