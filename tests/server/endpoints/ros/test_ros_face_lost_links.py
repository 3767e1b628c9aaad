from __future__ import annotations

from collections.abc import Callable

import pytest
from rigs.cells.ros_face_situations import PATH, jobs, moving, planning, superseding
from rigs.cells.server_rig import FAILURE, MS, SUCCESS, ServerRig, ready
from rigs.peers.server_clients import RosClient


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
