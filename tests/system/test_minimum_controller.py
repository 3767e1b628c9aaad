import asyncio
import contextlib
import json
import signal
import sys
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from rigs.clock.busy_machine import PATIENCE, UNHURRIED
from rigs.peers.minimum_controller import Controller, compiled

from openpendant.motion.description.robot import serial_robot
from openpendant.simplemsg.pendant import Activity, LinkState, Motion
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.packets.conformance.check import Profile
from openpendant.tools.packets.conformance.report import as_json
from openpendant.tools.packets.conformance.server.checks import ServerCheck
from openpendant.tools.packets.conformance.server.runner import applicable, judge
from openpendant.tools.packets.conformance.server.target import Options
from openpendant.tools.pendants.client import Aborted, PendantClient, Pose, Refused

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio(loop_scope="module")]
"""One loop for all: while the cells are served, the checks that wait long go on."""

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


AS_JUDGED = Options(
    *("127.0.0.1", 0, 0),
    profile=Profile.MINIMUM,
    may_move=True,
    limits=serial_robot("ur5").limits,
)
MOVING = (
    "MS02,MS03,MS04,MS05,MS07,MS08,TS16,TS17,TS18,TS20,QS08,QS09,QS10,QS11,QS16",
    "SS01,SS02,SS03,SS04,QS12",
    "KS10,KS12,KS16",
    *("MS01,RS21,SS06", "MS09,SS05", "MS10,KS13", "MS11,SS07", "MS20", "KS11"),
    *("LS01", "LS07", "LS08", "LS16", "LS17"),
)
"""What is judged by one motion, or by short ones in a row; nothing of it takes 4 s."""

LINKS = "link"
"""The part with two links that are judged when they are 8 s old."""

AT_REST = ("framing", "replies", "header,byte_order,topics,status")
PARTS = (*AT_REST, *MOVING, LINKS)
Results = list[dict[str, Any]]


def checks_of(part: str) -> list[ServerCheck]:
    chosen = applicable(AS_JUDGED, part.split(","))
    return [check for check in chosen if check.moves == (part in MOVING)]


async def judged(program: Path, part: str) -> Results:
    controller = await Controller.start(program)
    try:
        if part == LINKS:
            return await judged_by_command(controller, part)
        options = replace(AS_JUDGED, motion_port=controller.motion, state_port=controller.state)
        judgement = await judge(options, checks=checks_of(part))
        results: Results = json.loads(as_json(judgement))["results"]
        return results
    finally:
        await controller.end()


async def judged_by_command(controller: Controller, part: str) -> Results:
    tester = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "openpendant.tools", "packets", "conformance"),
        *("--role", "server", f"127.0.0.1:{controller.motion}:{controller.state}"),
        *("--profile", "minimum", "--robot", "ur5", "--yes-it-may-move"),
        *("--only", ",".join(check.number for check in checks_of(part)), "--json"),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    try:
        output, errors = await asyncio.wait_for(tester.communicate(), 2 * PATIENCE)
    finally:
        if tester.returncode is None:
            tester.kill()
            await tester.wait()
    assert errors.decode() == ""
    results: Results = json.loads(output)["results"]
    return results


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def judging(program: Path) -> AsyncIterator[dict[str, asyncio.Task[Results]]]:
    """All parts, begun at once with a controller each: the checks wait more than they work."""
    begun = {part: asyncio.create_task(judged(program, part)) for part in PARTS}
    left = list(begun.values())
    yield begun
    for task in left:
        task.cancel()
    await asyncio.gather(*left, return_exceptions=True)


async def passes(program: Path, judging: dict[str, asyncio.Task[Results]], part: str) -> None:
    # What was judged once has been taken out: a second attempt judges anew.
    begun = judging.pop(part, None)
    results = await (judged(program, part) if begun is None else begun)
    assert [result["number"] for result in results] == [c.number for c in checks_of(part)]
    # TS12 is about type 15, which this controller need not send.
    others = [result for result in results if result["verdict"] != "passed"]
    assert [result for result in others if result["number"] != "TS12"] == []


@pytest_asyncio.fixture(loop_scope="module")
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


@pytest.mark.parametrize("part", [*AT_REST, *MOVING])
async def test_it_passes_the_conformance_checks_of_its_profile(
    program: Path, judging: dict[str, asyncio.Task[Results]], part: str
) -> None:
    await passes(program, judging, part)


async def test_every_check_of_its_profile_is_in_one_part() -> None:
    numbers = [check.number for part in PARTS for check in checks_of(part)]
    assert sorted(numbers) == sorted(check.number for check in applicable(AS_JUDGED))
    assert len(numbers) > 90


async def test_joint_moves_arrive_slow_and_fast(shared_cell: Cell) -> None:
    cell, pendant = shared_cell, shared_cell.pendant
    for speed in (0.3, 1.0):
        target = cell.moved(0, 0.3)
        await (await pendant.move_joints(target, speed=speed)).done()
        await pendant.next_state()
        assert pendant.joints() == pytest.approx(target, abs=1e-3)


async def test_poses_and_paths_of_poses_arrive(shared_cell: Cell) -> None:
    pendant = shared_cell.pendant
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


async def test_a_taught_path_of_joints_arrives(shared_cell: Cell) -> None:
    cell, pendant = shared_cell, shared_cell.pendant
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


async def test_its_links_pass_the_conformance_checks_by_the_command(
    program: Path, judging: dict[str, asyncio.Task[Results]]
) -> None:
    await passes(program, judging, LINKS)
