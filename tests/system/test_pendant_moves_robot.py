"""A pendant, the server and the emulated controller as they are used: processes on real sockets."""

import asyncio
import os
import signal
from pathlib import Path
from typing import Any

import pytest
from rigs.clock.busy_machine import PATIENCE, SCALE

from openpendant.simplemsg.pendant import (
    Activity,
    OperatorAction,
    OperatorEvent,
    StateField,
)
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants import client

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio(loop_scope="module")]

with_a_cell_of_its_own = pytest.mark.asyncio(loop_scope="function")
"""For a test that configures its cell, or breaks it; the others share one."""

FAR = 0.8
"""A joint move of this size at low speed takes long enough to be interrupted [rad]."""


def moved(pendant: client.PendantClient, joint: int, by: float) -> list[float]:
    target = list(pendant.joints())
    target[joint] += by
    return target


def lowered(pose: client.Pose, by: float) -> client.Pose:
    x, y, z = pose.position
    return client.Pose((x, y, z - by), pose.orientation)


async def test_a_target_with_too_few_joints_is_refused_and_moves_nothing(shared_cell: Any) -> None:
    pendant = await shared_cell.ready_pendant()
    before = pendant.joints()
    async with pendant.control():
        for ask in (
            pendant.move_joints([0.3, *before[1:5]]),
            pendant.follow_joints([[0.3, *before[1:5]]]),
        ):
            with pytest.raises(client.Refused) as refused:
                await ask
            assert refused.value.code == V.WRONG_JOINT_COUNT
            assert (refused.value.value, refused.value.limit) == (5, 6)
        for wrong in (
            pendant.move_joints([0.0] * 11),
            pendant.follow_joints([]),
            pendant.follow_joints([before, before[:3]]),
            pendant.follow_poses([]),
        ):
            with pytest.raises(client.WrongArgument):
                await wrong
    await pendant.next_state()
    assert pendant.joints() == before


async def test_a_pendant_that_is_killed_in_motion_leaves_a_robot_at_rest(shared_cell: Any) -> None:
    observer = await shared_cell.ready_pendant()
    holder = await shared_cell.ready_pendant()
    await holder.take_control()
    before = holder.joints()[0]
    await holder.move_joints(moved(holder, 0, FAR), speed=0.1)
    await observer.wait_until(lambda state: max(map(abs, state.velocities)) > 0.1)

    holder.abort()
    state = await observer.wait_until(
        lambda state: state.in_motion == 0 and state.holder == 0, within=3 * SCALE
    )

    assert state.positions[0] - before < FAR - 0.1
    async with observer.control():
        await (await observer.move_joints(moved(observer, 1, 0.05))).done()


async def test_an_emergency_stop_at_the_controller_aborts_and_its_reset_moves_nothing(
    shared_cell: Any,
) -> None:
    pendant = await shared_cell.ready_pendant()
    await pendant.take_control()
    move = await pendant.move_joints(moved(pendant, 0, FAR), speed=0.05)
    await pendant.wait_until(lambda state: state.in_motion == 1)

    assert await shared_cell.tell_controller(OperatorEvent(OperatorAction.EMERGENCY_STOP)) == 1
    with pytest.raises(client.Aborted) as aborted:
        await asyncio.wait_for(move.done(), PATIENCE)
    assert aborted.value.code == V.CONTROLLER_STOPPED
    state = await pendant.wait_until(
        lambda state: (
            state.e_stopped == 1 and state.activity == Activity.IDLE and state.in_motion == 0
        )
    )
    with pytest.raises(client.Refused) as refused:
        await pendant.move_joints(moved(pendant, 0, 0.1))
    assert refused.value.code == V.CONTROLLER_NOT_READY

    assert await shared_cell.tell_controller(OperatorEvent(OperatorAction.RESET)) == 1
    again = await pendant.wait_until(lambda state: state.motion_possible == 1)
    assert again.positions == state.positions
    await (await pendant.move_joints(moved(pendant, 0, 0.1))).done()


async def test_a_frozen_controller_is_noticed_by_its_silence(shared_cell: Any) -> None:
    pendant = await shared_cell.ready_pendant()
    await pendant.take_control()
    move = await pendant.move_joints(moved(pendant, 0, FAR), speed=0.05)
    await pendant.wait_until(lambda state: state.in_motion == 1)

    os.kill(shared_cell.emulator.pid, signal.SIGSTOP)
    try:
        with pytest.raises(client.Aborted) as aborted:
            await asyncio.wait_for(move.done(), PATIENCE)
    finally:
        os.kill(shared_cell.emulator.pid, signal.SIGCONT)

    assert aborted.value.code in (V.FEEDBACK_STALE, V.CONTROLLER_SILENT)
    state = await pendant.wait_until(lambda state: state.in_motion == 0 and 0 <= state.age < 0.1)
    later = await pendant.wait_until(lambda now: now.sequence > state.sequence + 30)
    assert later.positions == state.positions


@with_a_cell_of_its_own
async def test_a_server_that_dies_in_motion_leaves_a_robot_at_rest(start_cell: Any) -> None:
    cell = await start_cell()
    pendant = await cell.ready_pendant()
    await pendant.take_control()
    move = await pendant.move_joints(moved(pendant, 0, FAR), speed=0.05)
    await pendant.wait_until(lambda state: state.in_motion == 1)

    os.kill(cell.server.pid, signal.SIGKILL)
    with pytest.raises(client.ConnectionLost):
        await asyncio.wait_for(move.done(), PATIENCE)

    reader, writer = await asyncio.open_connection("127.0.0.1", cell.controller["state"])
    in_motion = 1
    async with asyncio.timeout(PATIENCE):
        while in_motion:
            length = int.from_bytes(await reader.readexactly(4), "little")
            body = await reader.readexactly(length)
            if int.from_bytes(body[:4], "little") == 13:
                in_motion = int.from_bytes(body[28:32], "little", signed=True)
    writer.close()
    await writer.wait_closed()


async def test_a_dead_planner_refuses_and_comes_back(shared_cell: Any) -> None:
    pendant = await shared_cell.ready_pendant()
    await pendant.take_control()
    here = pendant.tool_pose()
    await (await pendant.move_to_pose(lowered(here, 0.02))).done()

    planners = planners_of(shared_cell.server.pid)
    assert planners
    for child in planners:
        os.kill(child, signal.SIGSTOP)
        waiting = asyncio.ensure_future(pendant.move_to_pose(here))
        await pendant.wait_until(lambda state: state.activity == Activity.PLANNING)
        with pytest.raises(client.Refused) as busy:
            await pendant.move_joints(moved(pendant, 0, 0.1))
        assert busy.value.code == V.PLANNING
        os.kill(child, signal.SIGKILL)
        with pytest.raises(client.Refused) as refused:
            await waiting
        assert refused.value.code == V.PLANNER_FAILED

    await (await pendant.move_to_pose(here)).done()


def planners_of(pid: int) -> list[int]:
    """All children but the watchdog: a planning process may have the server's own command line."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    return [
        int(child)
        for child in children
        if b"watchdog_main" not in Path(f"/proc/{child}/cmdline").read_bytes()
    ]


async def test_garbage_on_every_port_disturbs_nobody(shared_cell: Any) -> None:
    pendant = await shared_cell.ready_pendant()
    await pendant.take_control()
    move = await pendant.move_joints(moved(pendant, 0, 0.5), speed=0.1)
    ports = shared_cell.ports
    for port in (ports["pendant"], ports["ros_motion"], shared_cell.controller["motion"]):
        for garbage in (b"\xff" * 64, b"GET / HTTP/1.1\r\n\r\n", b"\0" * 16, os.urandom(4) * 9):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(garbage)
            async with asyncio.timeout(PATIENCE):
                await reader.read()
            writer.close()
            await writer.wait_closed()
    await move.done()


async def test_state_comes_at_the_chosen_rate_with_rising_sequence(shared_cell: Any) -> None:
    pendant = await shared_cell.pendant(state_rate=50)
    rates: list[float] = []
    for _ in range(10):  # a machine that stalls makes a second longer
        states = [await pendant.next_state() for _ in range(50)]
        sequences = [state.sequence for state in states]
        assert sequences == sorted(set(sequences))
        first, last = (state.time_s + state.time_ns / 1e9 for state in (states[0], states[-1]))
        rates.append(49 / (last - first))
        if rates[-1] == pytest.approx(50, rel=0.2):
            break
    assert rates[-1] == pytest.approx(50, rel=0.2), rates
    assert states[-1].valid_fields & StateField.TOOL
