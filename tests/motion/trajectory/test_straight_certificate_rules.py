"""Each rule of the certificate of a straight move alone, on a move whose numbers are round.

20 samples of 0.1 s, of which it speeds up for 5 and slows down for 5: the greatest rate is
1 / ((20 - 5) · 0.1 s) = 2/3 per second, and the sharpest change 2/3 / 0.5 s = 4/3 per second².
"""

from dataclasses import replace

import pytest

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import CertificateRefused
from openpendant.motion.trajectory.certificate import certify_straight_move
from openpendant.motion.trajectory.ptp import StraightMove

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
    move: StraightMove, limits: JointLimits = LIMITS, start: tuple[float, float] | None = None
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
def test_both_ends_of_the_move_are_in_the_range(
    start: float, goal: float, value: float, limit: float
) -> None:
    move = StraightMove((0.0, start), (0.0, goal), 20, 5, 0.1)
    assert refused(move) == ("position", "arm", value, limit)


@pytest.mark.parametrize("off", [0.0101, -0.0101])
def test_the_start_alone(off: float) -> None:
    assert refused(MOVE, start=(0.0, off)) == ("start", "arm", 0.0101, 0.01)


@pytest.mark.parametrize(("steps", "ramp", "period"), [(20, 0, 0.1), (20, 11, 0.1), (20, 5, -0.1)])
def test_a_move_that_is_none_in_time(steps: int, ramp: int, period: float) -> None:
    assert refused(StraightMove((0.0, 0.0), (0.0, 0.0), steps, ramp, period))[0] == "time"
