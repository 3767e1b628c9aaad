"""Promise 8: a frame that does not end, or never begins, costs its sender the connection."""

import asyncio
import socket

import pytest
from promises.promise_table import figure
from rigs.processes.app_on_loop import app_on_loop, said, until

from openpendant.simplemsg.pendant import Subscribe

pytestmark = pytest.mark.virtual_clock

FRAME = figure(8, "frame").seconds
HELLO = figure(8, "hello").seconds
TICK = 0.01

DRIP = 0.2
"""Between two bytes of who sends slowly [s]."""

SLOW = 60
"""Connections that send slowly: all but a few places of strangers."""


async def drip(sock: socket.socket, data: bytes) -> None:
    for at in range(len(data)):
        try:
            await asyncio.get_running_loop().sock_sendall(sock, data[at : at + 1])
        except OSError:
            return
        await asyncio.sleep(DRIP)


@pytest.mark.parametrize("face", ["pendant", "ros_state"])
async def test_promise_8_a_frame_that_comes_by_the_byte_is_given_so_long_after_its_first(
    face: str,
) -> None:
    async with app_on_loop() as served:
        begin = said() if face == "pendant" else b""
        sock = await served.visitor(getattr(served, face), begin=begin)
        await until(lambda: served.connections == 1, 1.0)
        await asyncio.sleep(0.05)
        dripping = asyncio.create_task(drip(sock, said()[:40]))
        took = await until(lambda: served.connections == 0, 2 * FRAME)
        dripping.cancel()
        assert FRAME <= took <= FRAME + 3 * TICK


async def test_promise_8_slow_strangers_are_gone_and_delay_nobody() -> None:
    async with app_on_loop() as served:
        reader = await served.visitor(begin=said(Subscribe(1, 100.0)))
        await until(lambda: served.connections == 1, 1.0)
        overruns = served.app.overruns
        dripping = []
        for _ in range(SLOW):
            sock = await served.visitor()
            dripping.append(asyncio.create_task(drip(sock, said()[:40])))
            await asyncio.sleep(0.02)
        got, loop = 0, asyncio.get_running_loop()
        until_then = loop.time() + FRAME + HELLO
        while loop.time() < until_then:
            got += len(await loop.sock_recv(reader, 65_536))
        assert served.connections == 1
        assert served.app.overruns == overruns
        # A state message of some 200 bytes each tick.
        assert got > (FRAME + HELLO) / TICK * 200
        for task in dripping:
            task.cancel()
