import math
import pickle

import numpy as np
import pytest

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import BadArgument
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import SAMPLE_PERIOD, Trajectory, join

LIMITS = JointLimits(
    names=("turn", "slide"),
    lower=(-3.0, -1.0),
    upper=(3.0, 1.0),
    velocity=(2.0, 0.5),
    acceleration=(8.0, 2.0),
    prismatic=(False, True),
)
HERE, THERE, ELSEWHERE = [0.0, 0.0], [1.0, -0.2], [-0.5, 0.3]
FIELDS = ("times", "position", "velocity", "acceleration", "waypoint_times")


@pytest.fixture
def move() -> Trajectory:
    return plan_joint_move(HERE, THERE, LIMITS)


@pytest.mark.parametrize("field", FIELDS)
def test_the_arrays_cannot_be_written(move: Trajectory, field: str) -> None:
    with pytest.raises(ValueError, match="read-only"):
        getattr(move, field)[0] = 1.0


@pytest.mark.parametrize("field", FIELDS)
def test_a_trajectory_survives_the_way_between_processes(move: Trajectory, field: str) -> None:
    arrived = pickle.loads(pickle.dumps(move))
    assert np.array_equal(getattr(arrived, field), getattr(move, field))
    assert not getattr(arrived, field).flags.writeable


def test_pickling_adds_little_to_the_numbers(move: Trajectory) -> None:

    assert len(pickle.dumps(move)) < sum(getattr(move, field).nbytes for field in FIELDS) + 1000


def test_the_shapes_must_agree(move: Trajectory) -> None:
    with pytest.raises(BadArgument, match="velocity"):
        Trajectory(
            move.times, move.position, move.velocity[1:], move.acceleration, move.waypoint_times
        )
    with pytest.raises(BadArgument, match="one row of joints for each time"):
        Trajectory(
            move.times[1:], move.position, move.velocity, move.acceleration, move.waypoint_times
        )


def test_at_a_sample_the_sample_is_returned(move: Trajectory) -> None:
    for row, time in enumerate(move.times.tolist()):
        state = move.sample(time)
        assert np.array_equal(state.position, move.position[row])
        assert np.array_equal(state.velocity, move.velocity[row])
        assert np.array_equal(state.acceleration, move.acceleration[row])


def test_between_samples_of_constant_acceleration_the_motion_is_exact(move: Trajectory) -> None:
    row, ahead = 3, 0.004
    state = move.sample(float(move.times[row]) + ahead)
    position, velocity = move.position[row], move.velocity[row]
    acceleration = move.acceleration[row]
    assert state.velocity == pytest.approx(velocity + acceleration * ahead, abs=1e-12)
    assert state.position == pytest.approx(
        position + velocity * ahead + acceleration * ahead**2 / 2.0, abs=1e-12
    )


@pytest.mark.parametrize(("time", "row"), [(-1.0, 0), (-math.inf, 0), (1e9, -1), (math.inf, -1)])
def test_outside_its_time_the_motion_stands_still(move: Trajectory, time: float, row: int) -> None:
    state = move.sample(time)
    assert np.array_equal(state.position, move.position[row])
    assert not state.velocity.any()


def test_a_time_that_is_no_number_is_refused(move: Trajectory) -> None:
    with pytest.raises(BadArgument, match="time"):
        move.sample(math.nan)


def test_joined_legs_follow_one_another() -> None:
    first = plan_joint_move(HERE, THERE, LIMITS)
    second = plan_joint_move(THERE, ELSEWHERE, LIMITS)

    whole = join([first, second])

    meeting = len(first.times) - 1
    assert whole.duration == pytest.approx(first.duration + second.duration)
    assert np.diff(whole.times) == pytest.approx(SAMPLE_PERIOD)
    assert np.array_equal(whole.position[: meeting + 1], first.position)
    assert np.array_equal(whole.position[meeting:], second.position)
    assert not whole.velocity[meeting].any()
    assert whole.waypoint_times == pytest.approx([0.0, first.duration, whole.duration])


def test_legs_that_do_not_meet_are_refused() -> None:
    first = plan_joint_move(HERE, THERE, LIMITS)
    with pytest.raises(BadArgument, match="leg 1 starts elsewhere"):
        join([first, first])


def test_legs_of_different_sample_periods_are_refused() -> None:
    first = plan_joint_move(HERE, THERE, LIMITS)
    second = plan_joint_move(THERE, HERE, LIMITS, sample_period=0.02)
    with pytest.raises(BadArgument, match="sample period"):
        join([first, second])


def test_no_legs_are_refused() -> None:
    with pytest.raises(BadArgument, match="at least one"):
        join([])
