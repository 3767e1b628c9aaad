"""Promises 4, 7 and 8: who does not read, or sends no whole frame, is cut off and slows nobody."""

import asyncio
import json
import socket
import struct
import tracemalloc

import pytest
from promises.promise_table import figure
from rigs.processes.app_on_loop import AppOnLoop, app_on_loop, clients_of, said, until

from openpendant.server.shell.client_connection import ClientConnection
from openpendant.simplemsg.pendant import Management, Subscribe

pytestmark = pytest.mark.virtual_clock

WINDOW = 4_096
"""What the kernel takes for a client that does not read [byte]."""

QUEUE = figure(4, "backlog").bytes
CUT_OFF = figure(4, "cut_off").seconds
FRAME = 512
"""No state message is larger [byte]."""

LISTENING = said(Subscribe(1, 100.0))

_DRAINS = 5
"""So often may the system still take bytes of a queue that was full: it has buffers of its own."""


def queued(client: ClientConnection) -> int:
    transport = client._transport
    return 0 if transport is None else transport.get_write_buffer_size()


async def test_promise_4_a_queue_stays_within_16_kib_and_is_cut_after_two_seconds() -> None:
    async with app_on_loop() as served:
        await served.visitor(window=WINDOW, begin=LISTENING)
        await until(lambda: served.connections == 1, 1.0)
        (client,) = clients_of(served.app).values()
        assert client._transport is not None
        # The kernel's own timer runs on the real clock, which a busy machine stretches.
        sock = client._transport.get_extra_info("socket")
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 0)
        most = 0

        def is_full() -> bool:
            nonlocal most
            most = max(most, queued(client))
            return queued(client) > QUEUE

        tick = 1.0 / 100
        took = 0.0
        for _ in range(_DRAINS):
            await until(is_full, 30.0)
            took = await until(lambda: served.connections == 0 or not is_full(), 3.0)
            if served.connections == 0:
                break
        assert served.connections == 0
        assert CUT_OFF - tick <= took <= CUT_OFF + 2 * tick
        assert most <= QUEUE + FRAME


async def test_promise_4_others_get_every_message_beside_stalled_ones() -> None:
    async with app_on_loop() as served:
        for _ in range(10):
            await served.visitor(window=WINDOW, begin=LISTENING)
        reader = await served.visitor(begin=LISTENING)
        loop = asyncio.get_running_loop()
        before, got = served.app.overruns, 0
        until_then = loop.time() + 5.0
        while loop.time() < until_then:
            got += len(await loop.sock_recv(reader, 65_536))
        assert served.app.overruns == before
        assert served.connections >= 1
        assert got > 450 * 200


async def test_promise_4_who_asks_and_does_not_read_is_cut_before_a_quarter_of_a_mebibyte() -> None:
    async with app_on_loop() as served:
        asks = [
            Management(number, json.dumps({"op": "errors.list"}).encode()) for number in range(400)
        ]
        questions = said(*asks)
        sock = await served.visitor(window=WINDOW, begin=said())
        await until(lambda: served.connections == 1, 1.0)
        (client,) = clients_of(served.app).values()
        most = 0
        loop = asyncio.get_running_loop()
        sending = loop.create_task(loop.sock_sendall(sock, questions))
        for _ in range(4_000):
            most = max(most, queued(client))
            if served.connections == 0:
                break
            await asyncio.sleep(0.001)
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)
        assert served.connections == 0
        assert most <= 256 * 1024 + 64 * 1024


IMPOSSIBLE = (-(2**31) + 1, -1, 0, 11, 0x01010101, 2**31 - 1)
"""Lengths that neither face takes, whichever end their bytes begin with."""

SOON = 0.02
"""The turns of the loop that a closed connection takes to be gone, and a tick [s]."""


async def closed_for(served: AppOnLoop, port: int, begin: bytes, length: int) -> None:
    sock = await served.visitor(port, begin=begin)
    await until(lambda: served.connections == 1, 1.0)
    sock.send(struct.pack("<i", length) + bytes(64))
    await until(lambda: served.connections == 0, SOON)


@pytest.mark.parametrize("order", ["first", "later"])
async def test_promise_7_an_impossible_length_closes_and_takes_no_memory(order: str) -> None:
    async with app_on_loop() as served:
        begin = said() if order == "later" else b""
        tracemalloc.start()
        try:
            for length in IMPOSSIBLE:
                await closed_for(served, served.pendant, begin, length)
            _, most = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert most < 1 << 20


async def test_promise_7_it_closes_a_ros_industrial_connection_as_well() -> None:
    async with app_on_loop() as served:
        for length in IMPOSSIBLE:
            await closed_for(served, served.ros_state, b"", length)


async def test_promise_7_who_sends_it_ends_nobody_elses_connection() -> None:
    async with app_on_loop() as served:
        await served.visitor(begin=said())
        await until(lambda: served.connections == 1, 1.0)
        sock = await served.visitor(begin=said())
        await until(lambda: served.connections == 2, 1.0)
        sock.send(struct.pack("<i", -1))
        await until(lambda: served.connections == 1, SOON)
        await asyncio.sleep(SOON)
        assert served.connections == 1


WHOLE_FRAME = figure(8, "frame").seconds
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
        took = await until(lambda: served.connections == 0, 2 * WHOLE_FRAME)
        dripping.cancel()
        assert WHOLE_FRAME <= took <= WHOLE_FRAME + 3 * TICK


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
        until_then = loop.time() + WHOLE_FRAME + HELLO
        while loop.time() < until_then:
            got += len(await loop.sock_recv(reader, 65_536))
        assert served.connections == 1
        assert served.app.overruns == overruns
        # A state message of some 200 bytes each tick.
        assert got > (WHOLE_FRAME + HELLO) / TICK * 200
        for task in dripping:
            task.cancel()
