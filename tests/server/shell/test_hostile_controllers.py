"""Controllers that mean harm, behind one cell of two: that robot does not move, all else goes on.

The flood of 10,000 reports a second runs on the real clock, beside an idle control (`realtime`).
"""

import asyncio
import logging
import math
import multiprocessing
import random
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.controller_reports import joint_report, status
from rigs.clock.busy_machine import PATIENCE, SCALE
from rigs.clock.virtual_clock import VirtualLoop
from rigs.peers.hostile_controller import HostileController
from rigs.processes.bare_app import bare_app
from rigs.processes.judged_server import ROBOT, LoopPlanner, running_emulator

from openpendant.motion.description.robot import serial_robot
from openpendant.server.cli import serve
from openpendant.server.settings.server_settings import make_server_settings
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.simplemsg import (
    PENDANT,
    JointFeedback,
    JointPosition,
    Ping,
    accepted,
    codec_for,
    joint_array,
)
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import Verdict
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.packets.journals.reenactment import rerun
from openpendant.tools.pendants.client import PendantClient, Refused

HOME = serial_robot(ROBOT).home_position
STILL = (0.0,) * len(HOME)
encode = codec_for(PENDANT).encode
READY = encode(status())
SOUND = encode(joint_report(HOME, STILL)) + READY


def of_robot(robot_id: int) -> bytes:
    at_home = joint_report(HOME, STILL)
    values = (at_home.valid_fields, 0.0, at_home.positions, at_home.velocities)
    return encode(JointFeedback(robot_id, *values, at_home.accelerations)) + READY


def not_a_number(number: int) -> bytes:
    value = (math.nan, math.inf, -math.inf, 1e38)[number % 4]
    return encode(joint_report([value] * len(HOME))) + READY


def of_unknown_type(number: int) -> bytes:
    body = (9_999 + number % 1_000, 1, 0, 7)
    return (16).to_bytes(4, "little") + b"".join(each.to_bytes(4, "little") for each in body)


CONTROL = b"\x1b]0;owned\x07\x1b[2J\r\nWARNING a line\x00\x85\xff\xe2\x80\xa8"


def with_control_characters(number: int) -> bytes:
    # Our own encoder refuses such a text.
    letters = "x" * len(CONTROL)
    said = encode(Verdict(number, 0, -1, math.nan, math.inf, letters))
    return said.replace(letters.encode(), CONTROL) + READY


def of_huge_numbers(number: int) -> bytes:
    sequence = (2**31 - 1, -(2**31))[number % 2]
    return encode(JointPosition(sequence, joint_array([1e30] * len(HOME)))) + READY


def noise(number: int) -> bytes:
    return random.Random(number).randbytes(400)


def half(number: int) -> bytes:
    return SOUND[:60] if number == 0 else b""


ANSWERS = encode(accepted(Ping())) * 10
ONES: dict[str, HostileController] = {
    "only other robots": HostileController(lambda number: of_robot(number % 7 + 1) * 10),
    "no numbers": HostileController(not_a_number),
    "unknown types": HostileController(lambda number: of_unknown_type(number) * 10),
    "control characters": HostileController(with_control_characters),
    "huge numbers": HostileController(of_huge_numbers),
    "noise": HostileController(noise, noise),
    "half a frame": HostileController(half, half),
    "a frame of 2 GB": HostileController(lambda number: b"\xff\xff\xff\x7f" * 100),
    "answers to nothing": HostileController(lambda number: ANSWERS, lambda number: ANSWERS),
    "questions without end": HostileController(
        lambda number: encode(Ping()) * 20, lambda number: encode(Ping()) * 20, reads=False
    ),
    "nothing": HostileController(),
}
"""Controllers with a robot that nobody may be able to move."""

NOT_TO_BE_TRUSTED = {
    VerdictCode.CONTROLLER_DOWN,
    VerdictCode.CONTROLLER_NOT_READY,
    VerdictCode.FEEDBACK_STALE,
    VerdictCode.NOT_FINITE,
}


@dataclass
class Room:
    """A server of two cells: `left` has the hostile controller, `right` an emulated one."""

    app: App
    port: int

    async def pendant(self, cell: str) -> PendantClient:
        return await PendantClient.connect("127.0.0.1", self.port, cell=cell, state_rate=50)


@asynccontextmanager
async def room_with(ports: dict[str, int], file: Path | None = None) -> AsyncIterator[Room]:
    async with AsyncExitStack() as stack:
        good = await stack.enter_async_context(running_emulator())
        links: dict[str, dict[str, Any]] = {
            "left": ports,
            "right": {"motion_port": good.motion_port, "state_port": good.state_port},
        }
        tables = [
            {"name": name, "robot": ROBOT, "controller": {**link, "reconnect_period": 0.25}}
            for name, link in links.items()
        ]
        settings = make_server_settings({"listen": {"pendant_port": 0}, "cells": tables}, "test")
        journal = Journal()
        stack.enter_context(serve.kept_journal(journal, file, settings))
        parts = [CellParts(cell, serial_robot(ROBOT), LoopPlanner()) for cell in settings.cells]
        app = bare_app(parts, journal)
        bound = await stack.enter_async_context(app.running())
        yield Room(app, bound.pendant)


async def moved(pendant: PendantClient) -> None:
    """Move a robot there and back."""
    await pendant.wait_until(lambda state: state.motion_possible == 1)
    home = pendant.joints()
    async with pendant.control():
        for goal in ([home[0] + 0.1, *home[1:]], list(home)):
            await (await pendant.move_joints(goal, speed=0.5)).done()


@pytest.mark.virtual_clock
@pytest.mark.parametrize("who", ONES)
async def test_a_hostile_controller_moves_nothing_and_another_cell_goes_on(
    who: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    hostile = ONES[who]
    async with hostile.listening() as ports, room_with(ports) as room:
        began = asyncio.get_running_loop().time()
        left, right = await room.pendant("left"), await room.pendant("right")
        await moved(right)
        lasted = asyncio.get_running_loop().time() - began
        async with left.control():
            with pytest.raises(Refused) as refusal:
                await left.move_joints(HOME)
        assert refusal.value.code in NOT_TO_BE_TRUSTED
        assert not any(cell.core.fault for cell in room.app.cells)
        assert room.app.cells[1].core.cell.stop is None
        await left.close()
        await right.close()
    assert hostile.connections
    assert len(caplog.records) < 100 * max(1.0, lasted)
    said = [record.getMessage() for record in caplog.records]
    assert [text for text in said if not text.isprintable()] == []


@pytest.mark.virtual_clock
async def test_reports_of_other_robots_among_those_of_ours_change_nothing() -> None:
    hostile = HostileController(lambda number: of_robot(3) + SOUND + of_robot(-1), period=0.01)
    async with hostile.listening() as ports, room_with(ports) as room:
        left = await room.pendant("left")
        await left.wait_until(lambda state: state.motion_possible == 1)
        assert left.joints() == pytest.approx(HOME)
        await left.close()


def test_a_run_with_turns_that_ended_is_executed_again_byte_for_byte(tmp_path: Path) -> None:
    file = tmp_path / "server.journal"
    burst = SOUND * 150
    hostile = HostileController(lambda number: burst if number % 10 == 0 else SOUND, period=0.01)

    async def live() -> None:
        async with hostile.listening() as ports, room_with(ports, file) as room:
            left, right = await room.pendant("left"), await room.pendant("right")
            await moved(right)
            await left.close()
            await right.close()

    loop = VirtualLoop()
    loop.run_until_complete(live())
    loop.close()
    assert '"ask": "turn", "link": "1/state/' in file.read_text()
    done = rerun(file)
    assert done.difference is None
    assert not done.is_cut
    assert done.bytes_out > 10_000


REPORT = encode(joint_report(HOME, STILL))
PER_SECOND = 10_000
LASTS = 5.0


class DueReports:
    """As many reports as are due at a time, which a timer of a millisecond alone would not give."""

    def __init__(self) -> None:
        self.per_second = 100
        self._asked = time.monotonic()
        self._owed = 0.0

    def __call__(self, number: int) -> bytes:
        now = time.monotonic()
        self._owed += (now - self._asked) * self.per_second
        self._asked = now
        due, self._owed = divmod(self._owed, 1.0)
        return REPORT * int(due) + (READY if number % 100 == 0 else b"")


def flood(ends: Connection) -> None:
    """Be, in a process of its own, a controller that reports as it should, and then does not."""

    async def report() -> None:
        reports, loop = DueReports(), asyncio.get_running_loop()
        async with HostileController(reports, period=0.001).listening() as ports:
            ends.send(ports)
            while (rate := await loop.run_in_executor(None, ends.recv)) is not None:
                reports.per_second = rate

    asyncio.run(report())


@contextmanager
def other_process() -> Iterator[tuple[Connection, dict[str, int]]]:
    ours, theirs = multiprocessing.Pipe()
    process = multiprocessing.get_context("spawn").Process(target=flood, args=(theirs,))
    process.start()
    try:
        assert ours.poll(PATIENCE)
        yield ours, ours.recv()
    finally:
        ours.send(None)
        process.join(PATIENCE)
        process.kill()


async def lateness() -> float:
    """Return how late a timer of the loop was in 99 of 100 cases [s], each 10 ms for a while."""
    loop, late = asyncio.get_running_loop(), list[float]()
    due, end = loop.time(), loop.time() + LASTS
    while due < end:
        due = max(due + 0.01, loop.time())
        await asyncio.sleep(due - loop.time())
        late.append(loop.time() - due)
    return sorted(late)[len(late) * 99 // 100]


@pytest.mark.realtime
@pytest.mark.soak
async def test_10000_reports_a_second_delay_no_tick_and_no_other_cell(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    with other_process() as (controller, ports):
        async with room_with(ports) as room:
            right = await room.pendant("right")
            feedback = room.app.cells[0].core.cell.feedback
            quiet = await lateness()
            controller.send(PER_SECOND)
            before = feedback.reports
            late, _ = await asyncio.gather(lateness(), moved(right))
            reported = (feedback.reports - before) / LASTS
            assert room.app.cells[1].core.cell.stop is None
            await right.close()
    assert late <= max(0.01, 1.5 * quiet)
    assert reported > PER_SECOND / 20 / SCALE
    assert len(caplog.records) < 100 * LASTS
