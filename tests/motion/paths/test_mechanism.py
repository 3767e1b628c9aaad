import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from rigs.data.example_counts import counts, few
from rigs.motion.loaded_robots import load_robot
from rigs.motion.nearness import assert_near, assert_same_pose
from rigs.motion.stewart_poses import (
    PLATFORM,
    platform_robot,
    pose_of_shares,
    poses_inside,
    random_poses,
)

from openpendant.motion import errors
from openpendant.motion.description.robot import robot_names
from openpendant.motion.kinematics.stewart.platform import StewartKinematics
from openpendant.motion.kinematics.stewart.workspace import PlatformRule
from openpendant.motion.orientation import rotation_of_vector
from openpendant.motion.paths import segments as kinds
from openpendant.motion.paths.mechanism import Mechanism, mechanism
from openpendant.motion.paths.stewart_path import check_path, leg_curve, platform_line
from openpendant.motion.pose import Array, Pose
from openpendant.motion.timing.parameterization import time_legs, time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointSpline, Path

NAMES = ["ur5", "abb_irb2400", "stewart_classroom"]


@pytest.fixture(params=NAMES)
def arm(request: pytest.FixtureRequest) -> Mechanism:
    return mechanism(load_robot(request.param))


def lifted(arm: Mechanism, z: float, turn: float = 0.05) -> Pose:
    home = arm.forward(arm.home_position)
    position = home.position + np.array([0.0, 0.0, z])
    turned = rotation_of_vector(np.array([0.0, 0.0, turn])) @ home.rotation
    return Pose.from_matrix(turned, position)


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
        turn = step * float(np.linalg.norm(twist[3:]))
        assert found.rotation_distance(start) == pytest.approx(turn, abs=1e-2 * step)


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
    seeds = (arm.home_position, PLATFORM.lower, PLATFORM.upper)
    found = [arm.solve(target, seed).joint_position.tolist() for seed in seeds]
    assert found[0] == found[1] == found[2]


HOME = PLATFORM.home_position
LIMITS = PLATFORM.limits
# No corner of the workspace lies on the straight way between two of these.
SIDE = pose_of_shares([0.35, 0.1, -0.1, 0.1, -0.1, 0.15])
OTHER = pose_of_shares([-0.3, 0.2, 0.2, -0.1, 0.1, 0.05])


def poses_along(path: Path, count: int = 50) -> list[Pose]:
    s = np.linspace(0.0, path.length, count)
    return [PLATFORM.forward(lengths) for lengths in path.evaluate(s)]


def off_line(pose: Pose, start: Pose, goal: Pose) -> float:
    along = (goal.position - start.position) / start.position_distance(goal)
    offset: Array = pose.position - start.position
    return float(np.linalg.norm(offset - (offset @ along) * along))


def test_a_line_starts_where_the_platform_stands_and_ends_on_the_pose_exactly() -> None:
    line = platform_line(PLATFORM, HOME, SIDE)
    ends = line.evaluate(np.array([0.0, line.length]))
    assert ends[0].tolist() == list(HOME)
    assert ends[1].tolist() == line.goal.tolist()
    assert line.goal == pytest.approx(PLATFORM.inverse(SIDE), abs=1e-15)


@few(8)
@given(poses_inside)
def test_the_platform_goes_straight_and_turns_evenly(pose: Pose) -> None:
    try:
        line = platform_line(PLATFORM, HOME, pose)
    except errors.NoMotion:
        return
    start = line.origin
    for part, found in enumerate(poses_along(line, 9)):
        ideal = start.interpolate(pose, part / 8.0)
        assert_same_pose(found, ideal, 1e-9)


def test_the_derivatives_are_those_of_the_lengths() -> None:
    line = platform_line(PLATFORM, PLATFORM.inverse(OTHER), SIDE)
    s, step = np.linspace(0.01, line.length - 0.01, 7), 1e-5
    before, here, after = (line.evaluate(s + shift) for shift in (-step, 0.0, step))
    assert_near(line.evaluate(s, 1), (after - before) / (2 * step), 1e-08)
    bend = (after - 2.0 * here + before) / step**2
    np.testing.assert_allclose(line.evaluate(s, 2), bend, atol=1e-4)


@pytest.mark.parametrize("count", counts(6, 200))
def test_the_extent_is_reached_and_never_passed(count: int) -> None:
    for pose in random_poses(count, seed=5):
        line = platform_line(PLATFORM, HOME, pose)
        least, greatest = line.extent()
        dense = line.evaluate(np.linspace(0.0, line.length, 5000))
        assert (dense >= least - 1e-12).all()
        assert (dense <= greatest + 1e-12).all()
        assert_near(dense.min(axis=0), least, 1e-08)
        assert_near(dense.max(axis=0), greatest, 1e-08)


def test_a_turn_on_the_spot_is_a_line_too() -> None:
    line = platform_line(PLATFORM, HOME, pose_of_shares([0.0, 0.0, 0.0, 0.0, 0.0, 0.8]))
    assert line.length == pytest.approx(0.8 * 0.5 * PLATFORM.size)
    assert max(pose.position_distance(line.origin) for pose in poses_along(line)) < 1e-12


@pytest.mark.parametrize("speed", [0.2, 1.0])
def test_a_line_is_timed_and_certified_and_leaves_the_ideal_nowhere(speed: float) -> None:
    trajectory = time_path(platform_line(PLATFORM, HOME, SIDE), LIMITS, speed=speed)
    certificate = certify(trajectory, LIMITS, start=HOME)
    assert certificate.velocity.ratio <= speed * (1.0 + 1e-6)
    assert max(certificate.velocity.ratio / speed, certificate.acceleration.ratio) > 0.9
    poses = [PLATFORM.forward(lengths) for lengths in trajectory.position]
    assert max(off_line(pose, poses[0], SIDE) for pose in poses) < 1e-9


def test_random_lines_and_curves_are_certified() -> None:
    here = np.array(HOME)
    for pose in random_poses(6, seed=2):
        goal = Pose(0.5 * (pose.position + SIDE.position), SIDE.quaternion)
        path = platform_line(PLATFORM, here, goal)
        certify(time_path(path, LIMITS), LIMITS, start=here)
        here = path.goal
    for pose in random_poses(4, seed=3):
        curve = leg_curve(PLATFORM, [HOME, PLATFORM.inverse(pose)])
        certify(time_path(curve, LIMITS), LIMITS, start=HOME)


def test_a_curve_through_several_lengths_stays_in_the_workspace() -> None:
    waypoints = [np.array(HOME), PLATFORM.inverse(SIDE), PLATFORM.inverse(OTHER), np.array(HOME)]
    curve = leg_curve(PLATFORM, waypoints)
    assert isinstance(curve, JointSpline)
    assert max(PLATFORM.workspace.usage(pose) for pose in poses_along(curve)) <= 1.0


def test_a_line_out_of_the_workspace_is_refused_before_it_starts() -> None:
    with pytest.raises(errors.PlatformLimit) as refusal:
        platform_line(PLATFORM, HOME, pose_of_shares([0.6, 0.0, 0.0, 0.0, 0.0, 0.6]))
    assert refusal.value.rule == PlatformRule.WORKSPACE
    assert refusal.value.fraction == 1.0


def test_a_line_between_good_ends_may_leave_the_workspace_on_its_way_and_says_where() -> None:
    # From pure roll to pure pitch the even turn has some yaw in the middle.
    start, goal = (pose_of_shares(0.97 * np.eye(6)[axis]) for axis in (3, 4))
    with pytest.raises(errors.PlatformLimit) as refusal:
        platform_line(PLATFORM, PLATFORM.inverse(start), goal)
    error = refusal.value
    assert error.rule == PlatformRule.WORKSPACE
    assert error.value > 1.0
    assert error.fraction is not None
    assert 0.1 < error.fraction < 0.9


def test_a_curve_of_legs_that_leaves_the_workspace_says_where() -> None:
    narrow = StewartKinematics(platform_robot(workspace={"z": 0.002}))
    corners = [[1, 0, 0, 0, 0, 0], [-1, 0, 0, 0, 0, 0]]
    start, goal = (narrow.inverse(pose_of_shares(0.97 * np.array(c))) for c in corners)
    # Between the two, straight in leg lengths, the platform bobs up.
    with pytest.raises((errors.PlatformLimit, errors.NoAssembly), match="of the path"):
        leg_curve(narrow, [start, goal])


def test_a_path_of_legs_is_checked_against_the_cones() -> None:
    narrow = StewartKinematics(platform_robot(leg={"anchor_cone_rad": 0.05}))
    curve = JointSpline([HOME, PLATFORM.inverse(SIDE)], LIMITS)
    check_path(PLATFORM, curve)
    with pytest.raises(errors.PlatformLimit, match=r"cone limit is 0\.05 rad.* of the path"):
        check_path(narrow, curve)


def test_standing_on_the_border_with_feedbacks_noise_a_line_leads_back() -> None:
    border = PLATFORM.inverse(pose_of_shares([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
    for noise in (-5e-7, 5e-7):
        line = platform_line(PLATFORM, border + noise, SIDE)
        certify(time_path(line, LIMITS), LIMITS, start=border)


@pytest.mark.parametrize(
    ("start", "error"),
    [
        (HOME[:5], errors.WrongJointCount),
        ([*HOME[:5], math.nan], errors.NotFinite),
        ([*HOME[:5], 0.5], errors.OutOfRange),
        ([0.318] * 6, errors.NoAssembly),
    ],
)
def test_a_start_that_is_none_is_refused(start: Sequence[float], error: type[Exception]) -> None:
    with pytest.raises(error):
        platform_line(PLATFORM, start, SIDE)
    with pytest.raises(error):
        leg_curve(PLATFORM, [start, HOME])


def test_where_the_platform_stands_already_no_line_leads() -> None:
    with pytest.raises(errors.NoMotion):
        platform_line(PLATFORM, HOME, PLATFORM.legs.home)
    with pytest.raises(errors.FrameUnknown):
        platform_line(PLATFORM, HOME, SIDE, frame="tool")
    with pytest.raises(errors.BadArgument, match="0, 1 or 2"):
        platform_line(PLATFORM, HOME, SIDE).evaluate(np.zeros(1), 3)
