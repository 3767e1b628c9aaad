"""Journals of real processes: they run again exactly, and never get in the way."""

import asyncio
import json
import sys
from pathlib import Path
from typing import Any

import pytest

from openpendant.tools.packets.rerun import main

pytestmark = pytest.mark.realtime


async def _swing(cell: Any) -> None:
    pendant = await cell.ready_pendant()
    async with pendant.control():
        home = pendant.joints()
        aside = (home[0] + 0.2, *home[1:])
        await (await pendant.move_joints(aside, speed=0.5)).done()
        await (await pendant.follow_joints([home, aside, home], speed=0.5)).done()


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
