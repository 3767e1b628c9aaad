"""What RoboAnalyzer's calls take for a number, a joint or a name, and how they refuse the rest."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest
from rigs.peers.roboanalyzer_rig import roboanalyzer_server
from rigs.peers.scripted_pendant_server import ScriptedPendantServer

from openpendant.simplemsg.pendant import JointMove, PoseMove
from openpendant.tools.pendants.connection_errors import WrongArgument
from openpendant.tools.pendants.roboanalyzer import RoboAnalyzerClient

pytestmark = pytest.mark.realtime


@pytest.fixture
def server() -> Iterator[ScriptedPendantServer]:
    with roboanalyzer_server() as running:
        yield running


@pytest.fixture
def robot(server: ScriptedPendantServer) -> Iterator[RoboAnalyzerClient]:
    with RoboAnalyzerClient("127.0.0.1", server.port, speed=0.5) as connected:
        yield connected


def test_whole_numbers_may_be_floats_as_those_of_matlab(server: ScriptedPendantServer) -> None:
    port: Any = float(server.port)
    with RoboAnalyzerClient("127.0.0.1", port) as robot:
        robot.IncrementJointAngle(1.0, 5)
        robot.IncrementJointAngles(array("d", [0.0] * 6))
    assert len(server.all(JointMove)) == 2


NO_NUMBERS: list[Any] = ["5", None, True, math.nan, math.inf, 1 + 2j, [1.0], 10**400]


@pytest.mark.parametrize("wrong", NO_NUMBERS, ids=lambda value: repr(value)[:9])
def test_what_is_no_number_is_refused_by_every_call_that_takes_one(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient, wrong: Any
) -> None:
    calls: list[Callable[[], object]] = [
        *(partial(getattr(robot, f"Increment{axis}"), wrong) for axis in "XYZABC"),
        lambda: robot.IncrementJointAngle(1, wrong),
        lambda: robot.IncrementJointAngle(wrong, 1.0),
        lambda: robot.IncrementJointAngles([wrong] * 6),
        lambda: robot.UpdateJointAngles([wrong] * 6),
        lambda: setattr(robot, "speed", wrong),
    ]
    for call in calls:
        with pytest.raises(WrongArgument, match="accepted: a finite number"):
            call()
    assert server.all(JointMove) == server.all(PoseMove) == []


@pytest.mark.parametrize("wrong", ["000000", 5.0, None, b"123456"])
def test_what_is_no_list_of_numbers_says_how_many_are_accepted(
    robot: RoboAnalyzerClient, wrong: Any
) -> None:
    for call in (robot.UpdateJointAngles, robot.IncrementJointAngles):
        with pytest.raises(WrongArgument, match="accepted: a list of 6 numbers"):
            call(wrong)


def test_half_a_joint_a_robot_that_is_no_text_and_too_much_speed_never_leave(
    robot: RoboAnalyzerClient,
) -> None:
    number: Any = 5
    with pytest.raises(WrongArgument, match=r"the joint is 1\.5; accepted: a whole number"):
        robot.IncrementJointAngle(1.5, 1.0)
    with pytest.raises(WrongArgument, match="the robot is 5; accepted: a text"):
        robot.LoadRobot(number)
    for speed in (0.0, -1.0, 1.5):
        with pytest.raises(WrongArgument, match="above 0, up to 1"):
            robot.speed = speed
    assert robot.speed == 0.5
