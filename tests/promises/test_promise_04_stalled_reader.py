"""Promise 4: who does not read costs little memory, is cut off after 2 s, and slows nobody."""

import asyncio
import json

import pytest
from promises.promise_table import figure
from rigs.processes.app_on_loop import app_on_loop, clients_of, said, until

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


def queued(client: ClientConnection) -> int:
    transport = client._transport
    return 0 if transport is None else transport.get_write_buffer_size()


async def test_promise_4_a_queue_stays_within_16_kib_and_is_cut_after_two_seconds() -> None:
    async with app_on_loop() as served:
        await served.visitor(window=WINDOW, begin=LISTENING)
        await until(lambda: served.connections == 1, 1.0)
        (client,) = clients_of(served.app).values()
        most = 0

        def is_full() -> bool:
            nonlocal most
            most = max(most, queued(client))
            return queued(client) > QUEUE

        await until(is_full, 30.0)
        tick = 1.0 / 100
        took = await until(lambda: (is_full() and served.connections == 0) or not is_full(), 3.0)
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
