from collections.abc import Callable
from dataclasses import replace

import pytest
from rigs.cells.ros_situations import (
    PATH,
    TOPIC,
    collecting,
    idle,
    jobs,
    left,
    moving,
    planning,
    superseding,
)
from rigs.cells.server_rig import FAILURE, MS, SUCCESS, TICK, ServerRig
from rigs.peers.server_clients import RosClient

from openpendant.server.cell.state_report import status_message
from openpendant.server.endpoints.ros.trajectory_collection import LATEST_BEGINNING_NS
from openpendant.server.events.effects import SendStop
from openpendant.server.events.events import Received
from openpendant.simplemsg import JointTrajPt, TriState, joint_array
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode as V

Situation = Callable[[], tuple[ServerRig, RosClient]]


@pytest.mark.parametrize("phase", [idle, collecting, planning, moving, superseding])
def test_a_stop_acts_at_once_is_answered_and_leaves_nothing_queued(phase: Situation) -> None:
    rig, client = phase()
    planned = len(jobs(rig))
    stop = JointTrajPt(-4, joint_array(()), 0.0, 0.0)
    out = rig.perform(rig.core.handle(Received(client.session, stop), rig.now))
    assert isinstance(out[0], SendStop)
    assert client.got[-1].reply_code == SUCCESS
    before = len(rig.points)
    rig.come_to_rest()
    rig.wait(1_000)
    assert len(jobs(rig)) == planned
    assert len(rig.points) == before
    assert rig.core.ros.refused is None
    assert client.trajectory(*PATH) == [SUCCESS] * 3


def late_point(rig: ServerRig, client: RosClient) -> None:
    assert client.point(3, 1.1, 0.3) is FAILURE
    assert rig.core.ros.refused is V.SEQUENCE


ENDS: dict[str, tuple[Callable[[ServerRig, RosClient], object], list[Situation]]] = {
    "a pendant's stop": (
        lambda rig, _: rig.pendant().stop(),
        [collecting, planning, moving, superseding],
    ),
    "another client's stop": (lambda rig, _: rig.ros().stop(), [collecting]),
    "a lost link": (lambda _, client: client.close(), [planning, superseding]),
    "a point that follows too late": (late_point, [planning, superseding]),
}


@pytest.mark.parametrize(
    ("end", "phase"),
    [
        pytest.param(end, phase, id=f"{name}, {phase.__name__}")
        for name, (end, phases) in ENDS.items()
        for phase in phases
    ],
)
def test_what_ends_a_trajectory_leaves_nothing_queued(
    end: Callable[[ServerRig, RosClient], object], phase: Situation
) -> None:
    rig, client = phase()
    planned, before = len(jobs(rig)), len(rig.points)
    end(rig, client)
    rig.come_to_rest()
    rig.wait(1_000)
    assert (len(jobs(rig)), len(rig.points)) == (planned, before)


def test_a_stop_as_topic_stops_and_is_not_answered() -> None:
    rig, client = moving()
    assert client.point(-4, comm_type=TOPIC) is None
    assert len(rig.stops) == 1


@pytest.mark.parametrize("phase", [moving, planning])
def test_a_new_trajectory_stops_the_old_one_and_follows_it(phase: Situation) -> None:
    rig, client = phase()
    assert client.trajectory((0.2, 0.0), (-0.5, 0.0)) == [SUCCESS, SUCCESS]
    assert len(rig.stops) == (1 if phase is moving else 0)
    assert rig.core.cell.driving.request is None
    rig.jobs.clear()
    rig.plans_at_once = True
    rig.wait(3_000)
    assert (rig.controller.position, rig.core.ros.refused) == ((-0.5, 0.0), None)
    assert client.closed_for == []


def test_it_waits_until_the_robot_stands() -> None:
    rig, client = superseding()
    rig.wait(500)
    assert len(jobs(rig)) == 1
    rig.come_to_rest()
    rig.wait(30)
    assert len(jobs(rig)) == 2
    assert client.closed_for == []


def test_the_third_trajectory_replaces_the_second_that_waits() -> None:
    rig, client = superseding()
    client.trajectory((0.0, 0.0), (-0.1, 0.0), (-0.2, 0.0))
    rig.come_to_rest()
    rig.wait(3_000)
    assert [len(job.points) for job in jobs(rig)] == [3, 3]
    assert rig.controller.position == (-0.2, 0.0)
    assert client.closed_for == []


def test_what_waits_for_the_robot_to_rest_does_not_begin_after_a_fault_that_came_and_went() -> None:
    rig, client = superseding()
    for error in (7, 0):
        rig.controller.error_code = error
        rig.report()
    rig.come_to_rest()
    rig.wait(1_000)
    assert len(jobs(rig)) == 1
    assert rig.core.ros.refused is V.CONTROLLER_STOPPED
    assert client.closed_for


def test_what_was_sent_while_frames_or_tools_are_saved_waits_for_that() -> None:
    rig, client = idle()
    rig.core.cell.awaited = "the tools are being saved"
    assert client.trajectory(*PATH) == [SUCCESS] * 3
    rig.wait(900)
    assert (jobs(rig), client.closed_for) == ([], [])
    assert rig.core.ros.refused is None
    status = status_message(rig.core.cell, None, rig.now)
    assert (status.in_error, status.motion_possible) == (TriState.FALSE, TriState.TRUE)
    rig.core.cell.awaited = ""
    rig.wait(20)
    assert len(jobs(rig)) == 1


SLOW_WATCHDOG = {"deadline": 1.0}
"""So that a loop that stood still is no reason to stop by itself."""


def at(rig: ServerRig, time: int) -> None:
    """Let the next report and tick come at a time [ns], after others in between."""
    while rig.now + 2 * TICK < time:
        rig.wait(10)
    rig.now = time
    rig.report()
    rig.tick()


@pytest.mark.parametrize("silence_ms", [200, 990])
def test_a_download_without_its_end_moves_nothing(silence_ms: int) -> None:
    rig, client = idle()
    for sequence, joints in zip((-1, 1, 2), PATH, strict=True):
        client.point(sequence, *joints, comm_type=TOPIC)
    rig.wait(silence_ms)
    assert (jobs(rig), rig.core.ros.refused) == ([], None)


def test_a_download_is_waited_for_until_its_end_comes_then_moved_and_never_answered() -> None:
    rig, client = idle()
    for sequence, joints in zip((-1, 1, -3), PATH, strict=True):
        assert client.point(sequence, *joints, comm_type=TOPIC) is None
        rig.wait(900 if sequence != -3 else 0)
    assert [point.position for point in jobs(rig)[0].points] == list(PATH)
    rig.wait(3_000)
    assert (rig.controller.position, client.got) == (PATH[-1], [])


@pytest.mark.parametrize(("wait_ns", "told"), [(1_000 * MS - 1, False), (1_000 * MS, True)])
def test_a_download_is_dropped_1_s_after_its_last_point(wait_ns: int, told: bool) -> None:
    rig, client = idle()
    client.point(-1, *PATH[0], comm_type=TOPIC)
    client.point(1, *PATH[1], comm_type=TOPIC)
    at(rig, rig.now + wait_ns)
    assert rig.core.ros.refused is (V.TRAJECTORY_INCOMPLETE if told else None)
    client.point(-3, *PATH[2], comm_type=TOPIC)
    assert len(jobs(rig)) == (0 if told else 1)


@pytest.mark.parametrize("begins_at", [0, -2])
def test_a_stream_that_announced_no_end_needs_none(begins_at: int) -> None:
    rig, client = idle()
    client.point(begins_at, *PATH[0])
    client.point(1, *PATH[1])
    rig.wait(150)
    assert len(jobs(rig)) == 1


@pytest.mark.parametrize(("wait_ns", "planned"), [(1_000 * MS, 2), (1_000 * MS + 1, 1)])
def test_what_waits_for_the_robot_to_rest_begins_within_1_s_or_not_at_all(
    wait_ns: int, planned: int
) -> None:
    rig, _ = superseding()
    last = rig.now - 160 * MS
    rig.wait(790)
    rig.come_to_rest()
    rig.core.cell.awaited = "the tools are being saved"
    rig.wait(40)
    rig.core.cell.awaited = ""
    at(rig, last + wait_ns)
    rig.wait(500)
    assert len(jobs(rig)) == planned
    assert rig.core.ros.refused is (None if planned == 2 else V.TRAJECTORY_LATE)


def test_what_waits_for_a_robot_that_never_rests_is_dropped_and_told() -> None:
    rig, _ = superseding()
    planned = len(jobs(rig))
    rig.wait(1_100)
    assert (rig.activity(), rig.core.ros.refused) == (Activity.STOPPING, V.TRAJECTORY_LATE)
    rig.controller.coasts = False
    rig.wait(1_000)
    assert len(jobs(rig)) == planned


@pytest.mark.parametrize(("late_ns", "moves"), [(0, True), (1, False)])
def test_a_plan_may_take_its_time_but_what_it_waited_counts(late_ns: int, moves: bool) -> None:
    rig, _ = planning()
    last = rig.now - 160 * MS
    job = rig.jobs.pop(0)
    planned = rig.plan_of(job)  # it took 10 ms
    while rig.now < last + LATEST_BEGINNING_NS:
        rig.wait(10)
    rig.now = last + LATEST_BEGINNING_NS + 10 * MS + late_ns
    rig.report()
    rig.planned(job, planned)
    assert (rig.activity() is Activity.MOVING) is moves
    assert rig.core.ros.refused is (None if moves else V.TRAJECTORY_LATE)
    assert bool(rig.points) is moves


def test_a_planner_that_waits_for_a_processor_is_planning() -> None:
    rig, _ = planning()
    job = rig.jobs.pop(0)
    planned = replace(rig.plan_of(job), took=2.5)
    rig.wait(3_300)
    rig.planned(job, planned)
    assert rig.activity() is Activity.MOVING


def test_what_is_read_late_may_have_come_when_the_loop_fell_asleep() -> None:
    rig, client = idle(watchdog=SLOW_WATCHDOG)
    client.point(0, *PATH[0])
    rig.now += 900 * MS  # the next point waits to be read meanwhile
    rig.report()
    client.point(1, *PATH[1])
    rig.wait(300)
    assert jobs(rig) == []
    assert rig.core.ros.refused is V.TRAJECTORY_LATE


def test_after_a_stall_a_silence_is_judged_by_the_next_tick_only() -> None:
    rig, client = idle(watchdog=SLOW_WATCHDOG)
    client.point(0, *PATH[0])
    rig.wait(20)
    rig.now += 300 * MS
    rig.report()
    rig.tick()
    assert jobs(rig) == []
    assert client.point(1, *PATH[1]) is SUCCESS
    rig.wait(200)
    assert [len(job.points) for job in jobs(rig)] == [2]


def test_a_loop_that_is_always_late_ends_a_stream_all_the_same() -> None:
    rig, client = idle()
    client.point(0, *PATH[0])
    client.point(1, *PATH[1])
    for _ in range(3):
        rig.now += 150 * MS
        rig.report()
        rig.tick()
    assert len(jobs(rig)) == 1


def test_a_point_that_follows_too_late_breaks_off_what_moves_already() -> None:
    rig, client = moving()
    assert client.point(3, 1.1, 0.3) is FAILURE
    assert len(rig.stops) == 1
    assert (rig.activity(), rig.core.ros.refused) == (Activity.STOPPING, V.SEQUENCE)
    assert client.point(4, 1.2, 0.3) is FAILURE
    rig.wait(1_000)
    assert len(jobs(rig)) == 1


@pytest.mark.parametrize("again", [1, 2])
def test_a_client_that_comes_back_goes_on_where_it_was(again: int) -> None:
    rig = left()
    rig.wait(1_900)
    assert jobs(rig) == []
    back = rig.ros()
    for index in range(again, 3):
        assert back.point(index, *PATH[index]) is SUCCESS
    rig.wait(160)
    assert [point.position for point in jobs(rig)[0].points] == list(PATH)


def test_2_s_are_the_longest_absence() -> None:
    rig = left()
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
    rig = left()
    back = rig.ros(address)
    assert back.point(sequence, *PATH[2]) is FAILURE
    rig.wait(500)
    assert jobs(rig) == []


def test_a_new_beginning_discards_what_was_sent_before_the_loss() -> None:
    rig = left()
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
