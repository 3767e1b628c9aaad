from __future__ import annotations

import math
from typing import get_args, get_type_hints

import pytest

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.ik.configuration import Elbow, Shoulder, Wrist
from openpendant.motion.pose import Pose
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.point_poses import check_consistency
from openpendant.server.programs.language.program import Program, check_robot
from openpendant.server.programs.language.program_errors import PointInconsistent, WrongRobot
from openpendant.simplemsg.pendant.management.points import (
    ArmConfiguration,
    JointVector,
    PointPose,
    TeachPoint,
)
from openpendant.simplemsg.pendant.management.words import BadValue, ProgramNameRefused
from openpendant.simplemsg.verdicts import VerdictCode as V

SQUARE = PointPose((0.4, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0), "base", "gripper")
POINT = TeachPoint("home", (0.0, 1.0), SQUARE)


def reaching(distance: float, angle: float) -> Pose:
    return Pose.from_rpy((0.4 + distance, 0.0, 0.3), (0.0, 0.0, angle))


def test_joints_that_put_the_tool_at_the_pose_agree_with_it() -> None:
    asked: list[tuple[JointVector, str, str]] = []

    def forward(joints: JointVector, frame: str, tool: str) -> Pose:
        asked.append((joints, frame, tool))
        return reaching(5e-5, 5e-4)

    check_consistency(POINT, forward)
    assert asked == [((0.0, 1.0), "base", "gripper")]


@pytest.mark.parametrize(("distance", "angle"), [(2e-4, 0.0), (0.0, 2e-3)])
def test_joints_that_put_it_elsewhere_are_refused_with_numbers(
    distance: float, angle: float
) -> None:
    with pytest.raises(PointInconsistent) as caught:
        check_consistency(POINT, lambda *_: reaching(distance, angle))
    assert caught.value.distance == pytest.approx(distance)
    assert caught.value.angle == pytest.approx(angle)
    assert caught.value.code is V.POINT_INCONSISTENT


def test_a_point_without_a_pose_agrees_with_everything() -> None:
    check_consistency(TeachPoint("home", (0.0,)), lambda *_: reaching(9.0, 3.0))


def test_the_words_of_a_configuration_are_those_of_motion() -> None:
    hints = get_type_hints(ArmConfiguration)
    for name, words in (("shoulder", Shoulder), ("elbow", Elbow), ("wrist", Wrist)):
        assert set(get_args(hints[name])) == {word.value for word in words}


@pytest.mark.parametrize("name", ["", " a", "a/b", "..", "a\\b", 'a"b', "a\nb", "\0", "x" * 65])
def test_a_name_that_is_a_path_or_not_printable_is_refused(name: str) -> None:
    with pytest.raises(ProgramNameRefused) as caught:
        TeachPoint(name, (0.0,))
    assert caught.value.code is V.BAD_NAME


@pytest.mark.parametrize("joints", [(), (0.0,) * 17, (math.nan,), (math.inf,)])
def test_joints_that_are_none_are_refused(joints: JointVector) -> None:
    with pytest.raises(BadValue):
        TeachPoint("a", joints)


def test_turns_are_one_for_each_joint() -> None:
    arm = ArmConfiguration("front", "up", "flip", (0, 0, 0))
    with pytest.raises(BadValue, match="turns are 3; accepted: 2, as joints"):
        TeachPoint("a", (0.0, 0.0), configuration=arm)


UR5 = serial_robot("ur5").limits
RAIL = serial_robot("rail_kr5_arc")


def taught_on(robot: str, joints: str, linear: str = "") -> Program:
    head = f'openpendant-program/1\nprogram "p" robot {robot} {linear}\n'
    return parse(f"{head}point a joints {joints}")


def test_a_program_of_this_robot_is_taken() -> None:
    check_robot(taught_on("ur5", "0 0 0 0 0 0 deg"), "ur5", UR5)
    check_robot(taught_on(RAIL.name, "5 mm 0 0 0 0 0 0 deg", "linear 1"), RAIL.name, RAIL.limits)


@pytest.mark.parametrize(
    ("program", "robot", "limits", "message"),
    [
        (taught_on("puma560", "0 0 0 0 0 0 deg"), "ur5", UR5, "taught on 'puma560'; accepted here"),
        (taught_on("ur5", "0 0 deg"), "ur5", UR5, "with 2 joints; accepted here: 6 joints"),
        (
            taught_on("x", "0 0 0 0 0 0 0 deg"),
            "x",
            RAIL.limits,
            "with no linear axes; accepted here: linear axes 1",
        ),
    ],
)
def test_a_program_of_another_robot_is_refused(
    program: Program, robot: str, limits: JointLimits, message: str
) -> None:
    with pytest.raises(WrongRobot, match=message) as caught:
        check_robot(program, robot, limits)
    assert caught.value.code is V.PROGRAM_WRONG_ROBOT
