import importlib.util
import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs.motion.loaded_robots import SERIAL, serial_robot
from rigs.motion.three_joints import GOAL, START, THREE

from openpendant.motion import errors
from openpendant.motion.description.limits import JointLimits
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.jerk_limited import jerk_limited_move, jerk_limits
from openpendant.motion.trajectory.ptp import plan_joint_move

UR5 = serial_robot("ur5").limits
HOME = [0.0] * 6
AWAY = [1.0, -0.5, 0.25, 0.1, 0.0, 2.0]


def optimum(delta: list[float], limits: JointLimits, speed: float) -> float:
    """The shortest time of a straight move, from the textbook: trapezoid or triangle."""
    pairs = [(abs(d), i) for i, d in enumerate(delta) if d]
    rate = min(speed * limits.velocity[i] / d for d, i in pairs)
    gain = min(limits.acceleration[i] / d for d, i in pairs)
    return 1.0 / rate + rate / gain if rate**2 < gain else 2.0 / math.sqrt(gain)


@pytest.mark.parametrize("name", SERIAL)
def test_random_moves_are_certified_and_near_the_optimum(name: str) -> None:
    limits = serial_robot(name).limits
    random = np.random.default_rng(7)
    for _ in range(30):
        start, goal = random.uniform(limits.lower, limits.upper, (2, limits.dof))
        # From moves of some thousandths of the range to the whole of it.
        goal = start + (goal - start) * 10.0 ** random.uniform(-3.0, 0.0)
        speed = random.uniform(0.02, 1.0)

        move = plan_joint_move(start, goal, limits, speed=speed)

        certificate = certify(move, limits, start=start.tolist())
        assert certificate.velocity.ratio <= speed * (1.0 + 1e-9)
        least = optimum((goal - start).tolist(), limits, speed)
        assert least - 1e-9 <= move.duration <= least + 2.0 * 0.01 + 1e-9


def test_a_move_starts_and_ends_exactly_at_rest_where_it_was_asked_to() -> None:
    move = plan_joint_move(HOME, AWAY, UR5)
    assert move.position[0].tolist() == HOME
    assert move.position[-1].tolist() == AWAY
    assert not move.velocity[[0, -1]].any()
    assert move.waypoint_times.tolist() == [0.0, move.duration]


def test_the_acceleration_is_constant_between_samples() -> None:
    move = plan_joint_move(HOME, AWAY, UR5)
    period = float(move.times[1])
    mean = (move.velocity[:-1] + move.velocity[1:]) / 2.0
    gained = move.acceleration[:-1] * period
    assert np.diff(move.velocity, axis=0) == pytest.approx(gained, abs=1e-12)
    assert np.diff(move.position, axis=0) == pytest.approx(mean * period, abs=1e-12)


def test_all_joints_keep_to_the_straight_line() -> None:
    move = plan_joint_move(HOME, AWAY, UR5)
    fraction = move.position[:, 5] / AWAY[5]
    assert move.position == pytest.approx(np.outer(fraction, AWAY), abs=1e-12)


def test_moves_between_the_very_corners_of_the_range_are_certified() -> None:
    for limits in (serial_robot(name).limits for name in SERIAL):
        for start, goal in ((limits.lower, limits.upper), (limits.upper, limits.lower)):
            certify(plan_joint_move(start, goal, limits), limits, start=start)


@pytest.mark.parametrize(
    ("start", "goal", "given", "error", "words"),
    [
        (HOME, HOME[:5], {}, errors.WrongJointCount, "5 joint values"),
        (HOME[:5], AWAY, {}, errors.WrongJointCount, "5 joint values"),
        (HOME, [*HOME, 0.0], {}, errors.WrongJointCount, "7 joint values"),
        (HOME, [], {}, errors.WrongJointCount, "0 joint values"),
        (HOME, [0.0, math.nan, 0.0, 0.0, 0.0, 0.0], {}, errors.NotFinite, "element 1"),
        (HOME, [0.0, 0.0, math.inf, 0.0, 0.0, 0.0], {}, errors.NotFinite, "element 2"),
        ([-math.inf, *HOME[1:]], AWAY, {}, errors.NotFinite, "element 0"),
        (HOME, HOME, {}, errors.NoMotion, "already there"),
        (HOME, [9e-6] * 6, {}, errors.NoMotion, "already there"),
        *(
            (HOME, AWAY, {"speed": speed}, errors.BadArgument, "speed")
            for speed in (0.0, -0.1, 1.0001, math.nan, math.inf)
        ),
        *(
            (HOME, AWAY, {"sample_period": period}, errors.BadArgument, "sample_period")
            for period in (0.0, -0.01, 2.0, math.nan)
        ),
        (HOME, AWAY, {"speed": 1e-5}, errors.NotTimeable, "3600 s"),
    ],
)
def test_what_cannot_be_planned_is_refused(
    start: list[float],
    goal: list[float],
    given: dict[str, float],
    error: type[errors.MotionError],
    words: str,
) -> None:
    with pytest.raises(error, match=words):
        plan_joint_move(start, goal, UR5, **given)


def test_a_goal_beyond_the_range_is_refused_with_joint_value_and_limit() -> None:
    beyond = math.nextafter(UR5.upper[2], math.inf)
    with pytest.raises(errors.OutOfRange) as refusal:
        plan_joint_move(HOME, [0.0, 0.0, beyond, 0.0, 0.0, 0.0], UR5)
    error = refusal.value
    assert (error.joint, error.value, error.upper) == (UR5.names[2], beyond, UR5.upper[2])
    assert error.unit == "rad"


def test_a_start_outside_by_feedback_noise_is_taken_to_stand_on_the_limit() -> None:
    noisy = [UR5.upper[0] + 4e-7, UR5.lower[1] - 4e-7, 0.0, 0.0, 0.0, 0.0]
    move = plan_joint_move(noisy, HOME, UR5)
    assert move.position[0].tolist() == [UR5.upper[0], UR5.lower[1], 0.0, 0.0, 0.0, 0.0]
    certify(move, UR5, start=noisy)


def test_a_start_outside_by_more_than_noise_is_refused() -> None:
    with pytest.raises(errors.OutOfRange) as refusal:
        plan_joint_move([UR5.upper[0] + 2e-6, *HOME[1:]], HOME, UR5)
    assert refusal.value.joint == UR5.names[0]


def test_the_least_move_takes_two_samples() -> None:
    move = plan_joint_move(HOME, [1.1e-5, *HOME[1:]], UR5)
    certify(move, UR5)
    assert len(move.times) == 3


needs_ruckig = pytest.mark.skipif(
    importlib.util.find_spec("ruckig") is None,
    reason="ruckig is not installed: the extra 'motion' of openpendant adds it",
)


@needs_ruckig
@pytest.mark.parametrize("name", SERIAL)
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
    start, goal = random.uniform(-0.5, 0.5, (2, 3)) * THREE.upper
    velocity = (random.uniform(-0.9, 0.9, 3) * THREE.velocity).tolist()
    acceleration = (random.uniform(-0.3, 0.3, 3) * THREE.acceleration).tolist()
    jerk = jerk_limits(THREE, 0.05)

    moving = {"start_velocity": velocity, "start_acceleration": acceleration}
    move = jerk_limited_move(start, goal, THREE, jerk=jerk, sample_period=period, **moving)
    assert certify(move, THREE, start=start, start_velocity=velocity, jerk=jerk).jerk is not None
    assert move.acceleration[0] == pytest.approx(acceleration)
    assert np.array_equal(move.position[-1], goal)


@needs_ruckig
def test_a_robot_that_moves_towards_its_goal_stays_on_the_line() -> None:
    way = np.array(GOAL) - START
    velocity = (0.4 * way).tolist()
    move = jerk_limited_move(START, GOAL, THREE, start_velocity=velocity)
    done = (move.position - START) / way
    assert done == pytest.approx(np.repeat(done[:, :1], 3, axis=1), abs=1e-12)
    assert move.duration < jerk_limited_move(START, GOAL, THREE).duration


@needs_ruckig
def test_a_moving_robot_comes_to_rest_where_it_is_asked_to_even_behind_it() -> None:
    move = jerk_limited_move(START, START, THREE, start_velocity=[1.0, 0.0, 0.0])
    assert move.position[:, 0].max() > 0.05
    assert np.array_equal(move.position[-1], START)


@needs_ruckig
@pytest.mark.parametrize(("ramp", "longer"), [(0.1, 0.12), (0.01, 0.02), (0.001, 0.01)])
def test_a_jerk_limit_costs_about_the_time_of_a_ramp(ramp: float, longer: float) -> None:
    plain = plan_joint_move(START, GOAL, THREE).duration
    gentle = jerk_limited_move(START, GOAL, THREE, jerk=jerk_limits(THREE, ramp)).duration
    assert plain - 1e-9 <= gentle <= plain + longer + 1e-9


@needs_ruckig
def test_the_sample_period_and_the_speed_are_kept() -> None:
    move = jerk_limited_move(START, GOAL, THREE, speed=0.1, sample_period=0.004)
    assert np.diff(move.times) == pytest.approx(0.004)
    assert certify(move, THREE).velocity.ratio == pytest.approx(0.1, rel=0.01)


@needs_ruckig
def test_a_sharper_move_is_refused_its_certificate() -> None:
    move = plan_joint_move(START, GOAL, THREE)
    with pytest.raises(errors.CertificateRefused, match="jerk") as refused:
        certify(move, THREE, jerk=jerk_limits(THREE))
    assert refused.value.unit in ("rad/s³", "m/s³")


@needs_ruckig
def test_a_certificate_without_the_start_velocity_is_refused() -> None:
    move = jerk_limited_move(START, GOAL, THREE, start_velocity=[0.5, 0.0, 0.0])
    with pytest.raises(errors.CertificateRefused, match="rest"):
        certify(move, THREE)


@needs_ruckig
@pytest.mark.parametrize(
    ("kind", "given"),
    [
        (errors.NoMotion, {"goal": START}),
        (errors.WrongJointCount, {"goal": [0.0]}),
        (errors.WrongJointCount, {"jerk": [1.0]}),
        (errors.NotFinite, {"goal": [math.nan, 0.0, 0.0]}),
        (errors.OutOfRange, {"goal": [4.0, 0.0, 0.0]}),
        (errors.OutOfRange, {"start": [2.9, 0.5, 0.0], "start_velocity": [2.0, 0.0, 0.0]}),
        (errors.TooFast, {"start_velocity": [2.1, 0.0, 0.0]}),
        (errors.TooSharp, {"start_acceleration": [0.0, 0.0, 2.1]}),
        (errors.BadArgument, {"jerk": [1.0, 0.0, 1.0]}),
        (errors.BadArgument, {"jerk": [1.0, math.nan, 1.0]}),
        (errors.BadArgument, {"speed": 1.5}),
        (errors.BadArgument, {"sample_period": 0.0}),
        (errors.NotTimeable, {"speed": 1e-4}),
    ],
)
def test_what_has_no_jerk_limited_move_is_refused(
    kind: type[Exception], given: dict[str, object]
) -> None:
    asked = {"start": START, "goal": GOAL} | given
    with pytest.raises(kind):
        jerk_limited_move(limits=THREE, **asked)  # type: ignore[arg-type]  # bad on purpose


@pytest.mark.parametrize("ramp", [0.0, -1.0, math.nan, 100.0])
def test_a_ramp_that_makes_no_sense_is_refused(ramp: float) -> None:
    with pytest.raises(errors.BadArgument, match="ramp"):
        jerk_limits(THREE, ramp)


def test_without_ruckig_the_extra_that_brings_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ruckig", None)
    with pytest.raises(errors.LibraryMissing, match="the extra 'motion' of openpendant"):
        jerk_limited_move(START, GOAL, THREE)
