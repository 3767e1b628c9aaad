"""The branches of an arm, and the singularities where they meet."""

import math

import numpy as np
import pytest
from rigs.motion.loaded_robots import SERIAL, arm
from rigs.motion.nearness import assert_near

from openpendant.motion.errors import NotFinite, WrongJointCount
from openpendant.motion.kinematics.ik.configuration import (
    Configuration,
    Elbow,
    Shoulder,
    Wrist,
    configuration_of,
)
from openpendant.motion.kinematics.ik.ik import solve_all
from openpendant.motion.kinematics.ik.singularity import SingularityKind, angular_first, dexterity
from openpendant.motion.kinematics.serial import Kinematics

WITHOUT = ("fanuc_m410ib", "kuka_iiwa14", "mitsubishi_rh6frh5520")


@pytest.mark.parametrize("name", [name for name in SERIAL if name not in WITHOUT])
def test_the_branches_of_a_pose_differ_in_their_flags(kinematics: Kinematics) -> None:
    random = np.random.default_rng(13)
    for _ in range(5):
        position = random.uniform(kinematics.lower, kinematics.upper)
        answers = solve_all(kinematics, kinematics.forward(position), position)
        seen = [configuration_of(kinematics, answer.joint_position) for answer in answers]
        assert [answer.configuration for answer in answers] == seen
        assert len(set(seen)) == len(seen)


@pytest.mark.parametrize("name", WITHOUT)
def test_a_robot_without_a_closed_form_has_no_flags(kinematics: Kinematics) -> None:
    assert configuration_of(kinematics, kinematics.robot.home_position) is None


@pytest.mark.parametrize(
    ("position", "expected"),
    [
        ((0.0, 0.0, 0.0, 0.0, 0.5, 0.0), ("front", "up", "no-flip")),
        ((0.0, 0.0, 0.0, math.pi, -0.5, 0.0), ("front", "up", "flip")),
        ((0.0, -1.5, 0.0, 0.0, 0.5, 0.0), ("back", "down", "no-flip")),
        ((0.0, 0.5, -1.6, 0.0, 0.5, 0.0), ("front", "down", "no-flip")),
    ],
)
def test_the_flags_of_an_industrial_arm_say_what_one_sees(
    position: tuple[float, ...], expected: tuple[str, str, str]
) -> None:
    found = configuration_of(arm("abb_irb120"), position)
    assert found is not None
    assert (found.shoulder, found.elbow, found.wrist) == expected


@pytest.mark.parametrize(
    ("angle", "turn"),
    [
        (0.0, 0),
        (3.0, 0),
        (3.2, 1),
        (-3.2, -1),
        (math.pi, 1),
        (-math.pi, 0),
        (-6.2, -1),
    ],
)
def test_a_turn_is_counted_from_half_a_turn_below_zero(angle: float, turn: int) -> None:
    found = configuration_of(arm("ur5"), (0.0, 0.0, 0.5, 0.0, 0.5, angle))
    assert found is not None
    assert found.turns == (0, 0, 0, 0, 0, turn)


def test_rounding_noise_at_half_a_turn_does_not_change_the_turn() -> None:
    kinematics = arm("ur5")
    angles = (math.pi - 1e-12, math.pi, math.pi + 1e-12)
    found = {configuration_of(kinematics, (0.0, 0.0, 0.5, 0.0, 0.5, each)) for each in angles}
    assert len(found) == 1


def test_a_linear_axis_has_no_turns() -> None:
    kinematics = arm("rail_kr5_arc")
    position = np.array(kinematics.robot.home_position)
    position[0] = 3.0
    found = configuration_of(kinematics, position)
    assert found is not None
    assert found.turns is not None
    assert found.turns[0] == 0


def test_on_a_singularity_both_flags_are_right() -> None:
    kinematics = arm("abb_irb120")
    position = np.array([0.0, 0.3, 0.1, 0.4, 0.0, 0.2])
    target = kinematics.forward(position)
    for wrist in Wrist:
        wanted = Configuration(Shoulder.FRONT, Elbow.UP, wrist)
        answers = solve_all(kinematics, target, position, configuration=wanted)
        places = np.array([answer.joint_position for answer in answers])
        assert np.abs(places - position).max(axis=1).min() <= 1e-7


def test_malformed_joint_positions_are_refused() -> None:
    kinematics = arm("ur5")
    with pytest.raises(WrongJointCount):
        configuration_of(kinematics, (0.0,) * 5)
    with pytest.raises(NotFinite):
        configuration_of(kinematics, (0.0, math.nan, 0.0, 0.0, 0.0, 0.0))


# Of the IRB 120: forearm 0.302 m ahead of and 0.07 m above the elbow, so joint 3 straightens it at
STRETCHED = (0.3, 0.4, -math.atan2(0.302, 0.07), 0.4, 0.9, 0.5)


@pytest.mark.parametrize(
    ("position", "kind", "unit", "joints"),
    [
        ((0.3, 0.2, 0.1, 0.4, 0.0, 0.5), SingularityKind.WRIST, "rad", {"joint_4", "joint_6"}),
        (STRETCHED, SingularityKind.ELBOW, "rad", {"joint_2", "joint_3"}),
    ],
)
def test_a_singularity_is_named_with_its_joints(
    position: tuple[float, ...], kind: SingularityKind, unit: str, joints: set[str]
) -> None:
    found = dexterity(arm("abb_irb120"), position)
    assert (found.kind, found.unit) == (kind, unit)
    assert found.distance == pytest.approx(0.0, abs=1e-9)
    assert joints <= set(found.joints)
    assert found.least_gain < 1e-9
    assert found.manipulability < 1e-9
    assert found.condition > 1e9


def test_a_wrist_above_the_first_axis_is_a_shoulder_singularity() -> None:
    # Wrist centre: x = 0.27 sin q2 + 0.07 sin q2 + 0.302 cos q2 with joint 3 at zero.
    above = math.atan2(-0.302, 0.34)
    found = dexterity(arm("abb_irb120"), (0.3, above, 0.0, 0.4, 0.9, 0.5))
    assert (found.kind, found.unit) == (SingularityKind.SHOULDER, "m")
    assert found.distance == pytest.approx(0.0, abs=1e-9)
    assert "joint_1" in found.joints
    assert found.least_gain < 1e-9


@pytest.mark.parametrize("name", SERIAL)
def test_manipulability_is_yoshikawas_in_arm_sizes(kinematics: Kinematics) -> None:
    position = np.random.default_rng(14).uniform(kinematics.lower, kinematics.upper)
    jacobian = kinematics.jacobian(position)
    jacobian[:3] /= kinematics.size
    jacobian[:, np.array(kinematics.limits.prismatic)] *= kinematics.size
    wide = jacobian if kinematics.dof >= 6 else jacobian.T
    expected = math.sqrt(max(np.linalg.det(wide @ wide.T), 0.0))
    found = dexterity(kinematics, position)
    assert found.manipulability == pytest.approx(expected, rel=1e-6, abs=1e-12)
    assert found.condition == pytest.approx(np.linalg.cond(jacobian), rel=1e-6)


@pytest.mark.parametrize("name", ["abb_irb2400", "fanuc_m10ia", "ur5", "rail_kr5_arc"])
@pytest.mark.parametrize("off", [0.0, 0.02, -0.02])
def test_a_step_along_the_way_out_leads_away_from_it(kinematics: Kinematics, off: float) -> None:
    position = np.array(kinematics.robot.home_position) + 0.3
    position[kinematics.dof - 2] = off
    here = dexterity(kinematics, position)
    assert np.abs(here.way_out).max() == pytest.approx(1.0)
    there = dexterity(kinematics, position + 0.01 * here.way_out)
    assert there.least_gain > here.least_gain
    assert there.distance > here.distance
    wanted = kinematics.jacobian(position) @ here.way_out
    assert_near(here.way_out_twist, wanted, 1e-12)


def test_the_lost_twist_is_one_that_no_joint_makes() -> None:
    kinematics = arm("abb_irb120")
    position = (0.3, 0.2, 0.1, 0.4, 0.0, 0.5)
    found = dexterity(kinematics, position)
    jacobian = kinematics.jacobian(position)
    jacobian[:3] /= kinematics.size
    assert_near(found.lost_twist @ jacobian, np.zeros(6), 1e-12)
    assert np.linalg.norm(found.lost_twist) == pytest.approx(1.0)


def test_an_arm_without_named_singularities_says_which_joints_are_involved() -> None:
    kinematics = arm("kuka_iiwa14")
    found = dexterity(kinematics, (0.0,) * 7)
    assert found.kind is SingularityKind.UNNAMED
    assert found.unit == ""
    assert found.distance == found.least_gain < 1e-9
    assert found.joints


def test_the_other_order_of_a_twist_has_the_angular_part_first() -> None:
    assert angular_first(np.arange(6.0)).tolist() == [3.0, 4.0, 5.0, 0.0, 1.0, 2.0]
    jacobian = arm("ur5").jacobian((0.1,) * 6)
    np.testing.assert_array_equal(angular_first(jacobian)[:3], jacobian[3:])


def test_malformed_joint_positions_have_no_dexterity() -> None:
    kinematics = arm("ur5")
    with pytest.raises(WrongJointCount):
        dexterity(kinematics, (0.0,) * 7)
    with pytest.raises(NotFinite):
        dexterity(kinematics, (0.0, math.inf, 0.0, 0.0, 0.0, 0.0))
