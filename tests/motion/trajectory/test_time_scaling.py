import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.example_counts import few
from rigs.motion.loaded_robots import serial_robot
from rigs.motion.refusals import Refusal, refusals

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import BadArgument, WrongJointCount
from openpendant.motion.pose import Array
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.jerk_limited import jerk_limited_move
from openpendant.motion.trajectory.joint_curves import JointLine, JointSpline
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.time_scaling import IntersampleCheck, ScaledRun
from openpendant.motion.trajectory.trajectory import Trajectory

ROBOTS = ("ur5", "abb_irb2400", "kuka_iiwa14", "rail_kr5_arc", "mitsubishi_rh6frh5520")
TICK = 10_000_000  # ns
SECOND = 1_000_000_000
BEGAN = 123_456_789  # any origin of the clock
UR5 = serial_robot("ur5").limits


@cache
def swing_of(name: str = "ur5", seed: int = 1, count: int = 6) -> Trajectory:
    limits = serial_robot(name).limits
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    random = np.random.default_rng(seed)
    shares = random.uniform(-0.1, 0.1, (count, limits.dof))
    return time_path(JointSpline((lower + upper) / 2 + shares * (upper - lower)), limits)


def ur5_run(scale: float = 1.0, ramp: float = 0.1) -> ScaledRun:
    return ScaledRun(swing_of(), UR5, started=BEGAN, scale=scale, ramp=ramp)


def rests(run: ScaledRun, now: int) -> bool:
    return run.scale(now) == 0.0


def ticks_until(run: ScaledRun, done: Callable[[int], bool], now: int = BEGAN) -> int:
    """The first tick at which something is so."""
    for tick in range(100_000):
        if done(now + tick * TICK):
            return now + tick * TICK
    raise AssertionError("it never was")


def test_at_full_scale_the_run_is_the_trajectory() -> None:
    trajectory, run = swing_of(), ur5_run()
    for index in range(len(trajectory)):
        state = run.state(BEGAN + index * TICK)
        assert state.position == pytest.approx(trajectory.position[index], abs=1e-12)
        assert state.velocity == pytest.approx(trajectory.velocity[index], abs=1e-9)
    assert run.finished(BEGAN + len(trajectory) * TICK)


def test_at_half_scale_everything_takes_twice_as_long() -> None:
    trajectory, run = swing_of(), ur5_run(0.5)
    assert run.remaining(BEGAN) == pytest.approx(2.0 * trajectory.duration)
    state = run.state(BEGAN + 60 * TICK)
    assert state.position == pytest.approx(trajectory.position[30], abs=1e-12)
    assert state.velocity == pytest.approx(0.5 * trajectory.velocity[30])


COMMANDS = st.lists(
    st.tuples(
        st.integers(0, 400_000_000),
        st.sampled_from(["pause", "resume", "set"]),
        st.floats(0.01, 1.0) | st.sampled_from([0.0, 1.0]),
    ),
    max_size=15,
)


@few(6, soak=1000)
@given(
    name=st.sampled_from(ROBOTS),
    seed=st.integers(1, 4),
    ramp=st.sampled_from([0.001, 0.1, 0.5]),
    commands=COMMANDS,
)
def test_any_sequence_of_overrides_keeps_the_limits_and_the_path(
    name: str, seed: int, ramp: float, commands: list[tuple[int, str, float]]
) -> None:
    limits, trajectory = serial_robot(name).limits, swing_of(name, seed)
    motion = IntersampleCheck(trajectory, limits)
    run = ScaledRun(trajectory, limits, started=0, ramp=ramp)
    rows, due, passed = [], 0, -1.0

    def look(now: int) -> None:
        nonlocal passed
        state, time = run.state(now), run.time(now)
        assert time >= passed
        on_path = motion.state(time)
        assert np.abs(state.position - on_path.position).max() <= 1e-12
        assert np.abs(state.velocity - run.scale(now) * on_path.velocity).max() <= 1e-9
        rows.append(state)
        passed = time

    at = 0
    for wait, command, scale in commands:
        at += wait
        while due <= at:
            look(due)
            due += TICK
        match command:
            case "pause":
                run.pause(at)
            case "resume":
                run.resume(at)
            case _:
                run.set_scale(at, scale)
    run.resume(at)
    run.set_scale(at, 1.0)
    while passed < trajectory.duration:
        look(due)
        due += TICK

    position, velocity, acceleration = (np.array(field) for field in zip(*rows, strict=True))
    times: Array = (np.arange(len(rows)) * 0.01).astype(np.float64)
    played = Trajectory(times, position, velocity, acceleration, np.zeros(1))
    certify(played, limits, start=trajectory.position[0])
    assert np.array_equal(played.position[-1], trajectory.position[-1])


@few(8, soak=1000)
@given(commands=COMMANDS, looks=st.lists(st.integers(0, 5 * SECOND), max_size=30))
def test_looking_at_the_run_does_not_change_it(
    commands: list[tuple[int, str, float]], looks: list[int]
) -> None:
    watched, unwatched = ur5_run(), ur5_run()
    at = BEGAN
    pending = sorted(BEGAN + look for look in looks)
    for wait, command, scale in commands:
        at += wait
        while pending and pending[0] <= at:
            watched.state(pending.pop(0))
        for run in (watched, unwatched):
            if command == "set":
                run.set_scale(at, scale)
            else:
                getattr(run, command)(at)

    end = at + SECOND
    for one, other in zip(watched.state(end), unwatched.state(end), strict=True):
        assert np.array_equal(one, other)


def test_a_pause_rests_on_the_path_and_going_on_ends_at_the_goal() -> None:
    trajectory, run = swing_of(), ur5_run()
    middle = BEGAN + len(trajectory) // 2 * TICK

    run.pause(middle)
    still = ticks_until(run, partial(rests, run), middle)
    rested = run.state(still)
    later = run.state(still + 3600 * SECOND)
    assert not rested.velocity.any()
    assert not later.acceleration.any()
    assert np.array_equal(rested.position, later.position)
    assert math.isinf(run.remaining(still + 3600 * SECOND))

    run.resume(still + 3600 * SECOND)
    done = ticks_until(run, run.finished, still + 3600 * SECOND)
    assert np.array_equal(run.state(done).position, trajectory.position[-1])


@pytest.mark.parametrize(
    ("seed", "moments"), [(0, 3), (1, 3), pytest.param(2, 200, marks=pytest.mark.soak)]
)
def test_on_a_straight_line_the_joints_accelerate_in_proportion(seed: int, moments: int) -> None:
    random = np.random.default_rng(seed)
    start, goal = random.uniform(-1.0, 1.0, (2, 6))
    trajectory = time_path(JointLine(start, goal), UR5)
    share = (goal - start) / np.abs(goal - start).max()

    for moment in random.uniform(0.05, 0.95, moments).tolist():
        run = ScaledRun(trajectory, UR5, started=0)
        paused = int(moment * trajectory.duration * SECOND)
        run.pause(paused)
        for now in range(paused, paused + 30 * TICK, TICK // 3):
            acceleration = run.state(now).acceleration
            leading = acceleration[np.abs(share).argmax()] / share[np.abs(share).argmax()]
            assert acceleration == pytest.approx(share * leading, abs=1e-6)
            assert (np.abs(acceleration) <= UR5.acceleration).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_a_pause_takes_half_again_what_is_left_or_a_second_and_a_half_at_most(name: str) -> None:
    limits, trajectory = serial_robot(name).limits, swing_of(name)
    for share in (0.1, 0.5, 0.9):
        run = ScaledRun(trajectory, limits, started=0)
        began = int(share * trajectory.duration * SECOND)
        run.pause(began)
        still = ticks_until(run, partial(rests, run), began)
        left = (1.0 - share) * trajectory.duration
        assert still - began <= min(1.5 * left + 0.1, 1.5) * SECOND


def test_a_cruising_move_stops_as_fast_as_its_acceleration_allows() -> None:
    move = plan_joint_move([0.0] * 6, [2.0] * 6, UR5)
    run = ScaledRun(move, UR5, started=0, ramp=0.001)
    began = len(move) // 2 * TICK
    speed, limit = float(move.velocity[len(move) // 2, 0]), UR5.acceleration[0]
    run.pause(began)
    still = ticks_until(run, partial(rests, run), began)
    assert (still - began) / SECOND == pytest.approx(speed / limit, abs=0.03)


def test_the_ramp_is_the_least_time_of_a_change() -> None:
    slow = plan_joint_move([0.0] * 6, [0.5] * 6, UR5, speed=0.05)
    run = ScaledRun(slow, UR5, started=0, ramp=0.5)
    run.pause(SECOND)
    assert run.scale(SECOND + 250_000_000) == pytest.approx(0.5)
    assert run.scale(SECOND + 500_000_001) == 0.0


def test_the_remaining_time_is_what_then_passes() -> None:
    run = ur5_run()
    run.set_scale(BEGAN + 20 * TICK, 0.37)
    told = run.remaining(BEGAN + 20 * TICK)
    end = BEGAN + 20 * TICK + round(told * SECOND)
    assert not run.finished(end - 1000)
    assert run.finished(end + 1000)
    assert run.remaining(end + SECOND) == 0.0


def test_a_scale_set_in_a_pause_waits_for_its_end() -> None:
    run = ur5_run()
    run.pause(BEGAN)
    run.set_scale(BEGAN, 0.4)
    assert run.scale_wanted == 0.0
    assert run.time(BEGAN + SECOND) == 0.0
    run.resume(BEGAN + SECOND)
    assert run.scale_wanted == 0.4
    assert run.scale(BEGAN + 2 * SECOND) == 0.4


def test_a_trajectory_that_starts_moving_starts_as_planned_and_slows_down() -> None:
    pytest.importorskip("ruckig")
    velocity = [0.5, 0.0, 0.0, 0.0, 0.0, 0.0]
    moving = jerk_limited_move([0.0] * 6, [1.0] * 6, UR5, start_velocity=velocity)
    run = ScaledRun(moving, UR5, started=0, scale=0.2)
    assert run.state(0).velocity.tolist() == velocity
    assert run.scale(SECOND) == pytest.approx(0.2)


@pytest.mark.parametrize("scale", [-0.1, 1.01, math.nan, math.inf])
def test_a_scale_outside_0_to_1_is_refused_and_changes_nothing(scale: float) -> None:
    run = ur5_run()
    with pytest.raises(BadArgument, match="scale"):
        run.set_scale(BEGAN, scale)
    assert run.scale_wanted == 1.0
    with pytest.raises(BadArgument, match="scale"):
        ur5_run(scale)


def test_time_that_runs_backwards_is_refused() -> None:
    run = ur5_run()
    run.set_scale(BEGAN + SECOND, 0.5)
    with pytest.raises(BadArgument, match="now"):
        run.state(BEGAN + SECOND - TICK)


SINGLE = JointLimits(("a",), (-9.0,), (9.0,), (1.0,), (10.0,), (False,))
WEAK = replace(UR5, acceleration=(0.1,) * 6)
IIWA = serial_robot("kuka_iiwa14").limits
NOTHING: Array = np.zeros((1, 1))
ONE_SAMPLE = Trajectory(np.zeros(1), NOTHING, NOTHING, NOTHING, np.zeros(1))


@refusals(
    ("no ramp", lambda: ur5_run(ramp=0.0), BadArgument, "ramp"),
    ("a ramp back", lambda: ur5_run(ramp=-1.0), BadArgument, "ramp"),
    ("no number for a ramp", lambda: ur5_run(ramp=math.nan), BadArgument, "ramp"),
    ("too long a ramp", lambda: ur5_run(ramp=100.0), BadArgument, "ramp"),
    ("too sharp", lambda: ScaledRun(swing_of(), WEAK, started=0), BadArgument, "acceleration of"),
    ("another robot's", lambda: ScaledRun(swing_of(), IIWA, started=0), WrongJointCount, ""),
    ("samples of another", lambda: IntersampleCheck(swing_of(), SINGLE), WrongJointCount, ""),
    ("one sample", lambda: IntersampleCheck(ONE_SAMPLE, SINGLE), BadArgument, "two samples"),
)
def test_what_cannot_be_scaled_is_refused(refusal: Refusal) -> None:
    refusal.check()


@pytest.mark.parametrize("distance", [5e-324, 2.2e-313, 1e-305, 1e-200])
def test_a_joint_that_moves_next_to_nothing_does_not_hinder_a_pause(distance: float) -> None:
    trajectory = plan_joint_move([0.5] * 5 + [0.0], [0.9] * 5 + [distance], UR5)
    run = ScaledRun(trajectory, UR5, started=BEGAN)
    run.pause(BEGAN + 20 * TICK)
    still = ticks_until(run, partial(rests, run), BEGAN + 20 * TICK)
    run.resume(still)
    done = ticks_until(run, run.finished, still)
    assert np.array_equal(run.state(done).position, trajectory.position[-1])


def interval(v: float, v_next: float, moved: float) -> Trajectory:
    """Two samples of one joint, 0.1 s apart."""
    places, rates = np.array([[0.0], [moved]]), np.array([[v], [v_next]])
    return Trajectory(np.array([0.0, 0.1]), places, rates, np.zeros((2, 1)), np.zeros(1))


def test_the_motion_meets_every_sample() -> None:
    motion = IntersampleCheck(swing_of(), UR5)
    for index, time in enumerate(swing_of().times.tolist()):
        state = motion.state(time)
        assert state.position == pytest.approx(swing_of().position[index], abs=1e-12)
        assert state.velocity == pytest.approx(swing_of().velocity[index], abs=1e-12)


def test_the_motion_ends_each_interval_where_the_next_begins() -> None:
    motion = IntersampleCheck(swing_of(), UR5)
    for time in swing_of().times[1:-1].tolist():
        before = motion.state(time - 1e-9)
        assert before.position == pytest.approx(motion.state(time).position, abs=1e-8)
        assert before.velocity == pytest.approx(motion.state(time).velocity, abs=1e-6)


def test_an_even_acceleration_is_found_again() -> None:
    move = plan_joint_move([0.0], [1.0], SINGLE)
    motion = IntersampleCheck(move, SINGLE)
    assert motion.pieces().acceleration[:, :, 0] == pytest.approx(move.acceleration[:-1], abs=1e-6)


def test_a_gain_in_position_takes_the_least_acceleration_there_is() -> None:
    # Up for half of the interval and down for the other: p = 4 |d| / h².
    motion = IntersampleCheck(interval(0.0, 0.0, 0.01), SINGLE)
    assert motion.pieces().acceleration[0, 0].tolist() == pytest.approx([4.0, 0.0, -4.0])
    assert motion.state(0.05).velocity == pytest.approx([0.2])


def test_the_velocity_limit_is_reached_but_not_passed() -> None:
    # From 0.9 to 0.9 with 0.098 in between: a triangle would reach 1.06.
    motion = IntersampleCheck(interval(0.9, 0.9, 0.098), SINGLE)
    assert motion.pieces().velocity.max() == pytest.approx(1.0)
    assert motion.pieces().acceleration[0, 0].tolist() == pytest.approx([5.0, 0.0, -5.0])
    assert motion.state(0.1).position == pytest.approx([0.098])


@pytest.mark.parametrize(("time", "row"), [(-1.0, 0), (1e9, -1)])
def test_outside_its_time_the_ends_hold(time: float, row: int) -> None:
    state = IntersampleCheck(swing_of(), UR5).state(time)
    assert state.position == pytest.approx(swing_of().position[row], abs=1e-12)
    assert state.velocity == pytest.approx(np.zeros(6), abs=1e-12)
