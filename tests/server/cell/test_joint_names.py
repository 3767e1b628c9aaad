import pytest
from rigs.cells.emulated_cell import EmulatedCell

from openpendant.motion.description.robot import serial_robot
from openpendant.server.cell.joint_names import JointNames
from openpendant.simplemsg.pendant import Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

UR5 = JointNames(serial_robot("ur5").limits)
IRB = JointNames(serial_robot("abb_irb2400").limits)

IN_FULL = [
    ("elbow_joint at 4 rad", "Upper-Arm (elbow_joint) at 4 rad"),
    ("joint 3 stands at 4", "Upper-Arm (elbow_joint) stands at 4"),
    ("joint 3, that is elbow_joint", "Upper-Arm (elbow_joint), that is Upper-Arm"),
    (
        "joint 1 and joint 2",
        "Base (shoulder_pan_joint) and Lower-Arm (shoulder_lift_joint)",
    ),
    ("joint 0 and joint 7 are none", "joint 0 and joint 7 are none"),
    ("my_elbow_joint and elbow_joint-2", "my_elbow_joint and elbow_joint-2"),
    ("nothing is named", "nothing is named"),
]


@pytest.mark.parametrize(("text", "told"), IN_FULL)
def test_a_joint_is_told_with_its_name_in_the_file_once(text: str, told: str) -> None:
    assert UR5.in_full(text) == told


def test_shortly_a_joint_is_told_by_its_display_name_alone() -> None:
    assert UR5.shortly("joint 3 or elbow_joint") == "Upper-Arm or Upper-Arm"


def test_of_two_names_the_longer_is_found() -> None:
    ten = serial_robot("rail_kr5_arc").limits
    names = JointNames(ten)
    for name, shown in zip(ten.names, ten.display_names, strict=True):
        assert names.shortly(f"{name} moves") == f"{shown} moves"


def test_names_of_the_six_axis_arms_are_those_of_the_first_paper() -> None:
    assert IRB.shortly("joint_1 joint_2 joint_3 joint_4 joint_5 joint_6").split() == [
        *("Base", "Lower-Arm", "Upper-Arm", "Wrist-Roll", "Wrist-Pitch", "Wrist-Twist")
    ]


@pytest.mark.parametrize("version", [2, 3])
def test_a_verdict_names_the_joint_as_people_do_in_either_version(version: int) -> None:
    pendant = EmulatedCell().stranger()
    pendant.hello(version=version)
    assert pendant.take() is V.ACCEPTED
    assert pendant.move(0.0, -1.5, 3.5, 0.0, 0.0, 0.0) is V.OUT_OF_RANGE
    told = [each for each in pendant.got if isinstance(each, Verdict)][-1]
    assert told.joint == 2
    assert told.text.startswith("Upper-Arm (elbow_joint) at 3.5 rad is outside its range")
