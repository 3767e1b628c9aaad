import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from openpendant.motion.errors import (
    BadArgument,
    FrameUnknown,
    NotFinite,
    Unreachable,
    WrongJointCount,
)
from openpendant.motion.ik import (
    POSITION_TOLERANCE,
    ROTATION_TOLERANCE,
    Solution,
    solve,
)
from openpendant.motion.kinematics import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.robot import robot_names, serial_robot

Array = NDArray[np.float64]

SERIAL = tuple(name for name in robot_names() if name != "stewart_classroom")
SIX_AXES = tuple(name for name in SERIAL if serial_robot(name).dof == 6)
OTHERS = tuple(name for name in SERIAL if name not in SIX_AXES)


def assert_solves(kinematics: Kinematics, solution: Solution, target: Pose, frame: str) -> None:
    kinematics.limits.check_position(solution.joint_position.tolist())
    reached = kinematics.forward(solution.joint_position, frame)
    assert reached.position_distance(target) <= POSITION_TOLERANCE
    assert reached.rotation_distance(target) <= ROTATION_TOLERANCE
    assert solution.position_error == pytest.approx(reached.position_distance(target), abs=1e-12)


def solved_share(name: str, count: int) -> float:
    """Solve poses of random joint positions, each from another random joint position."""
    kinematics = Kinematics(serial_robot(name))
    random = np.random.default_rng(1)
    solved = 0
    for _ in range(count):
        position, seed = random.uniform(kinematics.lower, kinematics.upper, (2, kinematics.dof))
        target = kinematics.forward(position)
        try:
            solution = solve(kinematics, target, seed)
        except Unreachable:
            continue
        assert_solves(kinematics, solution, target, "base")
        solved += 1
    return solved / count


@pytest.mark.parametrize("name", SIX_AXES)
def test_a_thousand_reachable_poses_of_a_six_axis_robot_are_solved(name: str) -> None:
    assert solved_share(name, 1000) >= 0.999


@pytest.mark.parametrize("name", OTHERS)
def test_reachable_poses_of_robots_with_fewer_or_more_axes_are_solved(name: str) -> None:
    assert solved_share(name, 300) >= 0.99


@pytest.mark.parametrize("name", SERIAL)
def test_a_pose_near_the_seed_is_solved_near_the_seed_without_restarts(name: str) -> None:
    kinematics = Kinematics(serial_robot(name))
    random = np.random.default_rng(2)
    seed = np.array(kinematics.robot.home_position)
    for _ in range(20):
        step = random.uniform(-0.03, 0.03, kinematics.dof)
        near = np.clip(seed + step, kinematics.lower, kinematics.upper)
        solution = solve(kinematics, kinematics.forward(near), seed)
        assert solution.restarts == 0
        assert np.abs(solution.joint_position - seed).max() < 0.5


@pytest.mark.parametrize("name", SERIAL)
def test_a_pose_with_joints_on_their_bounds_is_solved(name: str) -> None:
    kinematics = Kinematics(serial_robot(name))
    random = np.random.default_rng(3)
    for _ in range(20):
        inside = random.uniform(kinematics.lower, kinematics.upper)
        on_bound = random.random(kinematics.dof)
        position = np.where(on_bound < 0.25, kinematics.lower, inside)
        position = np.where(on_bound > 0.75, kinematics.upper, position)
        seed = position + random.uniform(-0.05, 0.05, kinematics.dof)
        target = kinematics.forward(position)
        assert_solves(kinematics, solve(kinematics, target, seed), target, "base")


@pytest.mark.parametrize("name", SIX_AXES)
def test_a_stretched_wrist_is_solved_where_closed_forms_divide_by_zero(name: str) -> None:
    kinematics = Kinematics(serial_robot(name))
    random = np.random.default_rng(4)
    for _ in range(20):
        position = random.uniform(kinematics.lower, kinematics.upper)
        position[4] = 0.0
        seed = np.clip(
            position + random.uniform(-0.02, 0.02, 6), kinematics.lower, kinematics.upper
        )
        target = kinematics.forward(position)
        assert_solves(kinematics, solve(kinematics, target, seed), target, "base")


@pytest.mark.parametrize("frame", ["base", "root"])
@pytest.mark.parametrize("name", ["ur5", "fanuc_m10ia"])
def test_the_target_is_read_in_the_frame_asked_for(name: str, frame: str) -> None:
    kinematics = Kinematics(serial_robot(name))
    home = kinematics.robot.home_position
    target = kinematics.forward(np.array(home) + 0.1, frame)
    assert_solves(kinematics, solve(kinematics, target, home, frame=frame), target, frame)


def test_the_turn_nearest_to_the_seed_is_taken_where_the_limits_allow_it() -> None:
    kinematics = Kinematics(serial_robot("ur5"))
    position = np.array(kinematics.robot.home_position)
    target = kinematics.forward(position)
    for turn in (-1.0, 0.0):
        seed = position.copy()
        seed[5] = position[5] + turn * 2.0 * math.pi + 0.2
        solution = solve(kinematics, target, seed)
        assert solution.joint_position[5] == pytest.approx(turn * 2.0 * math.pi, abs=1e-8)


def test_a_seed_beyond_the_limits_starts_at_the_bound() -> None:
    kinematics = Kinematics(serial_robot("kuka_kr5_arc"))
    target = kinematics.forward(kinematics.robot.home_position)
    solution = solve(kinematics, target, (1e300,) * 6)
    assert_solves(kinematics, solution, target, "base")


def test_the_same_question_gets_the_same_answer() -> None:
    kinematics = Kinematics(serial_robot("kuka_iiwa14"))
    random = np.random.default_rng(5)
    position, seed = random.uniform(kinematics.lower, kinematics.upper, (2, 7))
    target = kinematics.forward(position)
    answers = [solve(kinematics, target, seed, random_seed=7) for _ in range(3)]
    for first, second in pairwise(answers):
        assert first.joint_position.tolist() == second.joint_position.tolist()
        assert (first.restarts, first.iterations) == (second.restarts, second.iterations)


def test_a_pose_out_of_reach_is_refused_with_how_near_one_can_get() -> None:
    kinematics = Kinematics(serial_robot("abb_irb2400"))
    home = kinematics.robot.home_position
    target = Pose.from_values((5.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0))
    with pytest.raises(Unreachable) as refused:
        solve(kinematics, target, home, restarts=10)
    error = refused.value
    assert (error.pose, error.frame, error.restarts) == (target, "base", 10)
    assert 2.0 < error.best_position_error < 5.0
    assert 0.0 <= error.best_rotation_error <= math.pi


def test_an_orientation_the_palletiser_cannot_take_is_refused() -> None:
    kinematics = Kinematics(serial_robot("fanuc_m410ib"))
    home = kinematics.robot.home_position
    here = kinematics.forward(home)
    tilted = here.compose(Pose.from_rpy((0.0, 0.0, 0.0), (0.3, 0.0, 0.0)))
    with pytest.raises(Unreachable):
        solve(kinematics, tilted, home, restarts=5)


def test_a_pose_that_only_breaks_a_limit_is_refused_with_the_distance_left() -> None:
    kinematics = Kinematics(serial_robot("rail_kr5_arc"))
    beyond = np.array(kinematics.robot.home_position)
    beyond[0] = kinematics.upper[0] + 5.0
    with pytest.raises(Unreachable) as refused:
        solve(kinematics, kinematics.forward(beyond), kinematics.robot.home_position, restarts=5)
    assert refused.value.best_position_error > 1.0


def test_the_outer_time_cap_ends_a_search() -> None:
    kinematics = Kinematics(serial_robot("ur5"))
    target = Pose.from_values((5.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0))
    with pytest.raises(Unreachable) as refused:
        solve(kinematics, target, kinematics.robot.home_position, restarts=10_000, time_cap=0.0)
    assert refused.value.restarts <= 1


def test_a_malformed_seed_is_refused() -> None:
    kinematics = Kinematics(serial_robot("ur5"))
    target = Pose.identity()
    with pytest.raises(WrongJointCount):
        solve(kinematics, target, (0.0,) * 5)
    with pytest.raises(NotFinite):
        solve(kinematics, target, (0.0, 0.0, math.nan, 0.0, 0.0, 0.0))


def test_an_unknown_frame_is_refused() -> None:
    kinematics = Kinematics(serial_robot("ur5"))
    with pytest.raises(FrameUnknown):
        solve(kinematics, Pose.identity(), kinematics.robot.home_position, frame="world")


def test_budgets_and_tolerances_out_of_range_are_refused() -> None:
    kinematics = Kinematics(serial_robot("ur5"))
    home = kinematics.robot.home_position
    target = Pose.identity()
    with pytest.raises(BadArgument, match="restarts"):
        solve(kinematics, target, home, restarts=-1)
    with pytest.raises(BadArgument, match="iterations"):
        solve(kinematics, target, home, iterations=0)
    with pytest.raises(BadArgument, match="random_seed"):
        solve(kinematics, target, home, random_seed=-1)
    with pytest.raises(BadArgument, match="tolerance"):
        solve(kinematics, target, home, position_tolerance=0.0)
