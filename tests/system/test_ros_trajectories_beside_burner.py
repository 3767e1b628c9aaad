"""Trajectories at the pace of the captured ROS-I client: none is broken off but by the machine.

Two hundred of 3 to 1,000 points beside a process that burns one core in bursts; four without it.
What went wrong must be visible, in STATUS and in the log, each time and in one line.
"""

import asyncio
import json
import math
import random
import re
import statistics
import struct
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from promises.promise_figures import tell
from rigs.clock.busy_machine import PATIENCE, PATIENT
from rigs.processes.burner import MOST_VOID, VoidTime, burner

from openpendant import simplemsg
from openpendant.motion.description.robot import serial_robot
from openpendant.simplemsg.verdicts import STATUS_ERROR_OFFSET
from openpendant.simplemsg.verdicts import VerdictCode as V

VECTORS = Path(__file__).parents[1] / "vectors"
HOME = serial_robot("ur5").home_position
REACH = 0.2
"""How far the first joint goes, there and back [rad]."""

LEAST_SEGMENT, LEAST_WAY = 0.004, 0.5
"""No segment takes less, and no whole way [s]."""

PLACEHOLDER = 10.0
NEAR = 0.005
MOST_RUNS = 3


def pace() -> float:
    """Return the captured client's pause between a reply and its next point [s], the median."""
    capture = json.loads((VECTORS / "capture-industrial-robot-client.json").read_text())
    pauses: list[float] = []
    before: dict[str, Any] | None = None
    for item in capture:
        if item["port"] != 11000 or item["scenario"] != "stream_three_points_success":
            continue
        is_reply = item["dir"] == "server->client"
        if before is not None and not is_reply and item.get("hex") and _sequence(item) > 0:
            pauses.append(item["t"] - before["t"])
        before = item if is_reply and item.get("hex") else None
    assert pauses
    return statistics.median(pauses)


def _sequence(item: dict[str, Any]) -> int:
    return int(struct.unpack_from("<i", bytes.fromhex(item["hex"]), 16)[0])


@dataclass
class Peer:
    """A connection that speaks as the real client does."""

    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter
    wire: simplemsg.Connection = field(
        default_factory=lambda: simplemsg.Connection(
            simplemsg.Role.CLIENT, simplemsg.STANDARD, simplemsg.ByteOrder.LITTLE
        )
    )

    async def ask(self, point: simplemsg.JointTrajPt) -> simplemsg.ReplyCode:
        self.writer.write(self.wire.send(point))
        while True:
            data = await asyncio.wait_for(self.reader.read(4096), PATIENCE)
            if not data:
                raise EOFError
            for reply in self.wire.receive(data):
                assert isinstance(reply, simplemsg.HeaderOnly | simplemsg.JointTrajPt)
                return simplemsg.ReplyCode(reply.reply_code)


@dataclass
class Listener:
    peer: Peer
    joints: tuple[float, ...] = ()
    status: simplemsg.Status | None = None
    has_moved: bool = False

    async def listen(self) -> None:
        while data := await self.peer.reader.read(4096):
            for message in self.peer.wire.receive(data):
                if isinstance(message, simplemsg.JointPosition):
                    self.joints = message.joints
                elif isinstance(message, simplemsg.Status):
                    self.status = message
                    self.has_moved = self.has_moved or message.in_motion == simplemsg.TriState.TRUE

    @property
    def error(self) -> int:
        return 0 if self.status is None else self.status.error_code

    def stands_at(self, goal: tuple[float, ...]) -> bool:
        gaps = [abs(at - to) for at, to in zip(self.joints, goal, strict=False)]
        rests = self.status is not None and self.status.in_motion == simplemsg.TriState.FALSE
        return bool(gaps) and max(gaps) < NEAR and rests and self.has_moved


@dataclass
class Outcomes:
    arrived: int = 0
    spoiled: int = 0
    void: list[str] = field(default_factory=list)
    broken_off: list[str] = field(default_factory=list)
    invisible: list[str] = field(default_factory=list)
    void_share: float = 0.0


class Client:
    settling = 2.0
    """So long after a recovery a second line about what went wrong would be seen [s]."""

    def __init__(self, ports: dict[str, Any], log: Path) -> None:
        self._ports = ports
        self._log = log
        self._told = 0
        self._pause = pace()
        self._motion: Peer | None = None
        self.listener: Listener
        self.goal = HOME

    async def begin(self) -> None:
        self.listener = Listener(await _peer(self._ports["ros_state"]))
        self._listening = asyncio.create_task(self.listener.listen())
        deadline = time.monotonic() + PATIENCE
        while self.listener.status is None or self.listener.status.motion_possible != 1:
            assert time.monotonic() < deadline
            await asyncio.sleep(0.02)

    async def end(self) -> None:
        self._listening.cancel()
        self.listener.peer.writer.close()
        if self._motion is not None:
            self._motion.writer.close()

    def line(self) -> str:
        told = [line for line in self._log.read_text().splitlines() if "ROS-I trajectory" in line]
        if len(told) == self._told:
            return ""
        self._told += 1
        return told[self._told - 1]

    def further_lines(self) -> list[str]:
        return list(iter(self.line, ""))

    async def trajectory(self, count: int, *, spoiled: bool = False) -> str:
        start = self.listener.joints[: len(HOME)]
        target = HOME[0] + (REACH if start[0] < HOME[0] + REACH / 2 else 0.0)
        duration = max(LEAST_SEGMENT, LEAST_WAY / (count - 1))
        self.listener.has_moved = False
        for number in range(count):
            first = start[0] + (target - start[0]) * number / (count - 1)
            goal = (first, *start[1:])
            point = simplemsg.JointTrajPt(
                number + (1 if spoiled and number == count - 1 else 0),
                simplemsg.joint_array(goal),
                0.1 if number in (0, count - 1) else 0.3,
                PLACEHOLDER if number == 0 else duration,
                comm_type=2,
            )
            await self._send(point)
            await asyncio.sleep(self._pause)
        return await self._outcome(goal, 2 * PATIENCE)

    async def _send(self, point: simplemsg.JointTrajPt) -> None:
        for _ in range(5):
            try:
                if self._motion is None:
                    self._motion = await _peer(self._ports["ros_motion"])
                await self._motion.ask(point)
                return
            except (EOFError, OSError):
                self._motion = None
                await asyncio.sleep(0.25)

    async def _outcome(self, goal: tuple[float, ...], within: float) -> str:
        listener = self.listener
        async with asyncio.timeout(within):
            while not (line := self.line()):
                if listener.stands_at(goal):
                    return self.line()
                await asyncio.sleep(0.02)
        return line

    async def shows(self, line: str) -> bool:
        said = re.search(r": ([A-Z_]+) \((\d+)\): ", line)
        assert said is not None, line
        verdict = V(int(said.group(2)))
        assert verdict.name == said.group(1)
        of_controller = verdict.name.startswith("CONTROLLER_")
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            error = self.listener.error
            is_own = of_controller and 0 < error < STATUS_ERROR_OFFSET
            if error == STATUS_ERROR_OFFSET + verdict or is_own:
                return True
            await asyncio.sleep(0.02)
        return False

    async def recover(self, ports: dict[str, Any]) -> None:
        from openpendant.tools.pendants.client import PendantClient, PendantError

        async with asyncio.timeout(PATIENCE):
            async with await PendantClient.connect("127.0.0.1", ports["pendant"]) as pendant:
                while True:
                    try:
                        async with pendant.control():
                            await pendant.reset_stop()
                        break
                    except PendantError:
                        await asyncio.sleep(0.2)
            await asyncio.sleep(self.settling)


async def _peer(port: int) -> Peer:
    return Peer(*await asyncio.open_connection("127.0.0.1", port))


@asynccontextmanager
async def a_client(
    start_cell: Any, folder: Path, settings: str = ""
) -> AsyncIterator[tuple[Client, Any]]:
    log = folder / "server.log"
    cell = await start_cell(settings=settings, log=log)
    client = Client(cell.ports, log)
    await client.begin()
    try:
        yield client, cell
    finally:
        await client.end()


async def drive(
    client: Client, cell: Any, counts: list[int], spoiled: set[int], void: VoidTime
) -> Outcomes:
    outcomes = Outcomes()
    run_began = time.monotonic()
    for number, count in enumerate(counts):
        began, is_spoiled = time.monotonic(), number in spoiled
        line = await client.trajectory(count, spoiled=is_spoiled)
        told = f"trajectory {number} of {count} points: {line or 'arrived'}"
        if not line:
            outcomes.arrived += 1
            if is_spoiled:
                outcomes.invisible.append(told)
            continue
        if not await client.shows(line):
            outcomes.invisible.append(f"{told}; STATUS shows {client.listener.error}")
        if is_spoiled and "SEQUENCE (" in line:
            outcomes.spoiled += 1
        elif void.is_void(began, time.monotonic()):
            outcomes.void.append(told)
        else:
            outcomes.broken_off.append(told)
        await client.recover(cell.ports)
        outcomes.invisible += [f"{told}, and then {more}" for more in client.further_lines()]
    took = time.monotonic() - run_began
    outcomes.void_share = void.within(run_began, run_began + took) / took
    return outcomes


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def undisturbed(
    start_cell_of_the_file: Any, tmp_path_factory: pytest.TempPathFactory
) -> AsyncIterator[tuple[Client, Any]]:
    settings = f"{PATIENT}ros_i.idle_release = 0.2\n"
    async with a_client(start_cell_of_the_file, tmp_path_factory.mktemp("log"), settings) as pair:
        pair[0].settling = 0.5
        yield pair


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("counts", "spoiled"),
    [([3], set()), ([40], set()), ([5, 3], {0})],
    ids=["a few points", "many points", "a spoiled one and the next"],
)
@pytest.mark.asyncio(loop_scope="module")
async def test_a_trajectory_arrives_and_a_spoiled_one_is_seen(
    undisturbed: tuple[Client, Any], counts: list[int], spoiled: set[int]
) -> None:
    void = VoidTime()
    try:
        outcomes = await drive(*undisturbed, counts, spoiled, void)
    finally:
        void.end()
    assert (outcomes.invisible, outcomes.void, outcomes.broken_off) == ([], [], [])
    assert (outcomes.arrived, outcomes.spoiled) == (1, len(spoiled))


@pytest.mark.soak
@pytest.mark.realtime
@pytest.mark.timeout(3_600)
async def test_200_trajectories_beside_a_burner_are_broken_off_by_the_machine_alone(
    start_cell: Any, tmp_path: Path
) -> None:
    random_ways = random.Random(15)
    ends = [3, 1_000]
    exponents = [random_ways.uniform(math.log(3), math.log(1_000)) for _ in range(198)]
    counts = ends + [round(math.exp(exponent)) for exponent in exponents]
    spoiled = set(range(10, 200, 20))
    void = VoidTime()
    try:
        for run in range(1, MOST_RUNS + 1):
            folder = tmp_path / str(run)
            folder.mkdir()
            async with a_client(start_cell, folder) as (client, cell):
                with burner():
                    outcomes = await drive(client, cell, counts, spoiled, void)
            tell(
                f"run {run}: {outcomes.arrived} arrived, {outcomes.spoiled} spoiled,"
                f" {len(outcomes.broken_off)} broken off, {outcomes.void_share:.1%} void time,"
                f" {len(outcomes.void)} void: {outcomes.void}"
            )
            assert outcomes.invisible == []
            assert outcomes.broken_off == []
            if outcomes.void_share <= MOST_VOID:
                break
        else:
            pytest.fail(f"the machine was late for more than {MOST_VOID:.0%} of {MOST_RUNS} runs")
    finally:
        void.end()
    assert outcomes.arrived + outcomes.spoiled + len(outcomes.void) == len(counts)
