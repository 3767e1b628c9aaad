import math
from contextlib import suppress
from functools import cache
from unittest.mock import Mock

import numpy as np
import pytest
from numpy.typing import NDArray
from rigs.motion.loaded_robots import serial_robot

from openpendant.motion.errors import (
    BranchChange,
    MotionError,
    NoMotion,
    OutOfRange,
    PoseUnreachable,
)
from openpendant.motion.kinematics.ik.ik import solve
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths import tool_paths
from openpendant.motion.paths.path_chains import ToolChain
from openpendant.motion.paths.tool_curves import ToolArc, ToolLine, circle_about
from openpendant.motion.paths.tool_kinematics import next_joints
from openpendant.motion.paths.tool_paths import POSITION_STEP, deviation, follow_tool_curve
from openpendant.motion.pose import Pose, PoseArray
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.tools.bench.path_accuracy import (
    GREATEST_ANGLE,
    GREATEST_DISTANCE,
    deviations,
    path_accuracy,
)

Array = NDArray[np.float64]

UR5 = [0.3, -1.4, 1.6, -1.2, -1.3, 0.4]


@cache
def robot(name: str) -> Kinematics:
    return Kinematics(serial_robot(name))


def shifted(pose: Pose, shift: list[float]) -> Pose:
    return Pose(pose.position + shift, pose.quaternion)


def test_the_planned_tool_is_twice_as_exact() -> None:
    kinematics = robot("ur5")
    here = kinematics.forward(UR5)
    curve = ToolLine(here, shifted(here, [-0.1, 0.2, 0.1]))
    path = follow_tool_curve(kinematics, UR5, curve)
    joints = path.evaluate(np.linspace(0.0, path.length, 10 * len(path.knots)))
    off = deviations(kinematics, curve, joints, np.linspace(0.0, curve.length, len(joints)))
    assert np.linalg.norm(off[:, :3], axis=1).max() <= 0.05e-3
    assert np.linalg.norm(off[:, 3:], axis=1).max() <= math.radians(0.025)


def test_waypoints_are_passed_where_the_curve_passes_them() -> None:
    kinematics = robot("ur5")
    here = kinematics.forward(UR5)
    corner = shifted(here, [0.0, 0.1, 0.0])
    last = shifted(corner, [0.0, 0.0, 0.1])
    chain = ToolChain([ToolLine(here, corner), ToolLine(corner, last)], [0.03])

    path = follow_tool_curve(kinematics, UR5, chain)

    passing = path.evaluate(path.knots[path.waypoint_knots])
    positions = [kinematics.forward(position).position for position in passing]
    assert len(positions) == 3
    assert math.dist(positions[1], corner.position) == pytest.approx(
        3.0 * 0.03 / 8.0 * math.sin(math.pi / 4.0), abs=1e-5
    )
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
    kinematics = robot("ur5")
    here = kinematics.forward(UR5)

    with pytest.raises((PoseUnreachable, OutOfRange)) as refusal:
        follow_tool_curve(kinematics, UR5, ToolLine(here, shifted(here, shift)))

    error = refusal.value
    assert isinstance(error, PoseUnreachable | OutOfRange)
    assert error.fraction is not None
    assert least < error.fraction < most


def test_a_line_that_ends_out_of_reach_is_refused_where_following_it_is_and_sooner(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kinematics, asked = robot("ur5"), Mock(side_effect=next_joints)
    here = kinematics.forward(UR5)
    line = ToolLine(here, shifted(here, [2.0, 0.0, 0.0]))
    monkeypatch.setattr(tool_paths, "next_joints", asked)

    with pytest.raises((PoseUnreachable, OutOfRange)) as refusal:
        follow_tool_curve(kinematics, UR5, line)

    places = line.place(np.linspace(0.0, line.length, 1001)[1:])
    followed = [np.array(UR5)]
    with suppress(PoseUnreachable, OutOfRange):
        for place in zip(*places, strict=True):
            followed.append(next_joints(kinematics, Pose.from_matrix(*place), followed[-1]))
    assert isinstance(refusal.value, PoseUnreachable | OutOfRange)
    assert refusal.value.fraction == pytest.approx(len(followed) / 1000, abs=1e-12)
    assert asked.call_count < len(followed) / 4


def test_a_line_that_is_solved_in_short_steps_alone_is_planned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kinematics = robot("ur5")
    here = kinematics.forward(UR5)
    line = ToolLine(here, shifted(here, [0.05, 0.0, 0.0]))
    planned = follow_tool_curve(kinematics, UR5, line)

    def short_steps(robot: Kinematics, pose: Pose, before: NDArray[np.float64]) -> Array:
        if pose.position_distance(robot.forward(before)) > 1.01 * POSITION_STEP:
            raise PoseUnreachable(tuple(pose.position.tolist()), "base", 1.0, 0.0, 0)
        return next_joints(robot, pose, before)

    monkeypatch.setattr(tool_paths, "next_joints", short_steps)
    assert follow_tool_curve(kinematics, UR5, line).length == planned.length


def test_a_circle_of_a_hundred_metres_is_refused_soon() -> None:
    kinematics = robot("ur5")
    here = kinematics.forward(UR5)
    centre = shifted(here, [0.0, 99.0, 0.0]).position
    circle = circle_about(here.position, centre, [0.0, 0.0, 1.0])
    with pytest.raises(MotionError):
        follow_tool_curve(kinematics, UR5, ToolArc(circle, here, here))


def test_a_curve_too_short_to_move_a_joint_is_no_motion() -> None:
    kinematics = robot("ur5")
    here = kinematics.forward(UR5)
    with pytest.raises(NoMotion):
        follow_tool_curve(kinematics, UR5, ToolLine(here, shifted(here, [1e-8, 0.0, 0.0])))


@pytest.mark.parametrize("swing", [0.05, 0.2])
@pytest.mark.parametrize("fourth", [0.0, 0.2, 1.0])
def test_a_line_through_the_wrist_singularity_is_exact(fourth: float, swing: float) -> None:
    kinematics = robot("abb_irb2400")
    start, goal = ([0.1, 0.1, 0.1, fourth, fifth, 0.1] for fifth in (swing, -swing))
    line = ToolLine(kinematics.forward(start), kinematics.forward(goal))
    worst = path_accuracy(kinematics, np.array(start), line, runs=1)
    assert worst.distance <= GREATEST_DISTANCE
    assert worst.angle <= GREATEST_ANGLE


@pytest.mark.parametrize("swing", [0.02, 0.005, 1e-3, 1e-4])
@pytest.mark.parametrize("fourth", [0.0, 0.2, 1.0])
def test_a_short_line_through_the_wrist_singularity_is_timed_and_certified(
    fourth: float, swing: float
) -> None:
    kinematics = robot("abb_irb2400")
    start, goal = ([0.1, 0.1, 0.1, fourth, fifth, 0.1] for fifth in (swing, -swing))
    line = ToolLine(kinematics.forward(start), kinematics.forward(goal))

    trajectory = time_path(follow_tool_curve(kinematics, start, line), kinematics.limits)

    certify(trajectory, kinematics.limits, start=start)
    # Joint 5 alone has to move: it takes as long as its own two ramps, or its cruise.
    gain = kinematics.limits.acceleration[4]
    assert trajectory.duration <= 2.0 * math.sqrt(2.0 * swing / gain) * 1.05 + 0.02


@pytest.mark.parametrize("past", [1e-3, pytest.param(5e-4, marks=pytest.mark.soak), 2e-4])
@pytest.mark.parametrize("fourth", [-1.0, 0.5])
def test_a_line_that_grazes_the_wrist_singularity_keeps_its_branch(
    fourth: float, past: float
) -> None:
    kinematics = robot("abb_irb2400")
    middle = [0.1, 0.2, 0.1, fourth, past, 0.3]
    there = kinematics.forward(middle)
    start = solve(kinematics, shifted(there, [0.0, 0.0, -0.1]), middle).joint_position
    line = ToolLine(kinematics.forward(start), shifted(there, [0.0, 0.0, 0.1]))

    path = follow_tool_curve(kinematics, start, line)

    joints = path.evaluate(path.knots)
    assert len(set(np.sign(joints[:, 4]))) == 1
    assert np.ptp(joints[:, 3]) > 3.0  # within a millimetre; the tool waits for it
    certify(time_path(path, kinematics.limits), kinematics.limits, start=start)


def test_a_line_that_would_flip_the_wrist_is_refused_with_the_singularitys_name() -> None:
    kinematics = robot("abb_irb2400")
    start = [0.34, -0.25, -0.36, -1.35, 0.01, 2.31]
    here = kinematics.forward(start)
    line = ToolLine(here, shifted(here, [0.09, -0.07, -0.13]))
    with pytest.raises(BranchChange, match="at a wrist singularity; accepted: ") as refusal:
        follow_tool_curve(kinematics, start, line)
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
    kinematics = robot("abb_irb2400")
    here = kinematics.forward(start)
    path = follow_tool_curve(kinematics, start, ToolLine(here, shifted(here, shift)))
    assert path.extent()[1][joint] == pytest.approx(kinematics.upper[joint], abs=1e-8)
    certify(time_path(path, kinematics.limits), kinematics.limits, start=start)
