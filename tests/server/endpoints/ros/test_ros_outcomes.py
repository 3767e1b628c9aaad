from collections.abc import Callable

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.ros_situations import (
    PATH,
    collecting,
    idle,
    manual,
    moving,
    planning,
    status_of,
    superseding,
)
from rigs.cells.server_rig import MS, ServerRig, ready
from rigs.cells.watched_motions import following_ros
from rigs.peers.scripted_action_node import Goal, ScriptedActionNode
from rigs.peers.server_clients import RosClient

from openpendant.motion.description.robot import serial_robot
from openpendant.server.events.effects import LogLine
from openpendant.server.events.events import Port
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import JointPosition, Malformed, Status, TriState
from openpendant.simplemsg.errors import BodyFault
from openpendant.simplemsg.verdicts import STATUS_ERROR_OFFSET
from openpendant.simplemsg.verdicts import VerdictCode as V

Situation = tuple[ServerRig, RosClient]


def lines(rig: ServerRig) -> list[str]:
    return [item.text for _, item in rig.log if isinstance(item, LogLine)]


def may_not_move() -> Situation:
    rig = ready()
    manual(rig)
    client = rig.ros()
    client.point(0, 0.0, 0.0)
    client.point(1, 0.1, 0.0)
    return rig, client


def out_of_order() -> Situation:
    rig, client = collecting()
    client.point(7, 0.1, 0.0)
    client.point(8, 0.1, 0.0)
    return rig, client


def waiting() -> Situation:
    rig, client = superseding()
    rig.log.clear()
    return rig, client


def error_of_the_controller(rig: ServerRig, _: RosClient) -> None:
    for error in (7, 0):
        rig.controller.error_code = error
        rig.report()


def end_that_never_comes(rig: ServerRig, client: RosClient) -> None:
    client.point(-1, 0.0, 0.0)
    client.point(1, 0.1, 0.0)
    rig.wait(1_010)


def long_absence(rig: ServerRig, client: RosClient) -> None:
    client.close()
    rig.wait(2_020)


Happens = Callable[[ServerRig, RosClient], object]
SHORT = Malformed(11, 2, BodyFault("short", 11, 2, 0))
UNTIMED = Refusal(V.NOT_TIMEABLE, "no timing")

SET_BACKS: dict[str, tuple[Callable[[], Situation], Happens, str, V]] = {
    "not allowed": (may_not_move, lambda rig, ros: None, "0 of 1", V.NOT_AUTOMATIC),
    "out of order": (out_of_order, lambda rig, ros: None, "0 of 3", V.SEQUENCE),
    "out of range": (collecting, lambda rig, ros: ros.point(3, 2.5, 0.0), "0 of 3", V.OUT_OF_RANGE),
    "unreadable": (collecting, lambda rig, ros: ros.send(SHORT), "0 of 3", V.MALFORMED),
    "not planned": (planning, lambda rig, ros: rig.plan(UNTIMED), "0 of 3", V.NOT_TIMEABLE),
    "lost amid its points": (collecting, long_absence, "0 of 3", V.TRAJECTORY_INCOMPLETE),
    "lost too soon": (waiting, lambda rig, ros: ros.close(), "0 of 2", V.TRAJECTORY_INCOMPLETE),
    "lost in motion": (moving, lambda rig, ros: ros.close(), "2 of 3", V.AUTHORITY_LOST),
    "a pendant's stop": (moving, lambda rig, ros: rig.pendant().stop(), "2 of 3", V.STOPPED),
    "another's stop": (moving, lambda rig, ros: rig.ros().stop(), "2 of 3", V.STOPPED),
    "an early stop": (collecting, lambda rig, ros: rig.pendant().stop(), "0 of 3", V.STOPPED),
    "an error": (moving, error_of_the_controller, "2 of 3", V.CONTROLLER_STOPPED),
    "an end that never comes": (idle, end_that_never_comes, "0 of 2", V.TRAJECTORY_INCOMPLETE),
}
"""Where it begins, what happens, of how many points how many are done, and why it ended."""


@pytest.mark.parametrize(("begin", "happens", "done", "code"), SET_BACKS.values(), ids=SET_BACKS)
def test_each_set_back_stands_in_status_and_in_one_line_that_says_whose_how_far_and_why(
    begin: Callable[[], Situation], happens: Happens, done: str, code: V
) -> None:
    rig, client = begin()
    happens(rig, client)
    rig.controller.coasts = False
    rig.wait(20)
    status = status_of(rig)
    assert (status.error_code, status.in_error) == (STATUS_ERROR_OFFSET + code, TriState.TRUE)
    rig.wait(480)
    (line,) = lines(rig)
    whose = f"ROS-I trajectory of 127.0.0.1 (session {client.session})"
    what = "broken off" if begin is moving else "refused"
    assert line.startswith(f"{whose} {what}, {done} points done: {code.name} ({code:d}): ")


def test_a_point_is_done_where_the_robot_has_passed_it_and_not_only_its_set_point() -> None:
    it = following_ros()
    cell, home = it.cell, serial_robot("ur5").home_position
    while cell.position[0] < home[0] + 0.35:
        it.wait(10)
    assert cell.position[0] < home[0] + 0.4, "the robot is past the third point"
    told = cell.core.cell.end(Refusal(V.STOPPED), cell.now)
    (line,) = (item.text for item in told if isinstance(item, LogLine))
    assert "broken off, 2 of 4 points done" in line


@pytest.mark.parametrize("phase", [collecting, planning, moving])
def test_what_its_own_client_ends_is_one_line_and_no_error(phase: Callable[[], Situation]) -> None:
    rig, client = phase()
    client.stop()
    rig.wait(20)
    (line,) = lines(rig)
    assert f"STOPPED ({V.STOPPED:d}): stop from the ROS-I client at 127.0.0.1" in line
    assert status_of(rig).error_code == 0


@pytest.mark.parametrize("phase", [collecting, planning, moving, superseding])
def test_what_its_own_client_replaces_is_one_line_and_no_error(
    phase: Callable[[], Situation],
) -> None:
    rig, client = phase()
    rig.log.clear()
    client.trajectory((0.2, 0.0), (-0.5, 0.0))
    rig.wait(20)
    (line,) = lines(rig)
    assert "a new trajectory replaces this one" in line
    assert status_of(rig).error_code == 0


def test_a_trajectory_that_arrives_has_no_line() -> None:
    rig, _ = moving()
    rig.wait(3_000)
    assert (lines(rig), status_of(rig).error_code) == ([], 0)


def test_what_is_left_of_a_refused_trajectory_is_not_told_of_on_a_new_link_either() -> None:
    rig, client = may_not_move()
    client.close()
    rig.wait(250)
    again = rig.ros()
    again.point(1, 0.1, 0.0)
    again.point(2, 0.2, 0.0)
    assert len(lines(rig)) == 1
    assert rig.core.ros.refused is V.NOT_AUTOMATIC


def test_what_is_left_is_not_told_of_where_its_client_left_at_the_first_refusal() -> None:
    rig = ready()
    manual(rig)
    client = rig.ros()
    client.point(0, 0.0, 0.0)
    client.close()
    rig.wait(250)
    rig.ros().point(1, 0.1, 0.0)
    assert len(lines(rig)) == 1
    assert rig.core.ros.refused is V.NOT_AUTOMATIC


def test_long_after_it_the_middle_of_a_trajectory_is_told_of_again() -> None:
    rig, client = may_not_move()
    client.close()
    rig.wait(2_010)
    rig.ros().point(5, 0.1, 0.0)
    assert len(lines(rig)) == 2


# The newest reason.


def test_the_latch_of_the_stop_that_ended_it_does_not_hide_why() -> None:
    rig, _ = moving()
    rig.perform(rig.core.cell.protective_stop(Refusal(V.SERVER_LATE, "it was late"), rig.now))
    rig.wait(50)
    assert status_of(rig).error_code == STATUS_ERROR_OFFSET + V.SERVER_LATE


def test_what_keeps_the_robot_from_moving_since_then_is_newer() -> None:
    rig, _ = out_of_order()
    assert status_of(rig).error_code == STATUS_ERROR_OFFSET + V.SEQUENCE
    pendant = rig.holder() if rig.core.cell.authority.holder is None else rig.pendant()
    pendant.stop()
    rig.wait(20)
    assert status_of(rig).error_code == STATUS_ERROR_OFFSET + V.STOP_LATCHED


def test_it_stands_until_the_next_trajectory_begins() -> None:
    rig, client = out_of_order()
    rig.wait(10_000)
    assert status_of(rig).error_code == STATUS_ERROR_OFFSET + V.SEQUENCE
    client.trajectory(*PATH)
    rig.wait(200)
    assert status_of(rig).error_code == 0


def test_an_error_of_the_controllers_own_keeps_its_number() -> None:
    rig, _ = moving()
    rig.controller.error_code = 7
    rig.wait(50)
    assert status_of(rig).error_code == 7
    rig.controller.error_code = 0
    rig.wait(50)
    assert status_of(rig).error_code == STATUS_ERROR_OFFSET + V.CONTROLLER_STOPPED


# No positions for a while.


def positions_in(rig: ServerRig, listener: RosClient, milliseconds: int) -> int:
    before = len(listener.all(JointPosition))
    rig.wait(milliseconds)
    return len(listener.all(JointPosition)) - before


def test_its_client_is_told_no_positions_for_one_and_a_half_seconds() -> None:
    rig, client = collecting()
    listener = rig.ros(port=Port.ROS_STATE)
    client.point(7, 0.1, 0.0)
    states = len(listener.all(Status))
    assert positions_in(rig, listener, 1_480) == 0
    assert len(listener.all(Status)) - states == 74
    assert positions_in(rig, listener, 200) == 10


def test_a_listener_that_comes_meanwhile_is_told_none_either() -> None:
    rig, client = collecting()
    client.point(7, 0.1, 0.0)
    assert rig.ros(port=Port.ROS_STATE).all(JointPosition) == []


def test_other_addresses_see_on() -> None:
    rig, client = collecting()
    listener = rig.ros("10.0.0.9", Port.ROS_STATE)
    client.point(7, 0.1, 0.0)
    assert positions_in(rig, listener, 200) == 10


def test_the_client_sees_again_once_it_begins_anew() -> None:
    rig, client = collecting()
    listener = rig.ros(port=Port.ROS_STATE)
    client.point(7, 0.1, 0.0)
    rig.wait(300)
    client.trajectory(*PATH)
    assert positions_in(rig, listener, 200) == 10


def test_refusals_in_a_row_do_not_keep_a_client_blind() -> None:
    rig, client = collecting()
    listener = rig.ros(port=Port.ROS_STATE)
    seen = 0
    for _ in range(10):
        client.point(7, 0.1, 0.0)
        client.point(0, 3.0, 0.0)
        seen += positions_in(rig, listener, 400)
    assert seen >= 10


@pytest.mark.parametrize("happens", [lambda client: client.stop(), lambda client: client.got])
def test_nothing_is_withheld_where_nothing_went_wrong(
    happens: Callable[[RosClient], object],
) -> None:
    rig, client = moving()
    listener = rig.ros(port=Port.ROS_STATE)
    happens(client)
    assert positions_in(rig, listener, 200) == 10


def test_a_cell_may_withhold_none() -> None:
    rig = ready(ros_i={"abort_silence": 0})
    listener, client = rig.ros(port=Port.ROS_STATE), rig.ros()
    client.point(7, 0.1, 0.0)
    assert positions_in(rig, listener, 200) == 10
    assert rig.now % MS == 0


WAY = (0.0, 0.1, 0.2, 0.3, 0.4)
"""Where the first joint goes on its way, from where it stood [rad]."""


class Stack:
    def __init__(self) -> None:
        self.cell = EmulatedCell()
        self.motion: RosClient = self.cell.ros()
        self.state = self.cell.ros(port=Port.ROS_STATE)
        self.node = ScriptedActionNode(self.motion.stop)
        self._heard = 0
        self.run(100)
        self.start = self.cell.position

    def run(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, 10):
            self.cell.wait(10)
            for message in self.state.got[self._heard :]:
                self.node.hear(message, self.cell.now)
            self._heard = len(self.state.got)
            self.node.tick(self.cell.now)

    def send_goal(self, *, duration: float = 0.5, offsets: tuple[float, ...] = WAY) -> None:
        points = [(self.start[0] + offset, *self.start[1:]) for offset in offsets]
        last = points[-1]
        assert self.node.send_goal(last, duration * len(points), self.cell.now)
        for number, point in enumerate(points):
            self.motion.point(number, *point, duration=duration, velocity=0.5)
            self.run(10)

    def goal_ends_within(self, milliseconds: int) -> Goal | None:
        for _ in range(0, milliseconds, 50):
            self.run(50)
            if self.node.goal is not Goal.ACTIVE:
                break
        return self.node.goal


@pytest.fixture
def stack() -> Stack:
    return Stack()


def test_a_goal_that_is_reached_succeeds(stack: Stack) -> None:
    stack.send_goal()
    assert stack.goal_ends_within(6_000) is Goal.SUCCEEDED
    assert stack.cell.lines == []


def lose_the_controller(stack: Stack) -> None:
    stack.cell.disconnect(ControllerPath.MOTION)
    stack.cell.connect(ControllerPath.MOTION)


@pytest.mark.parametrize(
    ("happens", "code"),
    [
        (lambda stack: stack.cell.pendant().stop(), V.STOPPED),
        (lose_the_controller, V.CONTROLLER_LOST),
        (lambda stack: stack.motion.close(), V.AUTHORITY_LOST),
        (lambda stack: stack.motion.point(len(WAY), *stack.start), V.SEQUENCE),
    ],
    ids=["a pendant's stop", "a lost controller", "a lost link", "a late point"],
)
def test_a_goal_that_is_broken_off_is_aborted_within_1_1_s(
    stack: Stack, happens: Callable[[Stack], object], code: V
) -> None:
    stack.send_goal()
    stack.run(1_200)
    happens(stack)
    assert stack.goal_ends_within(1_100) is Goal.ABORTED
    (line,) = stack.cell.lines
    assert f"broken off, 3 of 5 points done: {code.name} ({code:d})" in line


def test_a_goal_that_is_refused_is_aborted_and_the_next_taken_once_positions_come_again(
    stack: Stack,
) -> None:
    stack.send_goal(offsets=(0.0, 9.0))
    assert stack.goal_ends_within(1_100) is Goal.ABORTED
    assert len(stack.cell.lines) == 1
    stack.run(1_100)
    stack.send_goal()
    assert stack.goal_ends_within(6_000) is Goal.SUCCEEDED


def test_a_goal_that_takes_the_place_of_a_refused_one_at_once_is_seen_to_its_end(
    stack: Stack,
) -> None:
    stack.send_goal(offsets=(0.0, 9.0))
    stack.run(300)
    stack.send_goal()
    assert stack.goal_ends_within(6_000) is Goal.SUCCEEDED
