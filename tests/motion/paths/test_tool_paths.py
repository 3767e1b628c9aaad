import math
from contextlib import suppress
from unittest.mock import Mock

import numpy as np
import pytest
from rigs.motion.loaded_robots import arm
from rigs.motion.refusals import Refusal, refusals

from openpendant.motion import errors
from openpendant.motion.kinematics.ik.ik import solve
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths import tool_paths
from openpendant.motion.paths.path_chains import ToolChain
from openpendant.motion.paths.paths import joint_path_through_poses, linear_legs, linear_path
from openpendant.motion.paths.tool_curves import ToolArc, ToolLine, circle_about
from openpendant.motion.paths.tool_kinematics import next_joints
from openpendant.motion.paths.tool_paths import POSITION_STEP, deviation, follow_tool_curve
from openpendant.motion.pose import Array, Pose, PoseArray
from openpendant.motion.timing.parameterization import time_legs, time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointSpline
from openpendant.tools.bench.path_accuracy import (
    GREATEST_ANGLE,
    GREATEST_DISTANCE,
    deviations,
    path_accuracy,
)

READY = {
    "ur5": [0.3, -1.4, 1.6, -1.2, -1.3, 0.4],
    "abb_irb2400": [0.2, 0.1, -0.1, 0.3, 0.8, 0.2],
    "kawasaki_ra10n": [0.2, 0.2, -1.2, 0.3, -0.8, 0.2],
    "kuka_iiwa14": [0.2, 0.5, 0.1, -1.2, 0.1, 0.8, 0.1],
}


UR5, IRB2400, START = arm("ur5"), arm("abb_irb2400"), READY["ur5"]
BEGIN = UR5.forward(START)


def moved(pose: Pose, shift: list[float], rpy: list[float]) -> Pose:
    turned = Pose.from_rpy([0.0, 0.0, 0.0], rpy).compose(Pose(np.zeros(3), pose.quaternion))
    return Pose(pose.position + shift, turned.quaternion)


def from_line(position: Array, start: Pose, end: Pose) -> float:
    along = end.position - start.position
    fraction = float((position - start.position) @ along / (along @ along))
    return math.dist(position, start.position + fraction * along)


@pytest.mark.parametrize("name", READY)
def test_the_tool_keeps_to_the_straight_line(name: str) -> None:
    kinematics, start = arm(name), READY[name]
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


def test_turning_on_the_spot_is_a_line_too() -> None:
    path = linear_path(UR5, START, moved(BEGIN, [0.0, 0.0, 0.0], [0.0, 0.0, 0.5]))
    for position in path.evaluate(np.linspace(0.0, path.length, 300)):
        assert UR5.forward(position).position_distance(BEGIN) <= 1e-4


def test_a_line_in_the_root_frame_reaches_the_same_pose() -> None:
    kinematics, start = arm("kawasaki_ra10n"), READY["kawasaki_ra10n"]
    goal = [value + 0.05 for value in start]
    in_root, in_base = (kinematics.forward(goal, frame) for frame in ("root", "base"))
    path = linear_path(kinematics, start, in_root, frame="root")
    assert kinematics.forward(path.goal).position_distance(in_base) <= 1e-5


def test_a_line_out_of_reach_is_refused_with_where_on_the_way() -> None:
    end = moved(BEGIN, [2.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    with pytest.raises(errors.PoseUnreachable) as refusal:
        linear_path(UR5, START, end)
    assert refusal.value.fraction is not None
    assert 0.0 < refusal.value.fraction < 1.0


def test_a_line_that_would_need_another_turn_of_a_joint_is_refused_as_a_change_of_branch() -> None:
    kinematics = arm("ur5")
    upper = kinematics.limits.upper[5]
    start = [*READY["ur5"][:5], upper - 0.1]
    flange = kinematics.forward(start)
    end = flange.compose(Pose.from_rpy([0.0, 0.0, 0.0], [0.0, 0.0, 0.4]))

    with pytest.raises(errors.BranchChange) as refusal:
        linear_path(kinematics, start, end)

    assert refusal.value.joint == kinematics.limits.names[5]
    assert refusal.value.fraction == pytest.approx(0.25, abs=0.01)
    assert refusal.value.step > 2.0


ASIDE = moved(BEGIN, [0.0, 0.1, 0.0], [0.0, 0.0, 0.0])


@refusals(
    ("where the tool stands", lambda: linear_path(UR5, START, BEGIN), errors.NoMotion, ""),
    ("out of range", lambda: linear_path(UR5, [7.0, *START[1:]], ASIDE), errors.OutOfRange, ""),
    ("no frame", lambda: linear_path(UR5, START, ASIDE, frame="moon"), errors.FrameUnknown, ""),
    ("no poses", lambda: linear_legs(UR5, START, []), errors.BadArgument, "poses"),
    ("no leg", lambda: linear_legs(UR5, START, [BEGIN]), errors.NoMotion, ""),
)
def test_a_line_that_cannot_be_is_refused(refusal: Refusal) -> None:
    refusal.check()


def test_legs_stop_at_each_pose_and_are_one_trajectory() -> None:
    end = moved(ASIDE, [0.0, 0.0, 0.1], [0.0, 0.0, 0.0])
    legs = linear_legs(UR5, START, [BEGIN, ASIDE, ASIDE, end])
    trajectory = time_legs(legs, UR5.limits)

    certify(trajectory, UR5.limits, start=START)
    assert len(legs) == 2
    state = trajectory.sample(float(trajectory.waypoint_times[1]))
    assert not state.velocity.any()
    assert UR5.forward(state.position).position_distance(ASIDE) <= 1e-5


def test_poses_become_joint_waypoints_near_one_another() -> None:
    taught = [[value + 0.15 * step for value in START] for step in (1, 2, 3)]
    poses = [UR5.forward(position) for position in taught]
    waypoints = joint_path_through_poses(UR5, START, poses)
    assert waypoints[0].tolist() == START
    assert np.array(waypoints[1:]) == pytest.approx(np.array(taught), abs=1e-5)
    certify(time_path(JointSpline(waypoints, UR5.limits), UR5.limits), UR5.limits)


def test_an_unreachable_pose_among_several_says_which() -> None:
    near = moved(BEGIN, [0.0, 0.05, 0.0], [0.0, 0.0, 0.0])
    far = moved(near, [3.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    with pytest.raises(errors.PoseUnreachable) as refusal:
        joint_path_through_poses(UR5, START, [near, far, near, near])
    assert refusal.value.fraction == 0.5


def shifted(pose: Pose, shift: list[float]) -> Pose:
    return Pose(pose.position + shift, pose.quaternion)


def test_the_planned_tool_is_twice_as_exact() -> None:
    curve = ToolLine(BEGIN, shifted(BEGIN, [-0.1, 0.2, 0.1]))
    path = follow_tool_curve(UR5, START, curve)
    joints = path.evaluate(np.linspace(0.0, path.length, 10 * len(path.knots)))
    off = deviations(UR5, curve, joints, np.linspace(0.0, curve.length, len(joints)))
    assert np.linalg.norm(off[:, :3], axis=1).max() <= 0.05e-3
    assert np.linalg.norm(off[:, 3:], axis=1).max() <= math.radians(0.025)


def test_waypoints_are_passed_where_the_curve_passes_them() -> None:
    corner = shifted(BEGIN, [0.0, 0.1, 0.0])
    last = shifted(corner, [0.0, 0.0, 0.1])
    chain = ToolChain([ToolLine(BEGIN, corner), ToolLine(corner, last)], [0.03])

    path = follow_tool_curve(UR5, START, chain)

    passing = path.evaluate(path.knots[path.waypoint_knots])
    positions = [UR5.forward(position).position for position in passing]
    assert len(positions) == 3
    cut = 3.0 * 0.03 / 8.0 * math.sin(math.pi / 4.0)
    assert math.dist(positions[1], corner.position) == pytest.approx(cut, abs=1e-5)
    assert positions[2] == pytest.approx(last.position, abs=1e-5)


def test_deviation_is_measured_from_the_nearest_place_not_from_the_one_in_time() -> None:
    line = ToolLine(Pose.identity(), Pose.from_values([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]))
    places = PoseArray(np.eye(3)[np.newaxis], np.array([[0.5, 0.003, 0.004]]))
    distance, angle = deviation(line, places, np.array([0.4]))
    assert (distance[0], angle[0]) == pytest.approx((0.005, 0.0))


@pytest.mark.parametrize(
    ("shift", "least", "most"), [([2.0, 0.0, 0.0], 0.1, 0.8), ([0.0, 0.0, 40.0], 0.0, 0.05)]
)
def test_a_curve_that_leaves_the_reach_is_refused_with_its_fraction(
    shift: list[float], least: float, most: float
) -> None:

    with pytest.raises((errors.PoseUnreachable, errors.OutOfRange)) as refusal:
        follow_tool_curve(UR5, START, ToolLine(BEGIN, shifted(BEGIN, shift)))

    error = refusal.value
    assert isinstance(error, errors.PoseUnreachable | errors.OutOfRange)
    assert error.fraction is not None
    assert least < error.fraction < most


def test_a_line_that_ends_out_of_reach_is_refused_where_following_it_is_and_sooner(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = Mock(side_effect=next_joints)
    line = ToolLine(BEGIN, shifted(BEGIN, [2.0, 0.0, 0.0]))
    monkeypatch.setattr(tool_paths, "next_joints", asked)
    refusals = (errors.PoseUnreachable, errors.OutOfRange)

    with pytest.raises(refusals) as refusal:
        follow_tool_curve(UR5, START, line)

    places = line.place(np.linspace(0.0, line.length, 1001)[1:])
    followed = [np.array(START)]
    with suppress(*refusals):
        for place in zip(*places, strict=True):
            followed.append(next_joints(UR5, Pose.from_matrix(*place), followed[-1]))
    assert isinstance(refusal.value, errors.PoseUnreachable | errors.OutOfRange)
    assert refusal.value.fraction == pytest.approx(len(followed) / 1000, abs=1e-12)
    assert asked.call_count < len(followed) / 4


def test_a_line_that_short_steps_alone_solve_is_planned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    line = ToolLine(BEGIN, shifted(BEGIN, [0.05, 0.0, 0.0]))
    planned = follow_tool_curve(UR5, START, line)

    def short_steps(robot: Kinematics, pose: Pose, before: Array) -> Array:
        if pose.position_distance(robot.forward(before)) > 1.01 * POSITION_STEP:
            x, y, z = pose.position.tolist()
            raise errors.PoseUnreachable((x, y, z), "base", 1.0, 0.0, 0)
        return next_joints(robot, pose, before)

    monkeypatch.setattr(tool_paths, "next_joints", short_steps)
    assert follow_tool_curve(UR5, START, line).length == planned.length


def test_a_circle_of_a_hundred_metres_is_refused_soon() -> None:
    centre = shifted(BEGIN, [0.0, 99.0, 0.0]).position
    circle = circle_about(BEGIN.position, centre, [0.0, 0.0, 1.0])
    with pytest.raises(errors.MotionError):
        follow_tool_curve(UR5, START, ToolArc(circle, BEGIN, BEGIN))


@pytest.mark.parametrize("swing", [0.05, 0.2])
@pytest.mark.parametrize("fourth", [0.0, 0.2, 1.0])
def test_a_line_through_the_wrist_singularity_is_exact(fourth: float, swing: float) -> None:
    start, goal = ([0.1, 0.1, 0.1, fourth, fifth, 0.1] for fifth in (swing, -swing))
    line = ToolLine(IRB2400.forward(start), IRB2400.forward(goal))
    worst = path_accuracy(IRB2400, np.array(start), line, runs=1)
    assert worst.distance <= GREATEST_DISTANCE
    assert worst.angle <= GREATEST_ANGLE


@pytest.mark.parametrize("swing", [0.02, 0.005, 1e-3, 1e-4])
@pytest.mark.parametrize("fourth", [0.0, 0.2, 1.0])
def test_a_short_line_through_a_wrist_singularity_is_certified(fourth: float, swing: float) -> None:
    start, goal = ([0.1, 0.1, 0.1, fourth, fifth, 0.1] for fifth in (swing, -swing))
    line = ToolLine(IRB2400.forward(start), IRB2400.forward(goal))

    trajectory = time_path(follow_tool_curve(IRB2400, start, line), IRB2400.limits)

    certify(trajectory, IRB2400.limits, start=start)
    # Joint 5 alone has to move: it takes as long as its own two ramps, or its cruise.
    gain = IRB2400.limits.acceleration[4]
    assert trajectory.duration <= 2.0 * math.sqrt(2.0 * swing / gain) * 1.05 + 0.02


@pytest.mark.parametrize("past", [1e-3, pytest.param(5e-4, marks=pytest.mark.soak), 2e-4])
@pytest.mark.parametrize("fourth", [-1.0, 0.5])
def test_a_line_past_the_wrist_singularity_keeps_its_branch(fourth: float, past: float) -> None:
    middle = [0.1, 0.2, 0.1, fourth, past, 0.3]
    there = IRB2400.forward(middle)
    start = solve(IRB2400, shifted(there, [0.0, 0.0, -0.1]), middle).joint_position
    line = ToolLine(IRB2400.forward(start), shifted(there, [0.0, 0.0, 0.1]))

    path = follow_tool_curve(IRB2400, start, line)

    joints = path.evaluate(path.knots)
    assert len(set(np.sign(joints[:, 4]))) == 1
    assert np.ptp(joints[:, 3]) > 3.0  # within a millimetre; the tool waits for it
    certify(time_path(path, IRB2400.limits), IRB2400.limits, start=start)


def test_a_line_that_would_flip_the_wrist_is_refused_with_the_singularitys_name() -> None:
    start = [0.34, -0.25, -0.36, -1.35, 0.01, 2.31]
    here = IRB2400.forward(start)
    line = ToolLine(here, shifted(here, [0.09, -0.07, -0.13]))
    with pytest.raises(errors.BranchChange, match="at a wrist singularity; accepted: ") as refusal:
        follow_tool_curve(IRB2400, start, line)
    assert refusal.value.singularity == "wrist"
    assert 0.0 < refusal.value.fraction < 1.0


@pytest.mark.parametrize(
    ("start", "shift", "joint"),
    [
        (
            [-0.266428523, -1.19516977, 0.670915407, -0.127643387, 0.919928456, 3.170013801],
            [-0.177811204058, -0.088834164157, 0.022173565115],
            2,
        ),
        (
            [-1.028892168, 1.903049309, -0.020656219, 0.215228066, 0.096887517, 3.068597262],
            [0.063150496657, 0.020170101513, -0.188693353823],
            1,
        ),
    ],
    ids=["joint 3", "joint 2"],
)
def test_a_line_that_just_touches_a_joints_bound_is_not_refused_for_the_curve_between_samples(
    start: list[float], shift: list[float], joint: int
) -> None:
    here = IRB2400.forward(start)
    path = follow_tool_curve(IRB2400, start, ToolLine(here, shifted(here, shift)))
    assert path.extent()[1][joint] == pytest.approx(IRB2400.upper[joint], abs=1e-8)
    certify(time_path(path, IRB2400.limits), IRB2400.limits, start=start)
