"""Curves of the joints, and the trajectories that are made of them."""

import locale
import math
import pickle
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from rigs.motion import three_joints
from rigs.motion.refusals import Refusal, refusals

from openpendant.motion import errors
from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import BadArgument, WrongJointCount
from openpendant.motion.pose import Array
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import (
    JointLine,
    JointSpline,
    check_extent,
    settle_start,
)
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import SAMPLE_PERIOD, Trajectory, join
from openpendant.motion.trajectory.trajectory_files import from_csv, to_csv, to_ros_yaml

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
    there = position + velocity * ahead + acceleration * ahead**2 / 2.0
    assert state.position == pytest.approx(there, abs=1e-12)


@pytest.mark.parametrize(("time", "row"), [(-1.0, 0), (-math.inf, 0), (1e9, -1), (math.inf, -1)])
def test_outside_its_time_the_motion_stands_still(move: Trajectory, time: float, row: int) -> None:
    state = move.sample(time)
    assert np.array_equal(state.position, move.position[row])
    assert not state.velocity.any()


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


THREE = replace(three_joints.THREE, names=("turn", 'a "quoted", name', "slide"))


@pytest.fixture(scope="module")
def swing() -> Trajectory:
    return time_path(JointSpline([[0.0, 0.0, 0.0], [1.0, -1.0, 1e-5], [0.5, 1.0, -0.3]]), THREE)


@pytest.fixture
def comma_locale() -> Iterator[None]:
    """A locale that writes 1,5 where one is installed; else the test shows less."""
    before = locale.setlocale(locale.LC_NUMERIC)
    for name in ("de_DE.UTF-8", "fr_FR.UTF-8", "C.UTF-8"):
        try:
            locale.setlocale(locale.LC_NUMERIC, name)
            break
        except locale.Error:
            continue
    yield
    locale.setlocale(locale.LC_NUMERIC, before)


@pytest.mark.usefixtures("comma_locale")
def test_csv_gives_the_same_numbers_again_to_the_last_bit(swing: Trajectory) -> None:
    read = from_csv(to_csv(swing, THREE), THREE)
    for field in ("times", "position", "velocity", "acceleration"):
        assert np.array_equal(getattr(read, field), getattr(swing, field))
    certify(read, THREE)


@pytest.mark.usefixtures("comma_locale")
def test_csv_has_a_column_with_a_unit_for_each_quantity_and_decimal_dots(swing: Trajectory) -> None:
    header, first, second, *_ = to_csv(swing, THREE).splitlines()
    assert header.startswith('time [s],turn position [rad],"a ""quoted"", name position [rad]",')
    assert header.endswith("slide acceleration [m/s²]")
    assert first.startswith("0.0,")
    assert second.startswith("0.01,")


def test_csv_of_a_spreadsheet_is_read_too(swing: Trajectory) -> None:
    text = "\ufeff" + to_csv(swing, THREE).replace("\n", "\r\n")
    assert np.array_equal(from_csv(text, THREE).position, swing.position)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("turn position [rad]", "turn position [deg]", "column 2"),
        ("time [s],", "", "column 1"),
        ("\n0.01,", "\n0,01,", "line 3 is .*accepted: 10 values"),
        ("\n0.01,", "\nx,", "line 3, column 1"),
        ("\n0.01,", "\nnan,", "line 3, column 1"),
        ("\n0.02,", "\n0.01,", "time in CSV line 4"),
    ],
)
def test_a_csv_that_is_not_as_written_is_refused_with_its_place(
    swing: Trajectory, old: str, new: str, words: str
) -> None:
    text = to_csv(swing, THREE)
    assert old in text
    with pytest.raises(BadArgument, match=words):
        from_csv(text.replace(old, new, 1), THREE)


def test_ros_yaml_holds_names_and_every_point(swing: Trajectory) -> None:
    message = yaml.safe_load(to_ros_yaml(swing, THREE))

    assert message["joint_names"] == list(THREE.names)
    assert len(message["points"]) == len(swing)
    for index, point in enumerate(message["points"]):
        assert point["positions"] == swing.position[index].tolist()
        assert point["velocities"] == swing.velocity[index].tolist()
        assert point["accelerations"] == swing.acceleration[index].tolist()
        stamp = point["time_from_start"]
        assert stamp["sec"] + stamp["nanosec"] * 1e-9 == pytest.approx(swing.times[index])
        assert 0 <= stamp["nanosec"] < 10**9


def test_tiny_numbers_stay_numbers_in_yaml() -> None:
    move = plan_joint_move([0.0, 0.0, 0.0], [1.0, 1e-9, 0.0], THREE)
    points = yaml.safe_load(to_ros_yaml(move, THREE))["points"]
    assert all(isinstance(value, float) for point in points for value in point["positions"])


MOVE = plan_joint_move(HERE, THERE, LIMITS)
SINGLE = JointLimits(("a",), (-1.0,), (1.0,), (1.0,), (1.0,), (False,))
ALONE = plan_joint_move([0.0], [0.5], SINGLE)
SLOWER = plan_joint_move(THERE, HERE, LIMITS, sample_period=0.02)


@refusals(
    ("less velocity", lambda: replace(MOVE, velocity=MOVE.velocity[1:]), BadArgument, "velocity"),
    ("less time", lambda: replace(MOVE, times=MOVE.times[1:]), BadArgument, "one row of joints"),
    ("no time", lambda: MOVE.sample(math.nan), BadArgument, "time"),
    ("legs that do not meet", lambda: join([MOVE, MOVE]), BadArgument, "leg 1 starts elsewhere"),
    ("another sample period", lambda: join([MOVE, SLOWER]), BadArgument, "sample period"),
    ("no legs", lambda: join([]), BadArgument, "at least one"),
    ("no CSV", lambda: from_csv("", THREE), BadArgument, "two samples"),
    ("an empty line", lambda: from_csv("\n", THREE), BadArgument, "two samples"),
    ("one sample", lambda: from_csv("time [s]\n0.0\n", THREE), BadArgument, "two samples"),
    ("another robot's as CSV", lambda: to_csv(ALONE, THREE), WrongJointCount, ""),
    ("another robot's as YAML", lambda: to_ros_yaml(ALONE, THREE), WrongJointCount, ""),
)
def test_what_is_no_trajectory_here_is_refused(refusal: Refusal) -> None:
    refusal.check()


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
def test_what_is_no_path_is_refused(points: list[list[float]], error: type[Exception]) -> None:
    with pytest.raises(error):
        JointSpline(points, THREE)


def test_a_curve_that_swings_out_of_the_range_between_waypoints_is_refused() -> None:
    points = [[0.0, 0.0, 0.0], [0.5, 0.0, 0.99], [1.0, 0.0, 0.99], [1.5, 0.0, 0.0]]
    with pytest.raises(errors.OutOfRange) as refusal:
        JointSpline(points, THREE)
    error = refusal.value
    assert (error.joint, error.lower, error.upper, error.unit) == ("slide", -1.0, 1.0, "m")
    assert 1.0 < error.value < 1.2


def test_the_curve_of_another_robot_is_refused() -> None:
    with pytest.raises(errors.WrongJointCount):
        check_extent(JointLine([0.0], [1.0]), THREE)


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
        ([3.0, -2.0, 1.0], [3.0, -2.0, 1.0]),
        ([3.0 + 5e-7, -2.0 - 5e-7, 1.0 + 9e-7], [3.0, -2.0, 1.0]),
    ],
)
def test_feedback_noise_at_a_limit_is_settled(position: list[float], settled: list[float]) -> None:
    assert settle_start(position, THREE) == settled
    assert JointSpline([position, BEND[1]], THREE).evaluate(np.zeros(1))[0].tolist() == settled
