"""How fast joints can move the elbow, on an arm that grows by a slide which follows its rail."""

import numpy as np
import pytest
from rigs.motion.loaded_robots import load_robot

from openpendant.motion.description.robot import SerialRobot
from openpendant.motion.jog.line_speed_bounds import LinePoints, lever_arms
from openpendant.motion.kinematics.pinocchio_model import greatest_travel
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.trajectory.point_speed import elbow_link

STAGE = {
    "type": "prismatic",
    "name": "stage",
    "child": "stage_link",
    "origin": {"xyz": [0, 0, 0], "rpy": [0, 0, 0]},
    "axis": [1.0, 0.0, 0.0],
    "lower": -0.01,
    "upper": 0.01,
    "velocity": 1.0,
    "dependent": {"terms": [{"joint": "joint_e1", "gain": 0.1}], "offset": 3.0},
}
"""Goes 3 m out and farther with the rail, whatever its own range says."""


@pytest.fixture(scope="module")
def telescope() -> Kinematics:
    robot = load_robot("rail_kr5_arc").model_dump(by_alias=True, mode="json", exclude_none=True)
    for field in ("dh", "vrm", "validation", "display"):
        robot.pop(field, None)
    joints = robot["joints"]
    joints[4]["parent"] = "stage_link"
    joints.insert(4, {**STAGE, "parent": joints[3]["child"]})
    return Kinematics(SerialRobot.model_validate(robot))


def test_a_dependent_slide_goes_where_its_joint_takes_it(telescope: Kinematics) -> None:
    names = [joint.name for joint in telescope.robot.moving]
    rail = max(abs(telescope.lower[0]), abs(telescope.upper[0]))
    travel = greatest_travel(telescope.robot)
    assert travel[names.index("joint_e1")] == pytest.approx(rail)
    assert travel[names.index("stage")] == pytest.approx(3.0 + 0.1 * rail)


def test_no_elbow_is_faster_than_its_levers_say(telescope: Kinematics) -> None:
    link = elbow_link(telescope)
    assert link is not None
    bound, point = np.array(lever_arms(telescope, link)), telescope.link_point(link)
    random = np.random.default_rng(1)
    for _ in range(300):
        place = random.uniform(telescope.lower, telescope.upper)
        rates = random.uniform(-1.0, 1.0, telescope.dof) * np.eye(telescope.dof)[random.integers(7)]
        (speed,) = telescope.point_speeds(place, rates, [point])
        assert speed <= bound @ np.abs(rates) * (1.0 + 1e-9)


def test_no_velocity_on_a_line_bends_more_than_its_bound(telescope: Kinematics) -> None:
    """By central differences of the tool's velocity, from its Jacobian."""
    random, points, step = np.random.default_rng(0), LinePoints(telescope), 1e-3
    for _ in range(200):
        place = random.uniform(telescope.lower, telescope.upper)
        rates = random.uniform(-0.3, 0.3, telescope.dof) * telescope.limits.velocity
        before, here, after = (
            telescope.linearise(place + sigma * rates)[2][:3] @ rates
            for sigma in (-step, 0.0, step)
        )
        bend = float(np.linalg.norm(after - 2.0 * here + before)) / step**2
        assert bend <= points.bends(rates.tolist())[0] * (1.0 + 1e-3)
