import math

import numpy as np
import pytest
from rigs.motion.loaded_robots import SERIAL, arm

from openpendant.motion.errors import NotFinite, WrongJointCount
from openpendant.motion.kinematics.ik.configuration import (
    Configuration,
    Elbow,
    Shoulder,
    Wrist,
    configuration_of,
)
from openpendant.motion.kinematics.ik.ik import solve_all
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
    found = {
        configuration_of(kinematics, (0.0, 0.0, 0.5, 0.0, 0.5, math.pi + noise))
        for noise in (-1e-12, 0.0, 1e-12)
    }
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
        assert any(
            np.allclose(answer.joint_position, position, rtol=0, atol=1e-7) for answer in answers
        )


def test_malformed_joint_positions_are_refused() -> None:
    kinematics = arm("ur5")
    with pytest.raises(WrongJointCount):
        configuration_of(kinematics, (0.0,) * 5)
    with pytest.raises(NotFinite):
        configuration_of(kinematics, (0.0, math.nan, 0.0, 0.0, 0.0, 0.0))
