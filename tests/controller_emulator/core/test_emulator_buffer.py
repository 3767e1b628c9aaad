"""Back-pressure and downloading: replies that wait, points that are collected."""

from __future__ import annotations

import pytest
from rigs.cells.controller_rig import FAILURE, LINK, STOP, SUCCESS, ControllerRig, ratio_point

from openpendant.controller_emulator.error_codes import ErrorCode, ViolationKind
from openpendant.simplemsg import CommType, JointTraj, JointTrajPt, Ping, TrajPoint, joint_array
from openpendant.simplemsg.pendant import OperatorAction


def full(depth: int = 3) -> ControllerRig:
    rig = ControllerRig(buffer_depth=depth)
    assert [rig.code(point(n)) for n in range(depth)] == [SUCCESS] * depth
    return rig


def point(sequence: int) -> JointTrajPt:
    return ratio_point(sequence, (0.1 * (sequence + 1), 0.0), 1.0)


def topic(sequence: int, joint: float) -> JointTrajPt:
    return ratio_point(sequence, (joint, 0.0), 1.0, comm_type=CommType.TOPIC)


def test_a_full_buffer_withholds_the_reply_until_a_point_is_reached() -> None:
    rig = full()
    assert rig.code(point(3)) is None
    assert rig.wait(999) == []
    assert rig.wait(1) == [(LINK, 11, SUCCESS)]
    rig.wait(3000)
    assert rig.position[0] == pytest.approx(0.4, abs=1e-7)


def test_pipelined_points_are_answered_in_order_as_room_comes() -> None:
    rig = full()
    assert [rig.code(point(n)) for n in (3, 4)] == [None, None]
    assert rig.wait(1000) == [(LINK, 11, SUCCESS)]
    assert rig.wait(1000) == [(LINK, 11, SUCCESS)]


def test_a_ping_is_answered_while_a_point_waits() -> None:
    rig = full()
    rig.code(point(3))
    assert rig.send(Ping()) == [(LINK, 1, SUCCESS)]


@pytest.mark.parametrize("stopping_link", [LINK, 2])
def test_stop_overtakes_waiting_points_and_fails_them_first(stopping_link: int) -> None:
    rig = full()
    rig.code(point(3))
    assert rig.send(STOP, link=stopping_link) == [(LINK, 11, FAILURE), (stopping_link, 11, SUCCESS)]
    assert rig.wait(5000) == []


def test_an_emergency_stop_fails_waiting_points() -> None:
    rig = full()
    rig.code(point(3))
    assert rig.operate(OperatorAction.EMERGENCY_STOP) == [(LINK, 11, FAILURE)]


def test_a_lost_link_takes_its_waiting_points_along() -> None:
    rig = full()
    rig.code(point(3))
    assert rig.lose() == []
    assert rig.wait(5000) == []


def test_a_waiting_point_that_turns_out_bad_is_answered_once() -> None:
    rig = full()
    assert rig.code(ratio_point(3, (9.0, 0.0), 1.0)) is None
    assert rig.wait(1000) == [(LINK, 11, FAILURE)]
    assert rig.wait(5000) == []


def test_waiting_points_are_bounded() -> None:
    rig = full()
    for n in range(3, 67):
        assert rig.code(point(n)) is None
    assert rig.send(point(67)) == [(LINK, 11, FAILURE)] * 65
    assert rig.status.error_code == ErrorCode.BUFFER_OVERFLOW


def test_a_whole_trajectory_that_can_never_fit_is_refused() -> None:
    rig = ControllerRig(buffer_depth=2)
    points = tuple(TrajPoint(n, joint_array((0.1 * n + 0.1,)), 0.1, 1.0) for n in range(3))
    assert rig.code(JointTraj(points)) == FAILURE
    assert rig.status.error_code == ErrorCode.BUFFER_OVERFLOW


def test_a_whole_trajectory_waits_for_room() -> None:
    rig = full()
    points = tuple(TrajPoint(n, joint_array((0.3 - 0.1 * n,)), 0.1, 1.0) for n in range(2))
    assert rig.code(JointTraj(points)) is None
    assert rig.wait(1000) == []
    assert rig.wait(1000) == [(LINK, 12, SUCCESS)]


def test_a_download_is_never_answered_and_moves_at_its_end(rig: ControllerRig) -> None:
    assert rig.send(topic(-1, 0.1)) == []
    assert rig.send(topic(1, 0.2)) == []
    rig.wait(5000)
    assert rig.position == (0.0, 0.0)
    assert rig.status.in_motion == 0
    assert rig.send(topic(-3, 0.3)) == []
    assert rig.status.in_motion == 1
    rig.wait(3000)
    assert rig.position[0] == pytest.approx(0.3, abs=1e-7)
    assert not rig.violations


def test_download_marks_sent_as_requests_are_answered_once(rig: ControllerRig) -> None:
    assert [
        rig.code(ratio_point(n, (0.1 * i, 0.0), 1.0)) for i, n in enumerate((-1, 1, -3), 1)
    ] == [SUCCESS] * 3


def test_a_one_point_download_sent_twice_takes_its_time_once(rig: ControllerRig) -> None:
    rig.send(topic(-1, 0.2))
    rig.send(topic(-3, 0.2))
    rig.wait(1000)
    assert rig.position[0] == pytest.approx(0.2, abs=1e-7)
    assert not rig.status.in_motion


def test_a_gap_in_a_download_discards_it_without_a_reply(rig: ControllerRig) -> None:
    for message in (topic(-1, 0.1), topic(3, 0.2), topic(-3, 0.3)):
        assert rig.send(message) == []
    rig.wait(3000)
    assert rig.position == (0.0, 0.0)
    assert rig.violations == {ViolationKind.SEQUENCE: 1}
    assert rig.status.error_code == ErrorCode.SEQUENCE


def test_a_download_larger_than_the_buffer_is_discarded() -> None:
    rig = ControllerRig(buffer_depth=2)
    for message in (topic(-1, 0.1), topic(1, 0.2), topic(2, 0.3), topic(-3, 0.4)):
        rig.send(message)
    rig.wait(5000)
    assert rig.position == (0.0, 0.0)
    assert rig.status.error_code == ErrorCode.BUFFER_OVERFLOW


def test_a_download_during_motion_stops_it_and_replaces_it(rig: ControllerRig) -> None:
    rig.send(topic(-1, 0.4))
    rig.send(topic(-3, 0.8))
    rig.wait(1000)
    for message in (topic(-1, 0.3), topic(-3, 0.2)):
        assert rig.send(message) == []
    rig.states(2500, step=10)
    assert rig.position[0] == pytest.approx(0.2, abs=1e-7)


def test_a_download_whose_link_is_lost_is_discarded(rig: ControllerRig) -> None:
    rig.send(topic(-1, 0.1))
    rig.lose()
    assert rig.code(point(0), link=2) == SUCCESS
    rig.wait(1000)
    assert rig.position[0] == pytest.approx(0.1, abs=1e-7)


def test_stop_during_a_download_forgets_it(rig: ControllerRig) -> None:
    rig.send(topic(-1, 0.1))
    assert rig.code(STOP) == SUCCESS
    rig.send(topic(-3, 0.3))
    rig.wait(3000)
    assert rig.position == (0.0, 0.0)
