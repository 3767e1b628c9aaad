import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import pytest
from rigs.clock.virtual_clock import VirtualLoop
from rigs.processes.bare_app import bare_app
from rigs.processes.judged_server import ROBOT, LoopPlanner, running_emulator

from openpendant.motion.description.robot import serial_robot
from openpendant.server.cli import serve
from openpendant.server.events.effects import Effect
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.settings.server_settings import ServerSettings, make_server_settings
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.shell.loop_share import LoopShare
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import Activity, StopKind
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.packets.rerun import main as rerun
from openpendant.tools.pendants.client import Aborted, ConnectionLost, PendantClient, Refused

pytestmark = pytest.mark.virtual_clock

NAMES = ("left", "right")


@dataclass
class Room:
    """A server of two cells.

    Attributes:
        app: the server.
        port: where it listens for pendants.
    """

    app: App
    port: int

    async def pendant(self, cell: str) -> PendantClient:
        pendant = await PendantClient.connect("127.0.0.1", self.port, cell=cell, state_rate=50)
        await pendant.wait_until(lambda state: state.motion_possible == 1)
        return pendant


@asynccontextmanager
async def running_room(file: Path | None = None) -> AsyncIterator[Room]:
    async with AsyncExitStack() as stack:
        tables = []
        for name in NAMES:
            emulator = await stack.enter_async_context(running_emulator())
            link = {"motion_port": emulator.motion_port, "state_port": emulator.state_port}
            tables.append({"name": name, "robot": ROBOT, "controller": link})
        settings = make_server_settings({"listen": {"pendant_port": 0}, "cells": tables}, "test")
        journal = Journal()
        stack.enter_context(serve.kept_journal(journal, file, settings))
        app = bare_app(_served(settings), journal)
        ports = await stack.enter_async_context(app.running())
        yield Room(app, ports.pendant)


def _served(settings: ServerSettings) -> list[CellParts]:
    return [CellParts(cell, serial_robot(ROBOT), LoopPlanner()) for cell in settings.cells]


async def moved(pendant: PendantClient, joint: int) -> None:
    goal = list(pendant.joints())
    goal[joint] += 0.2
    async with pendant.control():
        await (await pendant.move_joints(goal, speed=0.5)).done()


async def test_each_pendant_moves_the_robot_of_its_cell() -> None:
    async with running_room() as room:
        left, right = [await room.pendant(name) for name in NAMES]
        before = right.joints()
        await asyncio.gather(moved(left, 0), moved(right, 1))
        after = (await right.next_state()).positions
        assert [left.hello.cell, right.hello.cell] == ["left", "right"]
        assert after[0] == pytest.approx(before[0], abs=1e-6)
        assert after[1] == pytest.approx(before[1] + 0.2, abs=1e-5)
        await left.close()
        await right.close()


async def test_a_software_stop_stays_in_its_cell() -> None:
    async with running_room() as room:
        left, right = [await room.pendant(name) for name in NAMES]
        await left.stop("enough")
        await moved(right, 0)
        assert [cell.core.cell.stop is None for cell in room.app.cells] == [False, True]
        await left.close()
        await right.close()


def raising(after: int, tick: Callable[[int], list[Effect]]) -> Callable[[int], list[Effect]]:
    ticks = 0

    def broken(now: int) -> list[Effect]:
        nonlocal ticks
        ticks += 1
        if ticks > after:
            raise ZeroDivisionError("a fault for the test")
        return tick(now)

    return broken


async def test_a_fault_in_one_cells_tick_stops_that_robot_and_disturbs_no_other(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async with running_room() as room:
        left, right = [await room.pendant(name) for name in NAMES]
        core = room.app.cells[0].core
        first, *others = core._ticked
        monkeypatch.setattr(core, "_ticked", (raising(20, first), *others))
        with caplog.at_level(logging.ERROR):
            doomed = asyncio.create_task(moved(left, 0))
            await moved(right, 0)
            with pytest.raises(ConnectionLost):
                await doomed
        assert [record.levelname for record in caplog.records] == ["ERROR"]
        assert "cell left: A fault of the server itself stopped this cell" in caplog.text
        assert "Traceback" not in caplog.text
        with pytest.raises(Refused, match="fault of the server ended cell 'left'"):
            await PendantClient.connect("127.0.0.1", room.port, cell="left")
        await right.close()
        await left.close()


async def test_the_end_of_the_server_brings_every_robot_to_rest_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    at_the_end: list[bool] = []
    async with running_room() as room:
        pendants = [await room.pendant(name) for name in NAMES]
        moves = [asyncio.create_task(moved(pendant, 0)) for pendant in pendants]
        await asyncio.sleep(0.3)
        assert [cell.core.is_moving for cell in room.app.cells] == [True, True]
        cells, hang_up = room.app.cells, room.app.hang_up

        def look_and_hang_up() -> None:
            at_the_end.extend(cell.core.cell.feedback.is_standing for cell in cells)
            hang_up()

        monkeypatch.setattr(room.app, "hang_up", look_and_hang_up)
    await asyncio.gather(*moves, return_exceptions=True)
    for pendant in pendants:
        await pendant.close()
    assert at_the_end == [True, True]


def test_the_journal_of_two_cells_runs_again_to_the_byte(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], virtual_loop: VirtualLoop
) -> None:
    file = tmp_path / "server.journal"

    async def live() -> None:
        async with running_room(file) as room:
            for name in NAMES:
                pendant = await room.pendant(name)
                await moved(pendant, 1)
                goal = [[value + 0.05 for value in pendant.joints()], list(pendant.joints())]
                async with pendant.control():
                    await (await pendant.follow_joints(goal)).done()
                await pendant.close()

    virtual_loop.run_until_complete(live())
    assert rerun([str(file)]) == 0
    assert "identical" in capsys.readouterr().out


@asynccontextmanager
async def running_app() -> AsyncIterator[tuple[App, int]]:
    async with running_emulator() as emulator:
        link = {"motion_port": emulator.motion_port, "state_port": emulator.state_port}
        ports = {"pendant_port": 0, "ros_motion_port": 0, "ros_state_port": 0}
        settings = make_settings({"robot": ROBOT, "listen": ports, "controller": link}, "test")
        app = bare_app([CellParts(settings, serial_robot(ROBOT), LoopPlanner())])
        async with app.running() as listening:
            yield app, listening.pendant


async def connected(port: int) -> PendantClient:
    pendant = await PendantClient.connect("127.0.0.1", port, state_rate=100)
    await pendant.wait_until(lambda state: state.motion_possible == 1)
    return pendant


def broken(*_: object) -> NoReturn:
    raise ZeroDivisionError("a fault\nfor the test")


async def talk(other: PendantClient | None, port: int) -> None:
    pendant = other or await PendantClient.connect("127.0.0.1", port, state_rate=100)
    while True:
        await pendant.next_state()
        await pendant.release_control()


def newest(app: App) -> Any:
    return app.clients.by_session[max(app.clients.by_session)]


async def test_a_client_that_stays_after_our_fault_is_one_incident_all_the_same(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    async with running_app() as (app, port):
        other = await connected(port)
        with monkeypatch.context() as patch:
            patch.setattr(newest(app)._transport, "close", lambda: None)
            patch.setattr(newest(app).wire, "send", broken)
            await asyncio.sleep(0.3)
        incidents = [each for each in caplog.records if each.levelno >= logging.ERROR]
        await other.close()
    assert len(incidents) == 1


FAULTS: dict[str, tuple[Callable[[App], object], str, bool]] = {
    "let in": (lambda app: app.cells[0].core.pendants, "opened", True),
    "count": (lambda app: app.login.places, "_by_count", True),
    "handle": (lambda app: app.cells[0].core.pendants, "receive", False),
    "decode": (lambda app: newest(app).wire, "receive", False),
    "encode": (lambda app: newest(app).wire, "send", False),
    "look at deadlines": (newest, "is_clogged", False),
}
"""Whose method fails that serves a client, and whether a new one."""


@pytest.mark.parametrize(("whose", "method", "is_new"), FAULTS.values(), ids=FAULTS)
async def test_a_fault_anywhere_in_serving_a_client_is_one_incident(
    whose: Callable[[App], object],
    method: str,
    is_new: bool,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    async with running_app() as (app, port):
        holder = await connected(port)
        await holder.take_control()
        goal = [holder.joints()[0] + 1.0, *holder.joints()[1:]]
        other = None if is_new else await connected(port)
        move = await holder.move_joints(goal, speed=0.1)
        with monkeypatch.context() as patch:
            patch.setattr(whose(app), method, broken)
            with pytest.raises((ConnectionLost, OSError)):
                await talk(other, port)
        with pytest.raises(Aborted) as aborted:
            await move.done()
        assert aborted.value.code == V.PROTECTIVE_STOP
        assert "incident" in aborted.value.text
        assert app.cells[0].core.fault is None
        state = await holder.wait_until(lambda state: state.activity == Activity.IDLE)
        assert state.stop == StopKind.PROTECTIVE
        await holder.reset_stop()
        await (await holder.move_joints(goal, speed=0.5)).done()
        await holder.close()
    (line,) = [record for record in caplog.records if record.levelno >= logging.ERROR]
    assert line.getMessage().startswith("incident ")
    where = "test_server_of_several_cells.py:"
    assert f"ZeroDivisionError: a fault for the test ({where}" in line.getMessage()
    assert not any(record.exc_info for record in caplog.records)


async def test_promise_53_clients_learn_how_late_each_tick_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    late: list[int] = []
    monkeypatch.setattr(LoopShare, "ticked", lambda share, told: late.append(told))
    async with running_app() as (app, _):
        await asyncio.sleep(0.05)
        on_time = len(late)
        app._next_tick -= 0.05
        await asyncio.sleep(0.02)
    assert set(late[:on_time]) == {0}
    assert max(late[on_time:]) >= 50_000_000
