"""Each rule of the limit certificate alone: samples that break just this one, or just keep it.

The samples are written down, 0.1 s apart, so every bound can be worked out by hand: a joint may
change its velocity by 0.4 rad/s from sample to sample, and be 0.01 rad beside its mean velocity.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import CertificateRefused
from openpendant.motion.trajectory.certificate import Certificate, certify
from openpendant.motion.trajectory.point_speed import ToolSpeedLimit
from openpendant.motion.trajectory.trajectory import Trajectory

Array = NDArray[np.float64]

LIMITS = JointLimits(
    names=("base", "arm"),
    lower=(-9.0, -1.0),
    upper=(9.0, 2.0),
    velocity=(9.0, 0.8),
    acceleration=(90.0, 4.0),
    prismatic=(False, False),
)
H = 0.1

SPEEDS = (0.0, 0.4, 0.8, 0.8, 0.4, 0.0)
WAY = (0.0, 0.02, 0.08, 0.16, 0.22, 0.24)
GAINS = (4.0, 4.0, 0.0, -4.0, -4.0, 0.0)
STILL = (0.0,) * 6


def moved(
    position: Sequence[float], velocity: Sequence[float], acceleration: Sequence[float] = STILL
) -> Trajectory:
    """Return the samples of a motion of the arm, its base at rest."""
    base: Array = np.zeros(len(position))
    columns = [np.column_stack((base, values)) for values in (position, velocity, acceleration)]
    times: Array = np.array([H * place for place in range(len(position))])
    return Trajectory(times, columns[0], columns[1], columns[2], times[[0, -1]].copy())


def refused(trajectory: Trajectory, limits: JointLimits = LIMITS) -> tuple[str, str, float, float]:
    """Return check, joint, value and limit of the refusal."""
    with pytest.raises(CertificateRefused) as refusal:
        certify(trajectory, limits)
    error = refusal.value
    return error.check, error.joint, round(error.value, 9), round(error.limit, 9)


def with_value(values: Sequence[float], place: int, value: float) -> list[float]:
    changed = list(values)
    changed[place] = value
    return changed


def test_a_motion_on_its_limits_is_certified_with_how_near_it_comes() -> None:
    found = certify(moved(WAY, SPEEDS, GAINS), LIMITS)
    for extreme, time in (
        (found.velocity, 0.2),
        (found.acceleration, 0.0),
        (found.mean_velocity, 0.3),
    ):
        assert extreme.joint == "arm"
        assert (extreme.ratio, extreme.time) == pytest.approx((1.0, time))
    assert found.mean_acceleration.ratio == pytest.approx(1.0)
    assert found.second_difference.ratio == pytest.approx(1.0)
    assert found.consistency.ratio == pytest.approx(0.0, abs=1e-9)
    assert found.drift.ratio == pytest.approx(0.0, abs=1e-9)
    assert found.position_margin == pytest.approx(1.0)
    assert found.position_joint == "arm"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_velocity_alone(side: float) -> None:
    speeds = with_value(SPEEDS, 2, 0.80001)
    motion = moved(np.multiply(side, WAY).tolist(), np.multiply(side, speeds).tolist(), GAINS)
    assert refused(motion) == ("velocity", "arm", 0.80001, 0.8)
    certify(moved(WAY, with_value(SPEEDS, 2, 0.8 * (1.0 + 9e-7)), GAINS), LIMITS)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_acceleration_alone(side: float) -> None:
    motion = moved(WAY, SPEEDS, with_value(GAINS, 2, side * 4.005))
    assert refused(motion) == ("acceleration", "arm", 4.005, 4.0)
    certify(moved(WAY, SPEEDS, with_value(GAINS, 2, side * 4.0039)), LIMITS)


def test_a_mean_velocity_alone() -> None:
    """Positions that go on faster than any velocity says: by 0.0002 rad between two samples."""
    way = (0.0, 0.02, 0.08, 0.1602, 0.2202, 0.2402)
    assert refused(moved(way, SPEEDS, GAINS)) == ("mean velocity", "arm", 0.802, 0.8)


def test_a_mean_acceleration_alone() -> None:
    speeds = (0.0, 0.3, 0.71, 0.71, 0.35, 0.0)
    way = (0.0, 0.015, 0.0655, 0.1365, 0.1895, 0.207)
    assert refused(moved(way, speeds)) == ("mean acceleration", "arm", 4.1, 4.0)


def test_a_second_difference_alone() -> None:
    """A sample on the way a millimetre behind: back where it should be with the next."""
    way = with_value(WAY, 1, 0.019)
    assert refused(moved(way, SPEEDS, GAINS)) == ("second difference", "arm", 4.2, 4.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_jump_alone(side: float) -> None:
    """A robot at rest by its velocities, which is elsewhere from one sample on."""
    way = [0.0, 0.0, 0.0, side * 0.0101, side * 0.0101, side * 0.0101]
    assert refused(moved(way, STILL)) == ("consistency", "arm", 0.0101, 0.01)
    certify(moved([value * 0.99 for value in way], STILL), LIMITS)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_drift_alone(side: float) -> None:
    """A robot at rest by its velocities that creeps, in each interval by less than a jump."""
    way = [side * 0.0099 * place for place in range(6)]
    check, joint, value, limit = refused(moved(way, STILL))
    assert (check, joint, value, limit) == ("drift", "arm", round(side * 0.0495, 9), 0.04)
    certify(moved(way[:5], STILL[:5], STILL[:5]), LIMITS)


def test_a_drift_that_the_variation_of_the_acceleration_explains_is_none() -> None:
    way = [0.0099 * place for place in range(6)]
    certify(moved(way, STILL, (4.0, -4.0, 4.0, -4.0, 4.0, -4.0)), LIMITS)


@pytest.mark.parametrize(
    ("shift", "value", "limit"), [(2.0 - 0.23, 2.01, 2.0), (-1.0 - 0.01, -1.01, -1.0)]
)
def test_a_position_alone(shift: float, value: float, limit: float) -> None:
    way = [shift + value for value in WAY]
    assert refused(moved(way, SPEEDS, GAINS)) == ("position", "arm", value, limit)


@pytest.mark.parametrize("place", [0, -1])
def test_rest_at_both_ends_alone(place: int) -> None:
    motion = moved(WAY, with_value(SPEEDS, place, 1e-9), GAINS)
    assert refused(motion) == ("rest", "arm", 1e-9, 0.0)
    if place == 0:
        certify(motion, LIMITS, start_velocity=[0.0, 1e-9])


@pytest.mark.parametrize("off", [0.0101, -0.0101])
def test_the_start_alone(off: float) -> None:
    with pytest.raises(CertificateRefused) as refusal:
        certify(moved(WAY, SPEEDS, GAINS), LIMITS, start=[0.0, off])
    assert (refusal.value.check, refusal.value.joint) == ("start", "arm")
    assert certify(moved(WAY, SPEEDS, GAINS), LIMITS, start=[0.0, 0.009]).start_distance == 0.009


@pytest.mark.parametrize(
    "times",
    [
        (0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
        (0.0, 0.1, 0.2, 0.300001, 0.4, 0.5),
        (0.0, -0.1, -0.2, -0.3, -0.4, -0.5),
    ],
)
def test_time_alone(times: tuple[float, ...]) -> None:
    motion = replace(moved(WAY, SPEEDS, GAINS), times=np.array(times))
    with pytest.raises(CertificateRefused) as refusal:
        certify(motion, LIMITS)
    assert refusal.value.check == "time"


def slow(point: Callable[[Array], Array], limit: float = 0.25) -> ToolSpeedLimit:
    return ToolSpeedLimit("tool", point, limit)


def along(joints: Array) -> Array:
    """A point that goes one metre along x with one radian of the arm."""
    return np.column_stack((joints[:, 1], 0.0 * joints[:, 0], 0.0 * joints[:, 0]))


def slanting(joints: Array) -> Array:
    """A point that goes one metre along x and one along z with one radian of the arm."""
    return np.column_stack((joints[:, 1], 0.0 * joints[:, 0], joints[:, 1]))


def standing(joints: Array) -> Array:
    return np.zeros((len(joints), 3))


def refused_point(motion: Trajectory, *points: ToolSpeedLimit) -> tuple[str, float, float]:
    with pytest.raises(CertificateRefused) as refusal:
        certify(motion, LIMITS, tool_speed=points)
    assert refusal.value.check == "tool speed"
    return refusal.value.joint, round(refusal.value.value, 6), refusal.value.limit


FAST_AT_ONE_SAMPLE = moved((0.0, 0.01, 0.033, 0.056, 0.066), (0.0, 0.2, 0.26, 0.2, 0.0), STILL[:5])
"""At 0.26 m/s at a sample, and on no way between two faster than 0.23."""

FAST_ON_ONE_WAY = moved(
    (0.0, 0.0125, 0.0385, 0.0635, 0.076), (0.0, 0.25, 0.25, 0.25, 0.0), STILL[:5]
)
"""At 0.25 m/s at the samples, and at 0.26 on the way between the second and the third."""

SLOW = moved((0.0, 0.0125, 0.0375, 0.0625, 0.075), (0.0, 0.25, 0.25, 0.25, 0.0), STILL[:5])
"""At 0.25 m/s at most."""


def test_the_speed_of_the_tool_at_a_sample_alone() -> None:
    assert refused_point(FAST_AT_ONE_SAMPLE, slow(along)) == ("the tool", 0.26, 0.25)


def test_the_speed_of_the_tool_between_two_samples_alone() -> None:
    assert refused_point(FAST_ON_ONE_WAY, slow(along)) == ("the tool", 0.26, 0.25)


def test_a_tool_on_its_limit_is_certified() -> None:
    found: Certificate = certify(SLOW, LIMITS, tool_speed=[slow(along)])
    (point,) = found.tool_speed
    assert (point.point, point.limit) == ("tool", 0.25)
    assert point.ratio == pytest.approx(1.0)


@pytest.mark.parametrize(("tolerated", "is_refused"), [(5e-7, False), (1e-5, True)])
def test_the_limit_of_the_tool_is_kept_but_for_a_millionth(
    tolerated: float, is_refused: bool
) -> None:
    point = slow(along, 0.25 / (1.0 + tolerated))
    if is_refused:
        assert refused_point(SLOW, point)[0] == "the tool"
    else:
        certify(SLOW, LIMITS, tool_speed=[point])


def test_the_speed_of_the_tool_is_that_of_all_its_axes() -> None:
    assert refused_point(SLOW, slow(slanting))[1] == pytest.approx(0.353553)


def test_every_point_is_looked_at() -> None:
    elbow = ToolSpeedLimit("elbow", along, 0.2)
    assert refused_point(SLOW, slow(standing), elbow) == ("the elbow", 0.25, 0.2)
    assert refused_point(SLOW, elbow, slow(standing)) == ("the elbow", 0.25, 0.2)


@pytest.mark.parametrize("place", [0, 5])
def test_a_jerk_alone(place: int) -> None:
    motion = moved(STILL, STILL, with_value(STILL, place, 3.0))
    with pytest.raises(CertificateRefused) as refusal:
        certify(motion, LIMITS, jerk=[1000.0, 29.9])
    error = refusal.value
    assert (error.check, error.joint, round(error.value, 9), error.limit) == (
        "jerk",
        "arm",
        30.0,
        29.9,
    )
    assert certify(motion, LIMITS, jerk=[1000.0, 30.0]).jerk is not None
