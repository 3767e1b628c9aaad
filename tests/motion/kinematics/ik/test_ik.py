import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from rigs.data.example_counts import counts
from rigs.motion.loaded_robots import SERIAL, arm, serial_robot
from rigs.motion.nearness import assert_near

from openpendant.motion import errors
from openpendant.motion.kinematics.closed_form import closed_form
from openpendant.motion.kinematics.ik.configuration import (
    Configuration,
    Elbow,
    Shoulder,
    Wrist,
    configuration_of,
)
from openpendant.motion.kinematics.ik.ik import (
    POSITION_TOLERANCE,
    ROTATION_TOLERANCE,
    Solution,
    solve,
    solve_all,
)
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose

SIX_AXES = tuple(name for name in SERIAL if serial_robot(name).dof == 6)
OTHERS = tuple(name for name in SERIAL if name not in SIX_AXES)


def assert_solves(kinematics: Kinematics, solution: Solution, target: Pose, frame: str) -> None:
    kinematics.limits.check_position(solution.joint_position.tolist())
    reached = kinematics.forward(solution.joint_position, frame)
    assert reached.position_distance(target) <= POSITION_TOLERANCE
    assert reached.rotation_distance(target) <= ROTATION_TOLERANCE
    assert solution.position_error == pytest.approx(reached.position_distance(target), abs=1e-12)


def solved_share(kinematics: Kinematics, count: int, chance: int = 1) -> float:
    """Solve poses of random joint positions, each from another random joint position."""
    random = np.random.default_rng(chance)
    solved = 0
    for _ in range(count):
        position, seed = random.uniform(kinematics.lower, kinematics.upper, (2, kinematics.dof))
        target = kinematics.forward(position)
        try:
            solution = solve(kinematics, target, seed)
        except errors.PoseUnreachable:
            continue
        assert_solves(kinematics, solution, target, "base")
        solved += 1
    return solved / count


@pytest.mark.parametrize("count", counts(40, 1000))
@pytest.mark.parametrize("name", SIX_AXES)
def test_every_reachable_pose_of_a_six_axis_robot_is_solved(name: str, count: int) -> None:
    assert solved_share(arm(name), count) == 1.0


ALL_OF_50 = [(50, 1.0), pytest.param(1000, 0.999, marks=pytest.mark.soak)]
"""How many poses are tried, and the least share that is solved."""


@pytest.mark.parametrize(("count", "share"), ALL_OF_50)
@pytest.mark.parametrize("name", OTHERS)
def test_poses_of_fewer_or_more_axes_are_solved(name: str, count: int, share: float) -> None:
    assert solved_share(arm(name), count) >= share


@pytest.mark.parametrize("count", counts(8, 200))
@pytest.mark.parametrize("name", SERIAL)
def test_a_pose_near_the_seed_is_solved_without_restart(kinematics: Kinematics, count: int) -> None:
    random = np.random.default_rng(2)
    seed = np.array(kinematics.robot.home_position)
    for _ in range(count):
        step = random.uniform(-0.03, 0.03, kinematics.dof)
        near = np.clip(seed + step, kinematics.lower, kinematics.upper)
        solution = solve(kinematics, kinematics.forward(near), seed)
        assert solution.restarts == 0
        assert np.abs(solution.joint_position - seed).max() < 0.5


@pytest.mark.parametrize("count", counts(8, 200))
@pytest.mark.parametrize("name", SERIAL)
def test_a_pose_with_joints_on_their_bounds_is_solved(kinematics: Kinematics, count: int) -> None:
    random = np.random.default_rng(3)
    for _ in range(count):
        inside = random.uniform(kinematics.lower, kinematics.upper)
        on_bound = random.random(kinematics.dof)
        position = np.where(on_bound < 0.25, kinematics.lower, inside)
        position = np.where(on_bound > 0.75, kinematics.upper, position)
        seed = position + random.uniform(-0.05, 0.05, kinematics.dof)
        target = kinematics.forward(position)
        assert_solves(kinematics, solve(kinematics, target, seed), target, "base")


@pytest.mark.parametrize(
    ("position", "seed"),
    [
        (
            (-2.9668, 1.91, -2.9668, 2.0942, -2.96, -2.0942, 3.0541),
            (-2.99, 1.87, -3.01, 2.06, -2.97, -2.12, 3.07),
        ),
        (
            (0.13, -2.0942, -2.9668, -0.86, -2.9668, -2.0942, 3.0541),
            (0.17, -2.08, -2.95, -0.9, -3.01, -2.12, 3.05),
        ),
    ],
    ids=["four on a bound", "five on a bound"],
)
def test_a_pose_in_a_corner_is_solved(position: tuple[float, ...], seed: tuple[float, ...]) -> None:
    kinematics = arm("kuka_iiwa14")
    target = kinematics.forward(position)
    assert_solves(kinematics, solve(kinematics, target, seed), target, "base")


@pytest.mark.parametrize("frame", ["base", "root"])
@pytest.mark.parametrize("name", ["ur5", "fanuc_m10ia"])
def test_the_target_is_read_in_the_frame_asked_for(kinematics: Kinematics, frame: str) -> None:
    home = kinematics.robot.home_position
    target = kinematics.forward(np.array(home) + 0.1, frame)
    assert_solves(kinematics, solve(kinematics, target, home, frame=frame), target, frame)


def test_the_turn_nearest_to_the_seed_is_taken_where_the_limits_allow_it() -> None:
    kinematics = arm("ur5")
    position = np.array(kinematics.robot.home_position)
    target = kinematics.forward(position)
    for turn in (-1.0, 0.0):
        seed = position.copy()
        seed[5] = position[5] + turn * 2.0 * math.pi + 0.2
        solution = solve(kinematics, target, seed)
        assert solution.joint_position[5] == pytest.approx(turn * 2.0 * math.pi, abs=1e-8)


def test_a_seed_beyond_the_limits_starts_at_the_bound() -> None:
    kinematics = arm("kuka_kr5_arc")
    target = kinematics.forward(kinematics.robot.home_position)
    solution = solve(kinematics, target, (1e300,) * 6)
    assert_solves(kinematics, solution, target, "base")


def test_the_same_question_gets_the_same_answer() -> None:
    kinematics = arm("kuka_iiwa14")
    random = np.random.default_rng(5)
    position, seed = random.uniform(kinematics.lower, kinematics.upper, (2, 7))
    target = kinematics.forward(position)
    answers = [solve(kinematics, target, seed, random_seed=7) for _ in range(3)]
    for first, second in pairwise(answers):
        assert first.joint_position.tolist() == second.joint_position.tolist()
        assert (first.restarts, first.iterations) == (second.restarts, second.iterations)


def test_a_pose_out_of_reach_is_refused_with_how_near_one_can_get() -> None:
    kinematics = arm("abb_irb2400")
    home = kinematics.robot.home_position
    target = Pose.from_values((5.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0))
    with pytest.raises(errors.PoseUnreachable) as refused:
        solve(kinematics, target, home)
    error = refused.value
    assert (error.position, error.frame, error.restarts) == (tuple(target.position), "base", 0)
    assert 2.0 < error.best_position_error < 5.0
    assert 0.0 <= error.best_rotation_error <= math.pi


@pytest.mark.parametrize("name", ["fanuc_m410ib", "mitsubishi_rh6frh5520"])
def test_a_tilt_that_four_axes_cannot_take_is_refused_with_it(kinematics: Kinematics) -> None:
    home = kinematics.robot.home_position
    here = kinematics.forward(home)
    tilted = here.compose(Pose.from_rpy((0.0, 0.0, 0.0), (0.3, 0.0, 0.0)))
    with pytest.raises(errors.PoseUnreachable) as refused:
        solve(kinematics, tilted, home)
    assert refused.value.best_position_error < 1e-6
    assert refused.value.best_rotation_error == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize("name", ["abb_irb2400", "fanuc_m10ia", "ur5"])
def test_a_pose_beyond_a_limit_names_joint_value_and_limit(kinematics: Kinematics) -> None:
    robot = kinematics.robot
    beyond = np.array(robot.home_position)
    # Every branch needs joint 6 at one of two angles half a turn apart; a narrow range has neither.
    bounds = {"lower": beyond[5] + 1.0, "upper": beyond[5] + 1.1}
    joints = tuple(
        joint.model_copy(update=bounds) if joint.name == robot.limits.names[5] else joint
        for joint in robot.joints
    )
    narrow = robot.model_copy(update={"joints": joints})
    held = Kinematics(type(robot).model_construct(**dict(narrow)))
    with pytest.raises(errors.OutOfRange) as refused:
        solve(held, kinematics.forward(beyond), beyond)
    assert refused.value.joint == robot.limits.names[5]
    assert (refused.value.lower, refused.value.upper) == (beyond[5] + 1.0, beyond[5] + 1.1)
    assert not refused.value.lower <= refused.value.value <= refused.value.upper


def test_a_pose_that_only_breaks_a_limit_is_refused_with_the_distance_left() -> None:
    kinematics = arm("rail_kr5_arc")
    beyond = np.array(kinematics.robot.home_position)
    beyond[0] = kinematics.upper[0] + 5.0
    with pytest.raises(errors.PoseUnreachable) as refused:
        solve(kinematics, kinematics.forward(beyond), kinematics.robot.home_position, restarts=5)
    assert refused.value.best_position_error > 1.0


def test_the_outer_time_cap_ends_a_search() -> None:
    kinematics = arm("ur5")
    target = Pose.from_values((5.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0))
    with pytest.raises(errors.PoseUnreachable) as refused:
        solve(kinematics, target, kinematics.robot.home_position, restarts=10_000, time_cap=0.0)
    assert refused.value.restarts <= 1


TURNED_TWICE = Configuration(Shoulder.FRONT, Elbow.UP, Wrist.FLIP, (0, 0))


@pytest.mark.parametrize(
    ("name", "given", "error", "words"),
    [
        ("ur5", {"seed": (0.0,) * 5}, errors.WrongJointCount, "5 joint values"),
        ("ur5", {"seed": (0.0, 0.0, math.nan, 0.0, 0.0, 0.0)}, errors.NotFinite, "element 2"),
        ("ur5", {"frame": "world"}, errors.FrameUnknown, "world"),
        ("ur5", {"restarts": -1}, errors.BadArgument, "restarts"),
        ("ur5", {"iterations": 0}, errors.BadArgument, "iterations"),
        ("ur5", {"random_seed": -1}, errors.BadArgument, "random_seed"),
        ("ur5", {"position_tolerance": 0.0}, errors.BadArgument, "tolerance"),
        ("ur5", {"time_cap": math.nan}, errors.BadArgument, "time_cap"),
        ("ur5", {"configuration": TURNED_TWICE}, errors.WrongJointCount, "2 joint values"),
        ("kuka_iiwa14", {"configuration": TURNED_TWICE}, errors.BadArgument, "configuration"),
    ],
)
def test_a_malformed_question_is_refused(
    kinematics: Kinematics, given: dict[str, Any], error: type[Exception], words: str
) -> None:
    asked = {"seed": kinematics.robot.home_position} | given
    with pytest.raises(error, match=words):
        solve(kinematics, Pose.identity(), **asked)


@pytest.mark.parametrize("name", ["ur5", "abb_irb2400", "fanuc_m10ia"])
def test_all_answers_are_right_different_and_nearest_first(kinematics: Kinematics) -> None:
    random = np.random.default_rng(6)
    for _ in range(5):
        position, seed = random.uniform(kinematics.lower, kinematics.upper, (2, 6))
        target = kinematics.forward(position)
        answers = solve_all(kinematics, target, seed)
        for answer in answers:
            assert_solves(kinematics, answer, target, "base")
        places = np.array([answer.joint_position for answer in answers])
        for index, place in enumerate(places[1:], start=1):
            assert np.abs(places[:index] - place).max(axis=1).min() > 1e-6
        assert np.abs(places - position).max(axis=1).min() <= 1e-6
        nearest = solve(kinematics, target, seed)
        assert_near(answers[0].joint_position, nearest.joint_position, 1e-09)


def test_a_joint_with_two_turns_of_range_gives_each_branch_in_all_of_them() -> None:
    kinematics = arm("ur5")
    position = np.array([0.3, -1.2, 1.1, -0.8, 0.9, 0.4])
    answers = solve_all(kinematics, kinematics.forward(position), position)
    # Five joints reach two full turns and the elbow one, so eight branches become 8 · 2⁵.
    assert len(answers) == 256
    assert len({answer.configuration for answer in answers}) == 256


@pytest.mark.parametrize("name", ["ur5", "abb_irb2400", "fanuc_m10ia", "rail_kr5_arc"])
def test_an_answer_asked_for_by_configuration_has_it(kinematics: Kinematics) -> None:
    random = np.random.default_rng(7)
    for _ in range(10):
        position, seed = random.uniform(kinematics.lower, kinematics.upper, (2, kinematics.dof))
        target = kinematics.forward(position)
        wanted = configuration_of(kinematics, position)
        seed[0] = position[0]  # a linear axis stays, so that the same branch is asked for
        solution = solve(kinematics, target, seed, configuration=wanted)
        assert solution.configuration == wanted
        assert_near(solution.joint_position, position, 1e-07)


def test_a_configuration_outside_the_limits_is_refused_though_others_fit() -> None:
    kinematics = arm("abb_irb2400")
    home = kinematics.robot.home_position
    behind = Configuration(Shoulder.BACK, Elbow.UP, Wrist.NO_FLIP)
    with pytest.raises(errors.OutOfRange):
        solve(kinematics, kinematics.forward(home), home, configuration=behind)


def test_a_configuration_out_of_reach_is_refused_though_others_reach() -> None:
    kinematics = arm("kuka_kr5_arc")
    # Nearly stretched forwards: backwards over its own base the arm would be too short.
    stretched = np.array([0.0, -0.05, 0.3, 0.0, 0.5, 0.0])
    behind = Configuration(Shoulder.BACK, Elbow.UP, Wrist.NO_FLIP)
    target = kinematics.forward(stretched)
    assert_solves(kinematics, solve(kinematics, target, stretched), target, "base")
    with pytest.raises(errors.PoseUnreachable) as refused:
        solve(kinematics, target, stretched, configuration=behind)
    assert refused.value.best_position_error > 0.1


def offset_wrist() -> Kinematics:
    """An arm like the IRB 2400 whose axis 5 passes axis 4 by 60 mm: no closed form."""
    robot = serial_robot("abb_irb2400")
    joints = list(robot.joints)
    fifth = next(index for index, joint in enumerate(joints) if joint.name == "joint_5")
    origin = joints[fifth].origin
    moved = origin.model_copy(update={"xyz": (origin.xyz[0], origin.xyz[1] + 0.06, 0.04)})
    joints[fifth] = joints[fifth].model_copy(update={"origin": moved})
    changed = robot.model_copy(update={"joints": tuple(joints)})
    return Kinematics(type(robot).model_construct(**dict(changed)))


@pytest.mark.parametrize(("count", "share"), ALL_OF_50)
def test_an_arm_with_an_offset_wrist_is_solved_by_search(count: int, share: float) -> None:
    kinematics = offset_wrist()
    assert closed_form(kinematics) is None
    assert solved_share(kinematics, count, chance=15) >= share


@pytest.mark.parametrize("name", ["kuka_iiwa14", "mitsubishi_rh6frh5520", "rail_kr5_arc"])
def test_all_answers_of_a_robot_with_a_search_are_right(kinematics: Kinematics) -> None:
    random = np.random.default_rng(8)
    position, seed = random.uniform(kinematics.lower, kinematics.upper, (2, kinematics.dof))
    target = kinematics.forward(position)
    answers = solve_all(kinematics, target, seed, restarts=10)
    assert answers
    for answer in answers:
        assert_solves(kinematics, answer, target, "base")


def test_a_spare_joint_tends_to_the_middle_of_its_range() -> None:
    kinematics = arm("kuka_iiwa14")
    random = np.random.default_rng(9)
    shares = []
    for _ in range(40):
        position, seed = random.uniform(kinematics.lower, kinematics.upper, (2, 7))
        solution = solve(kinematics, kinematics.forward(position), seed)
        shares.append(np.abs(solution.joint_position / kinematics.upper).mean())
    # Uniform positions use half of their range on the average.
    assert np.mean(shares) < 0.44


def test_a_spare_joint_stays_where_it_is_when_the_target_is_near() -> None:
    kinematics = arm("kuka_iiwa14")
    seed = np.array([1.5, 1.0, -1.2, 1.3, 2.0, -1.0, 0.4])
    solution = solve(kinematics, kinematics.forward(seed), seed)
    assert_near(solution.joint_position, seed, 1e-09)
