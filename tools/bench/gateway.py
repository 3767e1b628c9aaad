"""The gateway of the browser pendant: what thirty pages that hold a key cost it.

Each of thirty pages has a WebSocket and is sent a state thirty times a second; twenty times a
second it sends what a page that holds sends: enabling and beat, two frames in one message. The
server behind the gateway is a stand-in that sends states and reads, so that the figures are those
of the gateway's process alone: its processor time by the kernel's account, and its greatest memory.
"""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from openpendant.simplemsg import PENDANT, ByteOrder, codec_for
from openpendant.simplemsg.pendant import Enabling, EnablingPosition, JogBeat, State

from .peers import process
from .table import Benchmark, Bound, Judged, MissingRequirement, Sides

if TYPE_CHECKING:
    from aiohttp import ClientSession, ClientWebSocketResponse

PAGES = 30
STATE_RATE = 30.0
BEAT = 0.05
WINDOW = 5.0
"""Length of one sample [s]."""

MOST_SHARE = 10.0
MOST_MEMORY = 60.0

_SETTLE = 1.0
_STATE_SIZE = 236
"""Bytes of a state, as `docs/protocol.md` lays it out."""


def benchmarks() -> list[Benchmark]:
    """Return the share of a processor and the memory that thirty holding pages cost."""
    name = f"gateway: {PAGES} pages holding at {STATE_RATE:g} Hz"
    share = Bound(MOST_SHARE, judged=Judged.VALUE)
    memory = Bound(MOST_MEMORY, judged=Judged.VALUE)
    return [
        Benchmark(f"{name}, of a processor", "%", partial(_room, "share"), share, 3),
        Benchmark(f"{name}, most memory", "MB", partial(_room, "memory"), memory, 3),
    ]


@contextmanager
def _room(figure: str) -> Iterator[Sides]:
    """Run a gateway with thirty pages; yields what one of its figures is now."""
    if find_spec("aiohttp") is None:
        raise MissingRequirement("aiohttp is not installed (extra web)")
    with ExitStack() as stack:
        ports = stack.enter_context(_on_thread())
        gateway = stack.enter_context(
            process(
                *("openpendant.tools", "web", "--json", "--port", "0"),
                *("--server", f"cell=127.0.0.1:{ports.server_port}"),
            )
        )
        ports.open_pages(str(gateway["page"]))
        pid = gateway["pid"]

        def share() -> float:
            before = _processor_time(pid)
            threading.Event().wait(WINDOW)
            return 100.0 * (_processor_time(pid) - before) / WINDOW

        def memory() -> float:
            threading.Event().wait(_SETTLE)
            return _most_memory(pid)

        threading.Event().wait(_SETTLE)
        yield Sides(share if figure == "share" else memory)


def _processor_time(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _most_memory(pid: int) -> float:
    for line in Path(f"/proc/{pid}/status").read_text("ascii").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1000.0
    raise RuntimeError("the system tells no memory of a process")


class _Peers:
    """The server behind the gateway and the pages before it, on a loop of their own."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.server_port = 0
        self._loop = loop
        self._server: asyncio.Server | None = None
        self._session: ClientSession | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    async def serve(self) -> None:
        self._server = server = await asyncio.start_server(self._feed, "127.0.0.1", 0)
        self.server_port = server.sockets[0].getsockname()[1]

    async def _feed(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        reading = self._loop.create_task(self._drop(reader))
        self._tasks.add(reading)
        state = _a_state()
        with suppress(ConnectionError):
            while not reading.done():
                writer.write(state)
                await asyncio.sleep(1.0 / STATE_RATE)
        writer.close()

    async def _drop(self, reader: asyncio.StreamReader) -> None:
        with suppress(ConnectionError):
            while await reader.read(65_536):
                pass

    def open_pages(self, page: str) -> None:
        """Open all pages; returns when they hold."""
        asyncio.run_coroutine_threadsafe(self._open(page), self._loop).result(20.0)

    async def _open(self, page: str) -> None:
        from aiohttp import ClientSession  # the other rows need none

        session = ClientSession()
        for _ in range(PAGES):
            socket = await session.ws_connect(f"{page}servers/cell")

            work = (_read(socket), _hold(socket))
            self._tasks |= {self._loop.create_task(each) for each in work}
        self._session = session

    async def close(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._session is not None:
            await self._session.close()
        if self._server is not None:
            self._server.close()


async def _read(socket: ClientWebSocketResponse) -> None:
    async for _ in socket:
        pass


async def _hold(socket: ClientWebSocketResponse) -> None:
    codec = codec_for(PENDANT, ByteOrder.LITTLE)
    held = codec.encode(Enabling(EnablingPosition.HELD)) + codec.encode(JogBeat(1, 1))
    with suppress(ConnectionError):
        while True:
            await socket.send_bytes(held)
            await asyncio.sleep(BEAT)


@contextmanager
def _on_thread() -> Iterator[_Peers]:
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()
    peers = _Peers(loop)
    asyncio.run_coroutine_threadsafe(peers.serve(), loop).result(10.0)
    try:
        yield peers
    finally:
        asyncio.run_coroutine_threadsafe(peers.close(), loop).result(10.0)
        loop.call_soon_threadsafe(loop.stop)
        thread.join(10.0)


def _a_state() -> bytes:
    """Return a frame of the size of a state; what it says is nobody's business here."""
    head = [_STATE_SIZE - 4, State.PLACE.msg_type, 1, 0]
    return b"".join(each.to_bytes(4, "little") for each in head).ljust(_STATE_SIZE, b"\0")
