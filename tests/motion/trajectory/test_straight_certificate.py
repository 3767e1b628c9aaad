"""Each rule of the certificate of a straight move alone, on a move whose numbers are round.

20 samples of 0.1 s, of which it speeds up for 5 and slows down for 5: the greatest rate is
1 / ((20 - 5) · 0.1 s) = 2/3 per second, and the sharpest change 2/3 / 0.5 s = 4/3 per second².
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rigs.motion.loaded_robots import SERIAL, serial_robot

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import CertificateRefused, WrongJointCount
from openpendant.motion.trajectory.certificate import certify, certify_straight_move
from openpendant.motion.trajectory.ptp import StraightMove, straight_move

LIMITS = JointLimits(
    names=("base", "arm"),
    lower=(-9.0, -1.0),
    upper=(9.0, 2.0),
    velocity=(9.0, 1.0),
    acceleration=(90.0, 2.0),
    prismatic=(False, False),
)
MOVE = StraightMove((0.0, 0.0), (0.0, 1.5), 20, 5, 0.1)
"""The arm goes by 1.5 rad: at 1 rad/s, and 2 rad/s²; both are its limits."""


def refused(
    move: StraightMove, limits: JointLimits = LIMITS, start: tuple[float, ...] | None = None
) -> tuple[str, str, float, float]:
    with pytest.raises(CertificateRefused) as refusal:
        certify_straight_move(move, limits, start=start or move.start)
    error = refusal.value
    return error.check, error.joint, round(error.value, 9), error.limit


def test_a_move_on_its_limits_is_certified() -> None:
    found = certify_straight_move(MOVE, LIMITS, start=(0.0, 0.005))
    for extreme, time in ((found.velocity, 0.5), (found.acceleration, 0.0)):
        assert extreme.joint == "arm"
        assert (extreme.ratio, extreme.time) == pytest.approx((1.0, time))
    assert (found.position_margin, found.position_joint) == (0.5, "arm")
    assert (found.start_distance, found.samples) == (0.005, 21)
    assert found.duration == pytest.approx(2.0)


@pytest.mark.parametrize("goal", [1.5, -1.5])
def test_a_velocity_alone(goal: float) -> None:
    limits = replace(LIMITS, lower=(-9.0, -2.0), velocity=(9.0, 0.9999))
    move = StraightMove((0.0, 0.0), (0.0, goal), 20, 5, 0.1)
    assert refused(move, limits) == ("velocity", "arm", 1.0, 0.9999)
    certify_straight_move(move, replace(limits, velocity=(9.0, 1.0 - 9e-7)), start=(0.0, 0.0))


def test_an_acceleration_alone() -> None:
    limits = replace(LIMITS, acceleration=(90.0, 1.99))
    assert refused(MOVE, limits) == ("acceleration", "arm", 2.0, 1.99)
    certify_straight_move(MOVE, replace(LIMITS, acceleration=(90.0, 1.9985)), start=(0.0, 0.0))


@pytest.mark.parametrize(
    ("start", "goal", "value", "limit"),
    [
        (0.6, 2.001, 2.001, 2.0),
        (2.001, 0.6, 2.001, 2.0),
        (0.0, -1.001, -1.001, -1.0),
        (-1.001, 0.0, -1.001, -1.0),
    ],
)
def test_both_ends_are_in_the_range(start: float, goal: float, value: float, limit: float) -> None:
    move = StraightMove((0.0, start), (0.0, goal), 20, 5, 0.1)
    assert refused(move) == ("position", "arm", value, limit)


@pytest.mark.parametrize("off", [0.0101, -0.0101])
def test_the_start_alone(off: float) -> None:
    assert refused(MOVE, start=(0.0, off)) == ("start", "arm", 0.0101, 0.01)


@pytest.mark.parametrize(("steps", "ramp", "period"), [(20, 0, 0.1), (20, 11, 0.1), (20, 5, -0.1)])
def test_a_move_that_is_none_in_time(steps: int, ramp: int, period: float) -> None:
    assert refused(StraightMove((0.0, 0.0), (0.0, 0.0), steps, ramp, period))[0] == "time"


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
def test_a_fault_is_refused_by_name(move: StraightMove, change: dict[str, Any], check: str) -> None:
    assert refused(replace(move, **change), UR5.limits, HOME)[0] == check


def test_a_move_of_another_robot_is_refused(move: StraightMove) -> None:
    with pytest.raises(WrongJointCount):
        certify_straight_move(replace(move, goal=GOAL[:5]), UR5.limits, start=HOME)


def test_it_says_how_it_was_made(move: StraightMove) -> None:
    found = certify_straight_move(move, UR5.limits, start=HOME).as_dict()
    assert found["valid"] is True
    assert found["method"] == "closed form"
