import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from openpendant.motion.errors import BadArgument, NotFinite
from openpendant.motion.pose import Pose, matrix_to_quaternion, rotation_distance, slerp

coordinates = st.floats(-10.0, 10.0)
positions = st.tuples(coordinates, coordinates, coordinates)
angles = st.floats(-math.pi, math.pi)
poses = st.builds(
    Pose.from_rpy, positions, st.tuples(angles, st.floats(-math.pi / 2, math.pi / 2), angles)
)


def assert_close(first: Pose, second: Pose) -> None:
    assert first.position_distance(second) < 1e-12
    assert first.rotation_distance(second) < 1e-12


@given(poses)
def test_a_pose_followed_by_its_inverse_moves_nothing(pose: Pose) -> None:
    assert_close(pose.compose(pose.inverse()), Pose.identity())
    assert_close(pose.inverse().compose(pose), Pose.identity())


@given(poses, poses)
def test_composing_is_multiplying_the_matrices(first: Pose, second: Pose) -> None:
    product = first.to_matrix() @ second.to_matrix()
    np.testing.assert_allclose(first.compose(second).to_matrix(), product, rtol=0, atol=1e-12)


@given(poses)
def test_a_pose_survives_the_way_through_a_matrix(pose: Pose) -> None:
    assert_close(Pose.from_matrix(pose.rotation, pose.position), pose)


@given(poses)
def test_quaternions_are_unit_and_w_is_not_negative(pose: Pose) -> None:
    assert np.linalg.norm(pose.quaternion) == pytest.approx(1.0, abs=1e-15)
    assert pose.quaternion[3] >= 0.0


@given(poses, poses, st.floats(0.0, 1.0))
def test_slerp_divides_the_angle_in_proportion(first: Pose, second: Pose, part: float) -> None:
    middle = slerp(first.quaternion, second.quaternion, part)
    whole = first.rotation_distance(second)
    assert rotation_distance(first.quaternion, middle) == pytest.approx(part * whole, abs=1e-7)
    assert rotation_distance(middle, second.quaternion) == pytest.approx(
        (1.0 - part) * whole, abs=1e-7
    )


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, 1e-3, 1.0, 3.0, math.pi])
def test_the_distance_between_orientations_keeps_its_digits(angle: float) -> None:
    turned = Pose.from_rpy((0.0, 0.0, 0.0), (angle, 0.0, 0.0))
    assert Pose.identity().rotation_distance(turned) == pytest.approx(angle, rel=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_turns_are_read_from_their_matrices(axis: int) -> None:
    diagonal = np.full(3, -1.0)
    diagonal[axis] = 1.0
    assert matrix_to_quaternion(np.diag(diagonal)).tolist() == np.eye(4)[axis].tolist()


def test_roll_pitch_yaw_turns_about_x_then_y_then_z_of_the_parent() -> None:
    pose = Pose.from_rpy((0.0, 0.0, 0.0), (math.pi / 2, 0.0, math.pi / 2))
    np.testing.assert_allclose(pose.rotation @ [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(pose.rotation @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], rtol=0, atol=1e-15)


def test_interpolation_goes_straight_and_ends_exactly() -> None:
    start = Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    goal = Pose.from_rpy((2.0, 0.0, 4.0), (0.0, 0.0, 1.0))
    half = start.interpolate(goal, 0.5)
    assert half.position.tolist() == [1.0, 0.0, 2.0]
    assert half.rotation_distance(start) == pytest.approx(0.5)
    assert_close(start.interpolate(goal, 1.0), goal)


def test_a_pose_owns_arrays_that_cannot_be_written() -> None:
    position = np.array([1.0, 2.0, 3.0])
    pose = Pose(position, np.array([0.0, 0.0, 0.0, 2.0]))
    position[0] = 9.0
    assert pose.position.tolist() == [1.0, 2.0, 3.0]
    assert pose.quaternion.tolist() == [0.0, 0.0, 0.0, 1.0]
    with pytest.raises(ValueError, match="read-only"):
        pose.position[0] = 9.0


@pytest.mark.parametrize(
    ("position", "quaternion"),
    [
        ([0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]),
        ([0.0, 0.0, 0.0], [0.0, 1e-7, 0.0, 0.0]),
        ([2e6, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
    ],
)
def test_a_malformed_pose_is_refused(position: list[float], quaternion: list[float]) -> None:
    with pytest.raises(BadArgument):
        Pose.from_values(position, quaternion)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_pose_with_a_value_that_is_not_finite_is_refused(value: float) -> None:
    with pytest.raises(NotFinite):
        Pose.from_values([0.0, value, 0.0], [0.0, 0.0, 0.0, 1.0])
    with pytest.raises(NotFinite):
        Pose.from_values([0.0, 0.0, 0.0], [0.0, 0.0, value, 1.0])


def test_a_huge_quaternion_is_normalised_without_overflow() -> None:
    pose = Pose.from_values([0.0, 0.0, 0.0], [1e300, 0.0, 0.0, 1e300])
    assert pose.quaternion.tolist() == pytest.approx([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])
