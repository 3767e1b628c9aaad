import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from openpendant.motion.errors import BadArgument, NotFinite
from openpendant.motion.jog.jog_commands import shifted, turned, with_rpy_changed
from openpendant.motion.orientation import roll_pitch_yaw
from openpendant.motion.pose import Pose

angles = st.floats(-1.2, 1.2)
poses = st.builds(
    lambda p, r: Pose.from_rpy(p, r),
    st.tuples(*[st.floats(-1.0, 1.0)] * 3),
    st.tuples(angles, angles, angles),
)


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


def test_the_two_things_called_a_are_not_one() -> None:
    pose = Pose.from_rpy((0.1, 0.2, 0.3), (0.3, 0.5, 0.7))
    by_axis = turned(pose, (0.1, 0.0, 0.0))
    assert by_axis.rotation_distance(with_rpy_changed(pose, (0.1, 0.0, 0.0))) > 0.01


def test_what_is_malformed_is_refused() -> None:
    pose = Pose.identity()
    with pytest.raises(BadArgument, match="3 numbers"):
        shifted(pose, (0.1,))
    with pytest.raises(NotFinite):
        shifted(pose, (0.1, math.nan, 0.0))
    with pytest.raises(NotFinite):
        with_rpy_changed(pose, (math.inf, 0.0, 0.0))
