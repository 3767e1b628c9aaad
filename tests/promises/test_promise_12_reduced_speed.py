"""Promise 12: in T1 neither tool nor elbow is ever faster than 250 mm/s, whatever is asked.

From the pendant's message to the set-points that leave for the emulated robot; speeds are found by
forward kinematics of the set-points, not from what planner or jog say of themselves.
"""

import itertools
import math

import numpy as np
import pytest
from promises.promise_table import figure
from rigs.cells.emulated_cell import EmulatedCell
from rigs.motion.jog_pad import EmulatedPad
from rigs.peers.server_clients import pose

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.trajectory.point_speed import elbow_link
from openpendant.simplemsg.pendant import JogSpace
from openpendant.simplemsg.standard import JointTrajPtFull
from openpendant.simplemsg.verdicts import VerdictCode as V

UR5 = Kinematics(serial_robot("ur5"))
CAP = figure(12, "speed").bound / 1e3
EXCESS = figure(12, "excess").bound
JOG = {"joint_speed": 1.0, "tool_speed": 2.0, "rotation_speed": 3.0}

JOGS = [
    (JogSpace.JOINTS, "", (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
    (JogSpace.JOINTS, "", (-1.0, -0.6, 0.8, 1.0, -1.0, 1.0)),
    (JogSpace.TOOL, "base", (0.0, 1.0, 0.4, 0.0, 0.0, 0.0)),
    (JogSpace.TOOL, "tool", (0.0, 0.0, -1.0, 1.0, 0.0, -1.0)),
    (JogSpace.TOOL, "base", (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)),
]


class T1(EmulatedPad):
    def __init__(self) -> None:
        super().__init__(EmulatedCell("ur5", jog=JOG))

    def jog(self, space: JogSpace, frame: str, values: tuple[float, ...]) -> None:
        assert self.press(*values, deadline=0.2, space=space, frame=frame) is V.ACCEPTED
        self.hold(600)
        assert self.release() is V.ACCEPTED
        self.finish()

    def runs(self) -> list[list[JointTrajPtFull]]:
        runs: list[list[JointTrajPtFull]] = []
        for point in self.sent:
            if point.sequence == 0:
                runs.append([])
            runs[-1].append(point)
        return runs


def fastest(run: list[JointTrajPtFull]) -> float:
    """Return the greatest speed of tool or elbow, between set-points and at each [m/s]."""
    speeds = [0.0]
    for link in (None, elbow_link(UR5)):
        for one, two in itertools.pairwise(run):
            before, after = (np.array(each.positions[:6]) for each in (one, two))
            velocity = np.array(two.velocities[:6])
            ends = [UR5.forward(at, link=link).position for at in (before, after)]
            speeds.append(math.dist(*ends) / (two.time - one.time))
            near = [
                UR5.forward(after + sign * 1e-6 * velocity, link=link).position for sign in (1, -1)
            ]
            speeds.append(math.dist(*near) / 2e-6)
    return max(speeds)


def test_promise_12_every_jog_keeps_tool_and_elbow_below_250_mm_a_second() -> None:
    hands = T1()
    for jog in JOGS:
        hands.jog(*jog)
    runs = hands.runs()
    assert len(runs) == len(JOGS)
    speeds = [fastest(run) for run in runs]
    assert max(speeds) <= CAP * (1 + EXCESS), speeds
    assert max(speeds) > 0.99 * CAP
    assert hands.cell.controller.referee.total == 0


def test_promise_12_every_planned_motion_keeps_below_it_too() -> None:
    hands = T1()
    home = hands.cell.position
    tool = UR5.forward(home)
    x, y, z = tool.position.tolist()
    assert hands.pendant.move(home[0] + 0.6, *home[1:]) is V.ACCEPTED
    hands.finish()
    assert hands.pendant.path((home[0] + 0.3, *home[1:]), home) is V.ACCEPTED
    hands.finish()
    goal = pose(2, 1.0, (x, y + 0.1, z - 0.05), tool.quaternion.tolist())
    goal.request_id = hands._request()
    assert hands.pendant.code(goal) is V.ACCEPTED
    hands.finish()
    runs = hands.runs()
    assert len(runs) == 3
    assert max(map(fastest, runs)) <= CAP * (1 + EXCESS)


@pytest.mark.parametrize(("override", "cap"), [(0.3, 0.25), (1.0, 0.1)])
def test_promise_12_override_and_cap_only_lower_it(override: float, cap: float) -> None:
    hands = T1()
    assert hands.speed(override, cap) is V.ACCEPTED
    hands.jog(*JOGS[0])
    (run,) = hands.runs()
    assert 0.0 < fastest(run) <= min(CAP, cap) * (1 + 1e-6)


@pytest.mark.parametrize(("override", "cap"), [(1.0, 0.2501), (1.01, 0.25)])
def test_promise_12_what_would_raise_it_is_refused(override: float, cap: float) -> None:
    hands = T1()
    assert hands.speed(override, cap) is V.BAD_ARGUMENT
