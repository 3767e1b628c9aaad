"""What the real ROS-I client sent, against the real server and emulator.

The client's side of the capture is sent packet by packet, waiting for replies as the client does.
A patient replay lets the robot arrive before a further trajectory or the client's closing STOP.
A few scenarios go to processes on the real clock, all of them to the same ports on a virtual one.
"""

import asyncio
import contextlib
import json
import math
import struct
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from rigs.clock.busy_machine import SCALE
from rigs.processes.judged_server import served_cell

from openpendant.controller_emulator.shell.build import build_controller
from openpendant.controller_emulator.shell.service import Service
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.simplemsg.pendant import State
from openpendant.tools.pendants.client import PendantClient

VECTORS = Path(__file__).parents[1] / "vectors"
STOP, END, START_DOWNLOAD = -4, -3, -1
TOPIC, REQUEST, REPLY = 1, 2, 3
REPLY_TIMEOUT = 5.0 * SCALE
ARRIVAL = 0.005
"""Half the goal threshold of the ROS-I action server [rad]."""

CELL = {"start": "zero"}
"""One cell for all; each test begins where the client of the capture did."""

ZERO = (0.0,) * 6

EXACT = 1e-6
"""Positions travel as 4-byte reals [rad]."""

STEPS = tuple(0.2 * joint for joint in range(1, 7))
"""Last point of the usual trajectory: 0.2, 0.4, … 1.2."""

SHIFTED = tuple(0.05 + step for step in STEPS)
"""The same from 0.05 on."""


@dataclass(frozen=True)
class Packet:
    connection: int
    data: bytes
    order: str

    @property
    def comm_type(self) -> int:
        return int(struct.unpack_from(self.order + "i", self.data, 8)[0])

    @property
    def sequence(self) -> int:
        return int(struct.unpack_from(self.order + "i", self.data, 16)[0])

    @property
    def joints(self) -> tuple[float, ...]:
        return struct.unpack_from(self.order + "6f", self.data, 20)

    @property
    def duration(self) -> float:
        return float(struct.unpack_from(self.order + "f", self.data, 64)[0])


def motion_packets(scenario: str) -> list[Packet]:
    capture = json.loads((VECTORS / "capture-industrial-robot-client.json").read_text())
    order = ">" if "bswap" in scenario else "<"
    return [
        Packet(item["conn"], bytes.fromhex(item["hex"]), order)
        for item in capture
        if item["scenario"] == scenario
        and item["dir"] == "client->server"
        and item["port"] == 11000
    ]


def trajectories(packets: list[Packet]) -> Iterator[list[Packet]]:
    group: list[Packet] = []
    for packet in packets:
        begins = packet.sequence in (0, START_DOWNLOAD, STOP)
        if begins and group:
            yield group
            group = []
        group.append(packet)
    if group:
        yield group


class RosClient:
    """The motion writer of the real client, as far as its packets go."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._connection = 0
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None
        self.answered = 0

    async def send(self, *packets: Packet) -> None:
        for packet in packets:
            await self._send(packet)

    async def _send(self, packet: Packet) -> None:
        if self._streams is None or packet.connection != self._connection:
            await self.close()
            self._streams = await asyncio.open_connection("127.0.0.1", self._port)
            self._connection = packet.connection
        reader, writer = self._streams
        writer.write(packet.data)
        await writer.drain()
        if packet.comm_type == REQUEST:
            assert await self._reply(reader, packet.order) == 1
            self.answered += 1
            await asyncio.sleep(0.005)

    @staticmethod
    async def _reply(reader: asyncio.StreamReader, order: str) -> int:
        async with asyncio.timeout(REPLY_TIMEOUT):
            (length,) = struct.unpack(order + "i", await reader.readexactly(4))
            body = await reader.readexactly(length)
        msg_type, comm_type, reply_code = struct.unpack_from(order + "3i", body)
        assert (msg_type, comm_type) == (11, REPLY)
        return int(reply_code)

    async def lose_reply_and_reconnect(self, packet: Packet) -> None:
        assert self._streams is not None
        _, writer = self._streams
        writer.write(packet.data)
        await writer.drain()
        await asyncio.sleep(0.02)
        await self.close()
        await asyncio.sleep(0.25)

    async def close(self) -> None:
        if self._streams is not None:
            self._streams[1].close()
            await self._streams[1].wait_closed()
            self._streams = None


@pytest_asyncio.fixture
async def both_at_zero() -> AsyncIterator[tuple[PendantClient, RosClient]]:
    emulated = EmulatorSettings(robot="ur5", start="zero", motion_port=0, state_port=0)
    now = round(asyncio.get_running_loop().time() * 1e9)
    service = Service(build_controller(emulated, now), emulated)
    robot = await service.start()
    app, settings = served_cell(controller={"motion_port": robot.motion, "state_port": robot.state})
    async with contextlib.AsyncExitStack() as stack:
        stack.push_async_callback(service.close)
        ports = await stack.enter_async_context(app.running())
        connect = PendantClient.connect("127.0.0.1", ports.pendant, state_rate=100)
        pendant = await stack.enter_async_context(await connect)
        await pendant.wait_until(lambda state: state.motion_possible == 1)
        assert distance(pendant, ZERO) < EXACT
        client = RosClient(ports.ros[settings.name].motion or 0)
        stack.push_async_callback(client.close)
        yield pendant, client
    assert service.controller.referee.kept == []


async def at_zero(cell: Any) -> tuple[PendantClient, RosClient]:
    pendant: PendantClient = await cell.ready_pendant()
    if distance(pendant, ZERO) > EXACT:
        async with pendant.control():
            await (await pendant.move_joints(ZERO, speed=1.0)).done()
        await pendant.next_state()
    assert distance(pendant, ZERO) < EXACT
    client = RosClient(cell.ports["ros_motion"])
    cell.at_end(client.close)
    return pendant, client


def distance(pendant: PendantClient, goal: tuple[float, ...]) -> float:
    return max(abs(at - to) for at, to in zip(pendant.joints(), goal, strict=True))


async def arrive(pendant: PendantClient, goal: tuple[float, ...]) -> float:
    def stands_there(state: State) -> bool:
        assert state.error_code == 0, f"the controller shows error {state.error_code}"
        gap = max(abs(a - b) for a, b in zip(state.positions, goal, strict=False))
        return state.in_motion == 0 and state.activity == 0 and gap < ARRIVAL

    state = await pendant.wait_until(stands_there)
    return state.time_s + state.time_ns / 1e9


async def replay(client: RosClient, pendant: PendantClient, packets: list[Packet]) -> None:
    for group in trajectories(packets):
        stop = group[0].sequence == STOP
        for number, packet in enumerate(group):
            following = group[number + 1] if number + 1 < len(group) else None
            if following is not None and following.connection != packet.connection:
                # The same point comes again on a new connection: its reply had been lost.
                assert following.data == packet.data
                await client.lose_reply_and_reconnect(packet)
            else:
                await client.send(packet)
        if not stop:
            await arrive(pendant, group[-1].joints)


ENDS = {
    "stream_three_points_success": SHIFTED,
    "stream_one_point": None,
    "stream_no_velocities": STEPS,
    "stream_reordered_joints": None,
    "stream_bswap_three_points": STEPS,
    "stream_invalid_reply_header": STEPS,
    "stream_disconnect_mid_then_listen_again": STEPS,
    "stream_idle_disconnect_then_trajectory": None,
    "download_three_points": ZERO,
    "download_with_replies": STEPS,
    "download_disconnect_then_trajectory": STEPS,
}
"""Scenario: the pose where it ends; None where the last point of the capture says it."""

QUICK = "download_with_replies"
"""The one for real processes in every run; the others follow there in the soak."""


def final_pose(scenario: str) -> tuple[float, ...]:
    named = ENDS[scenario]
    points = [packet for packet in motion_packets(scenario) if packet.sequence != STOP]
    if named is None:
        return points[-1].joints
    assert points[-1].joints == pytest.approx(named, abs=1e-6)
    return named


async def ends_where_it_was_sent(scenario: str, pendant: PendantClient, client: RosClient) -> None:
    packets = motion_packets(scenario)

    await replay(client, pendant, packets)

    requests = {packet.data for packet in packets if packet.comm_type == REQUEST}
    assert client.answered >= len(requests)
    await arrive(pendant, final_pose(scenario))


@pytest.mark.realtime
@pytest.mark.parametrize("scenario", ["stream_empty_trajectory_is_stop", "stream_stop_service"])
@pytest.mark.asyncio(loop_scope="module")
async def test_a_stop_while_idle_is_answered_and_moves_nothing(
    scenario: str, shared_cell: Any
) -> None:
    pendant, client = await at_zero(shared_cell)
    packets = motion_packets(scenario)

    await client.send(*packets)

    assert client.answered == len(packets)
    assert distance(pendant, ZERO) < EXACT


@pytest.mark.realtime
@pytest.mark.parametrize(
    "scenario",
    [QUICK, *(pytest.param(each, marks=pytest.mark.soak) for each in ENDS if each != QUICK)],
)
@pytest.mark.asyncio(loop_scope="module")
async def test_the_robot_of_a_process_ends_where_the_real_client_sent_it(
    scenario: str, shared_cell: Any
) -> None:
    await ends_where_it_was_sent(scenario, *await at_zero(shared_cell))


@pytest.mark.realtime
@pytest.mark.asyncio(loop_scope="module")
async def test_a_stop_in_motion_brings_the_robot_to_rest_on_the_way(shared_cell: Any) -> None:
    pendant, client = await at_zero(shared_cell)
    first, *_ = trajectories(motion_packets("stream_three_points_success"))
    stop = motion_packets("stream_three_points_success")[-1]
    assert stop.sequence == STOP

    await client.send(*first)
    await pendant.wait_until(lambda state: max(state.positions) > 0.2)
    await client.send(stop)
    state = await pendant.wait_until(lambda state: state.in_motion == 0, within=2 * SCALE)

    at_rest = state.positions
    assert 0.2 < max(at_rest) < max(STEPS) - 0.05
    later = await pendant.wait_until(lambda later: later.sequence > state.sequence + 30)
    assert later.positions == at_rest


@pytest.mark.virtual_clock
@pytest.mark.parametrize("scenario", ENDS)
async def test_the_robot_ends_where_the_real_client_sent_it(
    scenario: str, both_at_zero: tuple[PendantClient, RosClient]
) -> None:
    await ends_where_it_was_sent(scenario, *both_at_zero)


@pytest.mark.virtual_clock
async def test_the_robot_arrives_no_sooner_than_the_durations_allow(
    both_at_zero: tuple[PendantClient, RosClient],
) -> None:
    pendant, client = both_at_zero
    group = next(trajectories(motion_packets("stream_no_velocities")))
    asked = sum(packet.duration for packet in group[1:])

    seen: list[State] = []
    pendant.on_state = seen.append
    await client.send(*group)
    arrived = await arrive(pendant, group[-1].joints)
    await client.close()
    begun = next(state for state in seen if state.in_motion == 1)

    # One report period at either end is all that the observer may have missed.
    assert arrived - (begun.time_s + begun.time_ns / 1e9) >= asked - 0.05


@pytest.mark.virtual_clock
async def test_a_trajectory_broken_by_the_clients_stop_is_discarded(
    both_at_zero: tuple[PendantClient, RosClient],
) -> None:
    pendant, client = both_at_zero
    packets = motion_packets("stream_new_trajectory_while_streaming")
    assert [packet.sequence for packet in packets] == [0, 1, STOP, STOP]

    await client.send(*packets)
    await asyncio.sleep(1.0)  # far more than the gap that ends a trajectory

    assert client.answered == len(packets)
    assert distance(pendant, ZERO) < EXACT


@pytest.mark.virtual_clock
async def test_points_before_a_lost_link_are_forgotten_when_the_client_begins_anew(
    both_at_zero: tuple[PendantClient, RosClient],
) -> None:
    pendant, client = both_at_zero
    before, after = list(trajectories(motion_packets("stream_server_gone_then_back")))[:2]
    assert before[0].connection != after[0].connection

    await client.send(*before)
    await client.close()
    await asyncio.sleep(1.0)
    assert distance(pendant, ZERO) < EXACT
    await client.send(*after)

    await arrive(pendant, STEPS)


@pytest.mark.virtual_clock
async def test_the_whole_client_stack_gets_its_goal_and_its_cancel(
    both_at_zero: tuple[PendantClient, RosClient],
) -> None:
    pendant, client = both_at_zero
    groups = list(trajectories(motion_packets("full_stack_action")))
    goal, cancelled, cancel = groups[0], groups[1], groups[2]
    assert cancel[0].sequence == STOP

    await client.send(*goal)
    await arrive(pendant, goal[-1].joints)
    await client.send(*cancelled)
    await pendant.wait_until(lambda state: state.in_motion == 1)
    await client.send(*cancel)
    await pendant.wait_until(lambda state: state.in_motion == 0, within=2 * SCALE)

    assert distance(pendant, cancelled[-1].joints) > 0.1


def test_the_capture_holds_what_these_tests_rely_on() -> None:
    for scenario in ENDS:
        points = motion_packets(scenario)
        assert points, scenario
        assert all(math.isfinite(value) for packet in points for value in packet.joints)
