"""Streaming and downloading: points that are answered once, replies that wait, motion in time."""

import pytest
from rigs.cells.controller_rig import (
    FAILURE,
    LINK,
    MS,
    STOP,
    SUCCESS,
    ControllerRig,
    full_point,
    ratio_point,
)

from openpendant.controller_emulator.error_codes import ErrorCode, ViolationKind
from openpendant.controller_emulator.interpolation.servo import StartRule
from openpendant.simplemsg import (
    CommType,
    GetVersion,
    HeaderOnly,
    JointTraj,
    JointTrajPt,
    Opaque,
    Ping,
    TrajPoint,
    TriState,
    joint_array,
)
from openpendant.simplemsg.pendant import OperatorAction

SMOOTH = (
    full_point(0, 0.0, (0.0, 0.0)),
    full_point(1, 0.5, (0.25, -0.125), (0.75, -0.375)),
    full_point(2, 1.0, (0.5, -0.25)),
)


def test_each_point_is_answered_with_a_bare_reply_of_its_own_type(rig: ControllerRig) -> None:
    assert rig.send(SMOOTH[0]) == [(LINK, 14, SUCCESS)]
    assert rig.send(ratio_point(1, (0.1, 0.1), 1.0)) == [(LINK, 11, SUCCESS)]
    assert all(isinstance(message, HeaderOnly) for _, message in rig.sent)


def test_points_are_passed_at_their_times_with_their_velocities(rig: ControllerRig) -> None:
    assert rig.stream(*SMOOTH) == [SUCCESS] * 3
    rig.wait(500)
    position, velocity, _ = rig.state
    assert position == pytest.approx((0.25, -0.125), abs=1e-12)
    assert velocity == pytest.approx((0.75, -0.375), abs=1e-12)
    rig.wait(500)
    assert rig.state == ((0.5, -0.25), (0.0, 0.0), (0.0, 0.0))


def test_accelerations_are_passed_where_they_are_given(rig: ControllerRig) -> None:
    gains = ((0.0, 0.0, 0.0, 1.0), (0.5, 0.125, 0.5, 1.0), (1.0, 0.25, 0.0, -1.0))
    for n, (time, way, speed, gain) in enumerate(gains):
        rig.send(full_point(n, time, (way, 0.0), (speed, 0.0), (gain, 0.0)))
    rig.wait(499.999)
    assert rig.state[2] == pytest.approx((1.0, 0.0), abs=1e-3)


def test_one_long_wait_equals_many_short_ones() -> None:
    coarse, fine = ControllerRig(), ControllerRig()
    for rig in (coarse, fine):
        rig.stream(*SMOOTH)
    coarse.wait(730)
    fine.states(730, step=10)
    assert coarse.state == fine.state


def test_the_point_times_of_four_byte_reals_read_as_the_decimals_that_were_meant() -> None:
    rig = ControllerRig()
    rig.stream(full_point(0, 0.0, (0.0, 0.0)), full_point(1, 0.07000000029802322, (0.0, 0.0)))
    rig.now = 70 * MS
    rig.wait(0)
    assert not rig.status.in_motion


@pytest.mark.parametrize("points", [1, 2])
def test_the_clock_starts_once_enough_motion_is_buffered(points: int) -> None:
    rig = ControllerRig(start_rule=StartRule(points=2, lead=20 * MS, wait=50 * MS, patience=0))
    rig.stream(full_point(0, 0.0, (0.0, 0.0)))
    if points == 2:
        rig.stream(full_point(1, 0.02, (1e-4, 0.0)))
    rig.wait(10)
    assert any(rig.velocity) == (points == 2)


def test_a_single_point_starts_after_the_wait_and_is_a_motion_from_when_it_came() -> None:
    rig = ControllerRig(start_rule=StartRule(points=2, lead=20 * MS, wait=50 * MS, patience=0))
    told = [rig.status.in_motion]
    rig.stream(ratio_point(0, (0.1, 0.0), 1.0))
    told.append(rig.status.in_motion)
    rig.wait(50)
    assert not any(rig.velocity)
    rig.wait(0.001)
    assert any(rig.velocity)
    rig.wait(5_000)
    told.append(rig.status.in_motion)
    assert told == [TriState.FALSE, TriState.TRUE, TriState.FALSE]


def test_a_point_without_velocity_is_passed_at_speed_if_its_successor_is_known() -> None:
    rig = ControllerRig(start_rule=StartRule(points=3, lead=0, wait=MS, patience=MS))
    rig.stream(*(ratio_point(n, (0.2 * (n + 1), 0.0), 1.0) for n in range(3)))
    rig.wait(1000)
    position, velocity, _ = rig.state
    assert position[0] == pytest.approx(0.2, abs=1e-7)
    assert velocity[0] == pytest.approx(0.2, abs=1e-6)


def test_a_point_without_velocity_and_successor_is_a_point_of_rest(rig: ControllerRig) -> None:
    rig.stream(ratio_point(0, (0.2, 0.0), 1.0))
    rig.wait(1000)
    assert rig.state[1] == (0.0, 0.0)
    assert not rig.status.in_error


def test_a_late_point_goes_on_from_rest_in_its_own_time(rig: ControllerRig) -> None:
    rig.stream(ratio_point(0, (0.2, 0.0), 1.0))
    rig.wait(5000)
    assert rig.stream(ratio_point(1, (0.4, 0.0), 1.0)) == [SUCCESS]
    rig.wait(1000)
    assert rig.position[0] == pytest.approx(0.4, abs=1e-7)


SPEEDING_UP = [ratio_point(n, (2.0 * (0.01 * n) ** 2, 0.0), 0.01 if n else 0.0) for n in range(40)]
"""At the acceleration limit: at none of these points could the robot stand in time."""


@pytest.mark.parametrize("gap", [15, 45, 150])
def test_a_stream_on_a_slow_line_runs_dry_and_is_no_violation(gap: float) -> None:
    rule = StartRule(points=2, lead=50 * MS, wait=20 * MS, patience=200 * MS)
    rig = ControllerRig(start_rule=rule)
    for point in SPEEDING_UP:
        if rig.code(point) != SUCCESS:
            break
        rig.wait(gap)
    assert rig.status.error_code == ErrorCode.BUFFER_UNDERRUN
    assert not rig.violations


def test_a_stream_that_fell_behind_at_a_point_of_rest_is_waited_for_again() -> None:
    rig = ControllerRig(start_rule=StartRule(points=1, lead=0, wait=0, patience=200 * MS))
    rig.stream(ratio_point(0, (0.1, 0.0), 1.0))
    rig.wait(500)
    # From rest to rest this would need 8 rad/s²: it begins as soon as the next point is known.
    rig.stream(ratio_point(1, (0.12, 0.0), 0.1))
    rig.wait(550)
    assert not rig.status.in_error
    assert rig.position[0] == pytest.approx(0.1)
    rig.stream(ratio_point(2, (0.14, 0.0), 0.2))
    rig.wait(300)
    assert rig.position[0] == pytest.approx(0.14, abs=1e-7)
    assert not rig.violations


def test_a_joint_at_the_end_of_its_range_is_reached_without_overshoot() -> None:
    rig = ControllerRig(start_rule=StartRule(points=4, lead=0, wait=MS, patience=MS))
    joints = [1.0, 2.0, 2.0, 1.5]
    rig.stream(*(ratio_point(n, (q, 0.0), 1.2) for n, q in enumerate(joints)))
    assert max(state[0][0] for state in rig.states(4800, step=10)) <= 2.0


def test_a_new_trajectory_is_queued_behind_the_running_one(rig: ControllerRig) -> None:
    rig.stream(*SMOOTH)
    rig.wait(600)
    queued = full_point(0, 0.0, (0.5, -0.25)), full_point(1, 0.5, (0.4, -0.25))
    assert rig.stream(*queued) == [SUCCESS] * 2
    rig.wait(900)
    assert rig.position == pytest.approx((0.4, -0.25), abs=1e-7)
    assert not rig.violations


def test_an_identical_repeat_of_the_last_point_is_accepted_and_not_moved_twice() -> None:
    rig = ControllerRig()
    point = ratio_point(0, (0.2, 0.0), 1.0)
    assert rig.stream(point, point, point) == [SUCCESS] * 3
    rig.wait(1000)
    assert not rig.status.in_motion
    assert not rig.violations


def test_a_client_that_lost_its_link_at_rest_may_repeat_and_go_on(rig: ControllerRig) -> None:
    rig.stream(ratio_point(0, (0.2, 0.0), 1.0))
    rig.wait(1500)
    rig.lose()
    assert rig.code(ratio_point(0, (0.2, 0.0), 1.0), link=2) == SUCCESS
    assert rig.code(ratio_point(1, (0.4, 0.0), 1.0), link=2) == SUCCESS


@pytest.mark.parametrize("sequence", [2, 5, -7, -3])
def test_a_gap_in_the_sequence_breaks_the_motion_off(sequence: int, rig: ControllerRig) -> None:
    rig.stream(SMOOTH[0])
    if sequence == -3:
        rig = ControllerRig()
    assert rig.stream(ratio_point(sequence, (0.1, 0.1), 1.0)) == [FAILURE]
    assert rig.violations == {ViolationKind.SEQUENCE: 1}
    assert rig.status.error_code == ErrorCode.SEQUENCE


def test_what_is_under_way_of_a_broken_trajectory_is_refused_but_not_counted() -> None:
    rig = ControllerRig()
    rig.stream(SMOOTH[0], ratio_point(7, (0.1, 0.1), 1.0))
    assert rig.stream(*(ratio_point(n, (0.1, 0.1), 1.0) for n in (8, 9))) == [FAILURE, FAILURE]
    assert rig.violations == {ViolationKind.SEQUENCE: 1}


def test_a_lenient_controller_takes_points_in_order_of_arrival() -> None:
    rig = ControllerRig(is_strict=False)
    assert rig.stream(*(ratio_point(n, (0.1, 0.1), 1.0) for n in (3, 7, 4))) == [SUCCESS] * 3
    assert not rig.violations


def test_a_new_trajectory_clears_the_error_of_the_last_one(rig: ControllerRig) -> None:
    rig.stream(ratio_point(5, (0.1, 0.1), 1.0))
    assert rig.status.in_error
    rig.stream(ratio_point(0, (0.1, 0.1), 1.0))
    assert not rig.status.in_error
    assert rig.status.error_code == ErrorCode.NONE


def test_streaming_may_start_and_end_with_the_special_sequences(rig: ControllerRig) -> None:
    marks = ((-2, 0.1), (1, 0.2), (-3, 0.3))
    codes = rig.stream(*(ratio_point(mark, (q, 0.0), 1.0) for mark, q in marks))
    assert codes == [SUCCESS] * 3
    rig.wait(3000)
    assert rig.position[0] == pytest.approx(0.3, abs=1e-7)
    assert not rig.status.in_motion


def test_only_the_link_that_owns_the_motion_may_add_points(rig: ControllerRig) -> None:
    rig.stream(*SMOOTH)
    rig.wait(100)
    assert rig.code(ratio_point(0, (0.1, 0.1), 1.0), link=2) == FAILURE
    assert not rig.status.in_error
    rig.wait(900)
    assert rig.code(ratio_point(0, (0.1, 0.1), 1.0), link=2) == SUCCESS


def trajectory(*joints: tuple[float, float]) -> JointTraj:
    points = (TrajPoint(n, joint_array(q), 0.1, 1.0) for n, q in enumerate(joints))
    return JointTraj(tuple(points))


def test_a_whole_trajectory_in_one_message_is_moved_to_its_end(rig: ControllerRig) -> None:
    assert rig.code(trajectory((0.1, 0.0), (0.2, 0.0))) == SUCCESS
    rig.wait(2000)
    assert rig.position[0] == pytest.approx(0.2, abs=1e-7)


def test_a_whole_trajectory_is_taken_entirely_or_not_at_all(rig: ControllerRig) -> None:
    assert rig.code(trajectory((0.1, 0.0), (5.0, 0.0))) == FAILURE
    rig.wait(2000)
    assert rig.position == (0.0, 0.0)
    assert rig.violations == {ViolationKind.RANGE: 1}


def test_questions_are_answered_and_unknown_requests_refused(rig: ControllerRig) -> None:
    assert rig.send(Ping()) == [(LINK, 1, SUCCESS)]
    assert rig.send(GetVersion()) == [(LINK, 2, SUCCESS)]
    assert rig.send(rig.status) == []
    asked = rig.status
    asked.comm_type = CommType.REQUEST
    assert rig.send(asked) == [(LINK, 13, SUCCESS)]
    assert rig.send(Opaque(9999, b"", comm_type=CommType.REQUEST)) == [(LINK, 9999, FAILURE)]
    assert rig.send(Opaque(9999, b"", comm_type=CommType.TOPIC)) == []


def filled(depth: int = 3) -> ControllerRig:
    rig = ControllerRig(buffer_depth=depth)
    assert [rig.code(point(n)) for n in range(depth)] == [SUCCESS] * depth
    return rig


def point(sequence: int) -> JointTrajPt:
    return ratio_point(sequence, (0.1 * (sequence + 1), 0.0), 1.0)


def topic(sequence: int, joint: float) -> JointTrajPt:
    return ratio_point(sequence, (joint, 0.0), 1.0, comm_type=CommType.TOPIC)


def test_a_full_buffer_withholds_the_reply_until_a_point_is_reached() -> None:
    rig = filled()
    assert rig.code(point(3)) is None
    assert rig.wait(999) == []
    assert rig.wait(1) == [(LINK, 11, SUCCESS)]
    rig.wait(3000)
    assert rig.position[0] == pytest.approx(0.4, abs=1e-7)


def test_pipelined_points_are_answered_in_order_as_room_comes() -> None:
    rig = filled()
    assert [rig.code(point(n)) for n in (3, 4)] == [None, None]
    assert rig.wait(1000) == [(LINK, 11, SUCCESS)]
    assert rig.wait(1000) == [(LINK, 11, SUCCESS)]


def test_a_ping_is_answered_while_a_point_waits() -> None:
    rig = filled()
    rig.code(point(3))
    assert rig.send(Ping()) == [(LINK, 1, SUCCESS)]


@pytest.mark.parametrize("stopping_link", [LINK, 2])
def test_stop_overtakes_waiting_points_and_fails_them_first(stopping_link: int) -> None:
    rig = filled()
    rig.code(point(3))
    assert rig.send(STOP, link=stopping_link) == [(LINK, 11, FAILURE), (stopping_link, 11, SUCCESS)]
    assert rig.wait(5000) == []


def test_an_emergency_stop_fails_waiting_points() -> None:
    rig = filled()
    rig.code(point(3))
    assert rig.operate(OperatorAction.EMERGENCY_STOP) == [(LINK, 11, FAILURE)]


def test_a_lost_link_takes_its_waiting_points_along() -> None:
    rig = filled()
    rig.code(point(3))
    assert rig.lose() == []
    assert rig.wait(5000) == []


def test_a_waiting_point_that_turns_out_bad_is_answered_once() -> None:
    rig = filled()
    assert rig.code(ratio_point(3, (9.0, 0.0), 1.0)) is None
    assert rig.wait(1000) == [(LINK, 11, FAILURE)]
    assert rig.wait(5000) == []


def test_waiting_points_are_bounded() -> None:
    rig = filled()
    for n in range(3, 67):
        assert rig.code(point(n)) is None
    assert rig.send(point(67)) == [(LINK, 11, FAILURE)] * 65
    assert rig.status.error_code == ErrorCode.BUFFER_OVERFLOW


def test_a_whole_trajectory_that_can_never_fit_is_refused() -> None:
    rig = ControllerRig(buffer_depth=2)
    assert rig.code(trajectory((0.1, 0.0), (0.2, 0.0), (0.3, 0.0))) == FAILURE
    assert rig.status.error_code == ErrorCode.BUFFER_OVERFLOW


def test_a_whole_trajectory_waits_for_room() -> None:
    rig = filled()
    assert rig.code(trajectory((0.3, 0.0), (0.2, 0.0))) is None
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
    points = (ratio_point(n, (0.1 * i, 0.0), 1.0) for i, n in enumerate((-1, 1, -3), 1))
    assert rig.stream(*points) == [SUCCESS] * 3


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
