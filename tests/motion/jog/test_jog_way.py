"""The parts of a tool jog's way: the elbow's speed, the path of poses, a cell's inequalities."""

import math

import numpy as np
import pytest
from rigs.motion.jogged_robots import model, random_place, robot

from openpendant.motion.description.robot import robot_names
from openpendant.motion.jog.path_node import PathNode, slowed, sped_up
from openpendant.motion.jog.tool_path import JogTwist, ToolPath, turned
from openpendant.motion.orientation import rotation_of_vector
from openpendant.motion.paths.mechanism import SerialMechanism
from openpendant.motion.trajectory.point_speed import elbow_link

SERIAL = [name for name in robot_names() if isinstance(robot(name), SerialMechanism)]


@pytest.mark.parametrize("name", SERIAL)
def test_the_speeds_of_elbow_and_tool_are_those_of_differences(name: str) -> None:
    found = robot(name)
    assert isinstance(found, SerialMechanism)
    random = np.random.default_rng(5)
    arm = model(name).arm
    elbow = elbow_link(found.kinematics)
    for link in found.kinematics.robot.links:
        point = found.kinematics.link_point(link)
        place = np.array(random_place(name, random))
        velocity = random.uniform(-1.0, 1.0, len(place))
        ahead, behind = (
            found.kinematics.forward(place + sign * 1e-6 * velocity, link=link).position
            for sign in (1.0, -1.0)
        )
        speed = math.dist(ahead, behind) / 2e-6
        (told,) = found.kinematics.point_speeds(place, velocity, [point])
        assert told == pytest.approx(speed, abs=1e-7)
        if link == elbow:
            assert arm.elbow_speed(place.tolist(), velocity.tolist()) == told
            assert arm.point_speeds(place.tolist(), velocity.tolist())[1] == told
    # The last of the links is the tool's.
    assert arm.point_speeds(place.tolist(), velocity.tolist())[0] == told


def test_a_rotation_is_that_of_its_vector() -> None:
    random = np.random.default_rng(0)
    for size in (0.0, 1e-9, 1e-5, 1e-3, 1.0, 3.0):
        vector = size * random.normal(size=3)
        assert np.abs(turned(vector) - rotation_of_vector(vector)).max() < 1e-14


@pytest.mark.parametrize("of_tool", [False, True])
def test_many_steps_and_one_lead_to_the_same_pose(of_tool: bool) -> None:
    twist = JogTwist(np.array([0.1, -0.2, 0.05]), np.array([0.3, 0.4, -0.8]), of_tool)
    begin = ToolPath(turned(np.array([0.2, 0.5, 1.0])), np.array([0.4, 0.0, 0.6]), twist)
    path = begin
    for _ in range(1000):
        path = path.advanced(0.002)
    once = begin.advanced(2.0)
    assert np.abs(path.rotation - once.rotation).max() < 1e-12
    assert np.abs(path.point - once.point).max() < 1e-12


def test_a_bend_between_two_lines_is_a_parabola_that_ends_in_the_new_one() -> None:
    before = np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    path = ToolPath(
        np.eye(3), np.zeros(3), JogTwist(np.array([0.0, 0.2, 0.0]), np.zeros(3)), before, 0.5
    )
    for step in range(1, 11):
        path = path.advanced(min(0.05, path.left))
        share = step / 10.0
        assert path.point[0] == pytest.approx(0.1 * (share - share * share / 2.0))
        assert path.point[1] == pytest.approx(0.1 * share * share / 2.0)
    assert path.left == math.inf
    assert path.twist().tolist() == [0.0, 0.2, 0.0, 0.0, 0.0, 0.0]


def cell(limit: float = 2.0) -> PathNode:
    first, last = (
        PathNode(sigma, [math.sin(sigma)], [math.cos(sigma)], np.zeros(6), 1.0)
        for sigma in (0.6, 0.7)
    )
    first.lead_to(last, [limit])
    return first


def test_a_cell_meets_both_ends_and_stays_near_the_curve() -> None:
    node = cell()
    for ahead in np.linspace(0.0, 0.1, 11).tolist():
        position, rate = node.state(ahead)
        assert position[0] == pytest.approx(math.sin(0.6 + ahead), abs=1e-6)
        assert rate[0] == pytest.approx(math.cos(0.6 + ahead), abs=1e-4)


def test_a_joint_that_turns_round_within_a_cell_is_found() -> None:
    first, last = (
        PathNode(sigma, [math.sin(sigma)], [math.cos(sigma)], np.zeros(6), 1.0)
        for sigma in (1.5, 1.7)
    )
    first.lead_to(last, [2.0])
    assert first.furthest(0) == pytest.approx(1.0, abs=1e-5)
    assert cell().furthest(0) is None


def test_slowing_and_speeding_up_use_the_whole_acceleration_and_no_more() -> None:
    node = cell()
    for ends in ((slowed(node.rows, 0.5, 100.0), 0.5), (0.5, sped_up(node.rows, 0.5, 100.0))):
        worst = max(abs(a * ends[0] + b * ends[1]) / limit for a, b, limit in node.rows)
        assert worst == pytest.approx(1.0, abs=1e-6)
    assert slowed(node.rows, 0.5, 0.3) == 0.3
    # From so slow a start so fast an end cannot be reached; the start stays allowed.
    assert slowed(node.rows, 50.0, 0.3) == 0.3
