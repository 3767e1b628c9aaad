"""Random trajectories over all robots: the limits hold, and hardly any time is given away."""

import numpy as np
import pytest
from rigs.motion.loaded_robots import SERIAL, serial_robot
from rigs.motion.robot_families import FAMILIES
from rigs.motion.toppra_directly import certified_duration

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import OutOfRange
from openpendant.motion.pose import Array
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointSpline
from openpendant.motion.trajectory.sample_checks import ACCELERATION_TOLERANCE, VELOCITY_TOLERANCE
from openpendant.motion.trajectory.time_scaling import IntersampleCheck

PERIOD = 0.01


def random_path(limits: JointLimits, random: np.random.Generator) -> tuple[JointSpline, Array]:
    """A spline through 3 to 50 waypoints, from a hundredth of the ranges to half of them."""
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    while True:
        reach = 10.0 ** random.uniform(-2.0, 0.0) * (upper - lower)
        count = int(random.integers(3, 51))
        waypoints: Array = (lower + upper) / 2 + random.uniform(
            -0.25, 0.25, (count, limits.dof)
        ) * reach
        try:
            return JointSpline(waypoints, limits), waypoints
        except OutOfRange:
            continue


def check_random_trajectories(
    name: str, seed: int, count: int, *, compared: bool = True
) -> list[float]:
    """Check some trajectories, and return durations relative to the finer solution's.

    That and ten times the samples take most of the time: both may be left out.
    """
    limits = serial_robot(name).limits
    random = np.random.default_rng([seed, SERIAL.index(name)])
    ratios = []
    for _ in range(count):
        path, waypoints = random_path(limits, random)
        planned = time_path(path, limits, sample_period=PERIOD)
        certify(planned, limits, start=waypoints[0])
        assert np.array_equal(planned.position[[0, -1]], waypoints[[0, -1]])
        assert len(planned.waypoint_times) == len(waypoints)
        # What runs is the planned one: the motion through its samples, at every moment between.
        between = IntersampleCheck(planned, limits).pieces()
        speeds = np.abs(between.velocity).max(axis=(0, 2)) / limits.velocity
        gains = np.abs(between.acceleration).max(axis=(0, 2)) / limits.acceleration
        assert speeds.max() <= 1.0 + VELOCITY_TOLERANCE
        assert gains.max() <= 1.0 + ACCELERATION_TOLERANCE

        if not compared:
            continue
        dense = time_path(path, limits, sample_period=PERIOD / 10)
        found = certify(dense, limits, start=waypoints[0])
        assert found.velocity.ratio <= 1.0 + VELOCITY_TOLERANCE
        assert found.acceleration.ratio <= 1.0 + ACCELERATION_TOLERANCE
        # The two motions are one but for rounding the duration up to whole periods.
        assert dense.duration <= planned.duration <= dense.duration + PERIOD
        ratios.append(dense.duration / certified_duration(path, limits, PERIOD / 10))
    return ratios


@pytest.mark.parametrize("name", SERIAL)
def test_random_trajectories_are_certified(name: str) -> None:
    check_random_trajectories(name, seed=1, count=4, compared=False)


@pytest.mark.parametrize("name", [name for name in SERIAL if name in FAMILIES])
def test_random_trajectories_are_near_a_finer_solution(name: str) -> None:
    assert max(check_random_trajectories(name, seed=3, count=1)) <= 1.05


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", SERIAL)
def test_ten_thousand_trajectories_are_certified_and_near_a_finer_solution(
    name: str,
) -> None:
    ratios = check_random_trajectories(name, seed=2, count=435)
    assert max(ratios) <= 1.05
    assert np.median(ratios) <= 1.02
