import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.example_counts import few
from rigs.motion import toppra_directly
from rigs.motion.loaded_robots import SERIAL, serial_robot
from rigs.motion.robot_families import FAMILIES
from rigs.motion.toppra_directly import certified_duration

from openpendant.motion import errors
from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import OutOfRange
from openpendant.motion.paths.segments import SegmentRule
from openpendant.motion.pose import Array
from openpendant.motion.timing.parameterization import (
    rate_from_rest,
    steady_rate,
    time_legs,
    time_path,
    timing_grid,
)
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointLine, JointSpline
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.sample_checks import ACCELERATION_TOLERANCE, VELOCITY_TOLERANCE
from openpendant.motion.trajectory.time_scaling import IntersampleCheck
from openpendant.motion.trajectory.trajectory import Trajectory

WIDE = JointLimits(
    names=tuple("abcdef"),
    lower=(-100.0,) * 6,
    upper=(100.0,) * 6,
    velocity=(3.15,) * 6,
    acceleration=(8.0, 8.0, 8.0, 16.0, 16.0, 16.0),
    prismatic=(False,) * 6,
)
ORIGIN: Array = np.zeros(6)
ONE: Array
TWO: Array
ONE, TWO = np.eye(6)[:2]


def random_waypoints(limits: JointLimits, seed: int, count: int) -> Array:
    """Waypoints in the middle half of each range, which the curve between them does not leave."""
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    random = np.random.default_rng(seed)
    shares = random.uniform(-0.25, 0.25, (count, limits.dof)) * 10.0 ** random.uniform(-2.0, 0.0)
    points: Array = (lower + upper) / 2.0 + shares * (upper - lower)
    return points


@few(12)
@given(
    seed=st.integers(0, 10**6),
    count=st.integers(2, 30),
    speed=st.floats(0.01, 1.0),
    period=st.sampled_from([0.001, 0.004, 0.01]),
)
def test_the_continuous_motion_keeps_the_limits_at_any_sample_period(
    seed: int, count: int, speed: float, period: float
) -> None:
    path = JointSpline(random_waypoints(WIDE, seed, count) * 0.05)
    trajectory = time_path(path, WIDE, speed=speed, sample_period=period)
    slowed = replace(WIDE, velocity=tuple(speed * limit for limit in WIDE.velocity))
    certify(trajectory, slowed)


def test_a_move_below_ten_microradians_is_no_motion() -> None:
    with pytest.raises(errors.NoMotion):
        time_path(JointLine(ORIGIN, 5e-6 * ONE, WIDE), WIDE)


@pytest.mark.parametrize("count", [3, 5, 10, 25, 50])
def test_durations_are_within_five_percent_of_a_thousand_grid_points(count: int) -> None:
    path = JointSpline(np.random.default_rng(count).uniform(-2.0, 2.0, (count, 6)))
    assert time_path(path, WIDE).duration <= 1.05 * toppra_directly.duration(path, WIDE) + 0.01


def test_a_line_takes_as_long_as_the_closed_form_says() -> None:
    goal = np.array([2.0, -1.0, 0.5, 0.3, -0.2, 1.0])
    least = plan_joint_move(ORIGIN, goal, WIDE).duration
    line = time_path(JointLine(ORIGIN, goal), WIDE)
    assert line.duration == pytest.approx(least, rel=0.02, abs=0.01)


def test_samples_are_ten_milliseconds_apart_and_end_exactly_on_the_goal_at_rest() -> None:
    waypoints = random_waypoints(WIDE, 3, 7)
    trajectory = time_path(JointSpline(waypoints), WIDE)
    assert trajectory.times == pytest.approx(0.01 * np.arange(len(trajectory)), abs=1e-12)
    assert np.array_equal(trajectory.position[[0, -1]], waypoints[[0, -1]])
    assert not trajectory.velocity[[0, -1]].any()
    assert not trajectory.acceleration[-1].any()


def test_the_waypoint_times_are_when_the_motion_passes_the_waypoints() -> None:
    waypoints = random_waypoints(WIDE, 4, 9) * 0.1
    waypoints = np.insert(waypoints, 4, waypoints[3], axis=0)
    trajectory = time_path(JointSpline(waypoints), WIDE)
    passed = np.array([trajectory.sample(t).position for t in trajectory.waypoint_times.tolist()])
    assert passed == pytest.approx(waypoints, abs=1e-3)


def test_speed_scales_the_velocity_and_leaves_the_acceleration() -> None:
    path = JointSpline(random_waypoints(WIDE, 5, 6) * 0.1)
    slow = certify(time_path(path, WIDE, speed=0.1), WIDE)
    assert slow.velocity.ratio == pytest.approx(0.1, rel=0.01)
    assert slow.acceleration.ratio > 0.5


@few(12)
@given(
    seed=st.integers(0, 10**6),
    rules=st.lists(
        st.builds(
            SegmentRule,
            min_duration=st.none() | st.floats(0.0, 20.0),
            speed_fraction=st.none() | st.floats(0.01, 1.0),
        ),
        min_size=1,
        max_size=12,
    ),
)
def test_no_segment_is_faster_than_its_rule(seed: int, rules: list[SegmentRule]) -> None:
    path = JointSpline(random_waypoints(WIDE, seed, len(rules) + 1) * 0.05)
    trajectory = time_path(path, WIDE, segments=rules)
    certify(trajectory, WIDE)
    passing = trajectory.waypoint_times
    for rule, begin, end in zip(rules, passing[:-1], passing[1:], strict=True):
        assert end - begin >= (rule.min_duration or 0.0) * (1.0 - 1e-12)
        inside = (trajectory.times >= begin) & (trajectory.times <= end)
        speeds = np.abs(trajectory.velocity[inside]) / WIDE.velocity
        assert speeds.max(initial=0.0) <= (rule.speed_fraction or 1.0) * (1.0 + 1e-6)


def test_a_slow_segment_leaves_the_others_fast() -> None:
    path = JointSpline(random_waypoints(WIDE, 6, 7) * 0.05)
    free = np.diff(time_path(path, WIDE).waypoint_times)
    rules = [SegmentRule(min_duration=300.0 if index == 2 else None) for index in range(6)]
    ruled = np.diff(time_path(path, WIDE, segments=rules).waypoint_times)
    assert 300.0 <= ruled[2] <= 310.0
    assert ruled[[0, 4, 5]] == pytest.approx(free[[0, 4, 5]], rel=0.05)


@pytest.mark.parametrize("place", [1, 3, 5])
def test_the_time_asked_for_between_coinciding_waypoints_is_spent_beside_them(place: int) -> None:
    waypoints = random_waypoints(WIDE, 7, 5) * 0.05
    waypoints = np.insert(waypoints, place, waypoints[place - 1], axis=0)
    rules = [SegmentRule(1.0) for _ in range(5)]
    times = time_path(JointSpline(waypoints), WIDE, segments=rules).waypoint_times
    # Every waypoint after the pair is passed no earlier than asked, and all of the time is spent.
    assert (times[place + 1 :] >= np.arange(place + 1, 6)).all()
    assert times[-1] >= 5.0


@pytest.mark.parametrize(
    ("rules", "words"),
    [
        ([SegmentRule()] * 3, "segments"),
        ([SegmentRule(), SegmentRule(min_duration=-1.0)], "min_duration"),
        ([SegmentRule(), SegmentRule(min_duration=math.nan)], "min_duration"),
        ([SegmentRule(), SegmentRule(min_duration=math.inf)], "min_duration"),
        ([SegmentRule(), SegmentRule(speed_fraction=0.0)], "speed_fraction"),
        ([SegmentRule(), SegmentRule(speed_fraction=1.5)], "speed_fraction"),
        ([SegmentRule(), SegmentRule(speed_fraction=math.nan)], "speed_fraction"),
    ],
)
def test_rules_that_make_no_sense_are_refused(rules: list[SegmentRule], words: str) -> None:
    path = JointSpline([ORIGIN, ONE, ONE + TWO])
    with pytest.raises(errors.BadArgument, match=words):
        time_path(path, WIDE, segments=rules)


@pytest.mark.parametrize("speed", [0.0, -1.0, 1.5, math.nan])
def test_a_speed_outside_0_to_1_is_refused(speed: float) -> None:
    with pytest.raises(errors.BadArgument, match="speed"):
        time_path(JointLine(ORIGIN, ONE), WIDE, speed=speed)


def test_a_path_out_of_the_range_or_of_another_robot_is_refused() -> None:
    with pytest.raises(errors.OutOfRange):
        time_path(JointLine(ORIGIN, 101.0 * ONE), WIDE)
    with pytest.raises(errors.WrongJointCount):
        time_path(JointLine([0.0], [1.0]), WIDE)


def test_a_motion_of_more_than_an_hour_is_refused() -> None:
    with pytest.raises(errors.NotTimeable, match="3600 s"):
        time_path(JointLine(ORIGIN, ORIGIN + 90.0), WIDE, speed=0.001)


def test_the_same_path_is_timed_the_same_to_the_last_bit() -> None:
    path = JointSpline(random_waypoints(WIDE, 8, 20))
    first, second = time_path(path, WIDE), time_path(path, WIDE)
    assert np.array_equal(first.position, second.position)
    assert np.array_equal(first.acceleration, second.acceleration)


def test_legs_are_timed_with_a_stop_at_each_joint() -> None:
    legs = [JointLine(ORIGIN, ONE), JointLine(ONE, ONE + TWO)]
    whole = time_legs(legs, WIDE, speed=0.5)
    certify(whole, WIDE, start=[0.0] * 6)
    assert not whole.sample(float(whole.waypoint_times[1])).velocity.any()


def test_where_the_solver_fails_a_slower_one_is_certified(monkeypatch: pytest.MonkeyPatch) -> None:
    path = JointSpline(random_waypoints(WIDE, 3, 6) / 50.0)
    fastest = time_path(path, WIDE)
    monkeypatch.setattr("openpendant.motion.timing.parameterization.fastest_rates", lambda *_: None)
    slower = time_path(path, WIDE)
    certify(slower, WIDE)
    assert slower.duration > fastest.duration


GRID = timing_grid(np.array([0.0, 0.5, 1.0]))


def test_the_grid_holds_every_knot_and_grows() -> None:
    knots = np.array([0.0, 0.1, 0.7, 1.0])
    grid = timing_grid(knots)
    assert np.isin(knots, grid).all()
    assert (np.diff(grid) > 0.0).all()


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e-12])
def test_no_motion_from_rest_to_rest_is_faster_than_the_bound(scale: float) -> None:
    # One joint alone, whatever the unit: x'² = 2 s / slope until the middle, then back.
    slope = np.full((len(GRID), 1), scale)
    fastest = np.sqrt(2.0 * np.minimum(GRID, 1.0 - GRID) / scale)
    bound = rate_from_rest(GRID, slope)
    assert (bound >= fastest).all()
    assert bound[1:-1] == pytest.approx(np.sqrt(2.0) * fastest[1:-1])


def test_a_joint_that_stands_still_at_the_end_bounds_nothing_there() -> None:
    slope = np.column_stack((np.ones(len(GRID)), np.where(GRID < 0.5, 1.0, 1e-17)))
    assert (rate_from_rest(GRID, slope) > 0.0).all()


def test_the_steady_motion_keeps_the_limits_everywhere() -> None:
    slope = np.column_stack((np.cos(9.0 * GRID), np.sin(5.0 * GRID)))
    bend = np.column_stack((-9.0 * np.sin(9.0 * GRID), 5.0 * np.cos(5.0 * GRID)))

    rate = steady_rate(GRID, slope, bend, np.full(len(GRID), 0.2))

    gain = np.diff(rate**2) / (2.0 * np.diff(GRID))
    for square in (rate[:-1] ** 2, rate[1:] ** 2):
        used = slope[:-1] * gain[:, np.newaxis] + bend[:-1] * square[:, np.newaxis]
        assert np.abs(used).max() <= 1.0 + 1e-9
    assert rate.max() <= 0.2
    assert (rate[0], rate[-1]) == (0.0, 0.0)
    assert (rate[1:-1] > 0.0).all()


FILE = Path(__file__).with_name("timing_problems.yaml")
SUITE: dict[str, Any] = yaml.safe_load(FILE.read_text("utf-8"))
PROBLEMS: dict[str, dict[str, Any]] = {problem["name"]: problem for problem in SUITE["problems"]}
CERTIFIED = [name for name, problem in PROBLEMS.items() if problem["answer"] == "certified"]
REFUSED = [name for name in PROBLEMS if name not in CERTIFIED]


def limits_of(problem: dict[str, Any]) -> JointLimits:
    values = SUITE["limits"] | problem.get("limits", {})
    both: dict[str, Any] = {field: (float(value),) * 2 for field, value in values.items()}
    return JointLimits(names=("joint_1", "joint_2"), prismatic=(False, False), **both)


def waypoints_of(problem: dict[str, Any]) -> Array | list[list[float]]:
    random = np.random.default_rng(11)
    if "cloud" in problem:
        count, noise = problem["cloud"]["count"], problem["cloud"]["noise"]
        return random.normal(0.0, 1.0, (count, 2)) * float(noise)
    if "recorded" in problem:
        count, noise = problem["recorded"]["count"], problem["recorded"]["noise"]
        phase = np.linspace(0.0, 1.0, count)[:, np.newaxis] * random.uniform(3.0, 9.0, 2)
        sweep: Array = np.sin(phase + random.uniform(0.0, 6.0, 2))
        return sweep + random.normal(0.0, 1.0, (count, 2)) * float(noise)
    given: list[list[float]] = problem["waypoints"]
    return given


def answer(problem: dict[str, Any]) -> Trajectory:
    limits = limits_of(problem)
    return time_path(JointSpline(waypoints_of(problem), limits), limits)


@pytest.mark.parametrize("name", CERTIFIED)
def test_the_problem_gets_a_certified_motion(name: str) -> None:
    problem = PROBLEMS[name]
    waypoints = np.array(waypoints_of(problem))
    trajectory = answer(problem)
    certify(trajectory, limits_of(problem), start=waypoints[0])
    assert np.array_equal(trajectory.position[[0, -1]], waypoints[[0, -1]])
    assert trajectory.duration <= problem.get("most", 3600.0)


@pytest.mark.parametrize("name", REFUSED)
def test_the_problem_is_refused_in_words(name: str) -> None:
    problem = PROBLEMS[name]
    with pytest.raises(getattr(errors, problem["answer"]), match=problem["words"]):
        answer(problem)


PERIOD = 0.01


def random_path(limits: JointLimits, random: np.random.Generator) -> tuple[JointSpline, Array]:
    """A spline through 3 to 50 waypoints, from a hundredth of the ranges to half of them."""
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    while True:
        reach = 10.0 ** random.uniform(-2.0, 0.0) * (upper - lower)
        count = int(random.integers(3, 51))
        shares = random.uniform(-0.25, 0.25, (count, limits.dof))
        waypoints: Array = (lower + upper) / 2 + shares * reach
        try:
            return JointSpline(waypoints, limits), waypoints
        except OutOfRange:
            continue


def check_trajectories(name: str, seed: int, count: int, *, compared: bool = True) -> list[float]:
    """Check some trajectories, and return durations relative to the finer solution's.

    That and ten times the samples take most of the time: both may be left out.
    """
    limits = serial_robot(name).limits
    random = np.random.default_rng([seed, SERIAL.index(name)])
    ratios = []
    for _ in range(count):
        path, waypoints = random_path(limits, random)
        planned = time_path(path, limits, sample_period=PERIOD)
        certify(planned, limits, start=waypoints[0])
        assert np.array_equal(planned.position[[0, -1]], waypoints[[0, -1]])
        assert len(planned.waypoint_times) == len(waypoints)
        # What runs is the planned one: the motion through its samples, at every moment between.
        between = IntersampleCheck(planned, limits).pieces()
        speeds = np.abs(between.velocity).max(axis=(0, 2)) / limits.velocity
        gains = np.abs(between.acceleration).max(axis=(0, 2)) / limits.acceleration
        assert speeds.max() <= 1.0 + VELOCITY_TOLERANCE
        assert gains.max() <= 1.0 + ACCELERATION_TOLERANCE

        if not compared:
            continue
        dense = time_path(path, limits, sample_period=PERIOD / 10)
        found = certify(dense, limits, start=waypoints[0])
        assert found.velocity.ratio <= 1.0 + VELOCITY_TOLERANCE
        assert found.acceleration.ratio <= 1.0 + ACCELERATION_TOLERANCE
        # The two motions are one but for rounding the duration up to whole periods.
        assert dense.duration <= planned.duration <= dense.duration + PERIOD
        ratios.append(dense.duration / certified_duration(path, limits, PERIOD / 10))
    return ratios


@pytest.mark.parametrize("name", SERIAL)
def test_random_trajectories_are_certified(name: str) -> None:
    check_trajectories(name, seed=1, count=4, compared=False)


@pytest.mark.parametrize("name", [name for name in SERIAL if name in FAMILIES])
def test_random_trajectories_are_near_a_finer_solution(name: str) -> None:
    assert max(check_trajectories(name, seed=3, count=1)) <= 1.05


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", SERIAL)
def test_ten_thousand_trajectories_are_certified_and_near_a_finer_solution(name: str) -> None:
    ratios = check_trajectories(name, seed=2, count=435)
    assert max(ratios) <= 1.05
    assert np.median(ratios) <= 1.02
