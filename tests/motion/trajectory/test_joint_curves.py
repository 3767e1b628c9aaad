import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from openpendant.motion import errors
from openpendant.motion.description.limits import JointLimits
from openpendant.motion.pose import Array
from openpendant.motion.trajectory.joint_curves import (
    JointLine,
    JointSpline,
    check_extent,
    settle_start,
)

LIMITS = JointLimits(
    names=("a", "b", "c"),
    lower=(-3.0, -3.0, -1.0),
    upper=(3.0, 3.0, 1.0),
    velocity=(2.0, 2.0, 0.5),
    acceleration=(8.0, 8.0, 2.0),
    prismatic=(False, False, True),
)
BEND = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [1.2, 1.0, -0.1], [2.0, 0.5, 0.3]]


def waypoints(seed: int, count: int) -> Array:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3))


@pytest.mark.parametrize("count", [2, 3, 4, 10, 50])
def test_the_curve_passes_each_waypoint_at_its_knot(count: int) -> None:
    points = waypoints(count, count)
    curve = JointSpline(points)
    assert curve.evaluate(curve.knots) == pytest.approx(points, abs=1e-13)
    assert np.array_equal(curve.evaluate(curve.knots[[0, -1]]), points[[0, -1]])
    assert curve.waypoint_knots.tolist() == list(range(count))


@pytest.mark.parametrize("order", [0, 1, 2])
def test_position_and_both_derivatives_are_continuous(order: int) -> None:
    curve = JointSpline(waypoints(1, 12))
    inner = curve.knots[1:-1]
    before, after = curve.evaluate(inner - 1e-9, order), curve.evaluate(inner + 1e-9, order)
    assert before == pytest.approx(after, abs=1e-6)


def test_the_derivatives_are_those_of_the_position() -> None:
    curve = JointSpline(waypoints(2, 9))
    s, step = np.linspace(0.01, curve.length - 0.01, 200), 1e-5
    slope = (curve.evaluate(s + step) - curve.evaluate(s - step)) / (2.0 * step)
    bend = (curve.evaluate(s + step, 1) - curve.evaluate(s - step, 1)) / (2.0 * step)
    assert curve.evaluate(s, 1) == pytest.approx(slope, abs=1e-7)
    assert curve.evaluate(s, 2) == pytest.approx(bend, abs=1e-6)


def test_the_curve_leaves_and_arrives_along_its_end_chords() -> None:
    points = waypoints(3, 6)
    curve = JointSpline(points)
    chords = points[[1, -1]] - points[[0, -2]]
    chords /= np.linalg.norm(chords, axis=1, keepdims=True)
    assert curve.evaluate(curve.knots[[0, -1]], 1) == pytest.approx(chords, abs=1e-9)


def test_two_waypoints_give_the_straight_line() -> None:
    line = JointLine(BEND[0], BEND[3])
    s = np.linspace(0.0, line.length, 11)
    assert line.length == pytest.approx(math.dist(BEND[0], BEND[3]))
    assert line.evaluate(s) == pytest.approx(np.outer(s / line.length, BEND[3]), abs=1e-15)
    assert not line.evaluate(s, 2).any()


def test_a_third_derivative_is_not_offered() -> None:
    with pytest.raises(errors.BadArgument, match="order"):
        JointSpline(BEND).evaluate(np.array([0.1]), 3)


@pytest.mark.parametrize(
    ("extra", "place"),
    [
        ([0, 0, 1, 2, 3], [0, 0, 1, 2, 3]),
        ([0, 1, 1, 1, 2, 3], [0, 1, 1, 1, 2, 3]),
        ([0, 1, 2, 3, 3], [0, 1, 2, 3, 3]),
    ],
)
def test_repeated_waypoints_keep_their_place(extra: list[int], place: list[int]) -> None:
    curve = JointSpline([BEND[index] for index in extra])
    assert len(curve.knots) == 4
    assert curve.waypoint_knots.tolist() == place


@pytest.mark.parametrize(("gap", "knots"), [(9e-6, 4), (1.1e-5, 5)])
def test_waypoints_closer_than_ten_microradians_are_one(gap: float, knots: int) -> None:
    near = [value + gap for value in BEND[1]]
    assert len(JointSpline([BEND[0], BEND[1], near, BEND[2], BEND[3]]).knots) == knots


def test_the_goal_is_met_exactly_even_where_a_waypoint_stands_just_before_it() -> None:
    goal = [value + 5e-6 for value in BEND[3]]
    curve = JointSpline([*BEND, goal])
    assert curve.goal.tolist() == goal
    assert curve.waypoint_knots.tolist() == [0, 1, 2, 3, 3]


def test_slow_drift_in_steps_below_the_threshold_is_still_a_motion() -> None:
    curve = JointSpline([[index * 4e-6, 0.0, 0.0] for index in range(1001)])
    assert curve.length == pytest.approx(4e-3, rel=1e-9)
    assert len(curve.knots) > 300


@pytest.mark.parametrize(
    ("points", "error"),
    [
        ([], errors.BadArgument),
        ([[0.0, 0.0, 0.0]], errors.NoMotion),
        ([[0.0, 0.0, 0.0]] * 7, errors.NoMotion),
        ([[0.0, 0.0, 0.0], [9e-6, -9e-6, 0.0]], errors.NoMotion),
        ([[0.0, 0.0, 0.0], [1.0, 0.0]], errors.WrongJointCount),
        ([[0.0, 0.0], [1.0, 0.0]], errors.WrongJointCount),
        ([[0.0, 0.0, 0.0], [1.0, math.nan, 0.0]], errors.NotFinite),
        ([[0.0, 0.0, -math.inf], [1.0, 0.0, 0.0]], errors.NotFinite),
        ([[0.0, 0.0, 0.0], [0.0, 3.1, 0.0], [1.0, 0.0, 0.0]], errors.OutOfRange),
    ],
)
def test_what_is_no_path_is_refused(
    points: list[list[float]], error: type[errors.MotionError]
) -> None:
    with pytest.raises(error):
        JointSpline(points, LIMITS)


def test_a_curve_that_swings_out_of_the_range_between_waypoints_is_refused() -> None:
    points = [[0.0, 0.0, 0.0], [0.5, 0.0, 0.99], [1.0, 0.0, 0.99], [1.5, 0.0, 0.0]]
    with pytest.raises(errors.OutOfRange) as refusal:
        JointSpline(points, LIMITS)
    error = refusal.value
    assert (error.joint, error.lower, error.upper, error.unit) == ("c", -1.0, 1.0, "m")
    assert 1.0 < error.value < 1.2


def test_the_curve_of_another_robot_is_refused() -> None:
    with pytest.raises(errors.WrongJointCount):
        check_extent(JointLine([0.0], [1.0]), LIMITS)


@given(seed=st.integers(0, 10_000), count=st.integers(2, 20))
def test_the_extent_is_that_of_the_densely_sampled_curve(seed: int, count: int) -> None:
    curve = JointSpline(waypoints(seed, count))
    sampled = curve.evaluate(np.linspace(0.0, curve.length, 300 * count))
    least, greatest = curve.extent()
    assert (least <= sampled.min(axis=0) + 1e-12).all()
    assert (greatest >= sampled.max(axis=0) - 1e-12).all()
    assert least == pytest.approx(sampled.min(axis=0), abs=1e-3)
    assert greatest == pytest.approx(sampled.max(axis=0), abs=1e-3)


@pytest.mark.parametrize(
    ("position", "settled"),
    [
        ([0.1, 0.2, 0.3], [0.1, 0.2, 0.3]),
        ([3.0, -3.0, 1.0], [3.0, -3.0, 1.0]),
        ([3.0 + 5e-7, -3.0 - 5e-7, 1.0 + 9e-7], [3.0, -3.0, 1.0]),
    ],
)
def test_feedback_noise_at_a_limit_is_settled(position: list[float], settled: list[float]) -> None:
    assert settle_start(position, LIMITS) == settled
    assert JointSpline([position, BEND[1]], LIMITS).evaluate(np.zeros(1))[0].tolist() == settled
