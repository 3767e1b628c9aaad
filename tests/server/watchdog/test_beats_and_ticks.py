"""What the watchdog takes for a freeze the server takes for one too, and the other way round."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import cast

import pytest
from judged_server import ROBOT, LoopPlanner, running_emulator
from virtual_clock import VirtualLoop

from openpendant.motion.robot import serial_robot
from openpendant.server.app import App
from openpendant.server.cell_shell import ServedCell
from openpendant.server.settings import make_settings
from openpendant.server.watchdog.process import Watchdog
from openpendant.server.watchdog.watchdog import BeatWatch
from openpendant.tools.pendants.client import PendantClient

pytestmark = [pytest.mark.virtual_clock, pytest.mark.asyncio]

MS = 1_000_000
DEADLINE = 100 * MS


def loop() -> VirtualLoop:
    running = asyncio.get_running_loop()
    assert isinstance(running, VirtualLoop)
    return running


def stand_still(milliseconds: int) -> None:
    """Let the loop take its time over what it does."""
    loop()._virtual.now_ns += milliseconds * MS


class Judge:
    """The watchdog's rule at the loop's own clock, in place of its process."""

    def __init__(self) -> None:
        self._watch = BeatWatch(DEADLINE, loop().now_ns)
        self.has_stopped = False
        self.tells = False

    def beat(self, moving: Sequence[bool]) -> bool:
        self._look()
        self._watch.beat(int(moving[0]), loop().now_ns)
        told, self.tells = self.tells, False
        return told

    def news(self, moving: Sequence[bool]) -> None:
        self._look()
        self._watch.news(int(moving[0]))

    def _look(self) -> None:
        self.has_stopped |= bool(self._watch.overdue(loop().now_ns))


@asynccontextmanager
async def controlled() -> AsyncIterator[tuple[App, Judge]]:
    """Run a server whose robot somebody controls."""
    async with running_emulator() as emulator:
        link = {"motion_port": emulator.motion_port, "state_port": emulator.state_port}
        listen = {"pendant_port": 0, "ros_motion_port": "off", "ros_state_port": "off"}
        settings = make_settings({"robot": ROBOT, "controller": link, "listen": listen}, "test")
        judge, cell = Judge(), ServedCell(settings, serial_robot(ROBOT), LoopPlanner())
        app = App([cell], watchdog=cast(Watchdog, judge))
        async with app.running() as bound:
            pendant = await PendantClient.connect("127.0.0.1", bound.pendant)
            await pendant.wait_until(lambda state: state.motion_possible == 1)
            async with pendant.control():
                await asyncio.sleep(0.1)
                yield app, judge
            await pendant.close()


@pytest.mark.parametrize(
    ("before", "within", "is_freeze"),
    [
        (60, 50, False),
        (50, 60, False),
        (85, 0, False),
        (0, 85, False),
        (105, 0, True),
        (0, 105, True),
        (105, 105, True),
    ],
)
async def test_promise_26_server_and_watchdog_agree_on_a_delay_in_two_halves(
    before: int, within: int, is_freeze: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tick begins late and then takes long [ms]."""
    async with controlled() as (app, judge):
        check, left = app.clients.check_deadlines, [within]

        def slowly(now: int) -> None:
            stand_still(left.pop() if left else 0)
            check(now)

        monkeypatch.setattr(app.clients, "check_deadlines", slowly)
        stand_still(before)
        await asyncio.sleep(0.1)
        assert judge.has_stopped is is_freeze
        assert (app.cells[0].core.cell.stop is not None) is is_freeze


async def test_promise_26_a_stop_that_the_watchdog_tells_of_is_latched_in_the_next_tick() -> None:
    async with controlled() as (app, judge):
        judge.tells = True
        app.tick()
        stop = app.cells[0].core.cell.stop
        assert stop is not None
        assert stop.is_protective
