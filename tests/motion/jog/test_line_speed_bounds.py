"""The bound of the points' speeds along a line: never below them, hardly above, from few looks.

And how fast joints can move the elbow, on an arm that grows by a slide which follows its rail.
"""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from rigs.motion.jogged_robots import UR5_BENT, model, random_place, robot
from rigs.motion.loaded_robots import arm, load_robot

from openpendant.motion.description.robot import SerialRobot
from openpendant.motion.jog.line_speed_bounds import LinePoints, LineSpeeds, lever_arms
from openpendant.motion.kinematics.pinocchio_model import greatest_travel
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.trajectory.point_speed import elbow_link

LIMIT = 0.25
ROBOTS = ["ur5", "abb_irb120", "abb_irb4400l30", "mitsubishi_rh6frh5520", "kuka_iiwa14"]


class CountedPoints(LinePoints):
    """Counts the looks."""

    looks = 0

    def speeds(self, position: Sequence[float], rates: Sequence[float]) -> list[float]:
        self.looks += 1
        return super().speeds(position, rates)


def random_line(name: str, random: np.random.Generator) -> tuple[list[float], list[float]]:
    """Return a place and rates, up to the joints' speeds, of slow jogs and of fast ones."""
    dof = robot(name).limits.dof
    shares = random.uniform(-1.0, 1.0, dof) * random.choice((0.05, 0.3, 1.0))
    rates: list[float] = (shares * robot(name).limits.velocity).tolist()
    return random_place(name, random), rates


def place_on(line: tuple[list[float], list[float]], sigma: float) -> list[float]:
    return [start + sigma * rate for start, rate in zip(*line, strict=True)]


def way_inside(name: str, line: tuple[list[float], list[float]]) -> float:
    """Return how far a line stays in the ranges, but not for ever."""
    limits = robot(name).limits
    joints = zip(*line, limits.lower, limits.upper, strict=True)
    return min(1.0, *(((u if r > 0.0 else lo) - q) / r for q, r, lo, u in joints if r))


@pytest.mark.parametrize("name", ROBOTS)
def test_no_place_of_a_line_is_faster_than_the_bound_nor_much_slower(name: str) -> None:
    """By forward chain, at places between the looks; promise 12."""
    random = np.random.default_rng(1)
    points = LinePoints(arm(name), Pose(np.array((0.02, -0.03, 0.15)), np.eye(4)[3]))
    for _ in range(12):
        line = random_line(name, random)
        until = way_inside(name, line)
        speeds = LineSpeeds(points, line, until, LIMIT)
        for sigma in np.sort(random.uniform(0.0, until, 40)).tolist():
            bound, point = speeds.greatest(sigma, 1.0, 0.0)
            true = points.speeds(place_on(line, sigma), line[1])
            assert max(true) <= bound * (1.0 + 1e-9)
            assert bound - true[point] <= 0.03 * max(bound, LIMIT)


@pytest.mark.parametrize("name", ROBOTS)
def test_no_place_of_a_stop_is_faster_than_its_bound(name: str) -> None:
    random = np.random.default_rng(2)
    points = LinePoints(arm(name))
    for _ in range(12):
        line = random_line(name, random)
        until = way_inside(name, line)
        speeds = LineSpeeds(points, line, until, LIMIT)
        for start in np.sort(random.uniform(0.0, 0.7 * until, 4)).tolist():
            way, share = random.uniform(0.0, until - start), random.uniform()
            bound, _ = speeds.greatest(start, share, way)
            for p in np.linspace(0.0, 1.0, 40).tolist():
                scaled = share * math.sqrt(1.0 - p)
                true = points.speeds(place_on(line, start + p * way), line[1])
                assert scaled * max(true) <= bound * (1.0 + 1e-9)


class FasterPoints(LinePoints):
    """A tool whose speed grows evenly along the first joint's way."""

    def speeds(self, position: Sequence[float], rates: Sequence[float]) -> list[float]:
        return [0.1 + position[0], 0.05]

    def bends(self, rates: Sequence[float]) -> list[float]:
        return [0.0, 0.0]


@pytest.mark.parametrize("way", [0.9, 1.7, 2.6])
def test_a_stop_in_which_a_point_gets_faster_counts_where_it_is_fastest(way: float) -> None:
    """In the first cell, in the second and in the third."""
    line = ([0.0] * 6, [1.0] + [0.0] * 5)
    speeds = LineSpeeds(FasterPoints(arm("ur5")), line, 5.0, LIMIT)
    places = np.linspace(0.0, 1.0, 20001)
    true = 0.5 * (np.sqrt(1.0 - places) * (0.1 + way * places)).max()
    found, which = speeds.greatest(0.0, 0.5, way)
    assert found == pytest.approx(true, rel=1e-6)
    assert which == 0


def test_a_quick_answer_is_a_bound_too() -> None:
    line = (list(UR5_BENT), [0.1, -0.05, 0.05, 0.1, 0.0, 0.1])
    points = LinePoints(arm("ur5"))
    exact, _ = LineSpeeds(points, line, 1.0, LIMIT).greatest(0.01, 0.8, 0.02)
    quick, _ = LineSpeeds(points, line, 1.0, LIMIT).greatest(0.01, 0.8, 0.02, LIMIT)
    assert exact <= quick <= LIMIT


def test_one_look_stands_for_several_ticks() -> None:
    points = CountedPoints(arm("ur5"))
    line = (list(UR5_BENT), [0.2] * 6)
    speeds = LineSpeeds(points, line, 1.0, LIMIT)
    for tick in range(60):
        speeds.greatest(0.01 * tick, 1.0, 0.01)
    assert points.looks <= 60 / 5


def test_one_joint_alone_is_looked_at_but_once() -> None:
    points = CountedPoints(arm("ur5"))
    line = (list(UR5_BENT), [0.0, 0.4, 0.0, 0.0, 0.0, 0.0])
    speeds = LineSpeeds(points, line, 1.0, LIMIT)
    found = {round(speeds.greatest(0.01 * tick, 1.0, 0.01)[0], 9) for tick in range(90)}
    assert found == {round(max(points.speeds(*line)), 9)}
    assert points.looks == 3  # at both ends of the line, and just now


def test_a_coupled_joint_bends_the_way_of_another() -> None:
    """The IRB 4400 turns two axes of its model with the key of one joint."""
    assert min(LinePoints(arm("abb_irb4400l30")).bends([0.0, 0.5, 0.0, 0.0, 0.0, 0.0])) > 0.0
    assert LinePoints(arm("ur5")).bends([0.0, 0.5, 0.0, 0.0, 0.0, 0.0]) == [0.0, 0.0]


def test_a_platform_has_no_such_points() -> None:
    assert model("stewart_classroom").line_points is None


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


def test_no_elbow_on_a_growing_arm_is_faster_than_its_levers_say(telescope: Kinematics) -> None:
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
