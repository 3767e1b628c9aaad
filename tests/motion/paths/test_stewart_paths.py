import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from rigs.data.example_counts import counts, few
from rigs.motion.nearness import assert_near, assert_same_pose
from rigs.motion.stewart_poses import (
    PLATFORM,
    platform_robot,
    pose_of_shares,
    poses_inside,
    random_poses,
)

from openpendant.motion import errors
from openpendant.motion.kinematics.stewart.platform import StewartKinematics
from openpendant.motion.kinematics.stewart.workspace import PlatformRule
from openpendant.motion.paths.stewart_path import check_path, leg_curve, platform_line
from openpendant.motion.pose import Array, Pose
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointSpline, Path

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
    np.testing.assert_allclose(
        line.evaluate(s, 2), (after - 2.0 * here + before) / step**2, atol=1e-4
    )


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
        path = platform_line(
            PLATFORM, here, Pose(0.5 * (pose.position + SIDE.position), SIDE.quaternion)
        )
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
