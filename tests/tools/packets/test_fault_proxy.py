"""The fault proxy on loopback sockets, under virtual time."""

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from rigs.peers.loopback_peers import PING, PONG, Server, Stream, connect

from openpendant.tools.packets.faults import FaultProxy
from openpendant.tools.packets.faulty.fault_script import make_script

pytestmark = pytest.mark.virtual_clock

Start = Callable[..., Awaitable[tuple[FaultProxy, Stream, Stream]]]


@pytest.fixture
async def start(tmp_path: Path) -> AsyncIterator[Start]:
    closing: list[Callable[[], Awaitable[None]]] = []

    async def begin(*rules: dict[str, Any], log: bool = False) -> tuple[FaultProxy, Stream, Stream]:
        server = Server()
        await server.start()
        file = str(tmp_path / "log.jsonl") if log else None
        proxy = FaultProxy([server.pair()], make_script({"rule": rules}, "test"), log=file)
        (port,) = await proxy.start()
        client = await connect(port)
        closing.extend([proxy.close, server.close])

        async def close_client() -> None:
            client.writer.close()

        closing.append(close_client)
        return proxy, client, await server.next()

    yield begin
    for close in closing:
        await close()
    await asyncio.sleep(0.01)


async def test_what_no_rule_fits_passes_both_ways(start: Start) -> None:
    _, client, server = await start()
    client.write(PING + b"\0\0\0\0stray")
    assert await server.read(25) == PING + b"\0\0\0\0stray"
    server.write(PONG)
    assert await client.read(16) == PONG


async def test_a_delay_is_kept_by_the_clock(start: Start) -> None:
    _, client, server = await start({"fault": "delay", "ms": 2500})
    loop = asyncio.get_running_loop()
    before = loop.time()
    client.write(PING)
    await server.read(16)
    assert loop.time() - before == pytest.approx(2.5, abs=0.01)


async def test_a_reset_reaches_both_sides(start: Start) -> None:
    _, client, server = await start({"fault": "reset"})
    client.write(PING)
    assert await server.is_reset()
    assert await client.is_reset()


async def test_a_close_is_in_order_on_both_sides(start: Start) -> None:
    proxy, client, server = await start({"fault": "close", "forward": True})
    client.write(PING)
    assert await server.rest() == PING
    assert await client.rest() == b""
    await asyncio.sleep(0.01)
    assert proxy.connections == 0


async def test_a_half_open_connection_stays_and_says_nothing(start: Start) -> None:
    proxy, client, server = await start({"fault": "half_open"})
    client.write(PING)
    await asyncio.sleep(60)
    client.write(PING)
    server.write(PONG)
    for end in (client, server):
        with pytest.raises(TimeoutError):
            await end.rest()
    assert proxy.connections == 1


async def test_a_half_frame_is_forwarded_when_its_sender_ends(start: Start) -> None:
    _, client, server = await start()
    client.write(PING[:6])
    client.writer.write_eof()
    assert await server.rest() == PING[:6]


async def test_a_peer_that_resets_is_reset_though_frames_wait(start: Start) -> None:
    _, client, server = await start({"fault": "delay", "ms": 60_000})
    client.write(PING)
    await asyncio.sleep(1)
    client.reset()
    assert await server.is_reset()


async def test_what_is_held_back_is_bounded(start: Start) -> None:
    proxy, client, _ = await start({"fault": "delay", "ms": 600_000})
    client.write(((65_000).to_bytes(4, "little") + bytes(65_000)) * 300)
    await asyncio.sleep(5)
    assert proxy.relay.frames < 12


async def test_each_fault_is_logged_with_its_rule_and_frame(start: Start, tmp_path: Path) -> None:
    proxy, client, _ = await start({"fault": "drop", "match": {"type": 1}}, log=True)
    client.write(PING)
    await asyncio.sleep(0.5)
    (line,) = (tmp_path / "log.jsonl").read_text().splitlines()
    entry = json.loads(line)
    assert (entry["rule"], entry["fault"], entry["hex"]) == (1, "drop", PING.hex())
    assert proxy.done == {"drop": 1}
