"""A whole cell as processes on loopback: emulated controller and server, on free ports."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import AsyncIterator, Awaitable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import pytest_asyncio

from openpendant.tools.pendants.client import PendantClient

SCALE = float(os.environ.get("OPENPENDANT_TIME_SCALE", "1"))
"""Waits are multiplied by this on slow machines."""


async def read_ready(process: asyncio.subprocess.Process, name: str) -> dict[str, Any]:
    assert process.stdout is not None
    line = await asyncio.wait_for(process.stdout.readline(), 30 * SCALE)
    assert line, f"{name} ended before it was ready"
    ready: dict[str, Any] = json.loads(line)
    return ready


@dataclass
class RunningCell:
    emulator: asyncio.subprocess.Process
    server: asyncio.subprocess.Process
    controller: dict[str, Any]
    ports: dict[str, Any]
    referee_report: Path
    _stack: contextlib.AsyncExitStack = field(default_factory=contextlib.AsyncExitStack)

    async def pendant(self, **options: Any) -> PendantClient:
        connect = PendantClient.connect("127.0.0.1", self.ports["pendant"], **options)
        return await self._stack.enter_async_context(await connect)

    async def ready_pendant(self, **options: Any) -> PendantClient:
        pendant = await self.pendant(state_rate=100, **options)
        await pendant.wait_until(lambda state: state.motion_possible == 1, within=15 * SCALE)
        return pendant

    async def end(self) -> dict[str, Any]:
        """Stop both processes in order and return the referee's report."""
        await self._stack.aclose()
        for process in (self.server, self.emulator):
            await stop_process(process)
        report: dict[str, Any] = json.loads(self.referee_report.read_text(encoding="utf-8"))
        return report


async def stop_process(process: asyncio.subprocess.Process) -> None:
    if process.returncode is None:
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(signal.SIGTERM)
    try:
        await asyncio.wait_for(process.wait(), 10 * SCALE)
    except TimeoutError:
        process.kill()
        await process.wait()


class StartCell(Protocol):
    def __call__(
        self, *, robot: str = "ur5", start: str = "home", server: tuple[str, ...] = ()
    ) -> Awaitable[RunningCell]: ...


async def _spawn(module: str, *arguments: str) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        sys.executable, "-m", module, *arguments, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE
    )


@pytest_asyncio.fixture
async def start_cell(tmp_path: Path) -> AsyncIterator[StartCell]:
    cells: list[RunningCell] = []

    async def start(
        *, robot: str = "ur5", start: str = "home", server: tuple[str, ...] = ()
    ) -> RunningCell:
        report = tmp_path / f"referee-{len(cells)}.json"
        emulator = await _spawn(
            "openpendant.controller_emulator",
            *("--robot", robot, "--start", start, "--report", str(report), "--json"),
            *("--motion-port", "0", "--state-port", "0"),
        )
        controller = await read_ready(emulator, "the emulator")
        process = await _spawn(
            "openpendant.server",
            *("--robot", robot, "--json", "--pendant-port", "0"),
            *("--ros-motion-port", "0", "--ros-state-port", "0"),
            *("--controller", f"127.0.0.1:{controller['motion']}:{controller['state']}"),
            *server,
        )
        ports = await read_ready(process, "the server")
        cell = RunningCell(emulator, process, controller, ports, report)
        cells.append(cell)
        return cell

    yield start
    for cell in cells:
        await cell._stack.aclose()
        for process in (cell.server, cell.emulator):
            await stop_process(process)
