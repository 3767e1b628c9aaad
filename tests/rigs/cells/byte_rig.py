"""The rig of `server_rig` behind real connection shells: bytes in, bytes out.

Owns transports that lead into lists. Time stands still but for `wait`, and nothing costs any
processor time but what `used` says; what a shell leaves to a
later turn of the loop is handled when the test lets one pass.
"""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Any

from rigs.cells.server_rig import IDENTITY, LIMITS, NoTool, ServerRig
from rigs.peers.server_clients import Peer

from openpendant.server.access.admission import Admission
from openpendant.server.core.cell_core import CellCore
from openpendant.server.core.server_core import ServerCore
from openpendant.server.endpoints.pendant.access_requests import CoreAccess
from openpendant.server.events.effects import (
    Close,
    CutOff,
    Effect,
    HoldClient,
    ReleaseClient,
)
from openpendant.server.events.events import Event, Port
from openpendant.server.shell.client_connection import ClientConnection
from openpendant.server.shell.clients import Clients
from openpendant.server.shell.inbox import Inbox, Observations
from openpendant.simplemsg import (
    PENDANT,
    STANDARD,
    ByteOrder,
    Connection,
    Message,
    Role,
    Unasked,
)
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME

READ = 256 * 1024
"""What asyncio reads of a socket at once, at most [bytes]."""


class ListTransport(asyncio.Transport):
    """Keeps what is written."""

    def __init__(self, address: str = "127.0.0.1") -> None:
        super().__init__({"peername": (address, 0), "socket": _NoSocket()})
        self.written = bytearray()
        self.reads = True
        self.is_over = False

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.written += data

    def get_write_buffer_size(self) -> int:
        return 0

    def is_closing(self) -> bool:
        return self.is_over

    def close(self) -> None:
        self.is_over = True

    def abort(self) -> None:
        self.is_over = True

    def pause_reading(self) -> None:
        self.reads = False

    def resume_reading(self) -> None:
        self.reads = True


class _NoSocket:
    family = None


class ByteClient:
    """One client: its bytes go in as the loop would read them."""

    def __init__(self, rig: ByteRig, port: Port, order: ByteOrder, address: str) -> None:
        dialect, most = (PENDANT, MAX_PENDANT_FRAME) if port is Port.PENDANT else (STANDARD, 1_023)
        self.shell = rig.connect(port, None if port is Port.PENDANT else 0)
        self.transport = ListTransport(address)
        self.shell.connection_made(self.transport)
        self.session = self.shell.session
        self._wire = Connection(Role.CLIENT, dialect, order, max_frame=most)
        self._read = 0

    def frames(self, *messages: Message) -> bytes:
        return b"".join(self._wire.send(message) for message in messages)

    def tell(self, *messages: Message) -> None:
        self.say(self.frames(*messages))

    def say(self, data: bytes) -> None:
        """Have bytes arrive and read, as far as the server wants them; the rest is lost."""
        for at in range(0, len(data), READ):
            assert self.transport.reads, "the server does not read on"
            self.shell.data_received(data[at : at + READ])

    def heard(self) -> list[Any]:
        data = bytes(self.transport.written[self._read :])
        self._read += len(data)
        got = self._wire.receive(data)
        while self._wire.more:
            got += self._wire.receive(b"")
        return [each.message if isinstance(each, Unasked) else each for each in got]

    async def until_handled(self) -> int:
        """Let turns pass until nothing waits but behind a body that is read elsewhere."""
        turns = 0
        while self.shell.has_turn and not self.transport.is_over:
            await asyncio.sleep(0)
            turns += 1
            assert turns < 10_000
        return turns


class ByteRig(ServerRig):
    """A server core and its connections."""

    def __init__(self, login: Admission | None = None, **settings: Any) -> None:
        super().__init__(**settings)
        access = CoreAccess() if login is None else CoreAccess(login)
        self.core = CellCore(
            *(self.settings, LIMITS, IDENTITY, NoTool()),
            access=access,
            is_read_apart=lambda session: True,
        )
        journal = Journal()
        self.label = ""
        self.clients = Clients([self.settings], access.login)
        server = ServerCore([self.core])
        self.inbox = inbox = Inbox(journal, server, [self], self.clients, lambda: self.now)
        self.used, self.each_look = 0, 0
        self.connect = partial(
            ClientConnection, inbox, Observations(journal), processor_time=self._processor_time
        )
        self.connect_controller()

    def _processor_time(self) -> int:
        """Return what turns have used of the processor: each look at it finds some more [ns]."""
        self.used += self.each_look
        return self.used

    def client(
        self,
        port: Port = Port.PENDANT,
        order: ByteOrder = ByteOrder.LITTLE,
        address: str = "127.0.0.1",
    ) -> ByteClient:
        client = ByteClient(self, port, order, address)
        # Where the rig notes for what reason a connection was closed.
        self._peers[client.session] = Peer(self, client.session)
        return client

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        for item in outgoing:
            super().perform([item])
            if isinstance(item, Close):
                self.clients.by_session[item.session].close(item.reason)
            elif isinstance(item, CutOff):
                self.clients.by_session[item.session].abort(item.reason)
            elif isinstance(item, HoldClient):
                self.clients.by_session[item.session].hold()
            elif isinstance(item, ReleaseClient) and item.session in self.clients.by_session:
                self.clients.by_session[item.session].release()
        return outgoing

    def _deliver(self, session: int, message: Message) -> None:
        client = self.clients.by_session.get(session)
        if client is not None:
            client.send(message)

    def deliver(self, event: Event, now: int) -> None:
        self.perform(self.core.handle(event, now))

    def client_failed(self, session: int, error: Exception, now: int) -> None:
        raise error
