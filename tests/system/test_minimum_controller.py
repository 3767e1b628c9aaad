import asyncio
import contextlib
import json
import signal
import sys
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from rigs.clock.busy_machine import PATIENCE, UNHURRIED
from rigs.peers.minimum_controller import Controller, compiled

from openpendant.simplemsg.pendant import Activity, LinkState, Motion
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import Aborted, PendantClient, Pose, Refused

pytestmark = pytest.mark.realtime

FAR = 0.8
"""A joint move of this size at low speed takes long enough to be interrupted [rad]."""


@dataclass
class Cell:
    controller: Controller
    server: asyncio.subprocess.Process
    pendant: PendantClient

    async def is_ready(self) -> None:
        async with asyncio.timeout(PATIENCE):
            while (await self.pendant.snapshot())["obstacle"]:
                await self.pendant.next_state()

    def moved(self, joint: int, by: float) -> list[float]:
        target = list(self.pendant.joints())
        target[joint] += by
        return target


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(tmp_path_factory.mktemp("plain"))


@dataclass
class Served:
    controller: Controller
    server: asyncio.subprocess.Process
    port: int


@contextlib.asynccontextmanager
async def serving(program: Path, folder: Path) -> AsyncIterator[Served]:
    config = folder / "cell.toml"
    config.write_text(f'robot = "ur5"\ncontroller.points = "simple"\n{UNHURRIED}')
    controller = await Controller.start(program)
    server = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "openpendant.server", "--config", str(config), "--json"),
        *("--pendant-port", "0", "--ros-motion-port", "0", "--ros-state-port", "0"),
        *("--controller", f"127.0.0.1:{controller.motion}:{controller.state}"),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
    )
    assert server.stdout is not None
    try:
        ports = json.loads(await asyncio.wait_for(server.stdout.readline(), PATIENCE))
        yield Served(controller, server, ports["pendant"])
    finally:
        if server.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                server.terminate()
        await asyncio.wait_for(server.wait(), PATIENCE)
        await controller.end()


@contextlib.asynccontextmanager
async def in_control(served: Served) -> AsyncIterator[Cell]:
    pendant = await PendantClient.connect("127.0.0.1", served.port, state_rate=100)
    async with pendant:
        cell = Cell(served.controller, served.server, pendant)
        await pendant.next_state()
        await cell.is_ready()
        await pendant.take_control()
        yield cell


@pytest_asyncio.fixture
async def cell(program: Path, tmp_path: Path) -> AsyncIterator[Cell]:
    async with serving(program, tmp_path) as served, in_control(served) as cell:
        yield cell


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def served(program: Path, tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Served]:
    async with serving(program, tmp_path_factory.mktemp("shared")) as served:
        yield served


@pytest_asyncio.fixture(loop_scope="module")
async def shared_cell(served: Served) -> AsyncIterator[Cell]:
    async with in_control(served) as cell:
        yield cell


on_the_shared_loop = pytest.mark.asyncio(loop_scope="module")


@on_the_shared_loop
async def test_joint_moves_poses_and_taught_paths_arrive(shared_cell: Cell) -> None:
    cell, pendant = shared_cell, shared_cell.pendant
    for speed in (0.3, 1.0):
        target = cell.moved(0, 0.3)
        await (await pendant.move_joints(target, speed=speed)).done()
        await pendant.next_state()
        assert pendant.joints() == pytest.approx(target, abs=1e-3)

    here = pendant.tool_pose()
    x, y, z = here.position
    lower = Pose((x, y, z - 0.05), here.orientation)
    await (await pendant.move_to_pose(lower, motion=Motion.LIN, speed=0.5)).done()
    await pendant.next_state()
    assert pendant.tool_pose().position == pytest.approx(lower.position, abs=1e-3)

    path = [
        Pose((x, y + 0.02 * step, z - 0.05 + 0.02 * step), here.orientation) for step in range(1, 6)
    ]
    await (await pendant.follow_poses(path, speed=0.5)).done()
    await pendant.next_state()
    assert pendant.tool_pose().position == pytest.approx(path[-1].position, abs=1e-3)

    taught = [cell.moved(joint, 0.2) for joint in (1, 2, 3)]
    await (await pendant.follow_joints(taught, speed=1.0)).done()
    await pendant.next_state()
    assert pendant.joints() == pytest.approx(taught[-1], abs=1e-3)
    assert pendant.state is not None
    assert pendant.state.error_code == 0


async def begin(cell: Cell) -> Any:
    start = cell.pendant.joints()[0]
    move = await cell.pendant.move_joints(cell.moved(0, FAR), speed=0.1)
    await cell.pendant.wait_until(lambda state: state.positions[0] > start + 0.02)
    return move


async def aborted(move: Any) -> V:
    with pytest.raises(Aborted) as error:
        await asyncio.wait_for(move.done(), PATIENCE)
    return V(error.value.code)


@on_the_shared_loop
async def test_a_software_stop_stops_it_and_latches(shared_cell: Cell) -> None:
    cell, pendant = shared_cell, shared_cell.pendant
    before = pendant.joints()[0]
    move = await begin(cell)
    await pendant.stop("seen something")
    assert await aborted(move) is V.STOPPED
    at_rest = await pendant.wait_until(lambda state: state.activity == Activity.IDLE)
    assert at_rest.positions[0] - before < FAR / 2
    with pytest.raises(Refused) as refused:
        await pendant.move_joints(cell.moved(0, 0.1))
    assert refused.value.code == V.STOP_LATCHED
    await pendant.reset_stop()
    await (await pendant.move_joints(cell.moved(0, -0.05), speed=0.5)).done()


@on_the_shared_loop
async def test_its_emergency_stop_aborts_and_the_reset_moves_nothing(shared_cell: Cell) -> None:
    cell, pendant = shared_cell, shared_cell.pendant
    move = await begin(cell)
    cell.controller.press(signal.SIGUSR1)
    assert await aborted(move) is V.CONTROLLER_STOPPED
    state = await pendant.wait_until(
        lambda state: (
            state.e_stopped == 1 and state.activity == Activity.IDLE and state.in_motion == 0
        )
    )
    with pytest.raises(Refused) as refused:
        await pendant.move_joints(cell.moved(0, 0.1))
    assert refused.value.code == V.CONTROLLER_NOT_READY

    cell.controller.press(signal.SIGUSR2)
    again = await pendant.wait_until(lambda state: state.motion_possible == 1)
    assert again.positions == state.positions
    await cell.is_ready()
    await (await pendant.move_joints(cell.moved(0, 0.05), speed=0.5)).done()


async def test_when_it_dies_in_motion_the_server_says_so_and_nothing_resumes(
    cell: Cell, program: Path
) -> None:
    pendant = cell.pendant
    move = await begin(cell)
    cell.controller.press(signal.SIGKILL)
    assert await aborted(move) is V.CONTROLLER_LOST
    await pendant.wait_until(lambda state: state.link == LinkState.DOWN)
    with pytest.raises(Refused) as refused:
        await pendant.move_joints([0.0] * 6)
    assert refused.value.code == V.CONTROLLER_DOWN

    again = await Controller.start(program, cell.controller.motion, cell.controller.state)
    try:
        await cell.is_ready()
        first = await pendant.next_state()
        later = await pendant.wait_until(lambda state: state.sequence > first.sequence + 30)
        assert later.positions == first.positions
        await (await pendant.move_joints(cell.moved(0, 0.05), speed=0.5)).done()
    finally:
        await again.end()


async def test_a_server_that_dies_in_motion_leaves_the_robot_at_rest(cell: Cell) -> None:
    await begin(cell)
    async with cell.controller.listener() as listener:
        cell.server.kill()
        rounds = await listener.until_rest()
        assert rounds[-1][1].error_code == 111
        assert rounds[-1][0].joints[0] < FAR / 2


async def judged(program: Path, sections: str) -> list[dict[str, Any]]:
    controller = await Controller.start(program)
    tester = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "openpendant.tools", "packets", "conformance"),
        *("--role", "server", f"127.0.0.1:{controller.motion}:{controller.state}"),
        *("--profile", "minimum", "--robot", "ur5", "--yes-it-may-move"),
        *("--only", sections, "--json"),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    try:
        output, errors = await asyncio.wait_for(tester.communicate(), 2 * PATIENCE)
    finally:
        await controller.end()
    assert errors.decode() == ""
    results: list[dict[str, Any]] = json.loads(output)["results"]
    return results


async def test_it_passes_the_conformance_checks_of_its_profile(program: Path) -> None:
    # The checks wait more than they work, so five controllers are judged at once.
    groups = ("motion", "stop", "link", "limits,topics,status", "framing,header,byte_order,replies")
    found = await asyncio.gather(*(judged(program, group) for group in groups))
    results = [result for group in found for result in group]
    # TS12 is about type 15, which this controller need not send.
    others = [result for result in results if result["verdict"] != "passed"]
    assert [result for result in others if result["number"] != "TS12"] == []
    assert len(results) > 90
