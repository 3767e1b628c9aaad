"""A server that freezes in the middle of a motion (promise 26)."""

from __future__ import annotations

import asyncio
import os
import signal
from typing import Any

import pytest

from openpendant.simplemsg.pendant import StopKind
from openpendant.tools.pendants.client import Aborted

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio]


async def test_a_frozen_server_is_stopped_by_its_watchdog_and_goes_on_with_nothing(
    start_cell: Any,
) -> None:
    cell = await start_cell()
    pendant = await cell.ready_pendant()
    async with pendant.control():
        start = pendant.joints()
        target = [start[0] + 0.8, *start[1:]]
        move = await pendant.move_joints(target, speed=0.1)
        await pendant.wait_until(lambda state: state.positions[0] > start[0] + 0.05)

        os.kill(cell.server.pid, signal.SIGSTOP)
        # Ten times the watchdog's deadline: a busy machine lets it wait as well.
        await asyncio.sleep(1.0)
        os.kill(cell.server.pid, signal.SIGCONT)

        with pytest.raises(Aborted):
            await move.done()
        state = await pendant.wait_until(lambda state: state.stop != StopKind.NONE, within=5)
        assert state.stop == StopKind.PROTECTIVE
        await pendant.wait_until(lambda state: not any(state.velocities), within=5)
        at = pendant.joints()
        await asyncio.sleep(0.5)
        assert pendant.joints() == at
        assert at[0] < target[0] - 0.1
    report = await cell.end()
    assert report["events"]["stops"] >= 1
