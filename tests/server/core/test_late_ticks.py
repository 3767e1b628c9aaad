from __future__ import annotations

import asyncio

import pytest
from rigs.clock.virtual_clock import VirtualLoop
from rigs.processes.app_on_loop import app_on_loop, said, until

pytestmark = [pytest.mark.virtual_clock, pytest.mark.asyncio]

HELLO_DEADLINE = 2.0
LATE_NS = 300_000_000
_SAME_TURN = 5e-10
"""A timer that is due so much earlier runs in the same turn of the loop, before the other [s]."""


async def test_what_arrives_in_the_turn_of_a_late_tick_is_read_before_it() -> None:
    async with app_on_loop() as served:
        stranger = await served.visitor()
        await asyncio.sleep(HELLO_DEADLINE - 0.2)
        assert served.connections == 1
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)

        def stand_still() -> None:
            stranger.send(said())
            loop._virtual.now_ns += LATE_NS

        loop.call_at(served.app._next_tick - _SAME_TURN, stand_still)
        await asyncio.sleep(1.0)
        assert served.connections == 1


async def test_what_does_not_arrive_is_judged_by_the_late_tick() -> None:
    async with app_on_loop() as served:
        await served.visitor()
        await asyncio.sleep(HELLO_DEADLINE - 0.2)
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        loop._virtual.now_ns += LATE_NS
        took = await until(lambda: served.connections == 0, 0.05)
        assert took <= 0.02
