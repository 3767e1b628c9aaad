import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from openpendant.motion.errors import BadArgument, NotFinite, PoorGeometry
from openpendant.motion.frames.frame_teaching import frame_from_four_points, frame_from_three_points
from openpendant.motion.pose import Pose

coordinates = st.floats(-2.0, 2.0)
poses = st.builds(
    Pose.from_rpy,
    st.tuples(coordinates, coordinates, coordinates),
    st.tuples(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0)),
)
lengths = st.floats(0.05, 1.0)

ORIGIN, X, Y = (0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.2, 0.0)


def inside(frame: Pose, *point: float) -> list[float]:
    placed: list[float] = (frame.position + frame.rotation @ np.array(point)).tolist()
    return placed


@given(poses, lengths, st.floats(-0.5, 0.5), lengths)
def test_three_points_of_a_frame_give_the_frame_back(
    frame: Pose, x: float, beside: float, y: float
) -> None:
    assume(math.atan2(y, abs(beside)) > 0.1 and math.hypot(beside - x, y) > 0.02)
    taught = frame_from_three_points(
        frame.position, inside(frame, x, 0.0, 0.0), inside(frame, beside, y, 0.0)
    )
    assert taught.pose.position_distance(frame) == 0.0
    assert taught.pose.rotation_distance(frame) < 1e-12
    assert taught.x_distance == pytest.approx(x)
    assert taught.y_distance == pytest.approx(y)
    assert taught.angle == pytest.approx(math.atan2(y, beside))


def test_the_third_point_decides_the_side_of_z() -> None:
    assert frame_from_three_points(ORIGIN, X, Y).pose.rotation[:, 2] == pytest.approx([0, 0, 1])
    below = frame_from_three_points(ORIGIN, X, (0.1, -0.2, 0.0))
    assert below.pose.rotation[:, 2] == pytest.approx([0, 0, -1])


def test_the_tilt_tells_what_a_touch_that_is_off_does_to_the_frame() -> None:
    taught = frame_from_three_points(ORIGIN, X, Y)
    error = 1e-4
    tilted = frame_from_three_points(ORIGIN, X, (0.0, 0.2, error)).pose
    assert taught.pose.rotation_distance(tilted) == pytest.approx(
        error * taught.tilt_per_error, rel=1e-3
    )


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ((ORIGIN, ORIGIN, Y), ["origin to on_x", "0 mm", "at least 10 mm"]),
        ((ORIGIN, X, ORIGIN), ["origin to on_y_side", "0 mm"]),
        ((ORIGIN, X, X), ["on_x to on_y_side", "0 mm"]),
        ((ORIGIN, (0.0099, 0.0, 0.0), Y), ["9.9 mm", "at least 10 mm"]),
        ((ORIGIN, X, (0.6, 0.0, 0.0)), ["angle at the origin", "0°", "at least 5°"]),
        ((ORIGIN, X, (-0.2, 0.0, 0.0)), ["angle at the origin", "180°", "at most 175°"]),
        ((ORIGIN, X, (0.5, 0.04, 0.0)), ["4.57°", "at least 5°"]),
    ],
)
def test_points_that_give_no_frame_are_refused_with_numbers(
    points: tuple[tuple[float, ...], ...], words: list[str]
) -> None:
    with pytest.raises(PoorGeometry) as refusal:
        frame_from_three_points(*points)
    assert [word for word in words if word not in str(refusal.value)] == []


@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_point_that_is_none_is_refused(place: int) -> None:
    points: list[tuple[float, ...]] = [ORIGIN, X, Y]
    points[place] = (math.nan, 0.0, 0.0)
    with pytest.raises(NotFinite):
        frame_from_three_points(*points)
    points[place] = (1.0, 0.0)
    with pytest.raises(BadArgument, match="3 numbers"):
        frame_from_three_points(*points)


@given(poses, lengths, lengths)
def test_two_points_on_each_axis_give_the_frame_without_its_origin(
    frame: Pose, x: float, y: float
) -> None:
    taught = frame_from_four_points(
        inside(frame, x, 0.0, 0.0),
        inside(frame, x + 0.3, 0.0, 0.0),
        inside(frame, 0.0, y, 0.0),
        inside(frame, 0.0, y + 0.2, 0.0),
    )
    assert taught.pose.position_distance(frame) < 1e-12
    assert taught.pose.rotation_distance(frame) < 1e-12
    assert taught.skew < 1e-12
    assert taught.gap < 1e-12


def test_what_the_axes_miss_the_right_angle_and_each_other_by_is_told() -> None:
    taught = frame_from_four_points(
        (0.1, 0, 0), (0.5, 0, 0), (0.0, 0.1, 0.002), (0.4 * math.tan(0.05), 0.5, 0.002)
    )
    assert taught.skew == pytest.approx(0.05)
    assert taught.gap == pytest.approx(0.002)
    assert taught.pose.rotation == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ((X, X, Y, (0, 0.5, 0)), ["first_on_x to second_on_x", "0 mm"]),
        ((X, (0.5, 0, 0), Y, Y), ["first_on_y to second_on_y", "0 mm"]),
        ((X, (0.5, 0, 0), Y, (0.5, 0.5, 0)), ["right angle", "59°", "at most 10°"]),
        ((X, (0.5, 0, 0), X, (0.5, 0, 0)), ["right angle", "90°", "at most 10°"]),
        ((X, (0.5, 0, 0), (0, 0.2, 0.1), (0, 0.5, 0.1)), ["100 mm", "at most 20 mm"]),
    ],
)
def test_axes_that_do_not_fit_are_refused_with_numbers(
    points: tuple[tuple[float, ...], ...], words: list[str]
) -> None:
    with pytest.raises(PoorGeometry) as refusal:
        frame_from_four_points(*points)
    assert [word for word in words if word not in str(refusal.value)] == []
