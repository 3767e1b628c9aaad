import math

import numpy as np
import pytest
from rigs.motion.loaded_robots import serial_robot

from openpendant.motion.kinematics.revolutions import SNAP, JointRanges
from openpendant.motion.kinematics.serial import Kinematics

# Ranges of less than a turn, of exactly one, of several; coupled joints; a linear axis.
ROBOTS = ("puma560", "kuka_kr5_arc", "ur5", "fanuc_m10ia", "rail_kr5_arc")


@pytest.mark.parametrize("name", ROBOTS)
def test_the_nearest_turn_is_the_nearest_of_every_turn(name: str) -> None:
    kinematics = Kinematics(serial_robot(name))
    ranges, random = JointRanges(kinematics), np.random.default_rng(3)
    lower, upper = kinematics.lower, kinematics.upper
    for _ in range(200):
        seed = random.uniform(lower, upper).tolist()
        turns = 2.0 * math.pi * random.integers(-2, 3, kinematics.dof) * kinematics.turning
        position = (random.uniform(1.1 * lower, 1.1 * upper) + turns).tolist()
        nearest = ranges.nearest(position, seed)
        distances = [ranges.distance(each, seed) for each in ranges.every(position)]
        assert (nearest is None) == (not distances)
        if nearest is not None:
            assert nearest[0] == pytest.approx(min(distances))
            kinematics.limits.check_position(nearest[1])


@pytest.mark.parametrize("noise", [-0.5 * SNAP, 0.0, 0.5 * SNAP])
@pytest.mark.parametrize("turn", [-1, 0, 1])
def test_an_answer_on_a_bound_stays_there_in_spite_of_noise(noise: float, turn: int) -> None:
    kinematics = Kinematics(serial_robot("ur5"))
    ranges, seed = JointRanges(kinematics), kinematics.upper.tolist()
    position = [value + noise + turn * 2.0 * math.pi for value in seed]
    nearest = ranges.nearest(position, seed)
    assert nearest is not None
    np.testing.assert_allclose(nearest[1], seed, rtol=0, atol=SNAP)
    kinematics.limits.check_position(nearest[1])
