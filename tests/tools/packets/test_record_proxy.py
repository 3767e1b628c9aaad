"""The recording proxy on loopback sockets, under virtual time."""

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any, cast

import pytest
from rigs.peers.loopback_peers import LOOPBACK, PING, PONG, Server, Stream, connect

from openpendant.tools.packets.console import PeerError
from openpendant.tools.packets.live.endpoints import Endpoint
from openpendant.tools.packets.live.proxy import WRITE_HIGH, Pair
from openpendant.tools.packets.record import PacketRecorder

FLOOD = 300
"""Frames, more than the buffers of the kernel take."""

LARGEST_READ = 256 * 1024
"""What asyncio reads at once, bytes."""

pytestmark = pytest.mark.virtual_clock


class Recording:
    """A recorder between a server and the clients of a test."""

    def __init__(self, server: Server, file: Path) -> None:
        self.server, self.file = server, file
        self.reasons: list[str] = []
        self.clients: list[Stream] = []

    async def start(self, path: str = "", **options: Any) -> None:
        path = path or str(self.file)
        pairs = [self.server.pair()]
        self.recorder = PacketRecorder(pairs, path, on_end=self.reasons.append, **options)
        (self.port,) = await self.recorder.start()

    async def client(self) -> tuple[Stream, Stream]:
        """Connect through the proxy; return the client's and the server's end."""
        self.clients.append(await connect(self.port))
        return self.clients[-1], await self.server.next()

    def lines(self) -> list[dict[str, Any]]:
        return [json.loads(line) for line in self.file.read_text().splitlines()]

    def packets(self) -> list[tuple[str, bytes]]:
        lines = self.lines()
        return [(line["dir"], bytes.fromhex(line["hex"])) for line in lines if "hex" in line]

    def events(self) -> list[str]:
        return [line["event"] for line in self.lines() if "event" in line]

    async def end(self) -> None:
        await self.recorder.close()


Start = Callable[..., Awaitable[Recording]]


@pytest.fixture
async def start(tmp_path: Path) -> AsyncIterator[Start]:
    made: list[Recording] = []

    async def begin(path: str = "", **options: Any) -> Recording:
        server = Server()
        await server.start()
        recording = Recording(server, tmp_path / "trace.jsonl")
        await recording.start(path, **options)
        made.append(recording)
        return recording

    yield begin
    for recording in made:
        await recording.end()
        for client in recording.clients:
            client.writer.close()
        await recording.server.close()


async def test_frames_pass_and_are_written_with_direction_and_time(start: Start) -> None:
    recording = await start()
    client, server = await recording.client()
    await asyncio.sleep(1.5)
    client.write(PING)
    assert await server.read(16) == PING
    server.write(PONG)
    assert await client.read(16) == PONG
    await recording.end()
    header, connected, ping, pong = recording.lines()
    assert header["format"] == "openpendant-trace/1"
    assert connected["event"] == "client-connected"
    assert (ping["dir"], ping["hex"], ping["conn"]) == ("client->server", PING.hex(), 1)
    assert ping["t"] == pytest.approx(1.5, abs=0.01)
    assert (pong["dir"], pong["port"]) == ("server->client", recording.server.port)


async def test_the_file_is_at_most_a_tenth_of_a_second_behind(start: Start) -> None:
    recording = await start()
    client, server = await recording.client()
    client.write(PING)
    await server.read(16)
    await asyncio.sleep(0.11)
    assert recording.packets() == [("client->server", PING)]


async def test_half_of_a_frame_passes_before_its_other_half_comes(start: Start) -> None:
    recording = await start()
    client, server = await recording.client()
    client.write(PING[:5])
    assert await server.read(5) == PING[:5]
    client.write(PING[5:])
    assert await server.read(11) == PING[5:]
    await recording.end()
    assert recording.packets() == [("client->server", PING)]


async def test_bytes_that_are_no_frames_pass_and_are_marked(start: Start) -> None:
    recording = await start()
    client, server = await recording.client()
    client.write(PING + b"\0\0\0\0 anything")
    assert await server.read(29) == PING + b"\0\0\0\0 anything"
    await recording.end()
    assert recording.lines()[-1]["frame"] is False
    assert "out-of-step client" in recording.events()


async def test_a_closed_half_leaves_the_other_half_open(start: Start) -> None:
    recording = await start()
    client, server = await recording.client()
    client.write(PING)
    client.writer.write_eof()
    assert await server.rest() == PING
    server.write(PONG)
    assert await client.read(16) == PONG
    server.writer.close()
    assert await client.rest() == b""
    await asyncio.sleep(0.01)
    assert recording.recorder.connections == 0
    await recording.end()
    assert recording.events()[1:] == ["client-closed-connection", "server-closed-connection"]


@pytest.mark.parametrize("who", ["client", "server"])
async def test_a_reset_is_passed_on_as_a_reset(start: Start, who: str) -> None:
    recording = await start()
    ends = dict(zip(("client", "server"), await recording.client(), strict=True))
    ends.pop(who).reset()
    (other,) = ends.values()
    assert await other.is_reset()
    await recording.end()
    assert recording.events()[1:] == [f"reset {who}"]


async def test_a_server_that_is_not_there_closes_the_client(start: Start) -> None:
    recording = await start()
    await recording.server.close()
    client = await connect(recording.port)
    recording.clients.append(client)
    assert await client.rest() == b""
    await recording.end()
    assert recording.events()[1].startswith("refused ")
    assert "Connection refused" in recording.events()[1]


async def test_a_server_that_does_not_read_stops_the_reading_of_the_client(start: Start) -> None:
    recording = await start()
    client, server = await recording.client()
    transport = cast(asyncio.Transport, server.writer.transport)
    transport.pause_reading()
    frame = (65_000).to_bytes(4, "little") + bytes(65_000)
    client.write(frame * FLOOD)
    await asyncio.sleep(1)
    passed = recording.recorder.relay.packets
    await asyncio.sleep(1)
    assert passed == recording.recorder.relay.packets < FLOOD * 3 / 4
    assert recording.recorder.unsent <= WRITE_HIGH + LARGEST_READ
    transport.resume_reading()
    for _ in range(FLOOD):
        assert await server.read(len(frame)) == frame


async def test_a_port_in_use_leaves_nothing_open(start: Start, tmp_path: Path) -> None:
    recording = await start()
    listen = Endpoint(LOOPBACK, recording.port)
    pairs = [recording.server.pair(), Pair(listen, listen)]
    with pytest.raises(PeerError, match="Address already in use"):
        await PacketRecorder(pairs, str(tmp_path / "other")).start()


async def test_connections_are_numbered_by_port(start: Start) -> None:
    recording = await start()
    for _ in range(2):
        client, server = await recording.client()
        client.write(PING)
        await server.read(16)
    await recording.end()
    assert [line["conn"] for line in recording.lines() if "hex" in line] == [1, 2]


async def test_a_full_disk_ends_the_recording_and_not_the_traffic(start: Start) -> None:
    recording = await start("/dev/full")
    client, server = await recording.client()
    await asyncio.sleep(0.2)
    assert recording.reasons == ["No space left on device"]
    assert recording.recorder.output.failed
    client.write(PING)
    assert await server.read(16) == PING
    later, peer = await recording.client()
    later.write(PING)
    assert await peer.read(16) == PING


async def test_the_size_limit_ends_the_recording_and_not_the_traffic(start: Start) -> None:
    recording = await start(max_size=2_000)
    client, server = await recording.client()
    client.write(PING * 100)
    assert await server.read(1600) == PING * 100
    await recording.end()
    assert recording.reasons == ["--max-size of 2000 bytes is reached"]
    assert not recording.recorder.output.failed
    assert 1_500 < recording.file.stat().st_size <= 2_000
    assert recording.packets()


async def test_any_bytes_in_any_portions_arrive_as_they_were(start: Start) -> None:
    recording = await start()
    client, server = await recording.client()
    chunks = [bytes([index % 251]) * (index % 97) for index in range(300)]
    for chunk in chunks:
        client.write(chunk)
        server.write(chunk)
        await asyncio.sleep(0)
    total = b"".join(chunks)
    assert await server.read(len(total)) == total
    assert await client.read(len(total)) == total
