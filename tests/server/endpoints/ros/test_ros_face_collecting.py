from __future__ import annotations

import pytest
from rigs.cells.ros_face_situations import PATH, TOPIC, jobs, moving, status_of
from rigs.cells.server_rig import FAILURE, MS, SUCCESS, ready

from openpendant.simplemsg import JointTraj, TrajPoint, joint_array
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import STATUS_ERROR_OFFSET
from openpendant.simplemsg.verdicts import VerdictCode as V


def test_a_streamed_trajectory_is_moved_when_no_point_follows() -> None:
    rig = ready()
    client = rig.ros()
    assert client.trajectory(*PATH) == [SUCCESS, SUCCESS, SUCCESS]
    assert rig.activity() is Activity.IDLE
    rig.wait(3_000)
    assert rig.controller.position == PATH[-1]
    assert rig.core.ros.refused is None


@pytest.mark.parametrize(("wait_ns", "planned"), [(150 * MS - 1, 0), (150 * MS, 1)])
def test_the_gap_ends_exactly_150_ms_after_the_last_reply(wait_ns: int, planned: int) -> None:
    rig = ready(watchdog={"deadline": 1.0})
    client = rig.ros()
    client.trajectory((0.0, 0.0))
    rig.wait(100)
    client.point(1, 0.5, 0.5)
    last = rig.now
    rig.wait(50)
    rig.now = last + wait_ns
    rig.report()
    rig.tick()
    assert len(jobs(rig)) == planned


def test_a_download_is_moved_at_its_end_and_never_answered() -> None:
    rig = ready()
    client = rig.ros()
    for sequence, joints in zip((-1, 1, -3), PATH, strict=True):
        assert client.point(sequence, *joints, comm_type=TOPIC) is None
    assert [point.position for point in jobs(rig)[0].points] == list(PATH)
    rig.wait(3_000)
    assert rig.controller.position == PATH[-1]
    assert client.got == []


def test_a_download_of_one_point_is_sent_twice() -> None:
    rig = ready()
    client = rig.ros()
    client.point(-1, 0.3, 0.3, comm_type=TOPIC)
    client.point(-3, 0.3, 0.3, comm_type=TOPIC)
    rig.wait(2_000)
    assert rig.controller.position == (0.3, 0.3)


def test_sequence_minus_3_ends_a_stream_without_waiting() -> None:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH[:2])
    assert client.point(-3, *PATH[2]) is SUCCESS
    assert len(jobs(rig)) == 1


def test_a_trajectory_in_one_message_is_moved_at_once() -> None:
    rig = ready()
    client = rig.ros()
    points = tuple(TrajPoint(9, joint_array(joints), 0.1, 0.5) for joints in PATH)
    assert client.code(JointTraj(points)) is SUCCESS
    assert [point.position for point in jobs(rig)[0].points] == list(PATH)


def test_a_stop_inside_a_trajectory_in_one_message_stops() -> None:
    rig, client = moving()
    point = TrajPoint(-4, joint_array(()), 0.0, 0.0)
    assert client.code(JointTraj((point,))) is SUCCESS
    assert len(rig.stops) == 1


def test_a_point_that_comes_twice_is_taken_once() -> None:
    rig = ready()
    client = rig.ros()
    client.point(0, 0.0, 0.0)
    assert [client.point(1, 0.5, 0.1) for _ in range(3)] == [SUCCESS] * 3
    client.point(2, 1.0, 0.2)
    rig.wait(160)
    assert len(jobs(rig)[0].points) == 3


def test_the_end_that_comes_twice_starts_nothing_new() -> None:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH[:2])
    assert [client.point(-3, *PATH[2]) for _ in range(2)] == [SUCCESS, SUCCESS]
    assert len(jobs(rig)) == 1
    assert rig.stops == []


def test_the_same_goal_is_moved_to_again_after_somebody_else_moved_away() -> None:
    rig = ready()
    client = rig.ros()
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
    rig = ready()
    client = rig.ros()
    codes = [client.point(sequence, 0.1 * sequence, 0.0) for sequence in sequences]
    assert codes[-1] is FAILURE
    assert client.point(4, 0.4, 0.0) is FAILURE
    rig.wait(500)
    assert jobs(rig) == []
    assert status_of(rig).error_code == STATUS_ERROR_OFFSET + V.SEQUENCE
    assert client.closed_for == []


def test_a_beginning_ends_the_refusing() -> None:
    rig = ready()
    client = rig.ros()
    client.point(7, 0.1, 0.1)
    assert client.trajectory(*PATH) == [SUCCESS] * 3
    rig.wait(200)
    assert rig.core.ros.refused is None


def test_a_new_trajectory_before_the_old_one_began_replaces_it() -> None:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH)
    rig.wait(50)
    assert client.trajectory((0.0, 0.0), (-0.5, 0.0)) == [SUCCESS, SUCCESS]
    rig.wait(200)
    assert [len(job.points) for job in jobs(rig)] == [2]


def test_more_points_than_the_limit_discard_the_trajectory() -> None:
    rig = ready(ros_i={"max_points": 2})
    client = rig.ros()
    assert client.trajectory(*PATH) == [SUCCESS, SUCCESS, FAILURE]
    assert rig.core.ros.refused is V.TOO_MANY_POINTS
