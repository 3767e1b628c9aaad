"""LIN, CIRC and spline as the emulated controller runs them, and the measure itself."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from rigs.motion.loaded_robots import serial_robot
from rigs.motion.robot_families import FAMILIES

from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths.tool_curves import ToolLine
from openpendant.motion.paths.tool_paths import follow_tool_curve
from openpendant.motion.pose import Array, Pose
from openpendant.tools.bench.path_accuracy import (
    GREATEST_ANGLE,
    GREATEST_DISTANCE,
    ROBOTS,
    benchmarks,
    deviations,
    robot_accuracy,
)

START = [0.3, -1.4, 1.6, -1.2, -1.3, 0.4]
ORIGIN = np.zeros(3)
AHEAD = np.array([0.0, 0.1, 0.0])
CALCULATED = np.linspace(0.01, 0.09, 50)


@pytest.mark.parametrize("name", [name for name in ROBOTS if name in FAMILIES])
def test_the_executed_tool_keeps_every_kind_of_path(
    name: str, record_property: Callable[[str, object], None]
) -> None:
    for kind, accuracy in robot_accuracy(name, size=0.06, runs=1).items():
        record_property(kind.value, f"{accuracy.distance:.3f} mm, {accuracy.angle:.4f}°")
        assert accuracy.distance <= GREATEST_DISTANCE, kind
        assert accuracy.angle <= GREATEST_ANGLE, kind


@pytest.mark.soak
@pytest.mark.parametrize("name", ROBOTS)
def test_the_executed_tool_keeps_many_long_paths(name: str) -> None:
    for kind, accuracy in robot_accuracy(name, places=10, runs=2, seed=1).items():
        assert accuracy.distance <= GREATEST_DISTANCE, kind
        assert accuracy.angle <= GREATEST_ANGLE, kind


@pytest.fixture(scope="module")
def ur5() -> Kinematics:
    return Kinematics(serial_robot("ur5"))


@pytest.fixture(scope="module")
def run(ur5: Kinematics) -> Array:
    """Joint positions along a line of 100 mm along y, from where UR5 stands."""
    path = follow_tool_curve(ur5, START, line_beside(ur5))
    return path.evaluate(np.linspace(0.0, path.length, 101))


def line_beside(kinematics: Kinematics, shift: Array = ORIGIN, turn: Array = ORIGIN) -> ToolLine:
    """The line of 100 mm along y from a place beside where UR5 stands, the tool turned there."""
    here = kinematics.forward(START)
    turned = Pose.from_rpy(ORIGIN, turn).compose(Pose(ORIGIN, here.quaternion))
    begin = Pose(here.position + shift, turned.quaternion)
    return ToolLine(begin, Pose(begin.position + AHEAD, turned.quaternion))


@pytest.mark.parametrize("every", [[1], [1, 5, 20]])
def test_a_tool_that_is_late_on_its_path_is_not_off(
    ur5: Kinematics, run: Array, every: list[int]
) -> None:
    late = np.concatenate(
        [
            np.repeat(part, n, axis=0)
            for part, n in zip(np.array_split(run, len(every)), every, strict=True)
        ]
    )
    off = deviations(ur5, line_beside(ur5), late, CALCULATED)
    assert np.abs(off[:, :3]).max() < 2e-5
    assert np.abs(off[:, 3:]).max() < math.radians(0.005)


def test_a_tool_beside_its_path_is_off_by_what_it_is_aside_and_turned(
    ur5: Kinematics, run: Array
) -> None:
    aside, turned = np.array([0.003, 0.0, -0.004]), np.array([0.0, 0.0, 0.02])
    off = deviations(ur5, line_beside(ur5, aside, turned), run, CALCULATED)
    assert off[:, :3] == pytest.approx(np.tile(-aside, (50, 1)), abs=2e-5)
    assert off[:, 3:] == pytest.approx(np.tile(-turned, (50, 1)), abs=1e-4)


def test_every_robot_is_reported_in_position_and_orientation() -> None:
    rows = [(benchmark.name, benchmark.unit) for benchmark in benchmarks()]
    assert len(rows) == 2 * len(ROBOTS) == 46
    assert rows[:2] == [
        (f"path accuracy {ROBOTS[0]}, position", "mm"),
        (f"path accuracy {ROBOTS[0]}, orientation", "deg"),
    ]
