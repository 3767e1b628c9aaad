import math

import numpy as np
import pytest
from rigs.motion.loaded_robots import load_robot
from rigs.motion.stewart_poses import PLATFORM, platform_robot, pose_of_shares

from openpendant.motion import errors
from openpendant.motion.description.robot import robot_names
from openpendant.motion.orientation import rotation_of_vector
from openpendant.motion.paths import segments as kinds
from openpendant.motion.paths.mechanism import Mechanism, mechanism
from openpendant.motion.pose import Pose
from openpendant.motion.timing.parameterization import time_legs, time_path
from openpendant.motion.trajectory.certificate import certify

NAMES = ["ur5", "abb_irb2400", "stewart_classroom"]


@pytest.fixture(params=NAMES)
def arm(request: pytest.FixtureRequest) -> Mechanism:
    return mechanism(load_robot(request.param))


def lifted(arm: Mechanism, z: float, turn: float = 0.05) -> Pose:
    home = arm.forward(arm.home_position)
    position = home.position + np.array([0.0, 0.0, z])
    return Pose.from_matrix(
        rotation_of_vector(np.array([0.0, 0.0, turn])) @ home.rotation, position
    )


def test_every_robot_is_a_mechanism() -> None:
    for name in robot_names():
        arm = mechanism(load_robot(name))
        assert arm.jacobian(arm.home_position).shape == (6, arm.limits.dof)


def test_what_solve_finds_forward_confirms(arm: Mechanism) -> None:
    target = lifted(arm, -0.01)
    solution = arm.solve(target, arm.home_position)
    found = arm.forward(solution.joint_position)
    assert found.position_distance(target) <= 1e-5
    assert solution.position_error == pytest.approx(found.position_distance(target), abs=1e-9)
    arm.limits.check_position(solution.joint_position.tolist())


def test_a_jog_step_by_the_jacobian_moves_the_tool_as_asked(arm: Mechanism) -> None:
    here, step = np.array(arm.home_position), 1e-5
    start = arm.forward(here)
    for twist in np.eye(6):
        rates = np.linalg.pinv(arm.jacobian(here)) @ twist
        found = arm.forward(here + step * rates)
        assert ((found.position - start.position) / step) == pytest.approx(twist[:3], abs=1e-2)
        assert found.rotation_distance(start) == pytest.approx(
            step * float(np.linalg.norm(twist[3:])), abs=1e-2 * step
        )


def test_lines_and_curves_are_timed_and_certified(arm: Mechanism) -> None:
    start, target = arm.home_position, lifted(arm, -0.015)
    paths = [arm.line(start, target), arm.curve([start, arm.solve(target, start).joint_position])]
    for path in paths:
        trajectory = time_path(path, arm.limits)
        certify(trajectory, arm.limits, start=start)
        assert arm.forward(trajectory.final).position_distance(target) < 1e-5


def test_every_kind_of_segment_is_planned_timed_and_certified(arm: Mechanism) -> None:
    start = arm.home_position
    home = arm.forward(start)

    def at(x: float, y: float) -> Pose:
        return Pose(home.position + np.array([x, y, -0.01]), home.quaternion)

    near, far = at(0.01, 0.0), at(0.01, 0.01)
    lists: list[list[kinds.Segment]] = [
        [kinds.Ptp(near), kinds.Lin(far), kinds.Lin(at(0.0, 0.01))],
        [kinds.Lin(near), kinds.Circ(kinds.ThroughPoint(at(0.012, 0.006).position), far)],
        [kinds.Spline([near, far, at(0.0, 0.01)])],
        [kinds.Spline([near, far, at(0.0, 0.01)], kinds.SplineSpace.TOOL)],
        [kinds.Lin(near, zone=0.002), kinds.Lin(far, zone=0.002), kinds.Ptp(at(0.0, 0.01))],
        [kinds.Lin(at(1e-4, 0.0))],
    ]
    for segments in lists:
        certify(time_legs(arm.segments(start, segments), arm.limits), arm.limits, start=start)


def test_a_platforms_segment_that_breaks_a_limit_is_named_with_its_fraction() -> None:
    arm = mechanism(platform_robot())
    home = arm.forward(arm.home_position)
    first = pose_of_shares([0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    away = Pose(home.position + np.array([0.5, 0.0, 0.0]), home.quaternion)
    legs = np.array(arm.home_position) + 0.02 * np.array([1, -1, 1, -1, 1, -1])

    for segment in (kinds.Lin(away), kinds.Spline([legs]), kinds.Ptp(legs)):
        with pytest.raises(errors.SegmentRefused, match="of the path") as refusal:
            arm.segments(arm.home_position, [kinds.Ptp(first), segment])
        assert refusal.value.segment == 1
        assert isinstance(refusal.value.reason, errors.PlatformLimit)
        assert refusal.value.reason.fraction is not None
        assert 0.0 < refusal.value.reason.fraction < 1.0


def test_several_lines_meet_and_are_one_trajectory(arm: Mechanism) -> None:
    poses = [lifted(arm, -0.01), lifted(arm, 0.005, 0.0), lifted(arm, -0.005)]
    legs = arm.segments(arm.home_position, [kinds.Lin(pose) for pose in poses])
    trajectory = time_legs(legs, arm.limits)
    certify(trajectory, arm.limits, start=arm.home_position)
    assert arm.forward(trajectory.final).position_distance(poses[-1]) < 1e-5


def test_base_and_root_hold_for_all(arm: Mechanism) -> None:
    home = arm.home_position
    target = arm.forward(home, "root")
    found = arm.solve(target, home, frame="root").joint_position
    assert arm.forward(found).position_distance(arm.forward(home)) < 1e-5
    with pytest.raises(errors.FrameUnknown):
        arm.solve(target, home, frame="table")


@pytest.mark.parametrize("far", [5.0, 50.0])
def test_what_is_out_of_reach_is_refused(arm: Mechanism, far: float) -> None:
    target = Pose(np.array([far, 0.0, 0.0]), Pose.identity().quaternion)
    for ask in (arm.solve, lambda pose, seed: arm.line(seed, pose)):
        with pytest.raises(errors.MotionError):
            ask(target, arm.home_position)


def test_a_malformed_seed_is_refused(arm: Mechanism) -> None:
    target, home = lifted(arm, -0.01), arm.home_position
    with pytest.raises(errors.WrongJointCount):
        arm.solve(target, home[:-1])
    with pytest.raises(errors.NotFinite):
        arm.solve(target, (*home[:-1], math.nan))


def test_the_platforms_answer_does_not_depend_on_the_seed() -> None:
    arm = mechanism(platform_robot())
    target = pose_of_shares([0.2, 0.1, -0.2, 0.1, 0.1, -0.2])
    found = [
        arm.solve(target, seed).joint_position.tolist()
        for seed in (arm.home_position, PLATFORM.lower, PLATFORM.upper)
    ]
    assert found[0] == found[1] == found[2]
