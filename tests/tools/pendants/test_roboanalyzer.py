"""RoboAnalyzer's calls by their names, what each asks of the server, and what it refuses."""

import math
from array import array
from collections.abc import Callable, Iterator
from functools import partial
from itertools import groupby
from typing import Any

import pytest
from rigs.cells.server_rig import LIMITS, NoTool
from rigs.peers.scripted_pendant_server import ScriptedPendantServer, scripted_server

from openpendant.server.core.cell_core import CellCore
from openpendant.server.core.server_core import ServerCore
from openpendant.server.endpoints.pendant.access_requests import Identity
from openpendant.server.events.effects import Send
from openpendant.server.events.events import Opened, Port, Received
from openpendant.server.settings.cell_settings import make_settings
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.connection_errors import PendantError, Refused, WrongArgument
from openpendant.tools.pendants.loop_thread import LoopThread
from openpendant.tools.pendants.motions import quaternion_of, roll_pitch_yaw
from openpendant.tools.pendants.roboanalyzer import RoboAnalyzerClient
from openpendant.tools.pendants.roboanalyzer.values import some_cell

pytestmark = pytest.mark.realtime

THE_TWELVE = [
    *("RoboAnalyzerClient", "ClearTrace", "SetHomePosition", "UpdateJointAngles"),
    *(f"Increment{each}" for each in (*"ABCXYZ", "JointAngle", "JointAngles")),
]
"""The first is the constructor, which selects the robot."""

MORE = ["ShowAvailableRobots", "LoadRobot", "DisplayRobot", "UpdateRobot", "DisposeRobot"]


ARM = {"name": "j", "unit": "rad", "lower": -math.pi, "upper": math.pi}
RAIL = {"name": "rail", "unit": "m", "lower": 0.0, "upper": 2.0}
SNAPSHOT = {"cell": "left", "robot": "ur5", "joints": [RAIL, *[ARM] * 5]}
CELLS = {
    "cells": [
        {"cell": "left", "robot": "ur5", "dof": 6},
        {"cell": "right", "robot": "puma560", "dof": 6},
    ]
}


@pytest.fixture
def server() -> Iterator[ScriptedPendantServer]:
    """A server of two cells on a thread; its robot stands in AUTOMATIC."""
    thread = LoopThread("scripted server")
    with thread.entered(scripted_server()) as running:
        running.mode = messages.OperatingMode.AUTOMATIC
        running.answers = {"snapshot": SNAPSHOT, "cells": CELLS, "trace.clear": {}}
        yield running
    thread.end()


@pytest.fixture
def robot(server: ScriptedPendantServer) -> Iterator[RoboAnalyzerClient]:
    with RoboAnalyzerClient("127.0.0.1", server.port, speed=0.5) as connected:
        yield connected


@pytest.mark.parametrize("name", [*THE_TWELVE, *MORE])
def test_each_call_of_the_original_is_there_by_its_name(name: str) -> None:
    if name == RoboAnalyzerClient.__name__:
        assert len(THE_TWELVE) == 12
    else:
        assert callable(getattr(RoboAnalyzerClient, name))


def test_joint_positions_are_degrees_and_millimetres(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient
) -> None:
    robot.UpdateJointAngles([500.0, 90.0, -90.0, 0.0, 45.0, 180.0])
    move = server.one(messages.JointMove)
    expected = [0.5, math.pi / 2, -math.pi / 2, 0.0, math.pi / 4, math.pi]
    assert move.joints[:6] == pytest.approx(expected, abs=1e-6)
    assert move.speed == 0.5


def test_joint_increments_start_where_the_robot_stands(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient
) -> None:
    robot.IncrementJointAngle(1, -100.0)
    robot.IncrementJointAngles([0.0, 0.0, 0.0, 0.0, 0.0, 90.0])
    here = [0.125, 0.25, 0.375, 0.5, 0.625, 0.75]
    one, many = server.all(messages.JointMove)
    assert one.joints[:6] == pytest.approx([0.025, *here[1:]], abs=1e-6)
    assert many.joints[:6] == pytest.approx([*here[:5], 0.75 + math.pi / 2], abs=1e-6)


def test_home_is_asked_for_by_name(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient
) -> None:
    robot.SetHomePosition()
    assert server.one(messages.Home).target == "home"


@pytest.mark.parametrize(("axis", "index"), [("X", 0), ("Y", 1), ("Z", 2)])
def test_x_y_and_z_are_straight_lines_along_the_axes_of_base(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient, axis: str, index: int
) -> None:
    getattr(robot, f"Increment{axis}")(-25.0)
    expected = [0.5, 0.25, 0.75]
    expected[index] -= 0.025
    move = server.one(messages.PoseMove)
    assert move.position == pytest.approx(expected, abs=1e-6)
    assert (move.motion, move.frame, move.orientation) == (
        messages.Motion.LIN,
        "base",
        (0, 0, 0, 1),
    )


@pytest.mark.parametrize(("angle", "index"), [("A", 0), ("B", 1), ("C", 2)])
def test_a_b_and_c_change_the_values_of_roll_pitch_and_yaw(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient, angle: str, index: int
) -> None:
    getattr(robot, f"Increment{angle}")(30.0)
    move = server.one(messages.PoseMove)
    expected = [0.0, 0.0, 0.0]
    expected[index] = math.radians(30.0)
    assert roll_pitch_yaw(move.orientation) == pytest.approx(expected, abs=1e-6)
    assert move.position == (0.5, 0.25, 0.75)


@pytest.mark.parametrize(
    "angles", [(0.1, 0.2, 0.3), (3.0, -1.5, -3.0), (-math.pi, 0.0, 1.0), (0.5, 1.5, 2.5)]
)
def test_roll_pitch_yaw_and_quaternion_lead_back_to_each_other(
    angles: tuple[float, float, float],
) -> None:
    back = quaternion_of(*roll_pitch_yaw(quaternion_of(*angles)))
    dot = sum(a * b for a, b in zip(back, quaternion_of(*angles), strict=True))
    assert abs(dot) == pytest.approx(1.0, abs=1e-12)


def test_where_the_robot_is_comes_in_degrees_and_millimetres(robot: RoboAnalyzerClient) -> None:
    posture = robot.UpdateRobot()
    assert posture.joints[0] == pytest.approx(125.0, abs=1e-4)
    assert posture.joints[1] == pytest.approx(math.degrees(0.25), abs=1e-4)
    assert (posture.x, posture.y, posture.z) == (500.0, 250.0, 750.0)
    assert (posture.a, posture.b, posture.c) == (0.0, 0.0, 0.0)


def test_what_the_robot_is_comes_in_degrees_and_millimetres(robot: RoboAnalyzerClient) -> None:
    display = robot.DisplayRobot()
    assert (display.name, display.cell) == ("ur5", "left")
    rail, arm, *_ = display.joints
    assert (rail.unit, rail.upper) == ("mm", 2000.0)
    assert arm.unit == "°"
    assert arm.lower == pytest.approx(-180.0)


def test_the_trace_is_cleared_by_a_documented_message(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient
) -> None:
    robot.ClearTrace()
    assert server.all(messages.Management)[-1].body == b'{"op": "trace.clear"}'


@pytest.mark.parametrize("name", ["puma560", "right"])
def test_a_robot_is_selected_by_its_name_or_its_cell(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient, name: str
) -> None:
    assert robot.ShowAvailableRobots() == ["ur5", "puma560"]
    robot.LoadRobot(name)
    assert [hello.cell for hello in server.all(messages.Hello)] == ["", "right"]


def test_a_robot_that_is_refused_leaves_the_one_of_before(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient
) -> None:
    server.refusals[messages.Authority] = (VerdictCode.HELD_BY_OTHER, "anna moves it")
    with pytest.raises(Refused, match="anna moves it"):
        robot.LoadRobot("puma560")
    robot.IncrementX(1.0)
    assert len(server.all(messages.PoseMove)) == 1
    robot.LoadRobot("puma560")
    assert [hello.cell for hello in server.all(messages.Hello)] == ["", "right", "right"]


def test_after_its_disposal_each_call_says_what_to_make(robot: RoboAnalyzerClient) -> None:
    robot.DisposeRobot()
    robot.DisposeRobot()
    calls: list[Callable[[], object]] = [
        robot.ClearTrace,
        robot.DisplayRobot,
        robot.UpdateRobot,
        robot.ShowAvailableRobots,
        robot.SetHomePosition,
        lambda: robot.LoadRobot("right"),
        lambda: robot.IncrementX(1.0),
        lambda: robot.IncrementA(1.0),
        lambda: robot.IncrementJointAngle(1, 1.0),
        lambda: robot.UpdateJointAngles([0.0] * 6),
    ]
    for call in calls:
        with pytest.raises(PendantError, match="make another RoboAnalyzerClient"):
            call()


def test_user_and_password_are_shown_to_each_robot_that_is_loaded(
    server: ScriptedPendantServer,
) -> None:
    with RoboAnalyzerClient("127.0.0.1", server.port, user="ada", password="canary") as robot:
        robot.LoadRobot("right")
        logins = [(login.kind, login.name, login.secret) for login in server.all(messages.Login)]
        assert logins == [(messages.LoginKind.PASSWORD, "ada", "canary")] * 2
        assert "canary" not in repr(vars(robot))


def test_a_pairing_code_in_a_room_wants_its_cell(room: ScriptedPendantServer) -> None:
    with pytest.raises(WrongArgument, match=r"say cell=: .*here: left, right, third"):
        RoboAnalyzerClient("127.0.0.1", room.port, "puma560", pairing="ABC234")
    assert room.all(messages.Login) == []
    with RoboAnalyzerClient("127.0.0.1", room.port, cell="right", pairing="ABC234"):
        assert room.one(messages.Login).name == "RoboAnalyzer"


def test_a_robot_that_is_not_there_is_refused_with_those_that_are(
    server: ScriptedPendantServer,
) -> None:
    with pytest.raises(WrongArgument, match=r"no robot 'kr6'.*ur5 \(cell left\), puma560"):
        RoboAnalyzerClient("127.0.0.1", server.port, "kr6")


ROOM = {
    "cells": [
        {"cell": "left", "robot": "ur5"},
        {"cell": "right", "robot": "puma560"},
        {"cell": "third", "robot": "ur5"},
    ]
}


@pytest.fixture
def room(server: ScriptedPendantServer) -> ScriptedPendantServer:
    """A server of three cells, which takes no hello that names none of them."""
    server.answers["cells"] = ROOM
    server.cells = ("left", "right", "third")
    return server


@pytest.mark.parametrize(
    ("name", "cell"), [("puma560", "right"), ("right", "right"), ("left", "left")]
)
def test_in_a_room_the_robot_alone_selects_its_cell(
    room: ScriptedPendantServer, name: str, cell: str
) -> None:
    with RoboAnalyzerClient("127.0.0.1", room.port, name):
        assert room.all(messages.Hello)[-1].cell == cell


@pytest.mark.parametrize(
    ("asked", "error", "told"),
    [
        ({"robot": "ur5"}, WrongArgument, "2 cells have a robot 'ur5': name left or third"),
        ({}, WrongArgument, r"several robots: name one of ur5 \(cell left\), "),
        ({"cell": "attic"}, Refused, "no cell 'attic'; here: left, right, third"),
    ],
    ids=["a robot that two cells have", "no robot", "a cell that is not there"],
)
def test_in_a_room_what_selects_no_cell_is_refused_with_those_there_are(
    room: ScriptedPendantServer, asked: dict[str, Any], error: type[PendantError], told: str
) -> None:
    with pytest.raises(error, match=told):
        RoboAnalyzerClient("127.0.0.1", room.port, **asked)
    assert room.all(messages.Authority) == []


def test_loading_a_robot_that_two_cells_have_keeps_the_one_that_is_loaded(
    room: ScriptedPendantServer,
) -> None:
    with RoboAnalyzerClient("127.0.0.1", room.port, cell="third") as robot:
        with pytest.raises(WrongArgument, match="name left or third"):
            robot.LoadRobot("ur5")
        robot.UpdateRobot()
        robot.LoadRobot("left")
        assert room.all(messages.Hello)[-1].cell == "left"


def test_the_refusal_of_a_real_room_names_a_cell_that_tells_the_others() -> None:
    told = sentence_of_a_room("left", "right")
    assert some_cell(Refused(VerdictCode.UNKNOWN_CELL, told, -1, 0.0, 0.0)) == "left"
    assert some_cell(Refused(VerdictCode.VERSION, told, -1, 0.0, 0.0)) == ""


def sentence_of_a_room(*names: str) -> str:
    """Return what a server of several cells says to a hello that names none."""
    cores = [
        CellCore(
            make_settings({"name": name}, "test"),
            LIMITS,
            Identity(name, "two-joints", "openpendant test"),
            NoTool(),
        )
        for name in names
    ]
    cells = ServerCore(cores)
    for event in (
        Opened(7, Port.PENDANT, "127.0.0.1"),
        Received(7, messages.Hello(messages.PROTOCOL_VERSION, 0.0, "", "tester")),
    ):
        ((number, routed),) = cells.route(event)
        out = cores[number].handle(routed, 0)
    answer = out[0]
    assert isinstance(answer, Send)
    assert isinstance(answer.message, messages.Verdict)
    return answer.message.text


def test_in_a_manual_mode_each_motion_is_enabled(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient
) -> None:
    robot.IncrementX(1.0)
    assert server.all(messages.Enabling) == []
    server.mode = messages.OperatingMode.MANUAL_REDUCED
    # States of before may still be under way.
    robot._pendant.wait_until(lambda state: state.operating_mode == server.mode)
    robot.IncrementX(1.0)
    robot.ClearTrace()  # answered in order, so that all before it has come
    positions = [message.position for message in server.all(messages.Enabling)]
    # A motion that takes long has it held again and again.
    assert [position for position, _ in groupby(positions)] == [0, 1, 0]


def test_a_wrong_count_or_joint_never_leaves(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient
) -> None:
    with pytest.raises(WrongArgument, match="5 angles; the robot has 6 joints"):
        robot.UpdateJointAngles([0.0] * 5)
    with pytest.raises(WrongArgument, match="7 increments; the robot has 6 joints"):
        robot.IncrementJointAngles([0.0] * 7)
    with pytest.raises(WrongArgument, match="no joint 0; the robot has joints 1 to 6"):
        robot.IncrementJointAngle(0, 1.0)
    assert server.all(messages.JointMove) == []


def test_what_the_server_refuses_arrives_as_its_refusal(
    server: ScriptedPendantServer, robot: RoboAnalyzerClient
) -> None:
    server.refusals[messages.PoseMove] = (VerdictCode.UNREACHABLE, "too far")
    with pytest.raises(Refused, match="too far"):
        robot.IncrementZ(9000.0)


# What its calls take for a number, a joint or a name, and how they refuse the rest.


def test_whole_numbers_may_be_floats_as_those_of_matlab(server: ScriptedPendantServer) -> None:
    port: Any = float(server.port)
    with RoboAnalyzerClient("127.0.0.1", port) as robot:
        robot.IncrementJointAngle(1.0, 5)
        robot.IncrementJointAngles(array("d", [0.0] * 6))
    assert len(server.all(messages.JointMove)) == 2


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
    assert server.all(messages.JointMove) == server.all(messages.PoseMove) == []


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
