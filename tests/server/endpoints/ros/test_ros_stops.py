from __future__ import annotations

from collections.abc import Callable

import pytest
from rigs.cells.ros_face_situations import (
    PATH,
    TOPIC,
    collecting,
    idle,
    jobs,
    moving,
    planning,
    superseding,
)
from rigs.cells.server_rig import FAILURE, SUCCESS, ServerRig
from rigs.peers.server_clients import RosClient

from openpendant.server.cell.state_report import status_message
from openpendant.server.events.effects import SendStop
from openpendant.server.events.events import Received
from openpendant.simplemsg import JointTrajPt, TriState, joint_array
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.mark.parametrize("phase", [idle, collecting, planning, moving, superseding])
def test_a_stop_acts_at_once_is_answered_and_leaves_nothing_queued(
    phase: Callable[[], tuple[ServerRig, RosClient]],
) -> None:
    rig, client = phase()
    planned = len(jobs(rig))
    stop = JointTrajPt(-4, joint_array(()), 0.0, 0.0)
    out = rig.perform(rig.core.handle(Received(client.session, stop), rig.now))
    assert isinstance(out[0], SendStop)
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


@pytest.mark.parametrize("phase", [moving, planning])
def test_a_new_trajectory_stops_the_old_one_and_follows_it(
    phase: Callable[[], tuple[ServerRig, RosClient]],
) -> None:
    rig, client = phase()
    assert client.trajectory((0.2, 0.0), (-0.5, 0.0)) == [SUCCESS, SUCCESS]
    assert len(rig.stops) == (1 if phase is moving else 0)
    assert rig.core.cell.driving.request is None
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


def test_what_waits_for_the_robot_to_rest_does_not_begin_after_a_fault_that_came_and_went() -> None:
    rig, client = superseding()
    for error in (7, 0):
        rig.controller.error_code = error
        rig.report()
    rig.controller.coasts = False
    rig.controller.stop(rig.now)
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
