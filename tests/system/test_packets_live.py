"""The live packet tools as they are used: processes, real sockets, a full disk."""

import asyncio
import json
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from openpendant.tools.packets.reading.trace_files import read_trace

pytestmark = pytest.mark.realtime

PATIENCE_S = 30

Started = tuple[asyncio.subprocess.Process, dict[str, Any]]
Start = Callable[..., Awaitable[Started]]


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


async def packets(*arguments: str) -> tuple[int | None, str, str]:
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "openpendant.tools.packets.cli", *arguments),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    out, err = await asyncio.wait_for(process.communicate(), PATIENCE_S)
    return process.returncode, out.decode(), err.decode()


async def ended(process: asyncio.subprocess.Process, by: signal.Signals) -> tuple[int | None, str]:
    process.send_signal(by)
    _, errors = await asyncio.wait_for(process.communicate(), PATIENCE_S)
    return process.returncode, errors.decode()


async def test_a_recorded_stop_is_replayed_with_the_same_result(
    start: Start, tmp_path: Path
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


async def test_traffic_goes_on_when_the_disk_is_full(start: Start) -> None:
    motion = await emulator(start)
    recorder, ready = await start(
        "openpendant.tools.packets.cli",
        *("record", "--listen", "0", "--to", str(motion), "-o", "/dev/full"),
    )
    port = str(ready["listen"][0]["port"])
    code, out, _ = await packets("send", port, "ping", "--count", "3")
    assert (code, out.count("ping reply success")) == (0, 3)
    code, errors = await ended(recorder, signal.SIGINT)
    assert code == 1
    assert errors == "the recording ends here: No space left on device; traffic goes on\n"


async def test_a_full_disk_ends_everything_where_that_is_asked_for(start: Start) -> None:
    recorder, _ = await start(
        "openpendant.tools.packets.cli",
        *("record", "--listen", "0", "--to", "1", "-o", "/dev/full", "--fail", "stop"),
    )
    assert await asyncio.wait_for(recorder.wait(), PATIENCE_S) == 1
