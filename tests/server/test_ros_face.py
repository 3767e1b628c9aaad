"""The ROS-I face: collecting, gaps, stops, reconnections, and what STATUS says of it."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from server_rig import FAILURE, LIMITS, MS, SUCCESS, RosClient, ServerRig, ready

from openpendant.motion.limits import float32_ceiling
from openpendant.server.core import Port
from openpendant.server.jobs import RosPathJob, RosPoint
from openpendant.server.joint_slots import JointSlots
from openpendant.server.outgoing import ForwardStop, Plan
from openpendant.server.refusal import Refusal
from openpendant.server.robot_cell import ControllerPath
from openpendant.server.ros_trajectory import Collection
from openpendant.simplemsg import (
    CommType,
    ControllerMode,
    GetVersion,
    GetVersionReply,
    HeaderOnly,
    JointPosition,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    Malformed,
    Message,
    Opaque,
    Ping,
    Received,
    ReplyCode,
    Status,
    TrajPoint,
    TriState,
    ValidField,
    joint_array,
)
from openpendant.simplemsg.errors import BodyFault
from openpendant.simplemsg.pendant import Activity, AuthorityChanged, AuthorityReason
from openpendant.simplemsg.verdicts import VerdictCode as V

PATH = ((0.0, 0.0), (0.5, 0.1), (1.0, 0.2))
TOPIC = CommType.TOPIC


def jobs(rig: ServerRig) -> list[RosPathJob]:
    plans = [item.job for _, item in rig.log if isinstance(item, Plan)]
    return [job for job in plans if isinstance(job, RosPathJob)]


def moving() -> tuple[ServerRig, RosClient]:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH)
    rig.wait(400)
    assert rig.activity() is Activity.MOVING
    return rig, client


def status_of(rig: ServerRig) -> Status:
    """Ask a fresh state connection for STATUS."""
    (reply,) = rig.ros(port=Port.ROS_STATE).send(Status(0, 0, 0, 0, 0, 0, 0, comm_type=2))
    assert isinstance(reply, Status)
    return reply


# Collecting.


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
    rig = ready()
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
    assert status_of(rig).error_code == V.SEQUENCE
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


# Reading points.


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


@pytest.mark.parametrize("bad", [(9.0, 0.0), (float("nan"), 0.0)])
def test_one_bad_point_discards_the_whole_trajectory(bad: tuple[float, float]) -> None:
    rig = ready()
    client = rig.ros()
    assert client.trajectory((0.0, 0.0), bad, (0.1, 0.1)) == [SUCCESS, FAILURE, FAILURE]
    rig.wait(500)
    assert jobs(rig) == []
    assert status_of(rig).in_error == TriState.TRUE


# Who may.


def test_the_first_point_takes_the_authority_and_tells_everybody() -> None:
    rig = ready()
    pendant, client = rig.pendant(), rig.ros("127.0.0.1")
    client.point(0, 0.0, 0.0)
    (change,) = pendant.all(AuthorityChanged)
    assert (change.holder, change.client) == (client.session, "ROS-I 127.0.0.1")
    assert pendant.take() is V.HELD_BY_OTHER


def held(rig: ServerRig) -> None:
    rig.holder()


def manual(rig: ServerRig) -> None:
    rig.controller.mode = ControllerMode.MANUAL
    rig.wait(10)


def unknown_mode(rig: ServerRig) -> None:
    rig.controller.mode = ControllerMode.UNKNOWN
    rig.wait(10)


def latched(rig: ServerRig) -> None:
    rig.pendant().stop()


def down(rig: ServerRig) -> None:
    rig.path(ControllerPath.MOTION, False)


def stale(rig: ServerRig) -> None:
    rig.now += 101 * MS


def e_stopped(rig: ServerRig) -> None:
    rig.controller.e_stopped = True
    rig.wait(10)


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (held, V.HELD_BY_OTHER),
        (manual, V.NOT_AUTOMATIC),
        (unknown_mode, V.NOT_AUTOMATIC),
        (latched, V.STOP_LATCHED),
        (down, V.CONTROLLER_DOWN),
        (stale, V.FEEDBACK_STALE),
        (e_stopped, V.CONTROLLER_NOT_READY),
    ],
)
def test_a_client_that_may_not_move_gets_failure_and_is_closed(
    spoil: Callable[[ServerRig], None], code: V
) -> None:
    rig = ready()
    spoil(rig)
    client = rig.ros()
    before = rig.core.cell.authority.holder
    assert client.point(0, 0.0, 0.0) is FAILURE
    assert client.point(1, 0.1, 0.0) is FAILURE
    assert len(client.closed_for) == 1
    assert rig.core.ros.refused is code
    assert rig.core.cell.authority.holder == before


def test_an_address_that_is_not_allowed_may_not_move_but_may_stop() -> None:
    rig, _ = moving()
    stranger = rig.ros("10.0.0.9")
    assert stranger.point(0, 0.0, 0.0) is FAILURE
    assert stranger.closed_for
    assert rig.core.ros.refused is V.ADDRESS_NOT_ALLOWED
    assert stranger.stop() is SUCCESS
    assert len(rig.stops) == 1


def test_an_unknown_mode_is_taken_for_automatic_where_the_cell_says_so() -> None:
    rig = ready(ros_i={"unknown_mode_is_automatic": True})
    unknown_mode(rig)
    assert rig.ros().point(0, 0.0, 0.0) is SUCCESS


def test_a_mode_that_changes_while_points_are_collected_ends_it() -> None:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH)
    manual(rig)
    rig.wait(200)
    assert jobs(rig) == []
    assert client.closed_for
    assert rig.core.ros.refused is V.NOT_AUTOMATIC


def test_authority_without_use_is_given_back_after_3_s_at_rest() -> None:
    rig = ready()
    pendant, client = rig.pendant(), rig.ros()
    client.trajectory(*PATH)
    while rig.activity() is not Activity.IDLE or not rig.points:
        rig.wait(10)
    rested = rig.now
    while rig.core.cell.authority.holder is not None:
        rig.wait(10)
    assert rig.now == rested + 3_000 * MS
    assert pendant.all(AuthorityChanged)[-1].reason == AuthorityReason.RELEASED
    assert client.closed_for == []
    assert client.trajectory((0.0, 0.0)) == [SUCCESS]


# Stops.


def collecting() -> tuple[ServerRig, RosClient]:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH)
    return rig, client


def planning() -> tuple[ServerRig, RosClient]:
    rig = ready(plans_at_once=False)
    client = rig.ros()
    client.trajectory(*PATH)
    rig.wait(160)
    assert rig.activity() is Activity.PLANNING
    return rig, client


def superseding() -> tuple[ServerRig, RosClient]:
    rig, client = moving()
    rig.controller.coasts = True
    client.trajectory((0.0, 0.0), (0.1, 0.1))
    rig.wait(160)
    assert rig.activity() is Activity.STOPPING
    return rig, client


def idle() -> tuple[ServerRig, RosClient]:
    rig = ready()
    return rig, rig.ros()


@pytest.mark.parametrize("phase", [idle, collecting, planning, moving, superseding])
def test_a_stop_acts_at_once_is_answered_and_leaves_nothing_queued(
    phase: Callable[[], tuple[ServerRig, RosClient]],
) -> None:
    rig, client = phase()
    planned = len(jobs(rig))
    stop = JointTrajPt(-4, joint_array(()), 0.0, 0.0)
    out = rig.perform(rig.core.receive(client.session, stop, rig.now))
    assert isinstance(out[0], ForwardStop)
    assert client.got[-1].reply_code == SUCCESS
    before = len(rig.points)
    if rig.jobs:
        rig.plan()
    rig.controller.coasts = False
    rig.controller.stop(rig.now)
    rig.wait(1_000)
    assert len(jobs(rig)) == planned
    assert len(rig.points) == before
    assert rig.core.ros.refused is None
    assert client.trajectory(*PATH) == [SUCCESS] * 3


@pytest.mark.parametrize("phase", [collecting, planning, moving, superseding])
def test_a_pendants_stop_leaves_nothing_queued_either(
    phase: Callable[[], tuple[ServerRig, RosClient]],
) -> None:
    rig, client = phase()
    planned = len(jobs(rig))
    rig.pendant().stop()
    before = len(rig.points)
    if rig.jobs:
        rig.plan()
    rig.controller.coasts = False
    rig.controller.stop(rig.now)
    rig.wait(1_000)
    assert (len(jobs(rig)), len(rig.points)) == (planned, before)
    assert client.point(0, 0.0, 0.0) is FAILURE
    assert client.closed_for


def test_a_stop_of_another_client_forgets_the_points_of_this_one() -> None:
    rig, _ = collecting()
    rig.ros().stop()
    rig.wait(500)
    assert jobs(rig) == []


def test_a_stop_as_topic_stops_and_is_not_answered() -> None:
    rig, client = moving()
    assert client.point(-4, comm_type=TOPIC) is None
    assert len(rig.stops) == 1


# A new trajectory during the old one.


@pytest.mark.parametrize("phase", [moving, planning])
def test_a_new_trajectory_stops_the_old_one_and_follows_it(
    phase: Callable[[], tuple[ServerRig, RosClient]],
) -> None:
    rig, client = phase()
    assert client.trajectory((0.2, 0.0), (-0.5, 0.0)) == [SUCCESS, SUCCESS]
    assert len(rig.stops) == (1 if phase is moving else 0)
    assert rig.core.cell.request is None
    rig.jobs.clear()
    rig.plans_at_once = True
    rig.wait(3_000)
    assert rig.controller.position == (-0.5, 0.0)
    assert rig.core.ros.refused is None
    assert client.closed_for == []


def test_it_waits_until_the_robot_stands() -> None:
    rig, client = superseding()
    rig.wait(500)
    assert len(jobs(rig)) == 1
    rig.controller.coasts = False
    rig.controller.stop(rig.now)
    rig.wait(30)
    assert len(jobs(rig)) == 2
    assert client.closed_for == []


def test_the_third_trajectory_replaces_the_second_that_waits() -> None:
    rig, client = superseding()
    client.trajectory((0.0, 0.0), (-0.1, 0.0), (-0.2, 0.0))
    rig.controller.coasts = False
    rig.controller.stop(rig.now)
    rig.wait(3_000)
    assert [len(job.points) for job in jobs(rig)] == [3, 3]
    assert rig.controller.position == (-0.2, 0.0)
    assert client.closed_for == []


# Links that are lost.


@pytest.mark.parametrize("again", [1, 2])
def test_a_client_that_comes_back_goes_on_where_it_was(again: int) -> None:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH[:2])
    client.close()
    rig.wait(1_900)
    assert jobs(rig) == []
    back = rig.ros()
    for index in range(again, 3):
        assert back.point(index, *PATH[index]) is SUCCESS
    rig.wait(160)
    assert [point.position for point in jobs(rig)[0].points] == list(PATH)


def test_2_s_are_the_longest_absence() -> None:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH[:2])
    client.close()
    lost = rig.now
    rig.now = lost + 2_000 * MS
    rig.report()
    back = rig.ros()
    assert back.point(2, *PATH[2]) is SUCCESS
    back.close()
    rig.now += 2_000 * MS + 1
    rig.report()
    assert rig.ros().point(3, 1.0, 0.3) is FAILURE


@pytest.mark.parametrize(("sequence", "address"), [(3, "127.0.0.1"), (2, "::1"), (5, "127.0.0.1")])
def test_another_sequence_or_another_address_does_not_go_on(sequence: int, address: str) -> None:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH[:2])
    client.close()
    back = rig.ros(address)
    assert back.point(sequence, *PATH[2]) is FAILURE
    rig.wait(500)
    assert jobs(rig) == []


def test_a_new_beginning_discards_what_was_sent_before_the_loss() -> None:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH[:2])
    client.close()
    rig.ros().trajectory((0.3, 0.3))
    rig.wait(160)
    assert [len(job.points) for job in jobs(rig)] == [1]


def test_a_link_lost_in_motion_stops_it_and_frees_the_authority() -> None:
    rig, client = moving()
    client.close()
    assert len(rig.stops) == 1
    assert rig.core.cell.authority.holder is None
    rig.wait(2_500)
    assert len(jobs(rig)) == 1


@pytest.mark.parametrize("phase", [planning, superseding])
def test_a_link_lost_before_the_motion_began_leaves_nothing(
    phase: Callable[[], tuple[ServerRig, RosClient]],
) -> None:
    rig, client = phase()
    planned, before = len(jobs(rig)), len(rig.points)
    client.close()
    if rig.jobs:
        rig.plan()
    rig.controller.stop(rig.now)
    rig.wait(1_000)
    assert (len(jobs(rig)), len(rig.points)) == (planned, before)


# Answers and state.


@pytest.mark.parametrize("port", [Port.ROS_MOTION, Port.ROS_STATE])
@pytest.mark.parametrize(
    ("request_", "kind", "code"),
    [
        (Ping(), Ping, SUCCESS),
        (GetVersion(), GetVersionReply, SUCCESS),
        (Status(0, 0, 0, 0, 0, 0, 0, comm_type=CommType.REQUEST), Status, SUCCESS),
        (JointPosition(0, joint_array(()), comm_type=CommType.REQUEST), HeaderOnly, FAILURE),
        (Opaque(4711, b"xx"), HeaderOnly, FAILURE),
    ],
)
def test_every_request_is_answered_once(
    port: Port, request_: Message, kind: type[Message], code: ReplyCode
) -> None:
    client = ready().ros(port=port)
    (reply,) = client.send(request_)
    assert isinstance(reply, kind)
    assert (reply.comm_type, reply.reply_code) == (CommType.REPLY, code)


@pytest.mark.parametrize(
    "topic",
    [
        Opaque(4711, b"", comm_type=TOPIC),
        Status(0, 0, 0, 0, 0, 0, 0),
        Malformed(11, 1, BodyFault("short", 11, 1, 0)),
        JointTrajPt(0, joint_array(()), 0.0, 0.0, comm_type=TOPIC),
        JointTrajPt(9, joint_array(()), 0.0, 0.0, comm_type=TOPIC),
        JointTraj((TrajPoint(0, joint_array((9.0,)), 0.0, 0.0),), comm_type=TOPIC),
    ],
)
def test_no_topic_is_ever_answered(topic: Received) -> None:
    assert ready().ros().send(topic) == []


def test_a_malformed_request_is_answered_and_discards_the_points() -> None:
    rig, client = collecting()
    (reply,) = client.send(Malformed(11, 2, BodyFault("short", 11, 2, 0)))
    assert reply == HeaderOnly(11, reply_code=FAILURE)
    rig.wait(500)
    assert jobs(rig) == []


def test_ten_unknown_requests_in_ten_seconds_close_the_link() -> None:
    rig = ready()
    client = rig.ros()
    for _ in range(9):
        client.send(Opaque(4711, b""))
    assert client.closed_for == []
    client.send(Opaque(4711, b""))
    assert client.closed_for


def test_unknown_requests_that_come_slowly_are_put_up_with() -> None:
    rig = ready()
    client = rig.ros()
    for _ in range(30):
        client.send(Opaque(4711, b""))
        rig.wait(1_120)
    assert client.closed_for == []


def test_a_state_connection_is_told_at_once_and_then_at_its_rate() -> None:
    rig = ready(ros_i={"state_rate": 25})
    listener = rig.ros(port=Port.ROS_STATE)
    assert [type(message) for message in listener.got] == [JointPosition, Status]
    rig.wait(400)
    assert len(listener.all(Status)) == 11


def test_a_point_on_the_state_port_moves_nothing() -> None:
    rig = ready()
    assert rig.ros(port=Port.ROS_STATE).point(0, 0.0, 0.0) is FAILURE
    assert rig.core.cell.authority.holder is None


def test_positions_that_are_not_fresh_are_not_repeated() -> None:
    rig = ready()
    rig.controller.reports = False
    listener = rig.ros(port=Port.ROS_STATE)
    rig.wait(100)
    told = len(listener.all(JointPosition))
    rig.wait(200)
    assert len(listener.all(JointPosition)) == told
    assert listener.all(Status)[-1].error_code == V.FEEDBACK_STALE


@pytest.mark.parametrize(
    ("spoil", "error_code", "in_error", "possible"),
    [
        (lambda rig: None, 0, 0, 1),
        (manual, 0, 0, 1),
        (latched, V.STOP_LATCHED, 1, 0),
        (down, V.CONTROLLER_DOWN, 1, 0),
        (e_stopped, V.CONTROLLER_NOT_READY, 1, 0),
        (lambda rig: rig.holder().move(0.5, 0.5), 0, 0, 1),
    ],
)
def test_status_is_the_controllers_narrowed_by_our_own_obstacles(
    spoil: Callable[[ServerRig], None], error_code: int, in_error: int, possible: int
) -> None:
    rig = ready()
    spoil(rig)
    status = status_of(rig)
    assert (status.error_code, status.in_error, status.motion_possible) == (
        error_code,
        in_error,
        possible,
    )


def test_status_says_in_motion_as_long_as_the_motion_lasts() -> None:
    rig, _ = moving()
    assert status_of(rig).in_motion == TriState.TRUE
    rig.wait(3_000)
    assert status_of(rig).in_motion == TriState.FALSE


@pytest.mark.parametrize(
    ("code", "shown"), [(V.NOT_TIMEABLE, V.NOT_TIMEABLE), (V.NO_MOTION, None), (V.STOPPED, None)]
)
def test_status_shows_why_a_plan_was_refused_unless_that_is_no_error(
    code: V, shown: V | None
) -> None:
    rig, _ = planning()
    rig.plan(Refusal(code))
    assert rig.core.ros.refused is shown


def test_valid_fields_of_the_real_client_are_read_by_their_low_bits() -> None:
    assert ValidField(0x46F48B4F & 15) == ValidField.ALL
    message = full()
    message.valid_fields = 0x46F48B40 | 3
    assert isinstance(read(message), RosPoint)
