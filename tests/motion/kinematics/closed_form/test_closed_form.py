import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from rigs.data.example_counts import counts
from rigs.motion.loaded_robots import SERIAL, arm, serial_robot
from rigs.motion.nearness import assert_near

from openpendant.motion.kinematics.closed_form import closed_form
from openpendant.motion.kinematics.closed_form.geometry import ArmGeometry, arm_geometry
from openpendant.motion.kinematics.closed_form.three_parallel import ThreeParallel
from openpendant.motion.kinematics.closed_form.three_parallel import recognise as three_parallel
from openpendant.motion.kinematics.closed_form.wrist_partitioned import LinearAxis, WristPartitioned
from openpendant.motion.kinematics.closed_form.wrist_partitioned import (
    recognise as wrist_partitioned,
)
from openpendant.motion.kinematics.pinocchio_model import model_map
from openpendant.motion.kinematics.serial import Kinematics, rotation_vector
from openpendant.motion.pose import Array

NONE = ("fanuc_m410ib", "kuka_iiwa14", "mitsubishi_rh6frh5520")
SIX_AXES = tuple(name for name in SERIAL if serial_robot(name).dof == 6)
SOLVED = tuple(name for name in SERIAL if name not in NONE)


def screw(axis: Array, point: Array, value: float, prismatic: bool) -> Array:
    """The exponential of a joint's twist, by the series that the matrix exponential is."""
    twist = np.zeros((4, 4))
    if prismatic:
        twist[:3, 3] = axis
    else:
        x, y, z = axis
        twist[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
        twist[:3, 3] = -np.cross(axis, point)
    # Scaled so that the series converges in a few terms, then squared back.
    squarings = 8
    small = twist * value / 2.0**squarings
    result, term = np.eye(4), np.eye(4)
    for order in range(1, 14):
        term = term @ small / order
        result = result + term
    for _ in range(squarings):
        result = result @ result
    return result


def product_of_exponentials(geometry: ArmGeometry, values: Sequence[float] | Array) -> Array:
    result = np.eye(4)
    rows = zip(geometry.axes, geometry.points, values, geometry.prismatic, strict=True)
    for axis, point, value, prismatic in rows:
        result = result @ screw(axis, point, value, prismatic)
    return result @ geometry.tool


def random_positions(kinematics: Kinematics, count: int) -> Iterator[Array]:
    random = np.random.default_rng(11)
    for _ in range(count):
        yield random.uniform(kinematics.lower, kinematics.upper)


@pytest.mark.parametrize("count", counts(3, 100))
@pytest.mark.parametrize("name", SERIAL)
def test_a_forward_pose_is_a_product_of_exponentials(kinematics: Kinematics, count: int) -> None:
    geometry = arm_geometry(kinematics.robot)
    gain, offset = model_map(kinematics.robot)
    for position in random_positions(kinematics, count):
        expected = product_of_exponentials(geometry, gain @ position + offset)
        assert_near(kinematics.forward(position).to_matrix(), expected, 1e-11)


@pytest.mark.parametrize(
    ("name", "family"),
    [
        (name, {"ur5": ThreeParallel, "rail_kr5_arc": LinearAxis}.get(name, WristPartitioned))
        for name in SOLVED
    ]
    + [(name, type(None)) for name in NONE],
)
def test_each_robot_belongs_to_its_family(name: str, family: type) -> None:
    assert isinstance(closed_form(arm(name)), family)


@pytest.mark.parametrize("count", counts(8, 250))
@pytest.mark.parametrize("name", SIX_AXES)
def test_branches_reach_the_pose_and_one_is_its_origin(kinematics: Kinematics, count: int) -> None:
    robot, form = kinematics.robot, closed_form(kinematics)
    assert form is not None
    for position in random_positions(kinematics, count):
        target = kinematics.forward(position).to_matrix()
        reached = form.branches(target, (0.0,) * 6).within(0.0)
        assert 2 <= len(reached) <= 8
        differences = []
        for branch in reached:
            controller = np.array(robot.to_controller(branch))
            found = kinematics.forward(controller).to_matrix()
            assert_near(found, target, 1e-10)
            difference = np.array(branch) - robot.to_model(position.tolist())
            differences.append(np.abs(np.angle(np.exp(1j * difference))).max())
        assert min(differences) < 1e-7


@pytest.mark.parametrize("name", SIX_AXES)
def test_the_number_of_branches_is_that_of_an_independent_solver(name: str) -> None:
    eaik = pytest.importorskip("eaik.IK_HP", reason="EAIK is not installed")
    kinematics = arm(name)
    geometry, form = arm_geometry(kinematics.robot), closed_form(kinematics)
    assert form is not None
    points = np.vstack((np.zeros(3), geometry.points, geometry.tool[:3, 3]))
    oracle: Any = eaik.HPRobot(geometry.axes, np.diff(points, axis=0))
    for position in random_positions(kinematics, 25):
        target = kinematics.forward(position).to_matrix()
        ours = form.branches(target, (0.0,) * 6).within(0.0)
        wanted = target.copy()
        wanted[:3, :3] = target[:3, :3] @ geometry.tool[:3, :3].T
        answer = oracle.IK(wanted)
        exact = [row for row, rough in zip(answer.Q, answer.is_LS, strict=True) if not rough]
        assert len(ours) == len(exact)
        for branch in ours:
            turned = np.exp(1j * (np.array(exact) - np.array(branch)))
            assert np.abs(np.angle(turned)).max(axis=1).min() < 1e-6


@pytest.mark.parametrize("name", SOLVED)
def test_a_pose_out_of_reach_is_missed_by_what_it_is_too_far_away(kinematics: Kinematics) -> None:
    form = closed_form(kinematics)
    assert form is not None
    target = np.eye(4)
    target[:3, 3] = (0.0, 30.0, 1.0)
    assert 20.0 < min(form.branches(target, (0.0,) * kinematics.dof).gaps) < 30.0


@pytest.mark.parametrize("name", SIX_AXES)
def test_the_measures_vanish_exactly_where_the_jacobian_loses_rank(kinematics: Kinematics) -> None:
    robot, form = kinematics.robot, closed_form(kinematics)
    assert form is not None
    ratios = []
    for position in random_positions(kinematics, 30):
        shoulder, elbow, wrist = form.measures(robot.to_model(position.tolist()))
        product = shoulder * math.sin(elbow) * math.sin(wrist)
        ratios.append(abs(np.linalg.det(kinematics.jacobian(position)) / product))
    np.testing.assert_allclose(ratios, ratios[0], rtol=1e-6)


def moved(geometry: ArmGeometry, joint: int, shift: Sequence[float] | Array) -> ArmGeometry:
    points = geometry.points.copy()
    points[joint] += shift
    return ArmGeometry(geometry.axes, points, geometry.prismatic, geometry.tool)


@pytest.mark.parametrize("joint", [3, 4, 5])
def test_an_offset_wrist_is_not_taken_for_a_spherical_one(joint: int) -> None:
    geometry = arm_geometry(serial_robot("abb_irb2400"))
    assert wrist_partitioned(geometry) is not None
    assert wrist_partitioned(moved(geometry, joint, np.roll((0.0, 0.05, 0.0), joint == 4))) is None


def test_axes_that_are_a_little_out_of_parallel_are_not_of_the_family() -> None:
    for name, recognise in (("abb_irb2400", wrist_partitioned), ("ur5", three_parallel)):
        geometry = arm_geometry(serial_robot(name))
        for joint in range(6):
            axes = geometry.axes.copy()
            axes[joint] += (0.01, 0.02, 0.03)
            axes[joint] /= np.linalg.norm(axes[joint])
            bent = ArmGeometry(axes, geometry.points, geometry.prismatic, geometry.tool)
            assert recognise(bent) is None


def rotated_wrist(geometry: ArmGeometry, turn4: float, turn5: float) -> ArmGeometry:
    """The same arm whose zero is where joints 4 and 5 had these angles."""
    values = [0.0, 0.0, 0.0, turn4, turn5, 0.0]
    axes, points = geometry.axes.copy(), geometry.points.copy()
    for joint in range(6):
        before = np.eye(4)
        for earlier in range(joint):
            axis, point = geometry.axes[earlier], geometry.points[earlier]
            before = before @ screw(axis, point, values[earlier], False)
        axes[joint] = before[:3, :3] @ geometry.axes[joint]
        points[joint] = before[:3, :3] @ geometry.points[joint] + before[:3, 3]
    tool = product_of_exponentials(geometry, values)
    return ArmGeometry(axes, points, geometry.prismatic, tool)


def test_a_wrist_whose_zero_is_anywhere_is_solved() -> None:
    geometry = rotated_wrist(arm_geometry(serial_robot("puma560")), 0.6, -1.1)
    form = wrist_partitioned(geometry)
    assert form is not None
    values = (0.3, -0.4, 0.5, 0.6, 0.7, 0.8)
    target = product_of_exponentials(geometry, values)
    branches = form.branches(target, values).positions
    assert len(branches) == 8
    for branch in branches:
        found = product_of_exponentials(geometry, branch)
        assert_near(found, target, 1e-10)
        assert np.linalg.norm(rotation_vector(found[:3, :3] @ target[:3, :3].T)) < 1e-9
