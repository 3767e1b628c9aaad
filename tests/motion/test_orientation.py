import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from openpendant.motion.errors import BadArgument, NotFinite
from openpendant.motion.jog.jog_commands import turned
from openpendant.motion.orientation import (
    angular_velocity_of_rpy_rates,
    quaternion_of_vector,
    roll_pitch_yaw,
    rotation_of_vector,
    rpy_increment,
    vector_of_quaternion,
)
from openpendant.motion.pose import Pose, quaternion_to_matrix

angles = st.floats(-3.1, 3.1)
pitches = st.floats(-1.5, 1.5)
rpys = st.tuples(angles, pitches, angles)
vectors = st.tuples(*[st.floats(-1.8, 1.8)] * 3)
HERE = (0.1, -0.2, 0.3)


@given(rpys)
def test_roll_pitch_yaw_are_read_back(rpy: tuple[float, ...]) -> None:
    assert roll_pitch_yaw(Pose.from_rpy(HERE, rpy).rotation) == pytest.approx(rpy, abs=1e-12)


@pytest.mark.parametrize("pitch", [math.pi / 2, -math.pi / 2])
@given(roll=angles, yaw=angles)
def test_straight_up_or_down_the_roll_is_zero_and_the_rotation_kept(
    pitch: float, roll: float, yaw: float
) -> None:
    pose = Pose.from_rpy(HERE, (roll, pitch, yaw))
    found = roll_pitch_yaw(pose.rotation)
    assert found[0] == 0.0
    assert Pose.from_rpy(HERE, found).rotation_distance(pose) < 1e-7


@given(vectors)
def test_a_rotation_vector_its_quaternion_and_its_matrix_are_one(vector: tuple[float, ...]) -> None:
    quaternion = quaternion_of_vector(np.array(vector))
    matrix = rotation_of_vector(np.array(vector))
    np.testing.assert_allclose(quaternion_to_matrix(quaternion), matrix, rtol=0, atol=1e-14)
    if math.hypot(*vector) < 3.0:
        assert vector_of_quaternion(quaternion) == pytest.approx(vector, abs=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-12, 1e-8])
def test_small_turns_keep_their_digits(angle: float) -> None:
    quaternion = quaternion_of_vector(np.array([0.0, angle, 0.0]))
    assert vector_of_quaternion(quaternion)[1] == pytest.approx(angle, rel=1e-12)


@given(rpys, st.integers(0, 2))
def test_the_columns_of_the_rate_matrix_are_the_axes_turned_about(
    rpy: tuple[float, ...], which: int
) -> None:
    step = 1e-6
    varied = np.array(rpy)
    varied[which] += step
    before, after = (Pose.from_rpy(HERE, values).rotation for values in (rpy, varied))
    spin = (after @ before.T - np.eye(3)) / step
    omega = [spin[2, 1], spin[0, 2], spin[1, 0]]
    assert angular_velocity_of_rpy_rates(rpy)[:, which] == pytest.approx(omega, abs=1e-5)


@given(rpys)
def test_an_increment_of_the_values_adds_to_the_values(rpy: tuple[float, ...]) -> None:
    pose = rpy_increment(Pose.from_rpy(HERE, rpy), (0.01, 0.02, -0.01))
    assert pose.rotation_distance(Pose.from_rpy(HERE, np.add(rpy, (0.01, 0.02, -0.01)))) < 1e-12
    assert pose.position.tolist() == list(HERE)


@pytest.mark.parametrize(
    ("rpy", "axis", "same"),
    [
        ((0.0, 0.0, 0.0), 0, True),
        ((0.0, 0.0, 0.0), 1, True),
        ((0.3, 0.2, 0.1), 2, True),
        ((0.3, 0.2, 0.1), 0, False),
        ((0.3, 0.2, 0.1), 1, False),
    ],
)
def test_the_two_increments_are_different_things(
    rpy: tuple[float, ...], axis: int, same: bool
) -> None:
    pose = Pose.from_rpy(HERE, rpy)
    change = 0.1 * np.eye(3)[axis]
    by_value, by_axis = rpy_increment(pose, change), turned(pose, change.tolist())
    assert (by_value.rotation_distance(by_axis) < 1e-12) is same


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_an_increment_that_is_no_number_is_refused(bad: float) -> None:
    with pytest.raises(NotFinite):
        rpy_increment(Pose.identity(), (0.0, bad, 0.0))


@pytest.mark.parametrize("values", [(0.1,), (0.1, 0.2), (0.1, 0.2, 0.3, 0.4)])
def test_other_than_three_values_are_refused(values: tuple[float, ...]) -> None:
    with pytest.raises(BadArgument, match="3 numbers"):
        rpy_increment(Pose.identity(), values)
    with pytest.raises(BadArgument, match="3 numbers"):
        angular_velocity_of_rpy_rates(values)
