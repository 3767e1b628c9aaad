"""Poses, their orientations, and increments of both."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.motion.nearness import assert_near, assert_same_pose
from rigs.motion.refusals import Refusal, refusals

from openpendant.motion.errors import BadArgument, NotFinite
from openpendant.motion.jog.jog_commands import shifted, turned, with_rpy_changed
from openpendant.motion.orientation import (
    angular_velocity_of_rpy_rates,
    quaternion_of_vector,
    roll_pitch_yaw,
    rotation_of_vector,
    rpy_increment,
    vector_of_quaternion,
)
from openpendant.motion.pose import (
    Pose,
    composed,
    matrix_to_quaternion,
    quaternion_to_matrix,
    rotation_distance,
    slerp,
)

coordinates = st.floats(-10.0, 10.0)
positions = st.tuples(coordinates, coordinates, coordinates)
any_angles = st.floats(-math.pi, math.pi)
any_pitches = st.floats(-math.pi / 2, math.pi / 2)
any_poses = st.builds(Pose.from_rpy, positions, st.tuples(any_angles, any_pitches, any_angles))


@given(any_poses)
def test_a_pose_followed_by_its_inverse_moves_nothing(pose: Pose) -> None:
    assert_same_pose(pose.compose(pose.inverse()), Pose.identity())
    assert_same_pose(pose.inverse().compose(pose), Pose.identity())


@given(any_poses, any_poses)
def test_composing_is_multiplying_the_matrices(first: Pose, second: Pose) -> None:
    product = first.to_matrix() @ second.to_matrix()
    assert_near(first.compose(second).to_matrix(), product, 1e-12)


@given(any_poses, any_poses, st.integers(0, 300))
def test_a_chain_of_poses_is_composed_as_one_by_one(first: Pose, second: Pose, count: int) -> None:
    chain = [first, second][: count % 3] * (count // 2)
    wanted = Pose.identity()
    for each in chain:
        wanted = wanted.compose(each)
    assert_same_pose(composed(chain), wanted, 1e-8)


turns = st.tuples(*[st.sampled_from((-1.0, -0.5, -0.0, 0.0, 0.5, 1.0))] * 4)
many_poses = st.lists(st.tuples(positions, turns.filter(any)), min_size=1, max_size=5)


@given(any_poses, many_poses)
def test_many_are_composed_as_each_alone(
    place: Pose, poses: list[tuple[tuple[float, ...], tuple[float, ...]]]
) -> None:
    at_once = place.compose_all(np.array([(*position, *turn) for position, turn in poses]))
    alone = [place.compose(Pose.from_values(*pose)) for pose in poses]
    for row, pose in zip(at_once, alone, strict=True):
        assert_near(row[:3], pose.position, 1e-13)
        # Near w = 0 rounding decides which of the two quaternions of a rotation it is.
        same = 1.0 if row[3:] @ pose.quaternion > 0.0 or abs(row[6]) > 1e-12 else -1.0
        assert_near(same * row[3:], pose.quaternion, 1e-14)


@pytest.mark.parametrize(
    "turn",
    [(0.0, 0.0, 0.0, -1.0), (-1.0, 0.5, 0.0, 0.0), (0.0, -0.5, 1.0, 0.0), (0.0, 0.0, -2.0, 0.0)],
)
def test_of_the_two_quaternions_of_a_rotation_many_have_the_one_that_each_has(
    turn: tuple[float, ...],
) -> None:
    (row,) = Pose.identity().compose_all(np.array([(0.0, -0.0, 1.0, *turn)]))
    pose = Pose.from_values((0.0, -0.0, 1.0), turn)
    assert row.tolist() == [*pose.position.tolist(), *pose.quaternion.tolist()]
    assert not np.signbit(row[row == 0.0]).any()


def test_the_first_of_many_that_gets_too_far_is_refused() -> None:
    place = Pose.from_values((1e6, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    poses = np.array([(x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) for x in (-1.0, 0.0, 1.0, 2.0)])
    with pytest.raises(BadArgument, match=r"1000001\.0, 0\.0, 0\.0.*within a million metres"):
        place.compose_all(poses)
    assert place.compose_all(poses[:2])[:, 0].tolist() == [999_999.0, 1e6]


@given(any_poses)
def test_a_pose_survives_the_way_through_a_matrix(pose: Pose) -> None:
    assert_same_pose(Pose.from_matrix(pose.rotation, pose.position), pose)


@given(any_poses)
def test_quaternions_are_unit_and_w_is_not_negative(pose: Pose) -> None:
    assert np.linalg.norm(pose.quaternion) == pytest.approx(1.0, abs=1e-15)
    assert pose.quaternion[3] >= 0.0


@given(any_poses, any_poses, st.floats(0.0, 1.0))
def test_slerp_divides_the_angle_in_proportion(first: Pose, second: Pose, part: float) -> None:
    middle = slerp(first.quaternion, second.quaternion, part)
    whole = first.rotation_distance(second)
    before = rotation_distance(first.quaternion, middle)
    after = rotation_distance(middle, second.quaternion)
    assert (before, after) == pytest.approx((part * whole, (1.0 - part) * whole), abs=1e-7)


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
    assert_near(pose.rotation @ [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], 1e-15)
    assert_near(pose.rotation @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 1e-15)


def test_interpolation_goes_straight_and_ends_exactly() -> None:
    start = Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    goal = Pose.from_rpy((2.0, 0.0, 4.0), (0.0, 0.0, 1.0))
    half = start.interpolate(goal, 0.5)
    assert half.position.tolist() == [1.0, 0.0, 2.0]
    assert half.rotation_distance(start) == pytest.approx(0.5)
    assert_same_pose(start.interpolate(goal, 1.0), goal)


def test_a_pose_owns_arrays_that_cannot_be_written() -> None:
    position = np.array([1.0, 2.0, 3.0])
    pose = Pose(position, np.array([0.0, 0.0, 0.0, 2.0]))
    position[0] = 9.0
    assert pose.position.tolist() == [1.0, 2.0, 3.0]
    assert pose.quaternion.tolist() == [0.0, 0.0, 0.0, 1.0]
    with pytest.raises(ValueError, match="read-only"):
        pose.position[0] = 9.0


NAN, INF = math.nan, math.inf
STILL, ORIGIN, NO_TURN = Pose.identity(), [0.0] * 3, [0.0, 0.0, 0.0, 1.0]


@refusals(
    ("two numbers", lambda: Pose.from_values([0.0] * 2, NO_TURN), BadArgument, "accepted: "),
    ("three of a turn", lambda: Pose.from_values(ORIGIN, NO_TURN[1:]), BadArgument, "accepted: "),
    ("no turn", lambda: Pose.from_values(ORIGIN, [0.0] * 4), BadArgument, "accepted: "),
    ("short", lambda: Pose.from_values(ORIGIN, [0, 1e-7, 0, 0]), BadArgument, "accepted: "),
    ("far", lambda: Pose.from_values([2e6, 0, 0], NO_TURN), BadArgument, "accepted: "),
    ("NaN", lambda: Pose.from_values([0, NAN, 0], NO_TURN), NotFinite, "element 1 of position"),
    ("inf", lambda: Pose.from_values([0, INF, 0], NO_TURN), NotFinite, "element 1 of position"),
    ("-inf", lambda: Pose.from_values([0, -INF, 0], NO_TURN), NotFinite, "element 1 of position"),
    ("NaN as turn", lambda: Pose.from_values(ORIGIN, [0, 0, NAN, 1]), NotFinite, ""),
    ("inf as turn", lambda: Pose.from_values(ORIGIN, [0, 0, INF, 1]), NotFinite, ""),
    ("-inf as turn", lambda: Pose.from_values(ORIGIN, [0, 0, -INF, 1]), NotFinite, ""),
    ("roll by NaN", lambda: rpy_increment(STILL, (0.0, NAN, 0.0)), NotFinite, ""),
    ("roll by inf", lambda: rpy_increment(STILL, (0.0, INF, 0.0)), NotFinite, ""),
    ("roll alone", lambda: rpy_increment(STILL, (0.1,)), BadArgument, "3 numbers"),
    ("no yaw", lambda: rpy_increment(STILL, (0.1, 0.2)), BadArgument, "3 numbers"),
    ("too much", lambda: rpy_increment(STILL, [0.1] * 4), BadArgument, "3 numbers"),
    ("roll's rate", lambda: angular_velocity_of_rpy_rates((0.1,)), BadArgument, "3 numbers"),
    ("two rates", lambda: angular_velocity_of_rpy_rates([0.1] * 2), BadArgument, "3 numbers"),
    ("four rates", lambda: angular_velocity_of_rpy_rates([0.1] * 4), BadArgument, "3 numbers"),
    ("a shift of one", lambda: shifted(STILL, (0.1,)), BadArgument, "3 numbers"),
    ("a shift by NaN", lambda: shifted(STILL, (0.1, NAN, 0.0)), NotFinite, ""),
    ("a turn by inf", lambda: with_rpy_changed(STILL, (INF, 0.0, 0.0)), NotFinite, ""),
)
def test_what_is_no_pose_and_no_increment_is_refused(refusal: Refusal) -> None:
    refusal.check()


def test_a_huge_quaternion_is_normalised_without_overflow() -> None:
    pose = Pose.from_values([0.0, 0.0, 0.0], [1e300, 0.0, 0.0, 1e300])
    assert pose.quaternion.tolist() == pytest.approx([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])


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
def test_straight_up_or_down_the_roll_is_zero(pitch: float, roll: float, yaw: float) -> None:
    pose = Pose.from_rpy(HERE, (roll, pitch, yaw))
    found = roll_pitch_yaw(pose.rotation)
    assert found[0] == 0.0
    assert Pose.from_rpy(HERE, found).rotation_distance(pose) < 1e-7


@given(vectors)
def test_a_rotation_vector_its_quaternion_and_its_matrix_are_one(vector: tuple[float, ...]) -> None:
    quaternion = quaternion_of_vector(np.array(vector))
    matrix = rotation_of_vector(np.array(vector))
    assert_near(quaternion_to_matrix(quaternion), matrix, 1e-14)
    if math.hypot(*vector) < 3.0:
        assert vector_of_quaternion(quaternion) == pytest.approx(vector, abs=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-12, 1e-8])
def test_small_turns_keep_their_digits(angle: float) -> None:
    quaternion = quaternion_of_vector(np.array([0.0, angle, 0.0]))
    assert vector_of_quaternion(quaternion)[1] == pytest.approx(angle, rel=1e-12)


@given(rpys, st.integers(0, 2))
def test_each_column_of_the_rate_matrix_is_an_axis(rpy: tuple[float, ...], which: int) -> None:
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
def test_the_two_increments_are_different(rpy: tuple[float, ...], axis: int, same: bool) -> None:
    pose = Pose.from_rpy(HERE, rpy)
    change = 0.1 * np.eye(3)[axis]
    by_value, by_axis = rpy_increment(pose, change), turned(pose, change.tolist())
    assert (by_value.rotation_distance(by_axis) < 1e-12) is same


slopes = st.floats(-1.2, 1.2)
near = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
poses = st.builds(Pose.from_rpy, near, st.tuples(slopes, slopes, slopes))


@given(poses, poses, st.tuples(*[st.floats(-0.1, 0.1)] * 3))
def test_a_shift_is_along_a_frames_axes(pose: Pose, frame: Pose, shift: tuple[float, ...]) -> None:
    for axes in (None, frame, pose):
        moved = shifted(pose, shift, axes)
        rotation = np.eye(3) if axes is None else axes.rotation
        assert np.abs(rotation.T @ (moved.position - pose.position) - shift).max() < 1e-12
        assert moved.rotation_distance(pose) < 1e-12


@given(poses, poses, st.tuples(*[st.floats(-0.5, 0.5)] * 3))
def test_a_turn_is_about_an_axis_of_the_frame_and_stays_in_place(
    pose: Pose, frame: Pose, turn: tuple[float, float, float]
) -> None:
    angle = math.hypot(*turn)
    for axes in (None, frame, pose):
        after = turned(pose, turn, axes)
        assert after.position_distance(pose) == 0.0
        assert after.rotation_distance(pose) == pytest.approx(angle, abs=1e-9)
        direction = np.array(turn) if axes is None else axes.rotation @ turn
        assert np.abs(pose.rotation.T @ direction - after.rotation.T @ direction).max() < 1e-9


def test_a_turn_is_right_handed() -> None:
    assert turned(Pose.identity(), (0.0, 0.0, 0.1)).rotation[1, 0] == pytest.approx(math.sin(0.1))


@given(poses, poses, st.tuples(*[st.floats(-0.2, 0.2)] * 3))
def test_values_of_roll_pitch_and_yaw_change_by_the_amounts(
    pose: Pose, frame: Pose, change: tuple[float, float, float]
) -> None:
    for axes in (None, frame):
        changed = with_rpy_changed(pose, change, axes)
        rotation = np.eye(3) if axes is None else axes.rotation
        wanted = Pose.from_rpy((0, 0, 0), roll_pitch_yaw(rotation.T @ pose.rotation) + change)
        assert np.abs(rotation.T @ changed.rotation - wanted.rotation).max() < 1e-9
        assert changed.position_distance(pose) < 1e-12
