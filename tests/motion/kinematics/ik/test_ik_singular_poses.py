"""Singular joint positions, where closed forms divide by zero and searches slow down."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from rigs.data.example_counts import counts
from rigs.motion.loaded_robots import serial_robot

from openpendant.motion.description.robot import robot_names
from openpendant.motion.kinematics.closed_form import closed_form
from openpendant.motion.kinematics.ik.ik import POSITION_TOLERANCE, ROTATION_TOLERANCE, solve
from openpendant.motion.kinematics.serial import Kinematics

Array = NDArray[np.float64]
Place = Callable[[Kinematics, Array, float], Array | None]

SERIAL = tuple(name for name in robot_names() if name != "stewart_classroom")
WRIST_JOINT = {4: None, 6: 4, 7: 5}  # by number of axes
ELBOW_JOINT = {"kuka_iiwa14": 3, "mitsubishi_rh6frh5520": 1, "rail_kr5_arc": 3}
OFF = (0.0, 1e-6, 1e-3)


def with_stretched_wrist(kinematics: Kinematics, position: Array, off: float) -> Array | None:
    joint = WRIST_JOINT[kinematics.dof]
    if joint is not None:
        position[joint] = off
    return position


def with_straight_elbow(kinematics: Kinematics, position: Array, off: float) -> Array | None:
    """Set the bend of the elbow, which is linear in its joint; None if that is out of range."""
    joint = ELBOW_JOINT.get(kinematics.robot.name, 2)
    form = closed_form(kinematics)
    if form is None:
        position[joint] = off
    else:
        model = list(kinematics.robot.to_model(position.tolist()))
        for _ in range(2):
            bend = form.measures(model).elbow
            plus = [*model[:joint], model[joint] + 1e-3, *model[joint + 1 :]]
            rate = math.remainder(form.measures(plus).elbow - bend, 2.0 * math.pi) / 1e-3
            model[joint] -= math.remainder(bend - off, 2.0 * math.pi) / rate
        position[joint] = kinematics.robot.to_controller(model)[joint]
    lower, upper = kinematics.lower[joint], kinematics.upper[joint]
    for turn in (0.0, 2.0 * math.pi, -2.0 * math.pi):
        if lower <= position[joint] + turn <= upper:
            position[joint] += turn
            return position
    return None


def at_zero(kinematics: Kinematics, position: Array, off: float) -> Array | None:
    zero: Array = np.clip(np.full(kinematics.dof, off), kinematics.lower, kinematics.upper)
    return zero


def at_zero_but_for_the_first(kinematics: Kinematics, position: Array, off: float) -> Array | None:
    zero: Array = np.clip(np.full(kinematics.dof, off), kinematics.lower, kinematics.upper)
    zero[0] = position[0]
    return zero


PLACES: tuple[Place, ...] = (
    with_stretched_wrist,
    with_straight_elbow,
    at_zero,
    at_zero_but_for_the_first,
)


@pytest.mark.parametrize("count", counts(2, 200))
@pytest.mark.parametrize("place", PLACES, ids=lambda place: place.__name__)
@pytest.mark.parametrize("name", SERIAL)
def test_a_singular_pose_is_solved_from_near_and_far(name: str, place: Place, count: int) -> None:
    kinematics = Kinematics(serial_robot(name))
    random = np.random.default_rng(12)
    for off in OFF:
        for _ in range(count):
            anywhere, far = random.uniform(kinematics.lower, kinematics.upper, (2, kinematics.dof))
            position = place(kinematics, anywhere, off)
            if position is None:
                continue
            near = position + random.uniform(-0.02, 0.02, kinematics.dof)
            target = kinematics.forward(position)
            for seed in (near, far):
                solution = solve(kinematics, target, seed)
                kinematics.limits.check_position(solution.joint_position.tolist())
                reached = kinematics.forward(solution.joint_position)
                assert reached.position_distance(target) <= POSITION_TOLERANCE
                assert reached.rotation_distance(target) <= ROTATION_TOLERANCE


@pytest.mark.parametrize("name", ["abb_irb2400", "fanuc_m10ia", "puma560"])
def test_a_far_target_with_a_stretched_wrist_keeps_the_seeds_fourth_joint(name: str) -> None:
    kinematics = Kinematics(serial_robot(name))
    position = np.array([0.4, 0.3, 0.2, 0.9, 0.0, -0.3])
    seed = np.array([-0.6, 0.0, 0.1, 0.5, 0.4, 0.2])
    solution = solve(kinematics, kinematics.forward(position), seed)
    turned = math.remainder(solution.joint_position[3] - seed[3], math.pi)
    assert turned == pytest.approx(0.0, abs=1e-9)
