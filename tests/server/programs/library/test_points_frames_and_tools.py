import math
from collections.abc import Callable
from typing import Any, get_args, get_type_hints

import pytest
from rigs.cells.busy_cell import BusyCell
from rigs.cells.program_cell import A
from rigs.data.large_programs import large_body

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.ik.configuration import Elbow, Shoulder, Wrist
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.point_poses import check_consistency
from openpendant.server.programs.language.program import Program, check_robot
from openpendant.server.programs.language.program_errors import PointInconsistent, WrongRobot
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.store_errors import DiskFull
from openpendant.simplemsg import joint_array
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.pendant.management import program_values
from openpendant.simplemsg.pendant.management.program_values import (
    BadValue,
    JointVector,
    ProgramNameRefused,
    TeachPoint,
)
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
    assert cell.user.answers()[-1]["revision"] == 2
    taught = cell.points()[asked["point"]]
    assert taught["joints"] == pytest.approx(A, abs=1e-6)
    standing = cell.points()[asked["point"]]["pose"]["position"]
    go(cell, A)
    teach(cell, RECORD | {"point": "again"}, 2)
    assert standing == pytest.approx(cell.points()["again"]["pose"]["position"], abs=1e-6)


@pytest.mark.parametrize("asked", [RECORD, TOUCH_UP])
def test_a_point_is_taught_as_people_read_it_and_its_pose_is_that_of_its_joints(
    cell: BusyCell, asked: dict[str, Any]
) -> None:
    go(cell, (0.123456789123, *A[1:]))
    teach(cell, asked)
    taught = cell.points()[asked["point"]]
    assert math.degrees(taught["joints"][0]) == pytest.approx(
        round(math.degrees(taught["joints"][0]), 6), abs=1e-12
    )
    for value in taught["pose"]["position"]:
        assert 1000 * value == pytest.approx(round(1000 * value, 4), abs=1e-10)
    reached = Kinematics(serial_robot("ur5")).forward(taught["joints"]).position
    assert taught["pose"]["position"] == pytest.approx(reached.tolist(), abs=6e-8)


@pytest.mark.parametrize("asked", [RECORD, TOUCH_UP])
def test_a_robot_that_moves_is_refused_at_once_though_it_would_stand_later(
    cell: BusyCell, asked: dict[str, Any]
) -> None:
    assert cell.user.move(*B) is V.ACCEPTED
    cell.wait(200)
    cell.is_busy = True
    teach(cell, asked)
    assert cell.user.answers()[-1]["code"] == V.MOVING
    assert cell.waiting == []


def test_without_a_fresh_report_no_point_is_taught(cell: BusyCell) -> None:
    cell.now += 1_000_000_000
    cell.is_busy = True
    teach(cell, RECORD)
    assert cell.user.answers()[-1]["code"] == V.FEEDBACK_STALE


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


SQUARE = program_values.PointPose((0.4, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0), "base", "gripper")
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
def test_joints_that_put_it_elsewhere_are_refused_by_how_far(distance: float, angle: float) -> None:
    with pytest.raises(PointInconsistent) as caught:
        check_consistency(POINT, lambda *_: reaching(distance, angle))
    assert caught.value.distance == pytest.approx(distance)
    assert caught.value.angle == pytest.approx(angle)
    assert caught.value.code is V.POINT_INCONSISTENT


def test_a_point_without_a_pose_agrees_with_everything() -> None:
    check_consistency(TeachPoint("home", (0.0,)), lambda *_: reaching(9.0, 3.0))


def test_the_words_of_a_configuration_are_those_of_motion() -> None:
    hints = get_type_hints(program_values.ArmConfiguration)
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
    arm = program_values.ArmConfiguration("front", "up", "flip", (0, 0, 0))
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


Change = dict[str, Any]

LONG_TOOL = {"position": [0.0, 0.0, 1.0]}
SELECT: Change = {"op": "tools.select", "name": "lance", "expected_revision": 1}
ADD_FRAME: Change = {"op": "frames.add", "name": "table", "pose": TABLE, "expected_revision": 0}
ADD_TOOL: Change = {"op": "tools.add", "name": "gripper", "tcp": TABLE, "expected_revision": 1}


@pytest.fixture
def t1() -> BusyCell:
    """Return a cell in T1, enabled, with a tool that is not selected."""
    made = BusyCell()
    assert made.user.code(messages.Subscribe(made.user._next(), 100.0)) is V.ACCEPTED
    assert made.user.mode(messages.OperatingMode.MANUAL_REDUCED) is V.ACCEPTED
    made.user.ask("tools.add", name="lance", tcp=LONG_TOOL, expected_revision=0)
    made.user.enable(1)
    made.wait(100)
    return made


def jog(cell: BusyCell) -> V | None:
    newest = cell.user.all(messages.State)[-1].sequence
    rates = joint_array((1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    press, space = cell.user._next(), messages.JogSpace.JOINTS
    return cell.user.code(messages.JogStart(press, press, newest, 0.15, space, "", 6, rates))


def hold(cell: BusyCell, milliseconds: int) -> None:
    for beat in range(milliseconds // 50):
        cell.user.send(messages.JogBeat(cell.user.last_request, beat + 1))
        cell.user.enable(1)
        cell.wait(50)


def move(cell: BusyCell) -> V | None:
    return cell.user.move(*(value + 0.2 for value in cell.position), speed=0.3)


def selected(cell: BusyCell) -> object:
    return cell.user.ask("frames.show")["content"]["selected_tool"]


def why(cell: BusyCell, kind: str = "jog") -> dict[str, Any]:
    told = cell.user.ask("why", kind=kind, whose="mine")["conditions"]
    return next((each for each in told if not each["holds"]), {"condition": ""})


MOTIONS = pytest.mark.parametrize("motion", [jog, move])


@MOTIONS
@pytest.mark.parametrize("change", [SELECT, ADD_FRAME, ADD_TOOL], ids=lambda each: each["op"])
def test_no_motion_begins_while_frames_or_tools_are_being_kept(
    t1: BusyCell, change: dict[str, Any], motion: Callable[[BusyCell], V | None]
) -> None:
    t1.is_busy = True
    t1.begin(t1.user, **change)
    assert motion(t1) is V.CHANGE_WHILE_MOVING
    broken = why(t1)
    assert (broken["condition"], broken["name"]) == ("standing", "CHANGE_WHILE_MOVING")
    assert "being saved" in broken["text"]
    t1.catch_up()
    assert t1.user.answers()[-1]["revision"] == change["expected_revision"] + 1
    assert why(t1)["condition"] == ""
    t1.user.enable(1)
    assert motion(t1) is V.ACCEPTED


@MOTIONS
def test_while_it_moves_frames_and_tools_are_not_changed(
    t1: BusyCell, motion: Callable[[BusyCell], V | None]
) -> None:
    """The other order: the motion was first."""
    assert motion(t1) is V.ACCEPTED
    hold(t1, 100)
    assert t1.user.ask(**SELECT)["code"] == V.CHANGE_WHILE_MOVING
    assert selected(t1) is None


def test_a_jog_after_the_change_keeps_the_new_tool_below_250_mm_per_second(t1: BusyCell) -> None:
    t1.is_busy = True
    t1.begin(t1.user, **SELECT)
    assert jog(t1) is V.CHANGE_WHILE_MOVING
    t1.catch_up()
    assert selected(t1) == "lance"
    t1.user.enable(1)
    assert jog(t1) is V.ACCEPTED
    hold(t1, 1_000)
    fastest = max(state.tool_speed for state in t1.user.all(messages.State))
    assert 0.1 < fastest <= 0.2501


@pytest.mark.parametrize("change", [SELECT, ADD_FRAME], ids=lambda each: each["op"])
def test_a_change_the_disk_refuses_holds_up_nothing(t1: BusyCell, change: dict[str, Any]) -> None:
    t1.is_busy = True
    t1.begin(t1.user, **change)
    t1.fail(DiskFull("store.db: database or disk is full"))
    assert t1.user.answers()[-1]["code"] == V.DISK_FULL
    t1.user.enable(1)
    assert jog(t1) is V.ACCEPTED


def test_a_change_that_is_refused_at_once_holds_up_nothing(t1: BusyCell) -> None:
    t1.is_busy = True
    t1.begin(t1.user, **(SELECT | {"name": "unknown"}))
    assert jog(t1) is V.ACCEPTED


def test_a_change_of_frames_and_one_of_tools_at_once_do_not_undo_each_other(t1: BusyCell) -> None:
    t1.is_busy = True
    t1.begin(t1.user, **ADD_FRAME)
    t1.begin(t1.user, **SELECT)
    assert t1.user.answers()[-1]["code"] == V.STORE_BUSY
    t1.catch_up()
    assert "table" in t1.user.ask("frames.show")["names"]
    assert t1.user.ask(**SELECT) == {"revision": 2}
    assert "table" in t1.user.ask("frames.show")["names"]


def test_no_motion_begins_before_frames_tools_and_scene_were_read_at_the_start() -> None:
    cell = SlowStart()
    assert move(cell) is V.CHANGE_WHILE_MOVING
    assert "being read" in why(cell, "move")["text"]
    while cell.waiting:
        assert move(cell) is V.CHANGE_WHILE_MOVING
        cell.catch_up()
        cell.is_busy = bool(cell.waiting)
    assert move(cell) is V.ACCEPTED


def test_nothing_is_changed_before_what_is_kept_was_read() -> None:
    """What was read would come into force in its place."""
    cell = SlowStart()
    box = {"name": "box", "shape": {"type": "box", "size": [0.1, 0.1, 0.1]}, "position": [2, 0, 0]}
    assert cell.user.ask(**ADD_FRAME)["code"] == V.STORE_BUSY
    assert cell.user.ask("scene.add", object=box, expected_revision=0)["code"] == V.STORE_BUSY


def test_documents_that_cannot_be_read_hold_up_nothing_once_that_is_known() -> None:
    cell = SlowStart()
    while cell.waiting:
        cell.fail(DiskFull("store.db: disk I/O error"))
    assert move(cell) is V.ACCEPTED


class SlowStart(BusyCell):
    def perform(self, outgoing: list[Any]) -> list[Any]:
        self.is_busy = self.is_busy or not hasattr(self, "user")
        return super().perform(outgoing)
