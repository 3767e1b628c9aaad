import math

import pytest
from rigs.cells.expectations import expect, refusal_from
from rigs.cells.ros_situations import PATH, TOPIC, idle, jobs, left, status_of
from rigs.cells.server_rig import FAILURE, LIMITS, MS, SUCCESS, ready

from openpendant.motion.description.limits import float32_ceiling
from openpendant.server.cell.joint_slots import JointSlots
from openpendant.server.endpoints.ros.ros_trajectory import Collection
from openpendant.server.events.effects import SendStop
from openpendant.server.events.events import Received
from openpendant.server.planning.jobs import RosPoint
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import (
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    TrajPoint,
    TriState,
    ValidField,
    joint_array,
)
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import STATUS_ERROR_OFFSET
from openpendant.simplemsg.verdicts import VerdictCode as V


def read(message: JointTrajPt | JointTrajPtFull) -> RosPoint | V:
    collection = Collection(JointSlots(LIMITS), 100)
    refusal = collection.take(message)
    return refusal.code if isinstance(refusal, Refusal) else collection.points[0]


def simple(
    joints: tuple[float, ...] = (0.1, 0.2), velocity: float = 0.5, duration: float = 10.0
) -> JointTrajPt:
    return JointTrajPt(0, joint_array(joints), velocity, duration)


def full(
    joints: tuple[float, ...] = (0.1, 0.2),
    velocity: tuple[float, ...] = (0.0, 0.0),
    time: float = 0.0,
    valid: int = 7,
    robot_id: int = 0,
) -> JointTrajPtFull:
    none = joint_array(())
    return JointTrajPtFull(
        robot_id, 0, valid, time, joint_array(joints), joint_array(velocity), none
    )


@pytest.mark.parametrize(
    ("message", "min_duration", "fraction"),
    [
        (simple(), None, 0.5),
        (simple(velocity=0.0), None, 0.1),
        (simple(duration=0.0), None, 0.5),
        (simple(duration=2.0), 2.0, 0.5),
        (full(), None, 0.1),
        (full(time=3.0), 3.0, 0.1),
        (full(valid=2), None, 0.1),
    ],
)
def test_the_first_point_is_slow_and_its_10_s_are_a_placeholder(
    message: JointTrajPt | JointTrajPtFull, min_duration: float | None, fraction: float
) -> None:
    assert read(message) == RosPoint((0.1, 0.2), min_duration, fraction)


@pytest.mark.parametrize(
    ("velocity", "duration", "expected"),
    [(0.5, 2.0, (2.0, 1.0)), (0.5, 0.0, (None, 0.5)), (0.0, 0.0, (None, 0.1))],
)
def test_later_points_are_bound_by_their_time_else_by_their_speed(
    velocity: float, duration: float, expected: tuple[float | None, float]
) -> None:
    collection = Collection(JointSlots(LIMITS), 100)
    collection.take(simple())
    collection.take(JointTrajPt(1, joint_array((0.3, 0.2)), velocity, duration))
    point = collection.points[1]
    assert (point.min_duration, point.speed_fraction) == expected


@pytest.mark.parametrize(
    ("message", "code"),
    [
        (simple((float("nan"), 0.0)), V.NOT_FINITE),
        (simple((0.0, 0.0, float("inf"))), V.NOT_FINITE),
        (simple((0.0, 0.0, 0.1)), V.WRONG_JOINT_COUNT),
        (simple((0.0, 2.001)), V.OUT_OF_RANGE),
        (simple((0.0, -3e38)), V.OUT_OF_RANGE),
        (simple(velocity=1.001), V.BAD_ARGUMENT),
        (simple(velocity=-0.1), V.BAD_ARGUMENT),
        (simple(velocity=float("nan")), V.NOT_FINITE),
        (simple(duration=-1.0), V.BAD_ARGUMENT),
        (simple(duration=float("inf")), V.NOT_FINITE),
        (simple(duration=3601.0), V.BAD_ARGUMENT),
        (full(valid=1), V.BAD_ARGUMENT),
        (full(robot_id=1), V.BAD_ARGUMENT),
        (full(velocity=(2.1, 0.0)), V.TOO_FAST),
        (full(velocity=(float("nan"), 0.0)), V.NOT_FINITE),
        (full(time=float("nan")), V.NOT_FINITE),
        (full(time=-1.0), V.BAD_ARGUMENT),
    ],
)
def test_an_unusable_point_is_refused_with_its_reason(
    message: JointTrajPt | JointTrajPtFull, code: V
) -> None:
    assert read(message) is code


def test_a_limit_that_was_rounded_to_4_bytes_is_taken_as_the_limit() -> None:
    point = expect(RosPoint, read(simple((float32_ceiling(2.0), -float32_ceiling(2.0)))))
    assert point.position == (2.0, -2.0)


def test_times_of_full_points_increase_and_each_has_the_time_since_the_one_before_it() -> None:
    collection = Collection(JointSlots(LIMITS), 100)
    answers: list[Refusal | None] = []
    for sequence, time in enumerate((1.0, 2.5, 3.0, 3.0)):
        point = full((0.1 * sequence, 0.2), time=time)
        point.sequence = sequence
        answers.append(collection.take(point))
    assert answers[:3] == [None] * 3
    assert refusal_from(answers[3]).code is V.BAD_ARGUMENT
    assert [point.min_duration for point in collection.points] == [1.0, 1.5, 0.5]


@pytest.mark.parametrize(
    ("bad", "code"), [((9.0, 0.0), V.OUT_OF_RANGE), ((math.nan, 0.0), V.NOT_FINITE)]
)
def test_one_bad_point_discards_the_whole_trajectory(bad: tuple[float, float], code: V) -> None:
    rig, client = idle()
    answers = client.trajectory(PATH[0], bad, PATH[1], PATH[2])
    assert answers == [SUCCESS, FAILURE, FAILURE, FAILURE]
    rig.wait(500)
    assert (jobs(rig), rig.core.ros.refused) == ([], code)
    status = status_of(rig)
    assert (status.error_code, status.in_error) == (STATUS_ERROR_OFFSET + code, TriState.TRUE)


def test_valid_fields_of_the_real_client_are_read_by_their_low_bits() -> None:
    assert ValidField(0x46F48B4F & 15) == ValidField.ALL
    assert isinstance(read(full(valid=0x46F48B40 | 3)), RosPoint)


def test_a_streamed_trajectory_is_moved_when_no_point_follows() -> None:
    rig, client = idle()
    assert client.trajectory(*PATH) == [SUCCESS, SUCCESS, SUCCESS]
    assert rig.activity() is Activity.IDLE
    rig.wait(3_000)
    assert (rig.controller.position, rig.core.ros.refused) == (PATH[-1], None)


@pytest.mark.parametrize(("wait_ns", "planned"), [(150 * MS - 1, 0), (150 * MS, 1)])
def test_the_gap_ends_exactly_150_ms_after_the_last_reply(wait_ns: int, planned: int) -> None:
    rig, client = idle(watchdog={"deadline": 1.0})
    client.trajectory((0.0, 0.0))
    rig.wait(100)
    client.point(1, 0.5, 0.5)
    last = rig.now
    rig.wait(50)
    rig.now = last + wait_ns
    rig.report()
    rig.tick()
    assert len(jobs(rig)) == planned


def test_a_download_of_one_point_is_sent_twice() -> None:
    rig, client = idle()
    client.point(-1, 0.3, 0.3, comm_type=TOPIC)
    client.point(-3, 0.3, 0.3, comm_type=TOPIC)
    rig.wait(2_000)
    assert rig.controller.position == (0.3, 0.3)


def test_sequence_minus_3_ends_a_stream_without_waiting() -> None:
    rig, client = idle()
    client.trajectory(*PATH[:2])
    assert client.point(-3, *PATH[2]) is SUCCESS
    assert len(jobs(rig)) == 1


def test_a_trajectory_in_one_message_is_moved_at_once() -> None:
    rig, client = idle()
    points = tuple(TrajPoint(9, joint_array(joints), 0.1, 0.5) for joints in PATH)
    assert client.code(JointTraj(points)) is SUCCESS
    assert [point.position for point in jobs(rig)[0].points] == list(PATH)


def test_a_point_that_comes_twice_is_taken_once() -> None:
    rig, client = idle()
    client.point(0, 0.0, 0.0)
    assert [client.point(1, 0.5, 0.1) for _ in range(3)] == [SUCCESS] * 3
    client.point(2, 1.0, 0.2)
    rig.wait(160)
    assert len(jobs(rig)[0].points) == 3


def test_the_end_that_comes_twice_starts_nothing_new() -> None:
    rig, client = idle()
    client.trajectory(*PATH[:2])
    assert [client.point(-3, *PATH[2]) for _ in range(2)] == [SUCCESS, SUCCESS]
    assert len(jobs(rig)) == 1
    assert rig.stops == []


def test_the_same_goal_is_moved_to_again_after_somebody_else_moved_away() -> None:
    rig, client = idle()
    client.trajectory((0.3, 0.3))
    rig.wait(5_000)
    pendant = rig.holder()
    assert pendant.move(0.0, 0.0) is V.ACCEPTED
    rig.wait(2_000)
    pendant.release()
    client.trajectory((0.3, 0.3))
    rig.wait(2_000)
    assert rig.controller.position == (0.3, 0.3)


@pytest.mark.parametrize("sequences", [(0, 2), (0, 1, 3), (5,), (-3,)])
def test_a_gap_in_the_sequence_discards_the_trajectory(sequences: tuple[int, ...]) -> None:
    rig, client = idle()
    codes = [client.point(sequence, 0.1 * sequence, 0.0) for sequence in sequences]
    assert codes[-1] is FAILURE
    assert client.point(4, 0.4, 0.0) is FAILURE
    rig.wait(500)
    assert jobs(rig) == []
    assert status_of(rig).error_code == STATUS_ERROR_OFFSET + V.SEQUENCE
    assert client.closed_for == []


def test_a_beginning_ends_the_refusing() -> None:
    rig, client = idle()
    client.point(7, 0.1, 0.1)
    assert client.trajectory(*PATH) == [SUCCESS] * 3
    rig.wait(200)
    assert rig.core.ros.refused is None


def test_a_new_trajectory_before_the_old_one_began_replaces_it() -> None:
    rig, client = idle()
    client.trajectory(*PATH)
    rig.wait(50)
    assert client.trajectory((0.0, 0.0), (-0.5, 0.0)) == [SUCCESS, SUCCESS]
    rig.wait(200)
    assert [len(job.points) for job in jobs(rig)] == [2]


def test_more_points_than_the_limit_discard_the_trajectory() -> None:
    rig, client = idle(ros_i={"max_points": 2})
    assert client.trajectory(*PATH) == [SUCCESS, SUCCESS, FAILURE]
    assert rig.core.ros.refused is V.TOO_MANY_POINTS


def test_a_stop_forgets_the_points_of_a_client_that_is_away() -> None:
    rig = left()
    pendant = rig.holder()
    pendant.stop()
    assert pendant.reset() is V.ACCEPTED
    pendant.release()
    assert rig.ros().point(2, *PATH[2]) is FAILURE
    rig.wait(500)
    assert jobs(rig) == []


def test_a_whole_trajectory_with_a_stop_in_it_is_a_stop_and_nothing_else() -> None:
    rig, client = idle()
    points = tuple(
        TrajPoint(sequence, joint_array(joints), 0.1, 0.5)
        for sequence, joints in ((0, PATH[0]), (-4, (0.0, 0.0)), (2, PATH[2]))
    )
    out = rig.perform(rig.core.handle(Received(client.session, JointTraj(points)), rig.now))
    assert isinstance(out[0], SendStop)
    assert client.got[-1].reply_code == SUCCESS
    rig.wait(500)
    assert jobs(rig) == []


def test_a_client_that_waits_for_the_robot_to_stand_keeps_the_authority() -> None:
    rig = ready(ros_i={"idle_release": 0.3})
    rig.controller.be_moved((0.1, 0.0), (0.01, 0.0))
    rig.wait(20)
    client = rig.ros()
    client.trajectory(*PATH)
    rig.wait(600)
    assert jobs(rig) == []
    rig.controller.be_moved((0.1, 0.0))
    rig.wait(500)
    assert client.closed_for == []
    assert len(jobs(rig)) == 1
