import asyncio
import contextlib
import json
import signal
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from rigs.clock.busy_machine import PATIENCE, PATIENT, SCALE
from rigs.processes.warm_start import WarmProcess

from openpendant.simplemsg import PENDANT, Message, codec_for
from openpendant.simplemsg.pendant import State
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import PendantClient


class PatientPendant(PendantClient):
    async def wait_until(
        self, condition: Callable[[State], bool], *, within: float = PATIENCE
    ) -> State:
        return await super().wait_until(condition, within=within)


async def read_ready(process: WarmProcess, name: str) -> dict[str, Any]:
    line = await asyncio.wait_for(asyncio.to_thread(process.line), PATIENCE)
    assert line, f"{name} ended before it was ready"
    ready: dict[str, Any] = json.loads(line)
    return ready


@dataclass
class RunningCell:
    emulator: WarmProcess
    server: WarmProcess
    controller: dict[str, Any]
    ports: dict[str, Any]
    referee_report: Path
    _stack: contextlib.AsyncExitStack = field(default_factory=contextlib.AsyncExitStack)

    async def pendant(self, **options: Any) -> PendantClient:
        connect = PatientPendant.connect("127.0.0.1", self.ports["pendant"], **options)
        return await self._stack.enter_async_context(await connect)

    async def ready_pendant(self, **options: Any) -> PendantClient:
        pendant = await self.pendant(state_rate=100, **options)
        await pendant.wait_until(lambda state: state.motion_possible == 1)
        # The store is read while the first clients come, and no motion begins before.
        while any(  # noqa: ASYNC110 - what is waited for tells nobody
            each["code"] == V.CHANGE_WHILE_MOVING for each in (await pendant.why())["conditions"]
        ):
            await asyncio.sleep(0.01)
        return pendant

    async def tell_controller(self, message: Message) -> int:
        """Send a message to the controller's motion port; return the reply's code."""
        reader, writer = await asyncio.open_connection("127.0.0.1", self.controller["motion"])
        writer.write(codec_for(PENDANT).encode(message))
        async with asyncio.timeout(PATIENCE):
            reply = codec_for(PENDANT).decode(await reader.readexactly(16))
        writer.close()
        await writer.wait_closed()
        return reply.reply_code

    def at_end(self, close: Callable[[], Awaitable[None]]) -> None:
        self._stack.push_async_callback(close)

    async def hang_up(self) -> None:
        await self._stack.aclose()

    async def stop(self) -> None:
        await self.hang_up()
        for process in (self.server, self.emulator):
            await stop_process(process)

    async def end(self) -> dict[str, Any]:
        await self.stop()
        report: dict[str, Any] = json.loads(self.referee_report.read_text(encoding="utf-8"))
        return report


async def stop_process(process: WarmProcess) -> None:
    process.send_signal(signal.SIGTERM)
    try:
        await asyncio.wait_for(process.wait(), 20 * SCALE)
    except TimeoutError:
        process.kill()
        await process.wait()


class StartCell:
    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._cells: list[RunningCell] = []
        self._numbers = count()

    async def __call__(
        self,
        *,
        robot: str = "ur5",
        start: str = "home",
        settings: str = PATIENT,
        server: tuple[str, ...] = (),
        emulator: tuple[str, ...] = (),
        has_store: bool = False,
        log: Path | None = None,
    ) -> RunningCell:
        """Start a cell; where it is given no configuration, the server gets one of `settings`.

        What the server logs goes to `log`, or where the tests' own output goes.
        """
        number = next(self._numbers)
        report = self._folder / f"referee-{number}.json"
        if "--config" not in server:
            config = self._folder / f"server-{number}.toml"
            config.write_text(settings, encoding="utf-8")
            server = (*server, "--config", str(config))
        if has_store:
            server = (*server, "--store", str(self._folder / f"store-{number}.db"))
        controlling = WarmProcess(
            "openpendant.controller_emulator",
            *("--robot", robot, "--start", start, "--report", str(report), "--json"),
            *("--motion-port", "0", "--state-port", "0"),
            *emulator,
        )
        controller = await read_ready(controlling, "the emulator")
        serving = WarmProcess(
            "openpendant.server",
            *("--robot", robot, "--json", "--pendant-port", "0"),
            *("--ros-motion-port", "0", "--ros-state-port", "0"),
            *("--controller", f"127.0.0.1:{controller['motion']}:{controller['state']}"),
            *server,
            log=log,
        )
        ports = await read_ready(serving, "the server")
        cell = RunningCell(controlling, serving, controller, ports, report)
        self._cells.append(cell)
        return cell

    async def end(self) -> None:
        for cell in self._cells:
            await cell.stop()
        # An emulator that was killed has left no report.
        reports = [cell.referee_report for cell in self._cells if cell.referee_report.exists()]
        told = [json.loads(report.read_text(encoding="utf-8")) for report in reports]
        violations = [each["first"] for each in told if each["violations"]]
        assert violations == []


@pytest_asyncio.fixture
async def start_cell(tmp_path: Path) -> AsyncIterator[StartCell]:
    cells = StartCell(tmp_path)
    yield cells
    await cells.end()


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def start_cell_of_the_file(
    tmp_path_factory: pytest.TempPathFactory,
) -> AsyncIterator[StartCell]:
    cells = StartCell(tmp_path_factory.mktemp("cell"))
    yield cells
    await cells.end()


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def cell_of_the_file(
    request: pytest.FixtureRequest, start_cell_of_the_file: StartCell
) -> RunningCell:
    return await start_cell_of_the_file(**getattr(request.module, "CELL", {}))


@pytest_asyncio.fixture(loop_scope="module")
async def shared_cell(cell_of_the_file: RunningCell) -> AsyncIterator[RunningCell]:
    """The cell of the file for a test that leaves it as it found it, but for where the robot is.

    What the test connected is hung up after it. Such tests run on the loop of their file.
    """
    yield cell_of_the_file
    await cell_of_the_file.hang_up()
