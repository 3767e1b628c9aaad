import math
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from rigs.motion.loaded_robots import serial_robot

from openpendant.motion.errors import (
    BadArgument,
    BranchChange,
    FrameUnknown,
    NoMotion,
    OutOfRange,
    PoseUnreachable,
)
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths.paths import joint_path_through_poses, linear_legs, linear_path
from openpendant.motion.pose import Pose
from openpendant.motion.timing.parameterization import time_legs, time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointSpline

Array = NDArray[np.float64]

READY = {
    "ur5": [0.3, -1.4, 1.6, -1.2, -1.3, 0.4],
    "abb_irb2400": [0.2, 0.1, -0.1, 0.3, 0.8, 0.2],
    "kawasaki_ra10n": [0.2, 0.2, -1.2, 0.3, -0.8, 0.2],
    "kuka_iiwa14": [0.2, 0.5, 0.1, -1.2, 0.1, 0.8, 0.1],
}


@cache
def robot(name: str) -> Kinematics:
    return Kinematics(serial_robot(name))


def moved(pose: Pose, shift: list[float], rpy: list[float]) -> Pose:
    turned = Pose.from_rpy([0.0, 0.0, 0.0], rpy).compose(Pose(np.zeros(3), pose.quaternion))
    return Pose(pose.position + shift, turned.quaternion)


def from_line(position: Array, start: Pose, end: Pose) -> float:
    along = end.position - start.position
    fraction = float((position - start.position) @ along / (along @ along))
    return math.dist(position, start.position + fraction * along)


@pytest.mark.parametrize("name", READY)
def test_the_tool_keeps_to_the_straight_line(name: str) -> None:
    kinematics, start = robot(name), READY[name]
    begin = kinematics.forward(start)
    end = moved(begin, [-0.08, 0.12, -0.06], [0.1, -0.15, 0.2])

    path = linear_path(kinematics, start, end)

    positions = path.evaluate(np.linspace(0.0, path.length, 10 * len(path.knots)))
    poses = [kinematics.forward(position) for position in positions]
    assert max(from_line(pose.position, begin, end) for pose in poses) <= 1e-4
    # Turning about one axis only: the angles to both ends add up to the whole turn.
    turned = [begin.rotation_distance(p) + p.rotation_distance(end) for p in poses]
    assert max(turned) <= begin.rotation_distance(end) + 1e-4
    assert positions[0].tolist() == start
    assert poses[-1].position_distance(end) <= 1e-5
    assert poses[-1].rotation_distance(end) <= 1e-4
    assert path.waypoint_knots.tolist() == [0, len(path.knots) - 1]


@pytest.mark.parametrize("name", READY)
def test_a_timed_tool_line_is_certified(name: str) -> None:
    kinematics, start = robot(name), READY[name]
    end = moved(kinematics.forward(start), [0.0, 0.1, 0.05], [0.0, 0.0, 0.0])
    trajectory = time_path(linear_path(kinematics, start, end), kinematics.limits)
    certify(trajectory, kinematics.limits, start=start)


def test_turning_on_the_spot_is_a_line_too() -> None:
    kinematics, start = robot("ur5"), READY["ur5"]
    begin = kinematics.forward(start)
    path = linear_path(kinematics, start, moved(begin, [0.0, 0.0, 0.0], [0.0, 0.0, 0.5]))
    for position in path.evaluate(np.linspace(0.0, path.length, 300)):
        assert kinematics.forward(position).position_distance(begin) <= 1e-4


def test_a_line_in_the_root_frame_reaches_the_same_pose() -> None:
    kinematics, start = robot("kawasaki_ra10n"), READY["kawasaki_ra10n"]
    goal = [value + 0.05 for value in start]
    in_root, in_base = (kinematics.forward(goal, frame) for frame in ("root", "base"))
    path = linear_path(kinematics, start, in_root, frame="root")
    assert kinematics.forward(path.goal).position_distance(in_base) <= 1e-5


def test_a_line_out_of_reach_is_refused_with_where_on_the_way() -> None:
    kinematics, start = robot("ur5"), READY["ur5"]
    end = moved(kinematics.forward(start), [2.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    with pytest.raises(PoseUnreachable) as refusal:
        linear_path(kinematics, start, end)
    assert refusal.value.fraction is not None
    assert 0.0 < refusal.value.fraction < 1.0


def test_a_line_that_would_need_another_turn_of_a_joint_is_refused_as_a_change_of_branch() -> None:
    kinematics = robot("ur5")
    upper = kinematics.limits.upper[5]
    start = [*READY["ur5"][:5], upper - 0.1]
    flange = kinematics.forward(start)
    end = flange.compose(Pose.from_rpy([0.0, 0.0, 0.0], [0.0, 0.0, 0.4]))

    with pytest.raises(BranchChange) as refusal:
        linear_path(kinematics, start, end)

    assert refusal.value.joint == kinematics.limits.names[5]
    assert refusal.value.fraction == pytest.approx(0.25, abs=0.01)
    assert refusal.value.step > 2.0


def test_a_line_to_where_the_tool_stands_is_no_motion() -> None:
    kinematics, start = robot("ur5"), READY["ur5"]
    with pytest.raises(NoMotion):
        linear_path(kinematics, start, kinematics.forward(start))


def test_a_line_from_outside_the_range_or_in_no_frame_is_refused() -> None:
    kinematics, start = robot("ur5"), READY["ur5"]
    end = moved(kinematics.forward(start), [0.0, 0.1, 0.0], [0.0, 0.0, 0.0])
    with pytest.raises(OutOfRange):
        linear_path(kinematics, [7.0, *start[1:]], end)
    with pytest.raises(FrameUnknown):
        linear_path(kinematics, start, end, frame="moon")


def test_legs_stop_at_each_pose_and_are_one_trajectory() -> None:
    kinematics, start = robot("ur5"), READY["ur5"]
    begin = kinematics.forward(start)
    corner = moved(begin, [0.0, 0.1, 0.0], [0.0, 0.0, 0.0])
    end = moved(corner, [0.0, 0.0, 0.1], [0.0, 0.0, 0.0])

    legs = linear_legs(kinematics, start, [begin, corner, corner, end])
    trajectory = time_legs(legs, kinematics.limits)

    certify(trajectory, kinematics.limits, start=start)
    assert len(legs) == 2
    state = trajectory.sample(float(trajectory.waypoint_times[1]))
    assert not state.velocity.any()
    assert kinematics.forward(state.position).position_distance(corner) <= 1e-5


def test_no_legs_are_refused() -> None:
    kinematics, start = robot("ur5"), READY["ur5"]
    with pytest.raises(BadArgument, match="poses"):
        linear_legs(kinematics, start, [])
    with pytest.raises(NoMotion):
        linear_legs(kinematics, start, [kinematics.forward(start)])


def test_poses_become_joint_waypoints_near_one_another() -> None:
    kinematics, start = robot("ur5"), READY["ur5"]
    taught = [[value + 0.15 * step for value in start] for step in (1, 2, 3)]
    poses = [kinematics.forward(position) for position in taught]
    waypoints = joint_path_through_poses(kinematics, start, poses)
    assert waypoints[0].tolist() == start
    assert np.array(waypoints[1:]) == pytest.approx(np.array(taught), abs=1e-5)
    certify(
        time_path(JointSpline(waypoints, kinematics.limits), kinematics.limits), kinematics.limits
    )


def test_an_unreachable_pose_among_several_says_which() -> None:
    kinematics, start = robot("ur5"), READY["ur5"]
    near = moved(kinematics.forward(start), [0.0, 0.05, 0.0], [0.0, 0.0, 0.0])
    far = moved(near, [3.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    with pytest.raises(PoseUnreachable) as refusal:
        joint_path_through_poses(kinematics, start, [near, far, near, near])
    assert refusal.value.fraction == 0.5
