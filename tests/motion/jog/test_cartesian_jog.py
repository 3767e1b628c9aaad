"""The parts of a tool jog's way: the elbow's speed, the path of poses, a cell's inequalities.

And a jog that goes on at one speed: what is proven once for many ticks, and its bounds. That of the
points' speeds is never below them, hardly above, and from few looks.
"""

import math
from collections.abc import Sequence
from unittest.mock import patch

import numpy as np
import pytest
from rigs.motion.jogged_robots import (
    FAST,
    REDUCED,
    UR5_BENT,
    model,
    random_place,
    random_press,
    robot,
)
from rigs.motion.loaded_robots import SERIAL, arm, load_robot
from rigs.motion.loaded_robots import arm as arm_of
from rigs.motion.robot_families import one_of_each_family

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.description.robot import SerialRobot
from openpendant.motion.jog import JogCaps, Jogger, JogSlowdown, JogTarget, ToolJog
from openpendant.motion.jog.cartesian_jog import CartesianJogMotion
from openpendant.motion.jog.line_speed_bounds import LinePoints, LineSpeeds, lever_arms
from openpendant.motion.jog.path_node import (
    SPEED_RESERVE,
    PathNode,
    is_even,
    slowed,
    sped_up,
    speed_bounds,
)
from openpendant.motion.jog.tool_path import JogTwist, ToolPath, turned
from openpendant.motion.kinematics.pinocchio_model import greatest_travel
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.orientation import rotation_of_vector
from openpendant.motion.pose import Pose
from openpendant.motion.trajectory.point_speed import elbow_link


@pytest.mark.parametrize("name", SERIAL)
def test_the_speeds_of_elbow_and_tool_are_those_of_differences(name: str) -> None:
    kinematics = arm_of(name)
    random = np.random.default_rng(5)
    arm = model(name).arm
    elbow = elbow_link(kinematics)
    for link in kinematics.robot.links:
        point = kinematics.link_point(link)
        place = np.array(random_place(name, random))
        velocity = random.uniform(-1.0, 1.0, len(place))
        ahead, behind = (
            kinematics.forward(place + sign * 1e-6 * velocity, link=link).position
            for sign in (1.0, -1.0)
        )
        speed = math.dist(ahead, behind) / 2e-6
        (told,) = kinematics.point_speeds(place, velocity, [point])
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
    twist = JogTwist(np.array([0.0, 0.2, 0.0]), np.zeros(3))
    path = ToolPath(np.eye(3), np.zeros(3), twist, before, 0.5)
    for step in range(1, 11):
        path = path.advanced(min(0.05, path.left))
        share = step / 10.0
        assert path.point[0] == pytest.approx(0.1 * (share - share * share / 2.0))
        assert path.point[1] == pytest.approx(0.1 * share * share / 2.0)
    assert path.left == math.inf
    assert path.twist().tolist() == [0.0, 0.2, 0.0, 0.0, 0.0, 0.0]


def cell(begin: float = 0.6, end: float = 0.7) -> PathNode:
    first, last = (
        PathNode(sigma, [math.sin(sigma)], [math.cos(sigma)], np.zeros(6), 1.0)
        for sigma in (begin, end)
    )
    first.lead_to(last, [2.0])
    return first


def test_a_cell_meets_both_ends_and_stays_near_the_curve() -> None:
    node = cell()
    for ahead in np.linspace(0.0, 0.1, 11).tolist():
        position, rate = node.state(ahead)
        assert position[0] == pytest.approx(math.sin(0.6 + ahead), abs=1e-6)
        assert rate[0] == pytest.approx(math.cos(0.6 + ahead), abs=1e-4)


def test_a_joint_that_turns_round_within_a_cell_is_found() -> None:
    assert cell(1.5, 1.7).furthest(0) == pytest.approx(1.0, abs=1e-5)
    assert cell().furthest(0) is None


def test_slowing_and_speeding_up_use_the_whole_acceleration_and_no_more() -> None:
    node = cell()
    for ends in ((slowed(node.rows, 0.5, 100.0), 0.5), (0.5, sped_up(node.rows, 0.5, 100.0))):
        worst = max(abs(a * ends[0] + b * ends[1]) / limit for a, b, limit in node.rows)
        assert worst == pytest.approx(1.0, abs=1e-6)
    assert slowed(node.rows, 0.5, 0.3) == 0.3
    # From so slow a start so fast an end cannot be reached; the start stays allowed.
    assert slowed(node.rows, 50.0, 0.3) == 0.3


def way_of(
    name: str, start: list[float], caps: JogCaps, presses: list[JogTarget]
) -> list[tuple[list[float], list[float], float, JogSlowdown | None]]:
    """Return all that is told of a chain of presses, in ticks of two lengths."""
    jogger = Jogger(model(name), start, caps)
    told = []
    for press in presses:
        jogger.aim(press)
        for tick in range(60):
            step = jogger.step(0.01 if tick % 7 else 0.02)
            told.append((step.position, step.velocity, step.scale, step.reason))
    return told


@pytest.mark.parametrize("name", ["ur5", "kuka_kr5_arc", "kuka_iiwa14"])
def test_no_set_point_differs_without_a_look(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(11)
    went_on: list[bool] = []
    goes_on = CartesianJogMotion._goes_on

    def counted(motion: CartesianJogMotion, dt: float) -> bool:
        went_on.append(goes_on(motion, dt))
        return went_on[-1]

    for trial in range(6):
        start = random_place(name, random)
        caps = REDUCED if trial % 2 else FAST
        rates = 0.3 * np.eye(6)[trial]
        line = ToolJog(tuple(rates[:3]), tuple(rates[3:]))
        presses = [line, random_press(len(start), random), ToolJog((0.1, 0.0, 0.2))]
        with monkeypatch.context() as patch:
            patch.setattr(CartesianJogMotion, "_goes_on", counted)
            proven = way_of(name, start, caps, presses)
            patch.setattr(CartesianJogMotion, "_goes_on", lambda motion, dt: False)
            assert proven == way_of(name, start, caps, presses)
    assert sum(went_on) > 100


def test_most_ticks_of_a_line_go_on_without_a_look() -> None:
    jogger = Jogger(model("ur5"), UR5_BENT, REDUCED)
    jogger.aim(ToolJog((0.0, 0.3, 0.0)))
    allowed = CartesianJogMotion._allowed
    with patch.object(CartesianJogMotion, "_allowed", autospec=True, side_effect=allowed) as looked:
        for _ in range(100):
            jogger.step(0.01)
    assert looked.call_count < 50


def test_at_a_steady_speed_a_cell_keeps_to_the_bounds_of_every_tick() -> None:
    random = np.random.default_rng(2)
    speeds, accelerations = (1.0, 2.0), (3.0, 1.5)
    far, none = (9.0, 9.0), (False, False)
    limits = JointLimits(("a", "b"), (-9.0, -9.0), far, speeds, accelerations, none)
    tight = 0
    for _ in range(300):
        ways = ((random.normal(size=2) * 0.05, random.normal(size=2)) for _ in range(2))
        first, last = (
            PathNode(sigma, place.tolist(), rate.tolist(), np.zeros(6), 1.0)
            for sigma, (place, rate) in zip((0.0, 0.1), ways, strict=True)
        )
        first.lead_to(last, accelerations)
        first.bound_steady([SPEED_RESERVE * each for each in speeds], accelerations)
        speed = math.sqrt(first.steady)
        for begin, end in (random.uniform(0.0, 0.1, 2) for _ in range(5)):
            dt = abs(end - begin) / speed
            before, after = (first.state(place) for place in sorted((begin, end)))
            states = [(place, [each * speed for each in rate]) for place, rate in (before, after)]
            least, most = speed_bounds(limits, after[1], states[0][1], dt)
            assert least * (1.0 - 1e-7) <= speed <= most * (1.0 + 1e-7)
            assert is_even(limits, states[0], states[1], dt)
            tight += speed > 0.9 * most
    assert tight > 20


@pytest.mark.parametrize("name", one_of_each_family(SERIAL))
def test_no_elbow_is_faster_than_its_levers_say(name: str) -> None:
    kinematics = arm_of(name)
    random = np.random.default_rng(4)
    for link in (elbow_link(kinematics), kinematics.robot.tool_link):
        if link is None:
            continue
        bound = np.array(lever_arms(kinematics, link))
        point = kinematics.link_point(link)
        for trial in range(200):
            place = np.array(random_place(name, random))
            velocity = random.uniform(-1.0, 1.0, len(place))
            if trial % 2:
                velocity *= np.eye(len(place))[trial % len(place)]
            (speed,) = kinematics.point_speeds(place, velocity, [point])
            assert speed <= float(bound @ np.abs(velocity)) + 1e-9


def test_an_elbow_that_may_be_fast_is_looked_at() -> None:
    arm = model("ur5").arm
    velocity = [0.1, -0.2, 0.3, 0.0, 0.0, 0.0]
    speed = arm.elbow_speed(UR5_BENT, velocity)
    bound = arm.elbow_speed(UR5_BENT, velocity, 1.0)
    assert speed < bound < 1.0
    assert arm.elbow_speed(UR5_BENT, velocity, 0.999 * bound) == speed


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
