from __future__ import annotations

import pytest
from rigs.cells.ros_face_situations import jobs, status_of
from rigs.cells.server_rig import FAILURE, LIMITS, SUCCESS, ready

from openpendant.motion.description.limits import float32_ceiling
from openpendant.server.cell.joint_slots import JointSlots
from openpendant.server.endpoints.ros.ros_trajectory import Collection
from openpendant.server.planning.jobs import RosPoint
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import JointTrajPt, JointTrajPtFull, TriState, ValidField, joint_array
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
    point = read(simple((float32_ceiling(2.0), -float32_ceiling(2.0))))
    assert isinstance(point, RosPoint)
    assert point.position == (2.0, -2.0)


def test_times_of_full_points_must_increase() -> None:
    collection = Collection(JointSlots(LIMITS), 100)
    assert collection.take(full(time=1.0)) is None
    second = full((0.2, 0.2), time=1.0)
    second.sequence = 1
    refusal = collection.take(second)
    assert refusal is not None
    assert refusal.code is V.BAD_ARGUMENT


def test_a_full_point_has_the_time_since_the_one_before_it() -> None:
    collection = Collection(JointSlots(LIMITS), 100)
    for sequence, time in enumerate((1.0, 2.5, 3.0)):
        point = full((0.1 * sequence, 0.2), time=time)
        point.sequence = sequence
        assert collection.take(point) is None
    assert [point.min_duration for point in collection.points] == [1.0, 1.5, 0.5]


@pytest.mark.parametrize("bad", [(9.0, 0.0), (float("nan"), 0.0)])
def test_one_bad_point_discards_the_whole_trajectory(bad: tuple[float, float]) -> None:
    rig = ready()
    client = rig.ros()
    assert client.trajectory((0.0, 0.0), bad, (0.1, 0.1)) == [SUCCESS, FAILURE, FAILURE]
    rig.wait(500)
    assert jobs(rig) == []
    assert status_of(rig).in_error == TriState.TRUE


def test_valid_fields_of_the_real_client_are_read_by_their_low_bits() -> None:
    assert ValidField(0x46F48B4F & 15) == ValidField.ALL
    message = full()
    message.valid_fields = 0x46F48B40 | 3
    assert isinstance(read(message), RosPoint)
