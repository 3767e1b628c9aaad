"""The proxies on loopback sockets, under virtual time: one records, the other does faults.

Between them the recording relay without sockets: whatever comes goes on, and is noted once. What
the user of `record` is told when the arguments are wrong.
"""

import argparse
import asyncio
import json
import os
import socket
import stat
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.peers.loopback_peers import LOOPBACK, PING, PONG, Server, Stream, connect

from openpendant.tools.packets import faults
from openpendant.tools.packets.console import PeerError
from openpendant.tools.packets.faults import FaultProxy
from openpendant.tools.packets.faulty.fault_script import make_script
from openpendant.tools.packets.live.endpoints import Endpoint, listen_endpoint, target_endpoint
from openpendant.tools.packets.live.proxy import WRITE_HIGH, Pair
from openpendant.tools.packets.live.relay import ProxyLinkId, RecordingRelay, ResetBoth, SendBytes
from openpendant.tools.packets.record import PacketRecorder, main
from openpendant.tools.packets.trace import Entry, Event, Packet, TraceDirection

pytestmark = pytest.mark.virtual_clock

FLOOD = 300
"""Frames, more than the buffers of the kernel take."""

LARGEST_READ = 256 * 1024
"""What asyncio reads at once, bytes."""


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


async def test_a_recording_is_its_owners_alone(start: Start) -> None:
    before = os.umask(0)
    try:
        recording = await start()
        assert stat.S_IMODE(recording.file.stat().st_mode) == 0o600
        await recording.end()
        recording.file.chmod(0o666)
        again = await start()
        assert stat.S_IMODE(again.file.stat().st_mode) == 0o600
        await again.end()
    finally:
        os.umask(before)


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


LINK = ProxyLinkId(1, 11000, 1)
UP, DOWN = TraceDirection.TO_SERVER, TraceDirection.TO_CLIENT

chunks = st.lists(
    st.tuples(
        st.sampled_from(TraceDirection), st.binary(max_size=50) | st.sampled_from([PING, PONG])
    ),
    max_size=30,
)


def _relay() -> tuple[RecordingRelay, list[Entry]]:
    entries: list[Entry] = []
    relay = RecordingRelay(entries.append, 0)
    relay.opened(LINK, 0)
    return relay, entries


@given(chunks)
def test_every_portion_goes_on_at_once_as_it_came(
    portions: list[tuple[TraceDirection, bytes]],
) -> None:
    relay, entries = _relay()
    for now, (direction, data) in enumerate(portions):
        assert list(relay.received(LINK, direction, data, now)) == [
            SendBytes(LINK, direction, data)
        ]
        assert relay.held(LINK, direction) == 0
    relay.finish(len(portions))
    for direction in TraceDirection:
        recorded = [
            entry.data
            for entry in entries
            if isinstance(entry, Packet) and entry.direction is direction
        ]
        assert b"".join(recorded) == b"".join(data for way, data in portions if way is direction)


def test_bytes_are_sent_before_they_are_written_down() -> None:
    relay, entries = _relay()
    actions = iter(relay.received(LINK, UP, PING, 5))
    assert next(actions) == SendBytes(LINK, UP, PING)
    assert not any(isinstance(entry, Packet) for entry in entries)
    assert list(actions) == []
    assert entries[-1] == Packet(5, UP, PING, 11000)


def test_a_stream_out_of_step_is_noted_once() -> None:
    relay, entries = _relay()
    for _ in range(3):
        list(relay.received(LINK, DOWN, bytes(8), 0))
    notes = [entry.text for entry in entries if isinstance(entry, Event)]
    assert notes == ["client-connected", "out-of-step server"]


def test_a_reset_passes_on_and_leaves_no_half_frame_behind() -> None:
    relay, entries = _relay()
    list(relay.received(LINK, UP, PING[:7], 0))
    assert relay.reset(LINK, DOWN, 1) == [ResetBoth(LINK)]
    relay.closed(LINK, 2)
    assert [entry.data for entry in entries if isinstance(entry, Packet)] == [PING[:7]]


StartFaults = Callable[..., Awaitable[tuple[FaultProxy, Stream, Stream]]]


@pytest.fixture
async def start_faults(tmp_path: Path) -> AsyncIterator[StartFaults]:
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


async def test_what_no_rule_fits_passes_both_ways(start_faults: StartFaults) -> None:
    _, client, server = await start_faults()
    client.write(PING + b"\0\0\0\0stray")
    assert await server.read(25) == PING + b"\0\0\0\0stray"
    server.write(PONG)
    assert await client.read(16) == PONG


async def test_a_delay_is_kept_by_the_clock(start_faults: StartFaults) -> None:
    _, client, server = await start_faults({"fault": "delay", "ms": 2500})
    loop = asyncio.get_running_loop()
    before = loop.time()
    client.write(PING)
    await server.read(16)
    assert loop.time() - before == pytest.approx(2.5, abs=0.01)


async def test_a_reset_reaches_both_sides(start_faults: StartFaults) -> None:
    _, client, server = await start_faults({"fault": "reset"})
    client.write(PING)
    assert await server.is_reset()
    assert await client.is_reset()


async def test_a_close_is_in_order_on_both_sides(start_faults: StartFaults) -> None:
    proxy, client, server = await start_faults({"fault": "close", "forward": True})
    client.write(PING)
    assert await server.rest() == PING
    assert await client.rest() == b""
    await asyncio.sleep(0.01)
    assert proxy.connections == 0


async def test_a_half_open_connection_stays_and_says_nothing(start_faults: StartFaults) -> None:
    proxy, client, server = await start_faults({"fault": "half_open"})
    client.write(PING)
    await asyncio.sleep(60)
    client.write(PING)
    server.write(PONG)
    for end in (client, server):
        with pytest.raises(TimeoutError):
            await end.rest()
    assert proxy.connections == 1


async def test_a_half_frame_is_forwarded_when_its_sender_ends(start_faults: StartFaults) -> None:
    _, client, server = await start_faults()
    client.write(PING[:6])
    client.writer.write_eof()
    assert await server.rest() == PING[:6]


async def test_a_peer_that_resets_is_reset_though_frames_wait(start_faults: StartFaults) -> None:
    _, client, server = await start_faults({"fault": "delay", "ms": 60_000})
    client.write(PING)
    await asyncio.sleep(1)
    client.reset()
    assert await server.is_reset()


async def test_what_is_held_back_is_bounded(start_faults: StartFaults) -> None:
    proxy, client, _ = await start_faults({"fault": "delay", "ms": 600_000})
    client.write(((65_000).to_bytes(4, "little") + bytes(65_000)) * 300)
    await asyncio.sleep(5)
    assert proxy.relay.frames < 12


async def test_each_fault_is_logged_with_its_rule_and_frame(
    start_faults: StartFaults, tmp_path: Path
) -> None:
    proxy, client, _ = await start_faults({"fault": "drop", "match": {"type": 1}}, log=True)
    client.write(PING)
    await asyncio.sleep(0.5)
    (line,) = (tmp_path / "log.jsonl").read_text().splitlines()
    entry = json.loads(line)
    assert (entry["rule"], entry["fault"], entry["hex"]) == (1, "drop", PING.hex())
    assert proxy.done == {"drop": 1}


PAIR = ["--listen", "0", "--to", "1"]


@pytest.mark.parametrize(
    ("arguments", "code", "reason"),
    [
        ([], 2, "required: --listen, --to, -o"),
        ([*PAIR, "--listen", "0", "-o", "x"], 2, "2 --listen need as many --to, not 1"),
        ([*PAIR, "-o", "/nowhere/x"], 2, "/nowhere/x: No such file or directory"),
        ([*PAIR, "-o", "x", "--max-size", "many"], 2, "'many' is no size such as"),
        (["--listen", "70000", "--to", "1", "-o", "x"], 2, "a port is 0 to 65535"),
        (["--listen", "0", "--to", "0", "-o", "x"], 2, "a port is 1 to 65535"),
        (["--listen", "192.0.2.1:0", "--to", "1", "-o", "FILE"], 3, "cannot listen on"),
    ],
)
def test_a_wrong_argument_is_named(
    arguments: list[str], code: int, reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(tmp_path / "trace")
    assert main([file if argument == "FILE" else argument for argument in arguments]) == code
    assert reason in capsys.readouterr().err


def test_a_port_in_use_is_the_peers_fault(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["--listen", str(port), "--to", "1", "-o", str(tmp_path / "x")]) == 3
    assert capsys.readouterr().err == f"cannot listen on 127.0.0.1:{port}: Address already in use\n"
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("tool", ["record", "faults"])
def test_a_file_is_as_it_was_when_the_port_is_taken(tool: str, tmp_path: Path) -> None:
    file = tmp_path / "trace"
    file.write_text("an hour's recording")
    script = tmp_path / "script"
    script.write_text("rule = []")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        pair = ["--listen", str(taken.getsockname()[1]), "--to", "1"]
        if tool == "record":
            assert main([*pair, "-o", str(file)]) == 3
        else:
            assert faults.main([str(script), *pair, "--log", str(file)]) == 3
    assert file.read_text() == "an hour's recording"


@pytest.mark.parametrize(
    ("text", "endpoint"),
    [
        ("11000", Endpoint("127.0.0.1", 11000)),
        (":11000", Endpoint("127.0.0.1", 11000)),
        ("robot:11000", Endpoint("robot", 11000)),
        ("[::1]:11000", Endpoint("::1", 11000)),
    ],
)
def test_addresses_are_read_as_people_write_them(text: str, endpoint: Endpoint) -> None:
    assert listen_endpoint(text) == target_endpoint(text) == endpoint


@pytest.mark.parametrize("text", ["", "robot", "robot:", "1:2:x", "-1", "99999", "١٢", "9" * 5000])
def test_what_is_no_address_is_said(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match="is no"):
        listen_endpoint(text)
