"""Promise 7: a length that no frame has ends its connection at once, and takes no memory."""

import asyncio
import struct
import tracemalloc

import pytest
from rigs.processes.app_on_loop import AppOnLoop, app_on_loop, said, until

pytestmark = pytest.mark.virtual_clock

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
