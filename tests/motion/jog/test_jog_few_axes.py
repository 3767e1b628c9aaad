"""Tool jogs of arms of fewer than six axes whose tool keeps no direction."""

import math
from pathlib import Path

import numpy as np
import pytest
from rigs.data.foreign_robots import FEW_AXES
from rigs.data.urdf_files import SOUND, written
from rigs.motion.jog_referee import Referee
from rigs.motion.jogged_robots import REDUCED

from openpendant.motion.description.robot import robot_from_content
from openpendant.motion.jog import Jogger, JogSetpoint, JogSlowdown, ToolJog, jog_model
from openpendant.motion.paths.mechanism import Mechanism, mechanism
from openpendant.motion.robot_import.decisions import Decisions
from openpendant.motion.robot_import.new_robot import Wishes, configure
from openpendant.motion.robot_import.urdf import read_urdf
from openpendant.motion.robot_import.urdf_tree import chain_to

KEYS = "xyzABC"

TILTED = [0.3, 0.2, 0.9, -0.1, 0.2]
STRETCHED = [0.0, math.pi / 2.0, -math.pi / 2.0, 0.0, 0.0]
ALMOST_STRETCHED = [0.0, math.pi / 2.0, 0.02 - math.pi / 2.0, -0.02, 0.0]
"""Places of the five-axis arm: its tool aslant; its elbow straight; its elbow nearly so."""


def imported(urdf: str, tip: str, folder: Path) -> Mechanism:
    chain = chain_to(read_urdf(written(folder, urdf)), tip)
    content = configure(chain, Wishes(), Decisions("tiny.urdf", lambda _: None, None, False))
    return mechanism(robot_from_content(content, "tiny.yaml"))


@pytest.fixture(scope="module")
def five_axes(tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    foreign = FEW_AXES["five_axes"]
    return imported(foreign.urdf, foreign.tool, tmp_path_factory.mktemp("five_axes"))


def pressed(robot: Mechanism, start: list[float], key: str, ticks: int = 30) -> JogSetpoint:
    axis = tuple(np.eye(3)[KEYS.index(key) % 3])
    jog = ToolJog(axis) if key in "xyz" else ToolJog(angular=axis)
    watched = Referee(robot, Jogger(jog_model(robot), start, REDUCED))
    step = watched.run(jog, ticks)
    assert not watched.faults
    return step


@pytest.mark.parametrize("key", "xyABC")
def test_what_too_few_axes_cannot_do_is_told_as_that_without_a_way_out(
    five_axes: Mechanism, key: str
) -> None:
    step = pressed(five_axes, TILTED, key)
    assert step.position == TILTED
    assert step.cause is not None
    assert step.reason is JogSlowdown.DIRECTION
    asked = REDUCED.tool_speed if key in "xy" else REDUCED.rotation_speed
    assert step.cause.value == pytest.approx(asked)
    assert step.cause.limit == 0.0
    assert step.retreat is None


def test_what_is_left_to_few_axes_moves(five_axes: Mechanism) -> None:
    step = pressed(five_axes, TILTED, "z")
    way = five_axes.forward(step.position).position - five_axes.forward(TILTED).position
    assert way[2] > 0.02


@pytest.mark.parametrize("start", [STRETCHED, ALMOST_STRETCHED], ids=["at", "near"])
@pytest.mark.parametrize(
    ("key", "reason"), [("x", JogSlowdown.SINGULARITY), ("y", JogSlowdown.DIRECTION)]
)
def test_at_a_singularity_only_the_direction_that_is_lost_there_is_told_as_singular(
    five_axes: Mechanism, start: list[float], key: str, reason: JogSlowdown
) -> None:
    assert jog_model(five_axes).arm.condition(start) > 30.0
    step = pressed(five_axes, start, key)
    assert step.position == start
    assert step.reason is reason
    assert (step.retreat is not None) == (reason is JogSlowdown.SINGULARITY)


def test_a_way_that_few_axes_can_only_begin_ends_for_that_reason(tmp_path: Path) -> None:
    robot = imported(SOUND, "d", tmp_path)
    # The tool is at the elbow, right above the shoulder: it sets out along x, but on a circle.
    start = [0.0, math.atan2(-0.1, 0.2), 0.3]
    assert jog_model(robot).arm.forbids(start, np.array([0.25, 0.0, 0.0, 0.0, 0.0, 0.0])) is None
    step = pressed(robot, start, "x")
    assert step.at_rest
    assert step.position == pytest.approx(start, abs=1e-3)
    assert step.reason is JogSlowdown.DIRECTION


def test_the_axes_of_a_gantry_are_the_tools(tmp_path: Path) -> None:
    foreign = FEW_AXES["gantry"]
    robot = imported(foreign.urdf, foreign.tool, tmp_path)
    assert jog_model(robot).arm.condition(foreign.joints) == pytest.approx(1.0)
    for joint, (key, sign) in enumerate(zip("xyz", (1.0, 1.0, -1.0), strict=True)):
        step = pressed(robot, foreign.joints, key)
        moved = np.array(step.position) - np.array(foreign.joints)
        assert step.scale == 1.0
        assert moved[joint] * sign > 0.02
        assert np.delete(moved, joint) == pytest.approx([0.0, 0.0], abs=1e-9)
