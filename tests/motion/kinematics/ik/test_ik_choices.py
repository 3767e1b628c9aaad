import math

import numpy as np
import pytest
from rigs.motion.loaded_robots import arm, serial_robot
from rigs.motion.robot_families import one_of_each_family

from openpendant.motion.description.robot import robot_names
from openpendant.motion.kinematics.ik.ik import branch_of, solve_all, solve_configurations
from openpendant.motion.kinematics.ik.ik_choices import WantedBranches, choices

BENT = (0.1, -1.2, 1.3, -1.4, -1.5, 0.6)
SERIAL = one_of_each_family([name for name in robot_names() if name != "stewart_classroom"])


def test_each_configuration_is_told_once_in_the_turn_nearest_to_the_seed() -> None:
    kinematics = arm("ur5")
    target = kinematics.forward(BENT)
    seed = tuple(q + 2.0 * math.pi * (joint == 1) for joint, q in enumerate(BENT))
    found = choices(kinematics, target, seed, WantedBranches.ALL)
    assert found.listed[0].solution.joint_position.tolist() == pytest.approx(seed, abs=1e-6)
    assert found.listed[0].distance <= 1e-6
    turns = solve_all(kinematics, target, seed)
    for each in found.listed:
        position = each.solution.joint_position
        same = [
            float(np.abs(other.joint_position - seed).max())
            for other in turns
            if np.abs(np.sin((other.joint_position - position) / 2.0)).max() < 1e-6
        ]
        assert each.distance == pytest.approx(min(same), abs=1e-6)


@pytest.mark.parametrize("name", SERIAL)
def test_all_and_turns_are_what_solve_all_finds(name: str) -> None:
    kinematics = arm(name)
    home = serial_robot(name).home_position
    inside = np.clip(np.array(home) + 0.05, kinematics.lower, kinematics.upper)
    target = kinematics.forward(inside)
    every = solve_all(kinematics, target, home)
    turns = choices(kinematics, target, home, WantedBranches.TURNS)
    configurations = choices(kinematics, target, home, WantedBranches.ALL)
    numbers = [each.branch for each in configurations.listed]
    assert sorted(numbers) == list(range(1, configurations.total + 1))
    assert {each.branch for each in turns.listed} <= {*numbers}
    if turns.is_complete:
        assert turns.total == len(every)
    for each in (*turns.listed, *configurations.listed):
        kinematics.limits.check_position(each.solution.joint_position.tolist())
        assert each.solution.position_error <= 1e-5
        assert each.solution.rotation_error <= 1e-4


@pytest.mark.parametrize("wanted", [WantedBranches.ALL, WantedBranches.TURNS])
@pytest.mark.parametrize("name", SERIAL)
def test_the_answers_come_in_the_order_of_the_distance_that_they_tell(
    name: str, wanted: WantedBranches
) -> None:
    kinematics = arm(name)
    home = serial_robot(name).home_position
    inside = np.clip(np.array(home) + 0.05, kinematics.lower, kinematics.upper)
    found = choices(kinematics, kinematics.forward(inside), home, wanted)
    distances = [each.distance for each in found.listed]
    assert distances == sorted(distances)


@pytest.mark.parametrize("name", ["ur5", "fanuc_m10ia", "puma560", "kuka_kr6_2"])
def test_a_branch_is_the_one_that_a_motion_takes_by_its_number(name: str) -> None:
    kinematics = arm(name)
    home = serial_robot(name).home_position
    inside = np.clip(np.array(home) + 0.05, kinematics.lower, kinematics.upper)
    target = kinematics.forward(inside)
    for each in choices(kinematics, target, home, WantedBranches.ALL).listed:
        named = branch_of(kinematics, target, home, each.branch)
        assert named.joint_position == pytest.approx(each.solution.joint_position, abs=1e-6)


def test_a_rail_that_is_free_makes_a_family() -> None:
    kinematics = arm("rail_kr5_arc")
    home = serial_robot("rail_kr5_arc").home_position
    found = choices(kinematics, kinematics.forward(home), home, WantedBranches.ALL)
    assert not found.is_complete


def test_of_many_answers_the_nearest_are_listed_and_all_are_counted() -> None:
    kinematics = arm("ur5")
    found = solve_configurations(
        kinematics, kinematics.forward(BENT), BENT, most=3, in_every_turn=True
    )
    assert (len(found.listed), found.total) == (3, 256)
    assert found.numbers[0] == 1


def test_an_arm_of_four_axes_has_no_complete_answers() -> None:
    kinematics = arm("fanuc_m410ib")
    home = serial_robot("fanuc_m410ib").home_position
    found = choices(kinematics, kinematics.forward(home), home, WantedBranches.ALL)
    assert not found.is_complete
    assert found.listed[0].solution.configuration is None
