import numpy as np
import pytest
from numpy.typing import NDArray
from rigs.motion.loaded_robots import serial_robot

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import BadArgument, WrongJointCount
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.joint_curves import JointSpline
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.time_scaling import IntersampleCheck
from openpendant.motion.trajectory.trajectory import Trajectory

Array = NDArray[np.float64]

LIMITS = serial_robot("ur5").limits
SINGLE = JointLimits(("a",), (-9.0,), (9.0,), (1.0,), (10.0,), (False,))


@pytest.fixture(scope="module")
def swing() -> Trajectory:
    return time_path(JointSpline(np.random.default_rng(1).uniform(-1.0, 1.0, (8, 6))), LIMITS)


def interval(v: float, v_next: float, moved: float) -> Trajectory:
    """Two samples of one joint, 0.1 s apart."""
    column: Array = np.zeros((2, 1))
    return Trajectory(
        np.array([0.0, 0.1]),
        np.array([[0.0], [moved]]),
        np.array([[v], [v_next]]),
        column,
        np.zeros(1),
    )


def test_the_motion_meets_every_sample(swing: Trajectory) -> None:
    motion = IntersampleCheck(swing, LIMITS)
    for index, time in enumerate(swing.times.tolist()):
        state = motion.state(time)
        assert state.position == pytest.approx(swing.position[index], abs=1e-12)
        assert state.velocity == pytest.approx(swing.velocity[index], abs=1e-12)


def test_the_motion_ends_each_interval_where_the_next_begins(swing: Trajectory) -> None:
    motion = IntersampleCheck(swing, LIMITS)
    for time in swing.times[1:-1].tolist():
        before = motion.state(time - 1e-9)
        assert before.position == pytest.approx(motion.state(time).position, abs=1e-8)
        assert before.velocity == pytest.approx(motion.state(time).velocity, abs=1e-6)


def test_a_planned_motion_keeps_its_limits_between_the_samples(swing: Trajectory) -> None:
    pieces = IntersampleCheck(swing, LIMITS).pieces()
    assert (np.abs(pieces.velocity).max(axis=(0, 2)) <= LIMITS.velocity).all()
    greatest = np.abs(pieces.acceleration).max(axis=(0, 2))
    assert (greatest <= np.array(LIMITS.acceleration) * 1.001).all()


def test_an_even_acceleration_is_found_again() -> None:
    move = plan_joint_move([0.0], [1.0], SINGLE)
    motion = IntersampleCheck(move, SINGLE)
    assert motion.pieces().acceleration[:, :, 0] == pytest.approx(move.acceleration[:-1], abs=1e-6)


def test_a_gain_in_position_takes_the_least_acceleration_there_is() -> None:
    # Up for half of the interval and down for the other: p = 4 |d| / h².
    motion = IntersampleCheck(interval(0.0, 0.0, 0.01), SINGLE)
    assert motion.pieces().acceleration[0, 0].tolist() == pytest.approx([4.0, 0.0, -4.0])
    assert motion.state(0.05).velocity == pytest.approx([0.2])


def test_the_velocity_limit_is_reached_but_not_passed() -> None:
    # From 0.9 to 0.9 with 0.098 in between: a triangle would reach 1.06.
    motion = IntersampleCheck(interval(0.9, 0.9, 0.098), SINGLE)
    assert motion.pieces().velocity.max() == pytest.approx(1.0)
    assert motion.pieces().acceleration[0, 0].tolist() == pytest.approx([5.0, 0.0, -5.0])
    assert motion.state(0.1).position == pytest.approx([0.098])


@pytest.mark.parametrize(("time", "row"), [(-1.0, 0), (1e9, -1)])
def test_outside_its_time_the_ends_hold(swing: Trajectory, time: float, row: int) -> None:
    state = IntersampleCheck(swing, LIMITS).state(time)
    assert state.position == pytest.approx(swing.position[row], abs=1e-12)
    assert state.velocity == pytest.approx(np.zeros(6), abs=1e-12)


def test_another_robots_trajectory_and_a_single_sample_are_refused(swing: Trajectory) -> None:
    with pytest.raises(WrongJointCount):
        IntersampleCheck(swing, SINGLE)
    one: Array = np.zeros((1, 1))
    with pytest.raises(BadArgument, match="two samples"):
        IntersampleCheck(Trajectory(np.zeros(1), one, one, one, np.zeros(1)), SINGLE)
