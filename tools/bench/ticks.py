"""The server's control tick with listeners, and how late a 100 Hz timer is beside an idle one."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

from openpendant.motion.robot import serial_robot
from openpendant.server.app import App
from openpendant.server.cell_shell import ServedCell
from openpendant.server.controller_path import ControllerPath
from openpendant.server.core import Port
from openpendant.server.settings import CellSettings, Pendants
from openpendant.simplemsg import (
    PENDANT,
    ByteOrder,
    Connection,
    JointFeedback,
    Role,
    Status,
    joint_array,
)
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, PROTOCOL_VERSION, Hello

from .table import Benchmark, Sides

ROBOT = "ur5"
TICKS = 200
TICK_NS = 10_000_000


def benchmarks() -> list[Benchmark]:
    """Return the tick with 1 and 30 listeners at 100 Hz, against a tick that nobody listens to."""
    return [
        Benchmark(f"tick with {listeners} state listeners", "us", partial(_tick, listeners))
        for listeners in (1, 30)
    ] + [Benchmark("tick lateness, 100 Hz, 30 listeners", "ms", _lateness, None, 3)]


class _Sink:
    """A connection that takes frames and counts their bytes."""

    def __init__(self, app: App) -> None:
        self.port = Port.PENDANT
        self.address = "127.0.0.1"
        self.cell = None
        self.session = 0
        self.taken = 0
        self.wire = Connection(Role.SERVER, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)
        app.clients.admit(self)  # type: ignore[arg-type]  # stands in for a socket's shell

    def is_clogged(self) -> bool:
        return False

    def write(self, frame: bytes) -> None:
        self.taken += len(frame)

    def send(self, message: Any) -> None:
        """Replies are of no interest here."""

    def check_deadlines(self, now: int) -> None:
        """A sink is never late."""

    def close(self, reason: str) -> None:
        raise RuntimeError(reason)


def _report(app: App, now: int) -> None:
    home, still = joint_array(serial_robot(ROBOT).home_position), joint_array(())
    reports = (
        JointFeedback(
            robot_id=0,
            valid_fields=14,
            time=0.0,
            positions=home,
            velocities=still,
            accelerations=still,
        ),
        Status(
            drives_powered=1,
            e_stopped=0,
            error_code=0,
            in_error=0,
            in_motion=0,
            mode=2,
            motion_possible=1,
        ),
    )
    (cell,) = app.cells
    for report in reports:
        cell.perform(cell.core.on_controller(ControllerPath.STATE, report, 0, now))


def _app(listeners: int) -> App:
    settings = CellSettings(robot=ROBOT, pendants=Pendants(idle_timeout=3600))
    # Its clock stands: ticks are called by the benchmark.
    app = App([ServedCell(settings, serial_robot(ROBOT), _NoPlanner())], Journal(lambda: 0))
    (cell,) = app.cells
    for path in ControllerPath:
        cell.perform(cell.core.controller_path(path, True, 0))
    _report(app, 0)
    for _ in range(listeners):
        sink = _Sink(app)
        hello = Hello(
            protocol_version=PROTOCOL_VERSION, state_rate=100.0, cell="", client="benchmark"
        )
        app.clients.receive(sink.session, hello, 0)
    return app


class _NoPlanner:
    def submit(self, job: Any, deliver: Any) -> None:
        raise RuntimeError("nothing is planned here")

    def withdraw(self, job_id: int) -> None:
        raise RuntimeError("nothing is planned here")


@contextmanager
def _tick(listeners: int) -> Iterator[Sides]:
    def sampler(app: App) -> Any:
        clock = 0

        async def sample() -> float:
            nonlocal clock
            began = time.perf_counter()
            for _ in range(TICKS):
                clock += TICK_NS
                app.cells[0].tick(clock)
            return (time.perf_counter() - began) / TICKS * 1e6

        return lambda: asyncio.run(sample())

    yield Sides(sampler(_app(listeners)), sampler(_app(0)))


@contextmanager
def _lateness() -> Iterator[Sides]:
    """Compare a loop that runs the tick with one that does nothing, each at 100 Hz for a second."""

    async def late(work: Any) -> float:
        loop = asyncio.get_running_loop()
        begin = loop.time()
        lateness = []
        for number in range(1, 101):
            due = begin + number / 100
            await asyncio.sleep(due - loop.time())
            lateness.append(loop.time() - due)
            work(int((loop.time() - begin) * 1e9))
        return sorted(lateness)[98] * 1e3

    app = _app(30)

    def subject() -> float:
        return asyncio.run(late(app.cells[0].tick))

    def baseline() -> float:
        return asyncio.run(late(lambda now: None))

    yield Sides(subject, baseline)
