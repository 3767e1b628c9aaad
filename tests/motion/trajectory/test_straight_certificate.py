import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rigs.motion.loaded_robots import serial_robot

from openpendant.motion.description.robot import robot_names
from openpendant.motion.errors import CertificateRefused, WrongJointCount
from openpendant.motion.trajectory.certificate import certify, certify_straight_move
from openpendant.motion.trajectory.ptp import StraightMove, straight_move

SERIAL = [name for name in robot_names() if name != "stewart_classroom"]
UR5 = serial_robot("ur5")
HOME = UR5.home_position
GOAL = (HOME[0] + 0.8, HOME[1], HOME[2] - 0.4, *HOME[3:])


@pytest.fixture
def move() -> StraightMove:
    return straight_move(HOME, GOAL, UR5.limits)


@pytest.mark.parametrize("name", SERIAL)
def test_it_finds_what_the_check_of_all_samples_finds(name: str) -> None:
    limits = serial_robot(name).limits
    rng = np.random.default_rng(3)
    for _ in range(20):
        start, goal = rng.uniform(limits.lower, limits.upper, (2, limits.dof)).tolist()
        move = straight_move(start, goal, limits, speed=rng.uniform(0.02, 1.0))
        dense = certify(move.trajectory(), limits, start=start)
        proved = certify_straight_move(move, limits, start=start)
        assert proved.samples == dense.samples
        assert proved.velocity.ratio == pytest.approx(dense.velocity.ratio, rel=1e-9)
        assert proved.acceleration.ratio == pytest.approx(dense.acceleration.ratio, rel=1e-9)
        assert proved.position_margin == pytest.approx(dense.position_margin, abs=1e-12)


@pytest.mark.parametrize("name", SERIAL)
def test_single_rows_are_the_samples_of_the_trajectory(name: str) -> None:
    limits = serial_robot(name).limits
    rng = np.random.default_rng(4)
    start, goal = rng.uniform(limits.lower, limits.upper, (2, limits.dof)).tolist()
    move = straight_move(start, goal, limits)
    trajectory = move.trajectory()
    for index in range(len(move)):
        row, sample = move.row(index), trajectory.row(index)
        assert row.time == pytest.approx(sample.time, abs=1e-12)
        assert row.position == pytest.approx(sample.position, abs=1e-12)
        assert row.velocity == pytest.approx(sample.velocity, abs=1e-12)
        assert row.acceleration == pytest.approx(sample.acceleration, abs=1e-9)


@pytest.mark.parametrize(
    ("change", "check"),
    [
        ({"goal": (7.0, *GOAL[1:])}, "position"),
        ({"goal": (math.nan, *GOAL[1:])}, "finite"),
        ({"goal": (math.inf, *GOAL[1:])}, "finite"),
        ({"goal": (math.nextafter(UR5.limits.upper[0], 9.0), *GOAL[1:])}, "position"),
        ({"steps": 20, "ramp": 10}, "velocity"),
        ({"period": 0.005}, "velocity"),
        ({"ramp": 1}, "acceleration"),
        ({"ramp": 0}, "time"),
        ({"ramp": 10_000}, "time"),
        ({"period": 0.0}, "time"),
        ({"period": math.nan}, "time"),
        ({"start": (HOME[0] + 0.02, *HOME[1:])}, "start"),
        ({"start": (math.nan, *HOME[1:])}, "finite"),
    ],
)
def test_a_planted_fault_is_refused_by_name(
    move: StraightMove, change: dict[str, Any], check: str
) -> None:
    with pytest.raises(CertificateRefused) as refused:
        certify_straight_move(replace(move, **change), UR5.limits, start=HOME)
    assert refused.value.check == check


def test_a_move_of_another_robot_is_refused(move: StraightMove) -> None:
    with pytest.raises(WrongJointCount):
        certify_straight_move(replace(move, goal=GOAL[:5]), UR5.limits, start=HOME)


def test_it_says_how_it_was_made(move: StraightMove) -> None:
    found = certify_straight_move(move, UR5.limits, start=HOME).as_dict()
    assert found["valid"] is True
    assert found["method"] == "closed form"
