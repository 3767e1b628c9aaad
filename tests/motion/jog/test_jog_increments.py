from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jogged_robots import robot

from openpendant.motion.errors import BadArgument, NotFinite, OutOfRange, WrongJointCount
from openpendant.motion.jog.increments import (
    ANGLES,
    LENGTHS,
    StepKind,
    checked_step,
    joint_step,
    shifted,
    turned,
    with_rpy_changed,
)
from openpendant.motion.orientation import roll_pitch_yaw
from openpendant.motion.pose import Pose

angles = st.floats(-1.2, 1.2)
poses = st.builds(
    lambda p, r: Pose.from_rpy(p, r),
    st.tuples(*[st.floats(-1.0, 1.0)] * 3),
    st.tuples(angles, angles, angles),
)


def test_the_sizes_that_are_offered() -> None:
    assert [round(size * 1e3, 6) for size in LENGTHS] == [0.1, 1.0, 5.0, 10.0]
    assert [round(math.degrees(size), 6) for size in ANGLES] == [0.05, 0.5, 2.5, 5.0]
    for size in LENGTHS:
        assert checked_step(size, StepKind.LENGTH) == size
    for size in ANGLES:
        assert checked_step(size, StepKind.ANGLE) == size


@pytest.mark.parametrize("size", [0.0, -1e-3, 0.11, 1e-7, math.inf, math.nan])
def test_other_lengths_are_refused_with_what_is_accepted(size: float) -> None:
    with pytest.raises(BadArgument, match=r"1e-06 to 0\.1 m"):
        checked_step(size, StepKind.LENGTH)


def test_greater_angles_are_refused() -> None:
    assert checked_step(math.radians(30.0), StepKind.ANGLE)
    with pytest.raises(BadArgument, match="rad"):
        checked_step(math.radians(31.0), StepKind.ANGLE)


def test_several_joints_step_at_once_and_name_the_one_that_cannot() -> None:
    limits = robot("ur5").limits
    start = [0.0] * 6
    assert joint_step(start, (0.1, 0.0, -0.1, 0.0, 0.0, 0.2), limits)[5] == 0.2
    with pytest.raises(OutOfRange) as refused:
        joint_step(start, (0.0, 0.0, 4.0, 0.0, 0.0, 0.0), limits)
    assert refused.value.index == 2
    with pytest.raises(WrongJointCount):
        joint_step(start, (0.1,), limits)
    with pytest.raises(NotFinite):
        joint_step(start, (math.nan, 0.0, 0.0, 0.0, 0.0, 0.0), limits)


@given(poses, poses, st.tuples(*[st.floats(-0.1, 0.1)] * 3))
def test_a_shift_is_along_the_frames_axes(
    pose: Pose, frame: Pose, shift: tuple[float, float, float]
) -> None:
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
    after = turned(Pose.identity(), (0.0, 0.0, 0.1))
    assert after.rotation[1, 0] == pytest.approx(math.sin(0.1))


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


def test_the_two_things_called_a_are_not_one() -> None:
    pose = Pose.from_rpy((0.1, 0.2, 0.3), (0.3, 0.5, 0.7))
    by_axis = turned(pose, (0.1, 0.0, 0.0))
    by_value = with_rpy_changed(pose, (0.1, 0.0, 0.0))
    assert by_axis.rotation_distance(by_value) > 0.01


def test_what_is_malformed_is_refused() -> None:
    pose = Pose.identity()
    with pytest.raises(BadArgument, match="3 numbers"):
        shifted(pose, (0.1,))
    with pytest.raises(NotFinite):
        shifted(pose, (0.1, math.nan, 0.0))
    with pytest.raises(NotFinite):
        with_rpy_changed(pose, (math.inf, 0.0, 0.0))
