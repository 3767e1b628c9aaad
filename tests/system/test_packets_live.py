"""Packet tools and journals beside real processes: sockets, a full disk, tshark.

Journals run again exactly, and never get in the way.
"""

import asyncio
import io
import json
import random
import shutil
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from rigs.data.golden_vectors import GOLDEN
from rigs.data.pcap_files import Conversation, Stamped, pcap

from openpendant.tools.packets.cli import main as tool
from openpendant.tools.packets.reading.trace_files import read_trace
from openpendant.tools.packets.rerun import main
from openpendant.tools.packets.trace import Packet, TraceDirection

pytestmark = pytest.mark.realtime

PATIENCE_S = 30

Started = tuple[asyncio.subprocess.Process, dict[str, Any]]
Start = Callable[..., Awaitable[Started]]
Packets = Callable[..., Awaitable[tuple[int, str, str]]]


@pytest.fixture
async def start() -> AsyncIterator[Start]:
    processes: list[asyncio.subprocess.Process] = []

    async def begin(module: str, *arguments: str) -> Started:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", module, *arguments, "--json"),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        processes.append(process)
        assert process.stdout is not None
        line = await asyncio.wait_for(process.stdout.readline(), PATIENCE_S)
        return process, json.loads(line)

    yield begin
    for process in processes:
        if process.returncode is None:
            process.kill()
        await process.communicate()


async def emulator(start: Start) -> int:
    _, ready = await start(
        "openpendant.controller_emulator", "--motion-port", "0", "--state-port", "0"
    )
    return int(ready["motion"])


@pytest.fixture
def packets(capsys: pytest.CaptureFixture[str]) -> Packets:
    """Run a tool to its end in a thread; its exit code and what it said on its two outputs."""

    async def run(*arguments: str) -> tuple[int, str, str]:
        code = await asyncio.wait_for(asyncio.to_thread(tool, list(arguments)), PATIENCE_S)
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


async def ended(process: asyncio.subprocess.Process, by: signal.Signals) -> tuple[int | None, str]:
    process.send_signal(by)
    _, errors = await asyncio.wait_for(process.communicate(), PATIENCE_S)
    return process.returncode, errors.decode()


async def test_a_recorded_stop_is_replayed_with_the_same_result(
    start: Start, packets: Packets, tmp_path: Path
) -> None:
    motion = await emulator(start)
    trace = tmp_path / "trace.jsonl"
    recorder, ready = await start(
        "openpendant.tools.packets.cli",
        *("record", "--listen", "0", "--to", str(motion), "-o", str(trace)),
    )
    port = str(ready["listen"][0]["port"])
    assert (await packets("send", port, "ping"))[0] == 0
    code, out, _ = await packets("send", port, "stop", "--json")
    assert (code, json.loads(out)["reply_code"]) == (0, 1)
    assert await ended(recorder, signal.SIGTERM) == (0, "")
    assert len([entry for entry in read_trace(trace) if hasattr(entry, "data")]) == 4

    replay = ["replay", str(trace), "--as", "client", "--to", str(motion), "--as-fast-as-replies"]
    code, out, errors = await packets(*replay)
    assert (code, errors) == (0, "")
    assert out == "2 packets sent, 2 came back, 0 differences\n"


async def test_traffic_goes_on_when_the_disk_is_full(start: Start, packets: Packets) -> None:
    motion = await emulator(start)
    recorder, ready = await start(
        "openpendant.tools.packets.cli",
        *("record", "--listen", "0", "--to", str(motion), "-o", "/dev/full"),
    )
    port = str(ready["listen"][0]["port"])
    assert recorder.stderr is not None
    told = asyncio.create_task(recorder.stderr.readline())
    async with asyncio.timeout(PATIENCE_S):
        while not told.done():
            assert (await packets("send", port, "ping"))[0] == 0
    assert await told == b"the recording ends here: No space left on device; traffic goes on\n"
    code, out, _ = await packets("send", port, "ping", "--count", "3")
    assert (code, out.count("ping reply success")) == (0, 3)
    assert await ended(recorder, signal.SIGINT) == (1, "")


async def test_a_full_disk_ends_everything_where_that_is_asked_for(start: Start) -> None:
    recorder, _ = await start(
        "openpendant.tools.packets.cli",
        *("record", "--listen", "0", "--to", "1", "-o", "/dev/full", "--fail", "stop"),
    )
    assert await asyncio.wait_for(recorder.wait(), PATIENCE_S) == 1


async def _swing(cell: Any) -> None:
    pendant = await cell.ready_pendant()
    async with pendant.control():
        home = pendant.joints()
        aside = (home[0] + 0.2, *home[1:])
        await (await pendant.move_joints(aside, speed=1.0)).done()
        await (await pendant.follow_joints([home, aside, home], speed=1.0)).done()


async def test_a_server_that_moved_a_robot_runs_again_exactly(
    start_cell: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    journal = tmp_path / "server.journal"
    cell = await start_cell(server=("--journal", str(journal)))
    await _swing(cell)
    await cell.end()
    # The rerun has a loop of its own, which must not be nested in this one.
    assert await asyncio.to_thread(main, [str(journal), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["identical"]
    assert report["bytes_out"] > 10_000
    assert report["state"]["activity"] == "idle"


async def test_a_full_disk_does_not_hold_up_the_robot(start_cell: Any) -> None:
    """Nor does it need more patience than the settings that nobody chose have."""
    cell = await start_cell(settings="", server=("--journal", "/dev/full"))
    await _swing(cell)
    assert (await cell.end())["violations"] == 0


@pytest.mark.parametrize("module", ["openpendant.server", "openpendant.controller_emulator"])
async def test_a_journal_that_cannot_be_opened_is_one_line_and_exit_code_1(
    module: str, tmp_path: Path
) -> None:
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", module, "--journal", str(tmp_path / "no" / "file")),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    _, told = await process.communicate()
    assert process.returncode == 1
    assert told.decode().count("\n") == 1
    assert "no/file" in told.decode()


TSHARK = shutil.which("tshark")


def disordered(seed: int, stream: bytes) -> list[Stamped]:
    choose = random.Random(seed)
    link = Conversation(client=("10.0.0.1", 40_000 + seed), sequences=[2**32 - 5_000, 77])
    opened = link.opened()
    base, at = link.sequences[0], 0
    spans: list[tuple[int, int]] = []
    while at < len(stream):
        start = max(0, at - choose.choice([0, 0, 0, 30]))
        at = min(len(stream), at + choose.randint(1, 700))
        spans += [(start, at)] * choose.choice([1, 1, 1, 2])
    late = [index + choose.choice([0, 0, 0, 2.5]) for index in range(len(spans))]
    spans = [span for _, span in sorted(zip(late, spans, strict=True))]
    return [*opened, *(link.segment(0, stream[start:end], at=base + start) for start, end in spans)]


@pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")
def test_streams_are_put_together_as_tshark_does(tmp_path: Path) -> None:
    stream = b"".join(packet.frame for packet in GOLDEN if packet.file == "motoman-le-f32")
    frames = [frame for seed in range(6) for frame in disordered(seed, stream)]
    file = tmp_path / "disorder.pcap"
    file.write_bytes(pcap(frames))
    ours: dict[int, bytes] = {}
    for entry in read_trace(io.BytesIO(file.read_bytes())):
        if isinstance(entry, Packet) and entry.direction is TraceDirection.TO_SERVER:
            ours[entry.connection] = ours.get(entry.connection, b"") + entry.data
    for index in range(6):
        assert ours[index + 1] == _followed(file, index) == stream


def _followed(file: Path, stream: int) -> bytes:
    command = ["tshark", "-r", str(file), "-q", "-z", f"follow,tcp,raw,{stream}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    lines = done.stdout.split("Node 1:", 1)[1].splitlines()[1:]
    digits = [line.strip() for line in lines if not line.startswith("=")]
    return bytes.fromhex("".join(digits))
