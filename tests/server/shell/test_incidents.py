"""A fault of ours on a pendant's message: its robot stops, it is parted with, the rest goes on."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from typing import NoReturn

import pytest
from rigs.processes.bare_app import bare_app
from rigs.processes.judged_server import running_emulator

from openpendant.motion.description.robot import serial_robot
from openpendant.server.planning.jobs import Deliver, Job
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.simplemsg.pendant import Activity, StopKind
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import Aborted, ConnectionLost, PendantClient

ROBOT = "ur5"

pytestmark = [pytest.mark.asyncio, pytest.mark.virtual_clock]


class LaterPlanner:
    """Plans at once, and delivers as late as a real planner would."""

    def submit(self, job: Job, deliver: Deliver) -> None:
        asyncio.get_running_loop().call_later(0.03, deliver, answer(ROBOT, job))

    def withdraw(self, job_id: int) -> None:
        """An answer nobody waits for is ignored by the cell."""


@asynccontextmanager
async def running_app() -> AsyncIterator[tuple[App, int]]:
    async with AsyncExitStack() as stack:
        emulator = await stack.enter_async_context(running_emulator())
        link = {"motion_port": emulator.motion_port, "state_port": emulator.state_port}
        ports = {"pendant_port": 0, "ros_motion_port": 0, "ros_state_port": 0}
        settings = make_settings({"robot": ROBOT, "listen": ports, "controller": link}, "test")
        app = bare_app([CellParts(settings, serial_robot(ROBOT), LaterPlanner())])
        listening = await stack.enter_async_context(app.running())
        yield app, listening.pendant


async def connected(port: int) -> PendantClient:
    pendant = await PendantClient.connect("127.0.0.1", port)
    await pendant.wait_until(lambda state: state.motion_possible == 1)
    return pendant


def broken(*_: object) -> NoReturn:
    raise ZeroDivisionError("a fault\nfor the test")


async def test_a_fault_on_a_message_stops_the_robot_and_ends_that_connection_alone(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    async with running_app() as (app, port):
        holder, other = await connected(port), await connected(port)
        await holder.take_control()
        goal = [holder.joints()[0] + 1.0, *holder.joints()[1:]]
        move = await holder.move_joints(goal, speed=0.1)
        await other.wait_until(lambda state: state.activity == Activity.MOVING)
        with monkeypatch.context() as patch:
            patch.setattr(app.cells[0].core.pendants, "receive", broken)
            with pytest.raises(ConnectionLost):
                await other.release_control()
        with pytest.raises(Aborted) as aborted:
            await move.done()
        assert aborted.value.code == VerdictCode.PROTECTIVE_STOP
        assert "incident" in aborted.value.text
        state = await holder.wait_until(lambda state: state.activity == Activity.IDLE)
        assert state.stop == StopKind.PROTECTIVE
        assert app.cells[0].core.fault is None

        await holder.reset_stop()
        await (await holder.move_joints(goal, speed=0.5)).done()
        await holder.close()
    (line,) = [record for record in caplog.records if record.levelno >= logging.ERROR]
    assert line.exc_info is None
    assert line.getMessage().startswith("incident ")
    assert "ZeroDivisionError: a fault for the test (test_incidents.py:" in line.getMessage()


Break = Callable[[App, pytest.MonkeyPatch], None]


def fail_to_let_in(app: App, patch: pytest.MonkeyPatch) -> None:
    patch.setattr(app.cells[0].core.pendants, "opened", broken)


def fail_to_count(app: App, patch: pytest.MonkeyPatch) -> None:
    patch.setattr(app.clients, "_place_refusal", broken)


def fail_to_decode(app: App, patch: pytest.MonkeyPatch) -> None:
    newest = app.clients.by_session[max(app.clients.by_session)]
    patch.setattr(newest.wire, "receive", broken)


def fail_to_encode(app: App, patch: pytest.MonkeyPatch) -> None:
    newest = app.clients.by_session[max(app.clients.by_session)]
    patch.setattr(newest.wire, "send", broken)


def fail_to_look_at_deadlines(app: App, patch: pytest.MonkeyPatch) -> None:
    newest = app.clients.by_session[max(app.clients.by_session)]
    patch.setattr(newest, "is_clogged", broken)


async def talk(other: PendantClient | None, port: int) -> None:
    """Listen and ask on a connection, or on a new one, until it is closed."""
    pendant = other or await PendantClient.connect("127.0.0.1", port)
    while True:
        await pendant.next_state()
        await pendant.release_control()


@pytest.mark.parametrize(
    ("fault", "is_new"),
    [
        (fail_to_let_in, True),
        (fail_to_count, True),
        (fail_to_decode, False),
        (fail_to_encode, False),
        (fail_to_look_at_deadlines, False),
    ],
)
async def test_a_fault_anywhere_in_serving_a_client_is_one_incident(
    fault: Break, is_new: bool, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    async with running_app() as (app, port):
        holder = await connected(port)
        await holder.take_control()
        goal = [holder.joints()[0] + 1.0, *holder.joints()[1:]]
        other = None if is_new else await connected(port)
        move = await holder.move_joints(goal, speed=0.1)
        with monkeypatch.context() as patch:
            fault(app, patch)
            with pytest.raises((ConnectionLost, OSError)):
                await talk(other, port)
            with pytest.raises(Aborted) as aborted:
                await move.done()
        assert aborted.value.code == VerdictCode.PROTECTIVE_STOP
        assert app.cells[0].core.fault is None
        await holder.wait_until(lambda state: state.activity == Activity.IDLE)
        await holder.reset_stop()
        await (await holder.move_joints(goal, speed=0.5)).done()
        await holder.close()
    (line,) = [record for record in caplog.records if record.levelno >= logging.ERROR]
    assert line.getMessage().startswith("incident ")
    assert not any(record.exc_info for record in caplog.records)
