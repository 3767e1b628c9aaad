import importlib.util
import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs.motion.loaded_robots import serial_robot

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.description.robot import robot_names
from openpendant.motion.errors import (
    BadArgument,
    CertificateRefused,
    LibraryMissing,
    NoMotion,
    NotFinite,
    NotTimeable,
    OutOfRange,
    TooFast,
    TooSharp,
    WrongJointCount,
)
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.jerk_limited import jerk_limited_move, jerk_limits
from openpendant.motion.trajectory.ptp import plan_joint_move

needs_ruckig = pytest.mark.skipif(
    importlib.util.find_spec("ruckig") is None,
    reason="ruckig is not installed: the extra 'motion' of openpendant adds it",
)
ROBOTS = [name for name in robot_names() if name != "stewart_classroom"]
LIMITS = JointLimits(
    names=("turn", "tilt", "slide"),
    lower=(-3.0, -2.0, -1.0),
    upper=(3.0, 2.0, 1.0),
    velocity=(2.0, 1.5, 0.5),
    acceleration=(8.0, 6.0, 2.0),
    prismatic=(False, False, True),
)
START, GOAL = [0.0, 0.5, -0.2], [2.0, -0.5, 0.3]


@needs_ruckig
@pytest.mark.parametrize("name", ROBOTS)
def test_moves_from_rest_are_straight_and_keep_the_jerk(name: str) -> None:
    limits = serial_robot(name).limits
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    random = np.random.default_rng(4)
    for ramp in (0.01, 0.1, 1.0):
        start, goal = lower + (upper - lower) * random.uniform(0.0, 1.0, (2, limits.dof))

        move = jerk_limited_move(start, goal, limits, jerk=jerk_limits(limits, ramp))

        certify(move, limits, start=start, jerk=jerk_limits(limits, ramp))
        way = (goal - start) / np.linalg.norm(goal - start)
        beside = move.position - start - np.outer((move.position - start) @ way, way)
        assert np.abs(beside).max() < 1e-12
        assert np.array_equal(move.position[-1], goal)


@needs_ruckig
@settings(max_examples=100)
@given(seed=st.integers(0, 10**6), period=st.sampled_from([0.001, 0.004, 0.01]))
def test_moves_from_a_moving_state_are_certified(seed: int, period: float) -> None:
    random = np.random.default_rng(seed)
    start, goal = random.uniform(-0.5, 0.5, (2, 3)) * LIMITS.upper
    velocity = (random.uniform(-0.9, 0.9, 3) * LIMITS.velocity).tolist()
    acceleration = (random.uniform(-0.3, 0.3, 3) * LIMITS.acceleration).tolist()
    jerk = jerk_limits(LIMITS, 0.05)

    move = jerk_limited_move(
        start,
        goal,
        LIMITS,
        jerk=jerk,
        start_velocity=velocity,
        start_acceleration=acceleration,
        sample_period=period,
    )

    assert certify(move, LIMITS, start=start, start_velocity=velocity, jerk=jerk).jerk is not None
    assert move.acceleration[0] == pytest.approx(acceleration)
    assert np.array_equal(move.position[-1], goal)


@needs_ruckig
def test_a_robot_that_moves_towards_its_goal_stays_on_the_line() -> None:
    way = np.array(GOAL) - START
    velocity = (0.4 * way).tolist()
    move = jerk_limited_move(START, GOAL, LIMITS, start_velocity=velocity)
    done = (move.position - START) / way
    assert done == pytest.approx(np.repeat(done[:, :1], 3, axis=1), abs=1e-12)
    assert move.duration < jerk_limited_move(START, GOAL, LIMITS).duration


@needs_ruckig
def test_a_moving_robot_comes_to_rest_where_it_is_asked_to_even_behind_it() -> None:
    move = jerk_limited_move(START, START, LIMITS, start_velocity=[1.0, 0.0, 0.0])
    assert move.position[:, 0].max() > 0.05
    assert np.array_equal(move.position[-1], START)


@needs_ruckig
@pytest.mark.parametrize(("ramp", "longer"), [(0.1, 0.12), (0.01, 0.02), (0.001, 0.01)])
def test_a_jerk_limit_costs_about_the_time_of_a_ramp(ramp: float, longer: float) -> None:
    plain = plan_joint_move(START, GOAL, LIMITS).duration
    gentle = jerk_limited_move(START, GOAL, LIMITS, jerk=jerk_limits(LIMITS, ramp)).duration
    assert plain - 1e-9 <= gentle <= plain + longer + 1e-9


@needs_ruckig
def test_the_sample_period_and_the_speed_are_kept() -> None:
    move = jerk_limited_move(START, GOAL, LIMITS, speed=0.1, sample_period=0.004)
    assert np.diff(move.times) == pytest.approx(0.004)
    assert certify(move, LIMITS).velocity.ratio == pytest.approx(0.1, rel=0.01)


@needs_ruckig
def test_a_sharper_move_is_refused_its_certificate() -> None:
    move = plan_joint_move(START, GOAL, LIMITS)
    with pytest.raises(CertificateRefused, match="jerk") as refused:
        certify(move, LIMITS, jerk=jerk_limits(LIMITS))
    assert refused.value.unit in ("rad/s³", "m/s³")


@needs_ruckig
def test_a_certificate_without_the_start_velocity_is_refused() -> None:
    move = jerk_limited_move(START, GOAL, LIMITS, start_velocity=[0.5, 0.0, 0.0])
    with pytest.raises(CertificateRefused, match="rest"):
        certify(move, LIMITS)


@needs_ruckig
@pytest.mark.parametrize(
    ("kind", "given"),
    [
        (NoMotion, {"goal": START}),
        (WrongJointCount, {"goal": [0.0]}),
        (WrongJointCount, {"jerk": [1.0]}),
        (NotFinite, {"goal": [math.nan, 0.0, 0.0]}),
        (OutOfRange, {"goal": [4.0, 0.0, 0.0]}),
        (OutOfRange, {"start": [2.9, 0.5, 0.0], "start_velocity": [2.0, 0.0, 0.0]}),
        (TooFast, {"start_velocity": [2.1, 0.0, 0.0]}),
        (TooSharp, {"start_acceleration": [0.0, 0.0, 2.1]}),
        (BadArgument, {"jerk": [1.0, 0.0, 1.0]}),
        (BadArgument, {"jerk": [1.0, math.nan, 1.0]}),
        (BadArgument, {"speed": 1.5}),
        (BadArgument, {"sample_period": 0.0}),
        (NotTimeable, {"speed": 1e-4}),
    ],
)
def test_what_cannot_be_planned_is_refused(kind: type[Exception], given: dict[str, object]) -> None:
    asked = {"start": START, "goal": GOAL} | given
    with pytest.raises(kind):
        jerk_limited_move(limits=LIMITS, **asked)  # type: ignore[arg-type]  # bad on purpose


@pytest.mark.parametrize("ramp", [0.0, -1.0, math.nan, 100.0])
def test_a_ramp_that_makes_no_sense_is_refused(ramp: float) -> None:
    with pytest.raises(BadArgument, match="ramp"):
        jerk_limits(LIMITS, ramp)


def test_without_ruckig_the_extra_that_brings_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ruckig", None)
    with pytest.raises(LibraryMissing, match="the extra 'motion' of openpendant"):
        jerk_limited_move(START, GOAL, LIMITS)
