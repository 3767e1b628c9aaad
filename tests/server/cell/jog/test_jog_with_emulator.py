from __future__ import annotations

import numpy as np
import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.peers.server_clients import Pendant

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import (
    Enabling,
    JogBeat,
    JogEnd,
    JogEnded,
    JogRelease,
    JogSpace,
    JogStart,
    JogStep,
    JogUndo,
    OperatingMode,
    ResetStop,
    SetMode,
    State,
    Subscribe,
)
from openpendant.simplemsg.standard import JointTrajPtFull
from openpendant.simplemsg.verdicts import VerdictCode as V

UR5 = Kinematics(serial_robot("ur5"))


class JogClient:
    """A pendant in T1 that presses keys of an emulated cell."""

    def __init__(self, robot: str = "ur5", mode: OperatingMode = OperatingMode.MANUAL_REDUCED):
        self.cell = EmulatedCell(robot)
        self.pendant: Pendant = self.cell.holder()
        assert self.pendant.code(Subscribe(2, 100.0)) is V.ACCEPTED
        assert self.pendant.code(SetMode(3, mode)) is V.ACCEPTED
        self.request = 100
        self.press = 0
        self.beat = 0
        self.pendant.send(Enabling(1))
        self.cell.wait(30)
        self.limits = self.cell.limits

    def start(
        self,
        space: JogSpace,
        values: tuple[float, ...],
        frame: str = "base",
        deadline: float = 0.15,
    ) -> V | None:
        self.request += 1
        self.press += 1
        self.beat = 0
        newest = self.pendant.all(State)[-1].sequence
        return self.pendant.code(
            JogStart(
                self.request,
                self.press,
                newest,
                deadline,
                space,
                frame,
                len(values),
                joint_array(values),
            )
        )

    def hold(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, 50):
            self.beat += 1
            self.pendant.send(JogBeat(self.press, self.beat))
            self.enable()
            self.cell.wait(50)

    def enable(self) -> None:
        self.pendant.send(Enabling(1))

    def release(self) -> V | None:
        self.request += 1
        return self.pendant.code(JogRelease(self.request, self.press))

    def come_to_rest(self) -> JogEnded:
        for _ in range(40):
            self.enable()
            self.cell.wait(50)
            ended = self.pendant.all(JogEnded)
            if ended:
                return ended[-1]
        raise AssertionError("the jog did not end")

    def sent(self) -> list[JointTrajPtFull]:
        return [item for item in self.cell.sent if isinstance(item, JointTrajPtFull)]

    def tool(self) -> np.ndarray:
        return UR5.forward(self.cell.position).position


def violations(client: JogClient) -> int:
    return client.cell.controller.referee.total


def test_a_held_joint_key_moves_that_joint_and_release_ends_it() -> None:
    client = JogClient()
    before = client.cell.position
    assert client.start(JogSpace.JOINTS, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)) is V.ACCEPTED
    client.hold(500)
    assert client.release() is V.ACCEPTED
    ended = client.come_to_rest()
    moved = np.array(client.cell.position) - np.array(before)
    assert moved[2] > 0.05
    assert np.abs(np.delete(moved, 2)).max() < 1e-6
    assert ended.reason == JogEnd.RELEASED
    assert ended.stop_time > 0.0
    assert client.pendant.outcomes()[-1] == (101, V.ACCEPTED)
    assert violations(client) == 0


@pytest.mark.parametrize(
    ("frame", "values"),
    [
        ("base", (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)),
        ("tool", (0.0, 0.5, -0.5, 0.0, 0.0, 0.0)),
        ("base", (1.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
    ],
)
def test_a_held_tool_key_moves_the_tool_along_its_axis(
    frame: str, values: tuple[float, ...]
) -> None:
    client = JogClient()
    before = UR5.forward(client.cell.position)
    assert client.start(JogSpace.TOOL, values, frame) is V.ACCEPTED
    client.hold(400)
    client.release()
    client.come_to_rest()
    after = UR5.forward(client.cell.position)
    axes = before.rotation if frame == "tool" else np.eye(3)
    way = axes.T @ (after.position - before.position)
    direction = np.array(values[:3]) / np.linalg.norm(values[:3])
    assert way @ direction > 0.03
    assert np.linalg.norm(way - (way @ direction) * direction) < 1e-4
    assert violations(client) == 0


def test_a_second_key_takes_over_without_a_stop() -> None:
    client = JogClient()
    client.start(JogSpace.JOINTS, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    client.hold(300)
    assert client.start(JogSpace.JOINTS, (1.0, 1.0, 0.0, 0.0, 0.0, 0.0)) is V.ACCEPTED
    assert client.pendant.outcomes()[-1] == (101, V.ACCEPTED)
    client.hold(300)
    last = client.sent()[-1].velocities
    assert last[0] > 0.05
    assert last[1] > 0.05
    client.release()
    client.come_to_rest()
    assert violations(client) == 0


def test_an_undo_leads_back_to_where_the_jog_began() -> None:
    client = JogClient()
    before = client.cell.position
    client.start(JogSpace.TOOL, (0.0, 1.0, 0.0, 0.0, 0.0, 0.0))
    client.hold(600)
    client.release()
    client.come_to_rest()
    assert client.pendant.code(JogUndo(900, 1.0)) is V.ACCEPTED
    for _ in range(100):
        client.enable()
        client.cell.wait(50)
        if client.pendant.outcomes()[-1][0] == 900:
            break
    assert client.pendant.outcomes()[-1] == (900, V.ACCEPTED)
    assert np.abs(np.array(client.cell.position) - before).max() < 1e-4
    assert client.pendant.code(JogUndo(901, 1.0)) is V.NO_JOG_TO_UNDO
    assert violations(client) == 0


def test_the_rest_of_an_undo_goes_on_along_the_way_and_not_over_what_it_had_done() -> None:
    client = JogClient()
    before = client.cell.position
    client.start(JogSpace.JOINTS, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    client.hold(1_500)
    corner = client.cell.position
    client.start(JogSpace.JOINTS, (0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    client.hold(1_500)
    client.release()
    client.hold(1_000)
    assert client.pendant.code(JogUndo(900, 1.0)) is V.ACCEPTED
    while client.cell.position[0] > 0.5 * (before[0] + corner[0]):
        client.enable()
        client.cell.wait(50)
    client.pendant.stop()
    client.cell.wait(500)
    halfway = client.cell.position
    assert client.pendant.code(ResetStop(901)) is V.ACCEPTED
    client.pendant.send(Enabling(0))
    client.enable()
    sent = len(client.sent())
    assert client.pendant.code(JogUndo(902, 1.0)) is V.ACCEPTED
    while client.pendant.outcomes()[-1][0] != 902:
        client.enable()
        client.cell.wait(50)
    rest = np.array([point.positions[:6] for point in client.sent()[sent:]])
    assert rest[:, 0].max() <= halfway[0] + 1e-4, "the way to the corner is not gone again"
    assert np.abs(np.array(client.cell.position) - before).max() < 1e-4
    assert client.pendant.code(JogUndo(903, 1.0)) is V.NO_JOG_TO_UNDO
    assert violations(client) == 0


def test_a_step_moves_the_tool_by_its_increment() -> None:
    client = JogClient()
    before = client.tool()
    step = JogStep(900, 1.0, JogSpace.TOOL, "base", 6, joint_array((0.0, 0.0, 0.01)))
    assert client.pendant.code(step) is V.ACCEPTED
    for _ in range(60):
        client.enable()
        client.cell.wait(50)
    assert client.pendant.outcomes()[-1] == (900, V.ACCEPTED)
    assert client.tool() - before == pytest.approx((0.0, 0.0, 0.01), abs=1e-5)
    assert violations(client) == 0
