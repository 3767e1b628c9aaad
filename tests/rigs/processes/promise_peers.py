"""What runs beside a measured server, each as a process of its own.

`listeners PORT COUNT RATE` keeps that many pendants which take state and ask for nothing. `planner
PORT` keeps a dry run going, one after another. `storm PORT` connects without end. `forwarder PORT`
is the idle control: it listens, and what it is told goes on to PORT, on an event loop that has
nothing else to do. Each writes a line with a number when it is ready, and ends when it is killed.
"""

import asyncio
import gc
import json
import os
import sys
from contextlib import suppress
from pathlib import Path

from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Role
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    PROTOCOL_VERSION,
    AuthorityBeat,
    Hello,
    Management,
)

PROGRAM = """openpendant-program/1
program "load" robot ur5
point a joints 0 -90 90 -90 -90 0 deg
point b joints 30 -80 100 -110 -90 0 deg
move PTP a
loop 50
  move LIN b speed 250 mm/s
  move LIN a speed 250 mm/s
end
"""

_AGAIN = 0.01
"""Between two dry runs [s]."""

_GUSTS = 50
"""Connections of a storm at a time."""

_TALK = 10.0
"""Between two messages of a listener [s]."""


class _Listener(asyncio.Protocol):
    """A pendant that takes state; reads it away without a look, after the welcome."""

    def __init__(self, rate: float, welcome: asyncio.Future[None]) -> None:
        self._rate = rate
        self._welcome = welcome

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self._wire = _wire()
        transport.write(self._wire.send(Hello(PROTOCOL_VERSION, self._rate, "", "listener")))

    def data_received(self, data: bytes) -> None:
        if not self._welcome.done():
            self._welcome.set_result(None)

    def say_something(self) -> None:
        """Say what means nothing of an observer; who is silent for 30 s is closed."""
        self._transport.write(self._wire.send(AuthorityBeat()))

    def connection_lost(self, exc: Exception | None) -> None:
        # A server that loses listeners has less to do than the test says; the test is told.
        os.write(2, b"a listener was lost\n")
        os._exit(1)


def _wire() -> Connection:
    return Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)


async def listeners(port: int, count: int, rate: float) -> None:
    loop = asyncio.get_running_loop()
    crowd: list[_Listener] = []
    for _ in range(count):
        welcome: asyncio.Future[None] = loop.create_future()
        crowd.append(_Listener(rate, welcome))
        await loop.create_connection(lambda: crowd[-1], "127.0.0.1", port)
        await asyncio.wait_for(welcome, 10)

    async def talk() -> None:
        while True:
            await asyncio.sleep(_TALK)
            for each in crowd:
                each.say_something()

    talking = asyncio.create_task(talk())
    await _until_the_end(count)
    talking.cancel()


async def planner(port: int) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    wire = _wire()
    writer.write(wire.send(Hello(PROTOCOL_VERSION, 0.0, "", "planner")))
    number = 0

    async def ask(body: dict[str, object]) -> dict[str, object]:
        nonlocal number
        number += 1
        writer.write(wire.send(Management(number, json.dumps(body).encode())))
        while True:
            for message in wire.receive(await reader.read(65_536)):
                if isinstance(message, Management) and message.request_id == number:
                    answer: dict[str, object] = json.loads(message.body)
                    return answer

    await ask({"op": "programs.save", "name": "load", "body": PROGRAM, "expected_revision": 0})

    async def plan() -> None:
        while True:
            await ask({"op": "programs.dry_run", "name": "load"})
            await asyncio.sleep(_AGAIN)

    work = asyncio.create_task(plan())
    await asyncio.wait({work}, timeout=0.5)
    if work.done():
        await work  # to say why
    await _until_the_end(number)
    work.cancel()
    with suppress(asyncio.CancelledError):
        await work


async def storm(port: int) -> None:
    """Connect and close without end, as many at a time as the system lets."""

    async def again() -> None:
        while True:
            with suppress(OSError):
                _, writer = await asyncio.open_connection("127.0.0.1", port)
                writer.close()
            await asyncio.sleep(0.001)

    gusts = [asyncio.create_task(again()) for _ in range(_GUSTS)]
    await _until_the_end(_GUSTS)
    for gust in gusts:
        gust.cancel()


async def forwarder(port: int) -> None:
    _, onward = await asyncio.open_connection("127.0.0.1", port)

    class Forward(asyncio.Protocol):
        def data_received(self, data: bytes) -> None:
            onward.write(data)

    server = await asyncio.get_running_loop().create_server(Forward, "127.0.0.1", 0)
    gc.freeze()
    await _until_the_end(server.sockets[0].getsockname()[1])


async def _until_the_end(number: int) -> None:
    """Say that all is ready; wait until standard input is closed."""
    os.write(1, f"{number}\n".encode())
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    await reader.read()


def main(argv: list[str]) -> None:
    what, port, *rest = argv
    match what:
        case "listeners":
            asyncio.run(listeners(int(port), int(rest[0]), float(rest[1])))
        case "planner":
            asyncio.run(planner(int(port)))
        case "storm":
            asyncio.run(storm(int(port)))
        case "forwarder":
            asyncio.run(forwarder(int(port)))
        case _:
            raise SystemExit(f"{Path(__file__).name}: no {what!r} here")


if __name__ == "__main__":
    main(sys.argv[1:])
