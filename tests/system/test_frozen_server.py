"""A server that freezes in the middle of a motion (promise 26)."""

import asyncio
import json
import os
import signal
import time
from pathlib import Path
from typing import Any

import pytest
from rigs.peers.minimum_controller import CODEC, STOP

from openpendant.simplemsg.pendant import StopKind
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import Aborted

pytestmark = pytest.mark.realtime

ALERT = "controller.lead = 0.1\nwatchdog.deadline = 0.05\n"
"""The controller has points for twice as long as the watchdog waits."""


def stops_received(journal: Path) -> list[int]:
    """Return when an emulator got STOP, by its journal [ns of the machine's monotonic clock]."""
    header, *events = (json.loads(line) for line in journal.read_text("utf-8").splitlines())
    stop = CODEC.encode(STOP).hex()
    return [
        header["now"] + event["t"]
        for event in events
        if "on" in event and stop in event.get("hex", "")
    ]


async def freeze_in_motion(cell: Any, journal: Path) -> dict[str, int]:
    pendant = await cell.ready_pendant()
    async with pendant.control():
        start = pendant.joints()
        target = [start[0] + 0.8, *start[1:]]
        move = await pendant.move_joints(target, speed=0.1)
        await pendant.wait_until(lambda state: state.positions[0] > start[0] + 0.02)

        frozen = time.monotonic_ns()
        os.kill(cell.server.pid, signal.SIGSTOP)
        # Twenty times the watchdog's deadline: a busy machine lets it wait as well.
        await asyncio.sleep(1.0)
        thawed = time.monotonic_ns()
        os.kill(cell.server.pid, signal.SIGCONT)

        with pytest.raises(Aborted) as aborted:
            await move.done()
        assert aborted.value.code == V.SERVER_LATE
        state = await pendant.wait_until(lambda state: state.stop != StopKind.NONE, within=5)
        assert state.stop == StopKind.PROTECTIVE
        await pendant.wait_until(lambda state: not any(state.velocities), within=5)
        at = pendant.joints()
        await asyncio.sleep(0.5)
        assert pendant.joints() == at
        assert at[0] < target[0] - 0.1
    events: dict[str, int] = (await cell.end())["events"]
    assert frozen < stops_received(journal)[0] < thawed
    return events


async def test_a_frozen_server_is_stopped_by_its_watchdog_and_goes_on_with_nothing(
    start_cell: Any, tmp_path: Path
) -> None:
    """STOP comes while the server is frozen, and before the points end."""
    journal = tmp_path / "emulator.journal"
    cell = await start_cell(settings=ALERT, emulator=("--journal", str(journal)))
    assert "under-runs" not in await freeze_in_motion(cell, journal)
