"""Both ends of a proxy on one loop: a server that does as it is told, and clients.

Owns the doubles that the tests of the packet proxies share.
"""

import asyncio
import socket
import struct
from dataclasses import dataclass

from openpendant.tools.packets.live.endpoints import Endpoint
from openpendant.tools.packets.live.proxy import Pair

LOOPBACK = "127.0.0.1"
PATIENCE_S = 5.0

PING = bytes.fromhex("0c000000010000000200000000000000")
PONG = bytes.fromhex("0c000000010000000300000001000000")


@dataclass
class Stream:
    """One end of a connection."""

    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter

    def write(self, data: bytes) -> None:
        self.writer.write(data)

    async def read(self, size: int) -> bytes:
        return await asyncio.wait_for(self.reader.readexactly(size), PATIENCE_S)

    async def rest(self) -> bytes:
        return await asyncio.wait_for(self.reader.read(), PATIENCE_S)

    def reset(self) -> None:
        sock = self.writer.get_extra_info("socket")
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.writer.transport.abort()

    async def is_reset(self) -> bool:
        try:
            await self.rest()
        except ConnectionResetError:
            return True
        return False


class Server:
    """Accepts connections and hands them to the test."""

    def __init__(self) -> None:
        self.port = 0
        self.accepted: asyncio.Queue[Stream] = asyncio.Queue()
        self._streams: list[Stream] = []

    async def start(self) -> None:
        self._server = await asyncio.start_server(self._accept, LOOPBACK, 0)
        self.port = self._server.sockets[0].getsockname()[1]

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._streams.append(Stream(reader, writer))
        self.accepted.put_nowait(self._streams[-1])

    async def next(self) -> Stream:
        return await asyncio.wait_for(self.accepted.get(), PATIENCE_S)

    def pair(self) -> Pair:
        return Pair(Endpoint(LOOPBACK, 0), Endpoint(LOOPBACK, self.port))

    async def close(self) -> None:
        self._server.close()
        for stream in self._streams:
            stream.writer.close()
        await asyncio.sleep(0.01)


async def connect(port: int) -> Stream:
    return Stream(*await asyncio.open_connection(LOOPBACK, port))
