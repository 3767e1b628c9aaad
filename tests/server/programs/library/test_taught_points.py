import math
from typing import Any, get_args, get_type_hints

import pytest
from rigs.cells.busy_cell import BusyCell, answers
from rigs.cells.program_cell import A
from rigs.data.large_programs import large_body

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.ik.configuration import Elbow, Shoulder, Wrist
from openpendant.motion.pose import Pose
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.point_poses import check_consistency
from openpendant.server.programs.language.program import Program, check_robot
from openpendant.server.programs.language.program_errors import PointInconsistent, WrongRobot
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant.management import points
from openpendant.simplemsg.pendant.management.points import JointVector, TeachPoint
from openpendant.simplemsg.pendant.management.words import BadValue, ProgramNameRefused
from openpendant.simplemsg.verdicts import VerdictCode as V

B = (0.4, -1.3, 1.3, -1.4, -1.6, 0.2)
GRIPPER = {"position": [0.0, 0.0, 0.12]}
LONGER = {"position": [0.0, 0.0, 0.30]}
TABLE = {"position": [0.5, 0.0, 0.0]}
MOVED = {"position": [0.5, 0.2, 0.0]}
RECORD: dict[str, Any] = {"op": "programs.record", "point": "here"}
TOUCH_UP: dict[str, Any] = {"op": "programs.touch_up", "point": "p7"}


def go(cell: BusyCell, goal: tuple[float, ...]) -> None:
    assert cell.user.move(*goal) is V.ACCEPTED
    while cell.core.cell.is_busy:
        cell.pass_time(100)
    assert cell.position == pytest.approx(goal, abs=1e-6)


def teach(cell: BusyCell, asked: dict[str, Any], revision: int = 1, name: str = "main") -> None:
    cell.begin(cell.user, **asked, name=name, expected_revision=revision)


@pytest.fixture
def cell() -> BusyCell:
    made = BusyCell()
    go(made, A)
    body, kind = large_body(1_000, 1_000), DocumentKind.PROGRAM
    made.store.save(kind, "main", body, expected_revision=0, author="test")
    return made


@pytest.mark.parametrize("asked", [RECORD, TOUCH_UP])
def test_a_robot_that_went_on_before_the_point_was_kept_has_it_where_it_stood(
    cell: BusyCell, asked: dict[str, Any]
) -> None:
    cell.is_busy = True
    teach(cell, asked)
    go(cell, B)
    cell.catch_up()
    assert answers(cell.user)[-1]["revision"] == 2
    taught = cell.points()[asked["point"]]
    assert taught["joints"] == pytest.approx(A, abs=1e-6)
    standing = cell.points()[asked["point"]]["pose"]["position"]
    go(cell, A)
    teach(cell, RECORD | {"point": "again"}, 2)
    assert standing == pytest.approx(cell.points()["again"]["pose"]["position"], abs=1e-6)


@pytest.mark.parametrize("asked", [RECORD, TOUCH_UP])
def test_a_robot_that_moves_is_refused_at_once_though_it_would_stand_later(
    cell: BusyCell, asked: dict[str, Any]
) -> None:
    assert cell.user.move(*B) is V.ACCEPTED
    cell.wait(200)
    cell.is_busy = True
    teach(cell, asked)
    assert answers(cell.user)[-1]["code"] == V.MOVING
    assert cell.waiting == []


def test_without_a_fresh_report_no_point_is_taught(cell: BusyCell) -> None:
    cell.now += 1_000_000_000
    cell.is_busy = True
    teach(cell, RECORD)
    assert answers(cell.user)[-1]["code"] == V.FEEDBACK_STALE


@pytest.mark.parametrize(
    ("change", "fields"),
    [
        ("tools.move", {"name": "gripper", "tcp": LONGER}),
        ("tools.select", {"name": "gripper"}),
        ("frames.move", {"name": "table", "pose": MOVED}),
    ],
)
def test_a_point_has_the_pose_of_the_frames_and_tools_that_it_was_asked_for_with(
    cell: BusyCell, change: str, fields: dict[str, Any]
) -> None:
    cell.user.ask("tools.add", name="gripper", tcp=GRIPPER, expected_revision=0)
    cell.user.ask("frames.add", name="table", pose=TABLE, expected_revision=0)
    cell.user.ask("programs.create", name="own", frame="table", tool="gripper")
    teach(cell, RECORD | {"point": "before"}, 1, "own")
    before = cell.points("own")["before"]
    cell.is_busy = True
    teach(cell, RECORD, 2, "own")
    waiting, cell.waiting, cell.is_busy = cell.waiting, [], False
    cell.user.ask(change, **fields, expected_revision=1)
    cell.waiting = waiting
    cell.catch_up()
    assert cell.points("own")["here"]["pose"] == before["pose"]


def test_the_pose_of_a_point_is_the_same_whichever_tool_is_selected(cell: BusyCell) -> None:
    """The tool of a point is its program's; the selected one is that of jogs and pose moves."""
    cell.user.ask("tools.add", name="gripper", tcp=GRIPPER, expected_revision=0)
    cell.user.ask("tools.add", name="torch", tcp=LONGER, expected_revision=1)
    cell.user.ask("programs.create", name="own", tool="gripper")
    for number, selected in enumerate((None, "gripper", "torch")):
        cell.user.ask("tools.select", name=selected, expected_revision=2 + number)
        teach(cell, RECORD | {"point": str(selected)}, 1 + number, "own")
    bare, gripper, torch = (point["pose"] for point in cell.points("own").values())
    assert gripper["position"] == pytest.approx(bare["position"], abs=1e-9)
    assert torch["position"] == pytest.approx(bare["position"], abs=1e-9)


SQUARE = points.PointPose((0.4, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0), "base", "gripper")
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
    hints = get_type_hints(points.ArmConfiguration)
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
    arm = points.ArmConfiguration("front", "up", "flip", (0, 0, 0))
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
