from __future__ import annotations

import math

from rigs.cells.ros_face_situations import PATH, jobs, status_of
from rigs.cells.server_rig import FAILURE, SUCCESS, ready

from openpendant.server.events.effects import SendStop
from openpendant.server.events.events import Received
from openpendant.simplemsg import JointTraj, TrajPoint, joint_array
from openpendant.simplemsg.verdicts import STATUS_ERROR_OFFSET
from openpendant.simplemsg.verdicts import VerdictCode as V


def test_a_stop_forgets_the_points_of_a_client_that_is_away() -> None:
    rig = ready()
    client = rig.ros()
    client.trajectory(*PATH[:2])
    client.close()
    pendant = rig.holder()
    pendant.stop()
    assert pendant.reset() is V.ACCEPTED
    pendant.release()
    assert rig.ros().point(2, *PATH[2]) is FAILURE
    rig.wait(500)
    assert jobs(rig) == []


def test_a_whole_trajectory_with_a_stop_in_it_is_a_stop_and_nothing_else() -> None:
    rig = ready()
    client = rig.ros()
    points = tuple(
        TrajPoint(sequence, joint_array(joints), 0.1, 0.5)
        for sequence, joints in ((0, PATH[0]), (-4, (0.0, 0.0)), (2, PATH[2]))
    )
    out = rig.perform(rig.core.handle(Received(client.session, JointTraj(points)), rig.now))
    assert isinstance(out[0], SendStop)
    assert client.got[-1].reply_code == SUCCESS
    rig.wait(500)
    assert jobs(rig) == []


def test_the_rest_of_a_discarded_trajectory_does_not_hide_why_it_was_discarded() -> None:
    rig = ready()
    client = rig.ros()
    answers = client.trajectory(PATH[0], (math.nan, 0.0), PATH[1], PATH[2])
    assert answers == [SUCCESS, FAILURE, FAILURE, FAILURE]
    assert rig.core.ros.refused is V.NOT_FINITE
    assert status_of(rig).error_code == STATUS_ERROR_OFFSET + V.NOT_FINITE


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
