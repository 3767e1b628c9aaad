"""Jogs of the Stewart platform: by legs and by pose, within all its limits."""

import numpy as np
import pytest
from rigs.motion.jog_referee import Referee, line_error
from rigs.motion.jogged_robots import REDUCED, model, robot
from rigs.motion.stewart_poses import PLATFORM

from openpendant.motion.jog import JogCaps, Jogger, JogSlowdown, JointJog, ToolJog

NAME = "stewart_classroom"
CAPS = JogCaps(tool_speed=0.1, rotation_speed=0.5, joint_fraction=1.0)


def referee(start: list[float], caps: JogCaps = CAPS) -> Referee:
    return Referee(robot(NAME), Jogger(model(NAME), start, caps), 0.02)


def home() -> list[float]:
    return list(robot(NAME).home_position)


def inside(position: list[float]) -> bool:
    PLATFORM.workspace.check(PLATFORM.forward(position))
    return True


@pytest.mark.parametrize(
    "axis", [0, 2, 4, *(pytest.param(axis, marks=pytest.mark.soak) for axis in (1, 3, 5))]
)
def test_a_pose_jog_goes_straight_to_the_border_and_back(axis: int) -> None:
    rates = [float(each == axis) for each in range(6)]
    watched = referee(home())
    step = watched.rest(ToolJog(tuple(rates[:3]), tuple(rates[3:])))
    assert step.reason in (JogSlowdown.WORKSPACE, JogSlowdown.JOINT_LIMIT)
    assert inside(step.position)
    assert PLATFORM.workspace.usage(PLATFORM.forward(step.position)) > 0.5
    if axis < 3:
        off, turned = line_error(robot(NAME), home(), np.eye(3)[axis], step)
        assert off < 1e-6
        assert turned < 1e-6
    back = ToolJog(tuple(-rate for rate in rates[:3]), tuple(-rate for rate in rates[3:]))
    assert not watched.run(back, 50).at_rest
    assert not watched.faults


@pytest.mark.parametrize(
    ("leg", "sign"),
    [
        (0, 1.0),
        (3, -1.0),
        *(
            pytest.param(leg, sign, marks=pytest.mark.soak)
            for leg in range(6)
            for sign in (1.0, -1.0)
            if (leg, sign) not in ((0, 1.0), (3, -1.0))
        ),
    ],
)
def test_a_leg_jog_stays_in_the_workspace_and_is_left_by_what_is_suggested(
    leg: int, sign: float
) -> None:
    rates = [sign * float(each == leg) for each in range(6)]
    watched = referee(home())
    step = watched.rest(JointJog(tuple(rates)), 1000)
    assert step.reason in (JogSlowdown.WORKSPACE, JogSlowdown.JOINT_LIMIT)
    assert inside(step.position)
    assert step.retreat is not None
    assert step.retreat.joints is not None
    assert not watched.run(JointJog(step.retreat.joints), 50).at_rest
    assert not watched.faults


def test_all_legs_together_lift_the_platform() -> None:
    watched = referee(home(), REDUCED)
    step = watched.run(JointJog((1.0,) * 6), 30)
    way = robot(NAME).forward(step.position).position - robot(NAME).forward(home()).position
    assert way[2] > 0.003
    assert np.abs(way[:2]).max() < 1e-6
    assert not watched.faults
