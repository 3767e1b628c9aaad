"""The control tick with listeners, and the lateness of a 100 Hz timer beside an idle one."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import pairwise
from typing import Any

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.trajectory.ptp import straight_move
from openpendant.server.access.access_backend import ProcessAccess
from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.connection_loads import ConnectionLoad
from openpendant.server.cell.execution.motion_watch import MotionWatch, ReportTiming
from openpendant.server.cell.execution.tracking import tracking_tolerances
from openpendant.server.control import REDUCED_SPEED
from openpendant.server.events.events import TICK, ControllerReport, PathChanged, Port
from openpendant.server.settings.cell_settings import (
    CellSettings,
    ControllerLink,
    ControllerPath,
    Pendants,
)
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.shell.robot_kinematics import RobotKinematics
from openpendant.server.store.store_client import AbsentStore
from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Role
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, PROTOCOL_VERSION, Hello

from .peers import state_reports
from .table import Benchmark, Bound, Judged, Sides

ROBOT = "ur5"
TICKS = 200
TICK_NS = 10_000_000
WATCH_BOUND = Bound(20.0, judged=Judged.VALUE)
"""A set-point noted and a report judged [us]."""


def benchmarks() -> list[Benchmark]:
    """Return the tick with 1 and 30 listeners at 100 Hz, against a tick that nobody listens to.

    Besides what the comparison of the reported robot with the commanded one adds to each tick.
    """
    return [
        Benchmark(f"tick with {listeners} state listeners", "us", partial(_tick, listeners))
        for listeners in (1, 30)
    ] + [
        Benchmark("tick's watch of a moving robot", "us", partial(_watch, None), WATCH_BOUND),
        Benchmark("tick's watch of one in T1", "us", partial(_watch, REDUCED_SPEED), WATCH_BOUND),
        Benchmark("tick lateness, 100 Hz, 30 listeners", "ms", _lateness, None, 3),
    ]


class _Sink:
    """A connection that takes frames and counts their bytes."""

    def __init__(self, app: App) -> None:
        self.port = Port.PENDANT
        self.address = "127.0.0.1"
        self.cell: int | None = None
        self.session = 0
        self.taken = 0
        self.unread = 0
        self.load = ConnectionLoad()
        self.wire = Connection(Role.SERVER, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)
        app.inbox.opened(self)

    def is_clogged(self) -> bool:
        return False

    def write(self, frame: bytes) -> None:
        self.taken += len(frame)

    def failed(self, error: Exception) -> None:
        raise error

    def abort(self, reason: str) -> None:
        """Nothing is open."""

    def send(self, message: Any) -> None:
        """Replies are of no interest here."""

    def check_deadlines(self, now: int) -> None:
        """A sink is never late."""

    def hold(self) -> None:
        """Nothing is said here that could wait."""

    def release(self) -> None:
        """Nothing waits here."""

    def close(self, reason: str) -> None:
        raise RuntimeError(reason)


def _report(app: App, now: int) -> None:
    (cell,) = app.cells
    for report in state_reports(serial_robot(ROBOT).home_position):
        cell.deliver(ControllerReport(ControllerPath.STATE, report, 0), now)


def _app(listeners: int) -> App:
    settings = CellSettings(robot=ROBOT, pendants=Pendants(idle_timeout=3600))
    # Its clock stands: ticks are called by the benchmark.
    app = App(
        [CellParts(settings, serial_robot(ROBOT), _NoPlanner())],
        Journal(),
        AbsentStore(),
        ProcessAccess(None, AccountBook(), single_user=True),
        clock=lambda: 0,
    )
    (cell,) = app.cells
    for path in ControllerPath:
        cell.deliver(PathChanged(path, True), 0)
    _report(app, 0)
    for _ in range(listeners):
        sink = _Sink(app)
        hello = Hello(
            protocol_version=PROTOCOL_VERSION, state_rate=100.0, cell="", client="benchmark"
        )
        app.inbox.received(sink.session, hello, 0)
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
                app.cells[0].deliver(TICK, clock)
            return (time.perf_counter() - began) / TICKS * 1e6

        return lambda: asyncio.run(sample())

    yield Sides(sampler(_app(listeners)), sampler(_app(0)))


@contextmanager
def _watch(cap: float | None) -> Iterator[Sides]:
    """Note a set-point and judge a report, of a robot whose joints lag by 20 ms on a joint move.

    Its tool is as fast as the cap, or the joints at full speed where there is none.
    """
    robot = serial_robot(ROBOT)
    mathematics = RobotKinematics(robot)
    goal = tuple(value + 1.0 for value in robot.home_position)
    speed = 1.0 if cap is None else _share_at(mathematics, robot.home_position, goal, cap)
    move = straight_move(robot.home_position, goal, robot.limits, speed=speed)
    rows = [move.row(index) for index in range(len(move))]
    places = [tuple(row.position) for row in rows]

    def sample() -> float:
        link = ControllerLink()
        timing = ReportTiming(link.state_period)
        tolerances = tracking_tolerances(link, robot.limits, says_emulated=False)
        watch = MotionWatch(robot.limits, tolerances, timing, places[0], mathematics, lambda: cap)
        began = time.perf_counter()
        for number, row in enumerate(rows):
            now = number * TICK_NS
            watch.commanded(now + 9 * TICK_NS, row)
            if watch.judge(timing.take(places[max(number - 11, 0)], now)) is not None:
                raise RuntimeError("a robot on its path was found off it")
        return (time.perf_counter() - began) / len(rows) * 1e6

    yield Sides(sample)


def _share_at(
    mathematics: RobotKinematics, start: Sequence[float], goal: Sequence[float], cap: float
) -> float:
    """Return the share of the joints' speeds at which tool and elbow keep to a cap [m/s]."""
    limits = serial_robot(ROBOT).limits
    ways = [b - a for a, b in zip(start, goal, strict=True)]
    lasts = max(abs(way) / most for way, most in zip(ways, limits.velocity, strict=True))
    places = [
        mathematics.speed_points([a + way * at / 100 for a, way in zip(start, ways, strict=True)])
        for at in range(101)
    ]
    steps = [math.dist(*pair) for both in pairwise(places) for pair in zip(*both, strict=True)]
    return 0.95 * cap * lasts / 100 / max(steps)


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
        return asyncio.run(late(lambda now: app.cells[0].deliver(TICK, now)))

    def baseline() -> float:
        return asyncio.run(late(lambda now: None))

    yield Sides(subject, baseline)
