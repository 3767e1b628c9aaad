from __future__ import annotations

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import MS
from rigs.peers.server_clients import RosClient

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg.pendant import Activity, Motion, PoseMove
from openpendant.simplemsg.verdicts import VerdictCode as V


def violations(cell: EmulatedCell) -> dict[str, int]:
    return {kind.name: count for kind, count in cell.controller.referee.counts.items() if count}


def let_finish(cell: EmulatedCell) -> None:
    for _ in range(4_000):
        cell.wait(10)
        if cell.core.cell.activity is Activity.IDLE:
            return
    raise AssertionError("the motion does not end")


def test_a_move_onto_the_limits_themselves_arrives() -> None:
    cell = EmulatedCell(start="zero")
    pendant = cell.holder()
    goal = [0.0] * 6
    goal[2] = cell.limits.upper[2]
    assert pendant.move(*goal) is V.ACCEPTED
    let_finish(cell)
    assert [code for _, code in pendant.outcomes()] == [V.ACCEPTED]
    assert pendant.move(*([0.0] * 6)) is V.ACCEPTED
    let_finish(cell)
    assert violations(cell) == {}


@pytest.mark.parametrize("motion", Motion)
def test_a_pose_is_reached_by_either_motion(motion: Motion) -> None:
    cell = EmulatedCell()
    pendant = cell.holder()
    kinematics = Kinematics(serial_robot("ur5"))
    pose = kinematics.forward(cell.position)
    x, y, z = pose.position.tolist()
    target = (x, y, z - 0.05)
    request = PoseMove(5, motion, 0.5, "base", target, tuple(pose.quaternion.tolist()))
    assert pendant.code(request) is V.ACCEPTED
    let_finish(cell)
    assert [code for _, code in pendant.outcomes()] == [V.ACCEPTED]
    reached = kinematics.forward(cell.position).position.tolist()
    assert reached == pytest.approx(target, abs=1e-4)
    assert violations(cell) == {}


@pytest.mark.parametrize("after", [10, 200, 600])
def test_a_stop_brings_it_to_rest_and_a_reset_moves_nothing(after: int) -> None:
    cell = EmulatedCell()
    pendant = cell.holder()
    goal = tuple(value + 1.0 for value in cell.position)
    pendant.move(*goal)
    cell.wait(after)
    pendant.stop()
    cell.wait(1_000)
    assert pendant.reset() is V.ACCEPTED
    rest = cell.position
    cell.wait(500)
    assert cell.position == rest
    assert [code for _, code in pendant.outcomes()] == [V.STOPPED]
    assert pendant.move(*goal) is V.ACCEPTED
    let_finish(cell)
    assert cell.position == pytest.approx(goal, abs=1e-6)
    assert violations(cell) == {}


@pytest.mark.parametrize("path", [ControllerPath.MOTION, ControllerPath.STATE])
def test_a_lost_link_stops_the_robot(path: ControllerPath) -> None:
    cell = EmulatedCell()
    pendant = cell.holder()
    pendant.move(*(value + 1.0 for value in cell.position))
    cell.wait(300)
    cell.disconnect(path)
    cell.wait(1_000)
    assert not any(cell.controller.motion(cell.now)[1])
    assert [code for _, code in pendant.outcomes()] == [V.CONTROLLER_LOST]
    assert violations(cell) == {}


def stream(cell: EmulatedCell, client: RosClient, *offsets: float) -> None:
    home = cell.position
    """Send points at 5 ms, each asking for 0.4 s."""
    for index, offset in enumerate(offsets):
        client.point(index, *(value + offset for value in home), duration=0.4)
        cell.wait(5)


def test_a_streamed_trajectory_is_never_faster_than_asked() -> None:
    cell = EmulatedCell()
    client = cell.ros()
    home = cell.position
    stream(cell, client, 0.0, 0.05, 0.1, 0.15)
    cell.wait(160)
    moved = cell.now
    assert cell.core.cell.activity is Activity.MOVING
    let_finish(cell)
    assert cell.now - moved >= (3 * 400 - 20) * MS
    assert cell.position == pytest.approx([value + 0.15 for value in home], abs=1e-5)
    assert violations(cell) == {}


def test_a_superseding_trajectory_ends_where_the_new_one_ends() -> None:
    cell = EmulatedCell()
    client = cell.ros()
    home = cell.position
    stream(cell, client, 0.0, 0.2, 0.4)
    cell.wait(500)
    client.point(0, *home, duration=0.5)
    client.point(1, *(value - 0.1 for value in home), duration=0.5)
    cell.wait(400)
    let_finish(cell)
    cell.wait(100)
    let_finish(cell)
    assert cell.position == pytest.approx([value - 0.1 for value in home], abs=1e-5)
    assert violations(cell) == {}
