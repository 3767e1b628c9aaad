import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import cast

import pytest
from promises.promise_table import figure
from rigs.cells.expectations import expect, known
from rigs.clock.virtual_clock import VirtualLoop
from rigs.processes.app_on_loop import app_on_loop

from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.server.shell.app import App
from openpendant.server.watchdog.watchdog_process import Watchdog
from openpendant.server.watchdog.watchdog_protocol import BeatWatch
from openpendant.simplemsg import Message
from openpendant.tools.pendants.client import PendantClient

pytestmark = pytest.mark.virtual_clock

MS = 1_000_000
DEADLINE, EMULATED = figure(26, "stop").ns, figure(26, "emulated").ns


def loop() -> VirtualLoop:
    return expect(VirtualLoop, asyncio.get_running_loop())


def stand_still(milliseconds: int) -> None:
    loop()._virtual.now_ns += milliseconds * MS


class Judge:
    def __init__(self) -> None:
        self._watch = BeatWatch(DEADLINE, EMULATED, loop().now_ns)
        self.has_stopped = False
        self.tells = 0
        self.told: list[bool] = []

    def beat(self, moving: Sequence[bool], emulated: Sequence[bool]) -> int:
        self._look()
        self._watch.beat(int(moving[0]), int(emulated[0]), loop().now_ns)
        self.told.append(moving[0])
        told, self.tells = self.tells, 0
        return told

    def update(self, moving: Sequence[bool], emulated: Sequence[bool]) -> None:
        self._look()
        self._watch.update(int(moving[0]), int(emulated[0]))
        self.told.append(moving[0])

    def _look(self) -> None:
        self.has_stopped |= bool(self._watch.overdue(loop().now_ns))


@asynccontextmanager
async def moved() -> AsyncIterator[tuple[App, Judge, PendantClient]]:
    judge = Judge()
    async with app_on_loop(watchdog=cast(Watchdog, judge)) as served:
        pendant = await PendantClient.connect("127.0.0.1", served.pendant)
        await pendant.wait_until(lambda state: state.motion_possible == 1)
        async with pendant.control():
            at = pendant.joints()
            await pendant.move_joints([at[0] + 0.5, *at[1:]], speed=0.1)
            await asyncio.sleep(0.5)
            yield served.app, judge, pendant
        await pendant.close()


@pytest.mark.parametrize("deadline", [DEADLINE, EMULATED])
@pytest.mark.parametrize(
    ("before", "within", "is_freeze"),
    [
        (-40, 50, False),
        (-50, 60, False),
        (-15, 0, False),
        (None, -15, False),
        (5, 0, True),
        (None, 5, True),
        (5, 105, True),
    ],
)
async def test_promise_26_server_and_watchdog_agree_on_a_delay_in_two_halves(
    deadline: int, before: int | None, within: int, is_freeze: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tick begins late, by so much less than the deadline, and then takes long [ms].

    Where it begins in time, it takes as long as the deadline, or less by so much.
    """
    whole = deadline // MS
    async with moved() as (app, judge, _):
        app.cells[0].core.cell.feedback.says_emulated = deadline == EMULATED
        await asyncio.sleep(0.05)
        check, left = app.inbox.check_deadlines, [within + (whole if before is None else 0)]

        def slowly(now: int) -> None:
            stand_still(left.pop() if left else 0)
            check(now)

        monkeypatch.setattr(app.inbox, "check_deadlines", slowly)
        if before is not None:
            stand_still(whole + before)
        await asyncio.sleep(0.1)
        assert judge.has_stopped is is_freeze
        stop = app.cells[0].core.cell.stop
        assert (stop is not None and "did not tick" in stop.reason) is is_freeze


async def test_promise_26_a_stop_that_the_watchdog_tells_of_is_latched_in_the_next_tick() -> None:
    async with moved() as (app, judge, _):
        judge.tells = 0b10
        app.tick()
        assert app.cells[0].core.cell.stop is None, "it told of another cell"
        judge.tells = 0b01
        app.tick()
        assert known(app.cells[0].core.cell.stop).is_protective


async def test_promise_26_the_watchdog_knows_of_a_motion_before_its_first_point_leaves() -> None:
    async with moved() as (app, judge, pendant):
        await pendant.stop()
        await asyncio.sleep(0.5)
        await pendant.reset_stop()
        await asyncio.sleep(0.1)
        assert judge.told[-1] is False
        known: list[bool] = []
        link = app.cells[0].links[ControllerPath.MOTION]
        send = link.send

        def noting(message: Message) -> bool:
            known.append(judge.told[-1])
            return send(message)

        link.send = noting  # type: ignore[method-assign]
        at = pendant.joints()
        await pendant.move_joints([at[0] + 0.1, *at[1:]], speed=0.1)
        await asyncio.sleep(0.1)
        assert known
        assert all(known)
