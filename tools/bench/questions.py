"""Thirty pages that ask about the kinematics of one robot, and the ticks beside (promise 40).

Each page is a connection of its own and asks at an even rate, as one that drags a ghost does: for
the nearest answer, for all branches, or for those of an arm with a self-motion. Poses are near the
robot's home and never twice the same. One more connection has the robot swing to and fro all the
while and looks on at 100 Hz; times in its state messages show how late ticks are. The baseline is
the same room with pages that keep silent, and an idle timer of this process stands beside both.
"""

from __future__ import annotations

import asyncio
import math
import random
import sys
import time
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import ExitStack, asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.simplemsg.pendant import Activity, OperatingMode, State
from openpendant.simplemsg.verdicts import VerdictCode

from ..pendants.client import PendantClient, Refused
from .jogging_pendants import lateness
from .peers import process
from .table import Benchmark, Bound, Judged, Sides

PAGES = 30
WINDOW = 6.0
"""Length of one sample [s]."""

_LISTENED = 100.0  # Hz
_IDLE = 0.010  # s

_SWING = 0.3
"""How far the first joint goes to both sides [rad]."""

_SWING_SPEED = 0.2
"""Fraction of its greatest speed; so a swing takes about a second."""

_MOVES = 1e-4
"""A joint faster than this moves [rad/s]."""

_SETTLED = 0.2
"""From the begin of the motion until it counts [s]."""


@dataclass(frozen=True, slots=True)
class Asking:
    """How a page asks.

    Attributes:
        rate: questions in one second.
        most: 99th percentile of the replies [ms].
    """

    title: str
    robot: str
    branches: str
    rate: float
    most: float


ASKINGS = (
    Asking("nearest", "ur5", "nearest", 10.0, 10.0),
    Asking("all branches", "ur5", "all", 5.0, 20.0),
    Asking("self-motion", "kuka_iiwa14", "all", 2.0, 100.0),
)


@dataclass(slots=True)
class PagesSeen:
    """What was seen in one stretch of time.

    Attributes:
        replies: from question to answer [ms].
        refused: codes of the questions that were refused.
        late: lateness of the server's ticks [ms].
        moving: share of the ticks at which the robot moved.
        idle: how much later than asked an idle timer of this process woke [ms].
    """

    replies: list[float] = field(default_factory=list)
    refused: list[int] = field(default_factory=list)
    late: list[float] = field(default_factory=list)
    moving: float = 0.0
    idle: list[float] = field(default_factory=list)


def p99(delays: Sequence[float]) -> float:
    """Return the delay that one of a hundred exceeds."""
    return sorted(delays)[len(delays) * 99 // 100]


def benchmarks() -> list[Benchmark]:
    """Return for each way to ask how late replies and ticks are, in the 99th percentile."""
    rows: list[Benchmark] = []
    for asking in ASKINGS:
        name = f"questions: {PAGES} pages, {asking.title}, {asking.rate:g} a second"
        replies = Bound(asking.most, judged=Judged.VALUE)
        rows += [
            Benchmark(f"{name}, reply p99", "ms", partial(_room, asking, "replies"), replies, 3),
            Benchmark(f"{name}, tick p99 late", "ms", partial(_room, asking, "late"), None, 3),
        ]
    return rows


@contextmanager
def _room(asking: Asking, figure: str) -> Iterator[Sides]:
    with served(asking.robot) as port:

        def subject() -> float:
            seen = asyncio.run(observed(port, asking, WINDOW))
            if seen.refused:
                raise RuntimeError(f"questions were refused: {seen.refused}")
            told = {name: p99(getattr(seen, name)) for name in ("replies", "late", "idle")}
            print(f"  p99 [ms] {told}", file=sys.stderr)
            return float(told[figure])

        def baseline() -> float:
            seen = asyncio.run(observed(port, asking, WINDOW, are_silent=True))
            return p99(seen.late if figure == "late" else seen.idle)

        yield Sides(subject, baseline)


@contextmanager
def served(robot: str) -> Iterator[int]:
    """Serve an emulated robot in processes of their own; yield the pendants' port."""
    with ExitStack() as stack:
        emulator = stack.enter_context(
            process(
                *("openpendant.controller_emulator", "--robot", robot, "--json"),
                *("--motion-port", "0", "--state-port", "0"),
            )
        )
        controller = f"127.0.0.1:{emulator['motion']}:{emulator['state']}"
        command = ["openpendant.server", "--robot", robot, "--json", "--pendant-port", "0"]
        command += ["--ros-motion-port", "0", "--ros-state-port", "0", "--controller", controller]
        yield stack.enter_context(process(*command))["pendant"]


async def observed(
    port: int, asking: Asking, seconds: float, *, are_silent: bool = False, pages: int = PAGES
) -> PagesSeen:
    """Have pages ask for some time; return what was seen."""
    seen, ticks, moved = PagesSeen(), list[int](), 0

    def tick(state: State) -> None:
        nonlocal moved
        ticks.append(state.time_s * 1_000_000_000 + state.time_ns)
        moved += any(abs(speed) > _MOVES for speed in state.velocities)

    connect = partial(PendantClient.connect, "127.0.0.1", port)
    mover = await connect(client="mover", state_rate=_LISTENED)
    asking_pages = [await connect(client=f"page {number}") for number in range(pages)]
    poses = _poses(asking.robot)
    try:
        # The first question starts the process that answers.
        await mover.manage(_question(next(poses), asking))
        async with _swinging(mover, asking.robot, seconds):
            mover.on_state = tick
            over = time.monotonic() + seconds
            async with asyncio.TaskGroup() as group:
                group.create_task(_idle(seen, over))
                if not are_silent:
                    for number, page in enumerate(asking_pages):
                        later = number / pages / asking.rate
                        group.create_task(_page(page, asking, poses, seen, over, later))
            mover.on_state = None
    finally:
        for page in (mover, *asking_pages):
            await page.close()
    seen.late = [late / 1e6 for late in lateness(ticks)]
    seen.moving = moved / len(ticks)
    return seen


@asynccontextmanager
async def _swinging(mover: PendantClient, robot: str, seconds: float) -> AsyncIterator[None]:
    """Swing the first joint about home, longer than asked [s]; end it when the context is left."""
    first, *others = serial_robot(robot).home_position
    await mover.wait_until(lambda state: state.motion_possible == 1)
    async with mover.control():
        await mover.set_mode(OperatingMode.AUTOMATIC)
        # A swing takes a second, and twice as many are enough on any robot.
        turns = 10 + 2 * math.ceil(seconds)
        places = [first + (_SWING if turn % 2 else -_SWING) for turn in range(turns)]
        swings = await mover.follow_joints([(q, *others) for q in places], speed=_SWING_SPEED)
        await asyncio.sleep(_SETTLED)
        yield
        if swings.is_over:
            await swings.done()  # tells what ended it
            raise RuntimeError("the robot arrived before all was seen")
        await mover.program_stop()
        await mover.wait_until(lambda state: state.activity == Activity.IDLE)


async def _page(
    page: PendantClient,
    asking: Asking,
    poses: Iterator[dict[str, Any]],
    seen: PagesSeen,
    over: float,
    later: float,
) -> None:
    due = time.monotonic() + later
    while due < over:
        await asyncio.sleep(due - time.monotonic())
        began = time.perf_counter()
        try:
            await page.manage(_question(next(poses), asking))
            seen.replies.append((time.perf_counter() - began) * 1e3)
        except Refused as refused:
            if refused.code != VerdictCode.UNREACHABLE:
                seen.refused.append(int(refused.code))
        # What came late is not caught up with: that would be a burst.
        due = max(due + 1.0 / asking.rate, time.monotonic())


async def _idle(seen: PagesSeen, over: float) -> None:
    while (now := time.monotonic()) < over:
        await asyncio.sleep(_IDLE)
        seen.idle.append((time.monotonic() - now - _IDLE) * 1e3)


def _question(pose: dict[str, Any], asking: Asking) -> dict[str, Any]:
    return {"op": "kinematics.ik", "pose": pose, "branches": asking.branches}


def _poses(robot: str) -> Iterator[dict[str, Any]]:
    """Yield poses near home without end."""
    facts, chance = serial_robot(robot), random.Random(40)
    kinematics = Kinematics(facts)
    while True:
        near = [value + chance.uniform(-0.3, 0.3) for value in facts.home_position]
        pose = kinematics.forward(near)
        yield {"position": pose.position.tolist(), "orientation": pose.quaternion.tolist()}
