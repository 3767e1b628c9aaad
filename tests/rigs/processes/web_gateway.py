"""A gateway on the loop of the test, the tabs that use it, and tabs that do not read."""

import asyncio
import base64
import os
import socket
import ssl
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TypeVar

from aiohttp import ClientSession, ClientWebSocketResponse, ClientWSTimeout, TCPConnector, WSMsgType

from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Message, Role
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME
from openpendant.tools.pendants.web.cli import WebGateway
from openpendant.tools.pendants.web.server_link import GatewayIdentity, Server
from openpendant.tools.pendants.web.settings import settings_of

LOOPBACK = "127.0.0.1"
PATIENCE = 5.0
SECRET = "0123456789abcdef" * 4
WEB = GatewayIdentity("web", SECRET)

_PATIENT = ClientWSTimeout(ws_close=1.0)

_M = TypeVar("_M", bound=Message)


class Tab:
    """A page's WebSocket."""

    def __init__(self, socket: ClientWebSocketResponse) -> None:
        self.socket = socket
        self.wire = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)
        self.told: list[object] = []

    async def send(self, data: bytes) -> None:
        await self.socket.send_bytes(data)

    async def tell(self, *messages: Message) -> None:
        """Send several messages in one of the WebSocket's."""
        await self.send(b"".join(map(self.wire.send, messages)))

    async def read(self) -> bytes:
        """Return the next message as bytes."""
        return await self.socket.receive_bytes(timeout=PATIENCE)

    async def read_all(self) -> list[bytes]:
        """Return every message until the gateway closes."""
        found = []
        while (message := await self.socket.receive(timeout=PATIENCE)).type is WSMsgType.BINARY:
            found.append(message.data)
        return found

    async def answer(self, kind: type[_M], **fields: object) -> _M:
        """Return the next message of a kind with these fields; others are kept in `told`."""
        while True:
            for message in self.wire.receive(await self.read()):
                self.told.append(message)
                if isinstance(message, kind) and all(
                    getattr(message, key) == value for key, value in fields.items()
                ):
                    return message

    async def closed(self) -> tuple[int | None, str]:
        """Wait for the end; return its code and reason."""
        while True:
            message = await self.socket.receive(timeout=PATIENCE)
            if message.type is WSMsgType.CLOSE:
                return message.data, message.extra or ""
            if message.type in (WSMsgType.CLOSED, WSMsgType.ERROR):
                return self.socket.close_code, ""


class GatewayRig:
    """A running gateway.

    Attributes:
        page: address of its page.
    """

    def __init__(self, gateway: WebGateway, page: str, session: ClientSession) -> None:
        self.gateway, self.page, self.session = gateway, page, session
        self.tabs: list[Tab] = []

    @property
    def port(self) -> int:
        return int(self.page.rstrip("/").rpartition(":")[2])

    async def tab(self, server: str = "cell", **headers: str) -> Tab:
        """Open a WebSocket as a page of the gateway's own does; it is closed at the end."""
        sent = {"Origin": self.page.rstrip("/")}
        sent |= {key.replace("_", "-"): value for key, value in headers.items()}
        url = f"{self.page}servers/{server}"
        opened = await self.session.ws_connect(url, headers=sent, timeout=_PATIENT)
        self.tabs.append(Tab(opened))
        return self.tabs[-1]


@asynccontextmanager
async def running_gateway(
    port: int,
    identity: GatewayIdentity | None = None,
    page: Path | None = None,
    own_address: str = "",
    tls: ssl.SSLContext | None = None,
    trusted: ssl.SSLContext | None = None,
    **settings: object,
) -> AsyncIterator[GatewayRig]:
    """Run a gateway in front of the server at a port of this machine, named `cell`.

    Args:
        tls: of the gateway's own certificate, which its tabs trust by `trusted`.
    """
    data = {"port": 0, "servers": [{"name": "cell", "address": f"{LOOPBACK}:{port}"}], **settings}
    if identity is not None:
        data["gateway"] = {"name": identity.name, "secret_file": "not read here"}
    checked = settings_of(data, "test")
    servers = [Server.of(each, own_address) for each in checked.servers]
    folder = page or Path("no such folder")
    gateway = WebGateway(checked, servers, identity, tls, folder)
    async with ClientSession(connector=TCPConnector(ssl=trusted or True)) as session:
        rig = GatewayRig(gateway, await gateway.start(), session)
        try:
            yield rig
        finally:
            for tab in rig.tabs:
                await tab.socket.close()
            await gateway.close()


class DeafTab:
    """A tab that reads nothing but what it is asked to, through the smallest of buffers."""

    def __init__(self, port: int, server: str = "cell") -> None:
        self.socket = socket.socket()
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4_096)
        self.socket.setblocking(False)
        self._address = (LOOPBACK, port)
        self._path = f"/servers/{server}"

    async def open(self) -> None:
        loop = asyncio.get_running_loop()
        await loop.sock_connect(self.socket, self._address)
        lines = [
            f"GET {self._path} HTTP/1.1",
            f"Host: {LOOPBACK}:{self._address[1]}",
            "Upgrade: websocket",
            "Connection: Upgrade",
            "Sec-WebSocket-Version: 13",
            f"Sec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}",
        ]
        await loop.sock_sendall(self.socket, ("\r\n".join([*lines, "", ""])).encode())
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += await loop.sock_recv(self.socket, 1)
        assert b" 101 " in head.splitlines()[0], head

    async def messages(self) -> tuple[list[bytes], int | None]:
        """Read to the end; return the messages, and the code of the closing frame."""
        loop = asyncio.get_running_loop()
        data = bytearray()
        try:
            async with asyncio.timeout(PATIENCE):
                while piece := await loop.sock_recv(self.socket, 1 << 20):
                    data += piece
        except ConnectionResetError:
            pass
        return _messages(bytes(data))

    def close(self) -> None:
        self.socket.close()


def _messages(data: bytes) -> tuple[list[bytes], int | None]:
    found: list[bytes] = []
    at = 0
    while at + 2 <= len(data):
        kind, size = data[at] & 15, data[at + 1]
        at += 2
        if size >= 126:
            wide = 2 if size == 126 else 8
            size = int.from_bytes(data[at : at + wide], "big")
            at += wide
        body = data[at : at + size]
        at += size
        if kind == 8:
            return found, int.from_bytes(body[:2], "big")
        if kind == 2:
            found.append(body)
    return found, None


def frames_in(messages: Sequence[bytes]) -> list[bytes]:
    """Cut little-endian messages into their frames."""
    found: list[bytes] = []
    for message in messages:
        at = 0
        while at < len(message):
            size = 4 + int.from_bytes(message[at : at + 4], "little")
            found.append(message[at : at + size])
            at += size
        assert at == len(message), "a message that does not end with a frame"
    return found
