"""The ball around an arm's reach: no tool leaves it, what is outside is refused without search."""

import numpy as np
import pytest
from rigs.motion.loaded_robots import load_robot, serial_robot

from openpendant.motion.description.robot import SerialRobot, robot_names
from openpendant.motion.errors import PoseUnreachable
from openpendant.motion.kinematics.ik.ik import solve
from openpendant.motion.kinematics.ik.ik_context import reach_bound
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose

ROBOTS = [name for name in robot_names() if isinstance(load_robot(name), SerialRobot)]


@pytest.mark.parametrize("name", ROBOTS)
def test_no_tool_leaves_the_ball(name: str) -> None:
    kinematics = Kinematics(serial_robot(name))
    bound = reach_bound(kinematics)
    random = np.random.default_rng(6)
    joints = random.uniform(kinematics.lower, kinematics.upper, (300, kinematics.dof))
    corners = np.where(random.random((300, kinematics.dof)) < 0.5, *joint_ends(kinematics))
    positions = kinematics.places(np.vstack((joints, corners))).position
    assert max(bound.beyond(position) for position in positions) <= 1e-9
    assert bound.radius < 2.0 * kinematics.size + 1.0


def joint_ends(kinematics: Kinematics) -> tuple[np.ndarray, np.ndarray]:
    return kinematics.lower, kinematics.upper


@pytest.mark.parametrize("name", ["rail_kr5_arc", "kuka_iiwa14", "mitsubishi_rh6frh5520"])
def test_a_pose_outside_the_ball_is_refused_without_restarts(name: str) -> None:
    kinematics = Kinematics(serial_robot(name))
    home = kinematics.robot.home_position
    here, bound = kinematics.forward(home), reach_bound(kinematics)
    far = Pose(bound.foot + np.array([0.0, bound.radius + 0.5, 0.0]), here.quaternion)
    with pytest.raises(PoseUnreachable) as refused:
        solve(kinematics, far, home)
    assert refused.value.restarts == 0
    # The ball is the least that is missing; what was found is a place that the tool can be at.
    assert 0.5 - 1e-9 <= refused.value.best_position_error < 0.5 + kinematics.size + 1.0


def test_the_ball_goes_along_the_rail() -> None:
    kinematics = Kinematics(serial_robot("rail_kr5_arc"))
    bound = reach_bound(kinematics)
    rail = kinematics.upper[0] - kinematics.lower[0]
    assert np.linalg.norm(bound.track) == pytest.approx(rail)
    end = bound.foot + bound.track
    assert bound.beyond(end) == pytest.approx(-bound.radius)
    assert bound.beyond(end + bound.track) == pytest.approx(rail - bound.radius)
