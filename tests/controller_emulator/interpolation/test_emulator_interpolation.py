"""The mathematics between two points, checked against its own definition."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.controller_rig import (
    FAILURE,
    LIMITS,
    MS,
    STOP,
    SUCCESS,
    ControllerRig,
    float32,
    full_point,
    ratio_point,
)

from openpendant.controller_emulator.error_codes import PointRefusal, ViolationKind
from openpendant.controller_emulator.float32 import read_time
from openpendant.controller_emulator.interpolation.polynomials import Bounds, SegmentEnd
from openpendant.controller_emulator.interpolation.segment import MotionSegment, connect
from openpendant.controller_emulator.interpolation.servo import StartRule
from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import OperatorAction

BOUNDS = Bounds(-2.0, 2.0, 2.0, 4.0, 4.0)
SLACK = 1e-6
MARGIN = 1.05


def one(
    h: float, start: SegmentEnd, end: SegmentEnd, bounds: Bounds = BOUNDS
) -> MotionSegment | PointRefusal:
    return connect(h, [start], [end], (bounds,))


def sampled(segment: MotionSegment) -> list[tuple[float, float, float]]:
    states = (segment.sample(segment.duration * n / 200) for n in range(201))
    return [(position[0], velocity[0], sharp[0]) for position, velocity, sharp in states]


@pytest.mark.parametrize(
    ("start", "end", "h"),
    [
        (SegmentEnd(0.0, 0.0), SegmentEnd(0.5, 0.0), 1.0),
        (SegmentEnd(0.0, 0.5), SegmentEnd(0.5, 0.5), 1.0),
        (SegmentEnd(0.0, 0.0, 1.0), SegmentEnd(0.5, 1.0, 1.0), 1.0),
        (SegmentEnd(0.0, 1.0), SegmentEnd(-0.1, -1.0), 1.0),
        (SegmentEnd(0.0, 0.0), SegmentEnd(1.9, 1.9), 1.5),
        (SegmentEnd(0.0, 2.0), SegmentEnd(0.01996, 1.99), 0.01),
        (SegmentEnd(0.0, 0.0), SegmentEnd(1.0, 0.0), 1.0),
    ],
)
def test_both_ends_are_met_in_position_and_velocity_and_bounds_hold(
    start: SegmentEnd, end: SegmentEnd, h: float
) -> None:
    segment = one(h, start, end)
    assert isinstance(segment, MotionSegment)
    states = sampled(segment)
    assert states[0][:2] == pytest.approx((start.position, start.velocity))
    assert states[-1][:2] == pytest.approx((end.position, end.velocity), abs=1e-9)
    for position, velocity, acceleration in states:
        assert BOUNDS.lower <= position <= BOUNDS.upper
        assert abs(velocity) <= BOUNDS.velocity + SLACK
        assert abs(acceleration) <= BOUNDS.acceleration + SLACK


def test_a_motion_at_the_limit_from_rest_to_rest_is_possible_and_no_shorter_one() -> None:
    fast = Bounds(-2.0, 2.0, 9.0, 4.0, 4.0)
    assert isinstance(one(1.0, SegmentEnd(0.0, 0.0), SegmentEnd(1.0, 0.0), fast), MotionSegment)
    refusal = one(0.99, SegmentEnd(0.0, 0.0), SegmentEnd(1.0, 0.0), fast)
    assert isinstance(refusal, PointRefusal)
    assert refusal.kind is ViolationKind.VELOCITY_STEP
    assert refusal.value == pytest.approx(4 / 0.99**2)


@pytest.mark.parametrize("switch", [0.1, 0.35, 0.8])
@pytest.mark.parametrize("rate", [0.5, 2.5, 4.0])
@pytest.mark.parametrize("told", [True, False])
def test_joints_in_proportion_stay_in_proportion_whatever_one_of_them_demands(
    rate: float, switch: float, told: bool
) -> None:
    # The path is accelerated until the switch and slowed down after it; the first joint moves most.
    shares = (1.0, -0.3, 0.05)
    h = 0.1
    before, after = switch * h, (1 - switch) * h
    speed = 0.5 + rate * (before - after)
    way = 0.5 * h + rate * (before**2 / 2 + before * after - after**2 / 2)
    starts = [SegmentEnd(0.0, 0.5 * share, rate * share if told else None) for share in shares]
    ends = [
        SegmentEnd(way * share, speed * share, -rate * share if told else None) for share in shares
    ]
    segment = connect(h, starts, ends, (BOUNDS,) * len(shares))
    assert isinstance(segment, MotionSegment)
    for n in range(101):
        for state in segment.sample(h * n / 100):
            assert state[1:] == pytest.approx([share * state[0] for share in shares[1:]], abs=1e-9)
            assert abs(segment.sample(h * n / 100)[2][0]) <= BOUNDS.acceleration * (1 + SLACK)


@pytest.mark.parametrize("switch", [0.1, 0.35, 0.8])
@pytest.mark.parametrize(("rate", "after"), [(3.9, -3.9), (3.9, 0.5), (-1.0, 3.9)])
def test_a_step_at_the_limit_on_a_bent_path_is_followed_where_a_quintic_would_swing(
    rate: float, after: float, switch: float
) -> None:
    # The second joint is half the square of the first.
    h, speed = 0.01, 1.0
    middle = speed + rate * switch * h
    way = (speed + middle) / 2 * switch * h
    end = middle + after * (1 - switch) * h
    way += (middle + end) / 2 * (1 - switch) * h
    starts = [SegmentEnd(0.0, speed, rate), SegmentEnd(0.0, 0.0, speed**2)]
    ends = [SegmentEnd(way, end, after), SegmentEnd(way**2 / 2, way * end, end**2 + way * after)]
    segment = connect(h, starts, ends, (BOUNDS,) * 2)
    assert isinstance(segment, MotionSegment)
    for n in range(101):
        (first, second), _, acceleration = segment.sample(h * n / 100)
        assert second == pytest.approx(first**2 / 2, abs=2e-8)
        assert max(map(abs, acceleration)) <= BOUNDS.acceleration


def test_a_quintic_in_bounds_is_taken_though_its_control_values_are_not() -> None:
    # The greatest of the acceleration's is 8.6.
    segment = one(1.0, SegmentEnd(0.0, 0.0, 1.0), SegmentEnd(0.66, 1.9, 1.0))
    assert isinstance(segment, MotionSegment)
    accelerations = [state[2] for state in sampled(segment)]
    assert (accelerations[0], accelerations[-1]) == pytest.approx((1.0, 1.0))
    assert max(map(abs, accelerations)) == pytest.approx(3.6459, abs=1e-3)


def test_joints_that_can_do_nothing_alike_each_do_what_they_can() -> None:
    # One has to switch early, the other late.
    a, h = BOUNDS.acceleration, 0.1
    starts, ends = [], []
    for switch in (0.2, 0.8):
        before, after = switch * h, (1 - switch) * h
        starts.append(SegmentEnd(0.0, 0.0))
        way = a * (before**2 / 2 + before * after - after**2 / 2)
        ends.append(SegmentEnd(way, a * (before - after)))
    segment = connect(h, starts, ends, (BOUNDS, BOUNDS))
    assert isinstance(segment, MotionSegment)
    assert [pieces[1][0] for pieces in segment.joints] == pytest.approx([0.02, 0.08])


def test_a_turn_outside_the_range_is_refused_with_the_place_of_the_turn() -> None:
    refusal = one(1.0, SegmentEnd(1.9, 1.0), SegmentEnd(1.9, -1.0), BOUNDS)
    assert isinstance(refusal, PointRefusal)
    assert refusal.kind is ViolationKind.RANGE
    assert refusal.value > 2.0


@given(
    st.floats(-2, 2),
    st.floats(-2, 2),
    st.floats(0.001, 5),
    st.lists(st.tuples(st.floats(0, 1), st.sampled_from((-4.0, -1.0, 0.0, 2.5, 4.0))), min_size=1),
)
def test_whatever_a_bounded_motion_does_its_ends_can_be_joined_within_the_bounds(
    position: float, velocity: float, h: float, phases: list[tuple[float, float]]
) -> None:
    # Drive a joint with accelerations in bounds; cut the run where it would leave them.
    begin, p, v, elapsed = SegmentEnd(position / 2, velocity / 2), position / 2, velocity / 2, 0.0
    total = sum(share for share, _ in phases) or 1.0
    for share, a in phases:
        span = h * share / total
        turn = p - v * v / (2 * a) if a and v * (v + a * span) < 0 else p
        after = p + span * (v + a * span / 2)
        if abs(v + a * span) > 2 or max(abs(after), abs(turn)) > 2:
            break
        p, v, elapsed = after, v + a * span, elapsed + span
    if elapsed < 1e-4:
        return
    bounds = Bounds(-4, 4, 2 + 1e-6, 4 + 1e-6 / elapsed**2, 4)
    segment = one(elapsed, begin, SegmentEnd(p, v), bounds)
    assert isinstance(segment, MotionSegment)


USUAL = st.sampled_from((0.0, 0.005, 0.01, 0.1))
NUMBER = st.one_of(st.floats(-2, 2, width=32), st.floats(width=32), USUAL)


@given(st.data())
def test_random_streams_never_exceed_the_limits_and_never_crash(data: st.DataObject) -> None:
    rule = StartRule(points=2, lead=10 * MS, wait=20 * MS, patience=50 * MS)
    rig = ControllerRig(start_rule=rule, buffer_depth=5)
    sequence, time = 0, 0.0
    last: tuple[float, ...] = (0.0, 0.0)
    for _ in range(data.draw(st.integers(1, 25))):
        action = data.draw(st.sampled_from(("near", "near", "near", "full", "wild", "stop", "op")))
        time += data.draw(st.sampled_from((0.05, 0.2, 0.5)))
        moves = st.floats(-0.125, 0.125, width=32)
        near = (last[0] + data.draw(moves), last[1] + data.draw(moves))
        match action:
            case "near":
                code = rig.code(ratio_point(sequence, near, data.draw(st.floats(0.2, 1.0))))
            case "full":
                speeds = (data.draw(moves), data.draw(moves))
                code = rig.code(full_point(sequence, time, near, speeds))
            case "wild":
                numbers = [data.draw(NUMBER) for _ in range(7)]
                place, speed, gain = numbers[1:3], numbers[3:5], numbers[5:7]
                code = rig.code(full_point(sequence, numbers[0], place, speed, gain))
            case "stop":
                code = rig.code(STOP)
            case _:
                rig.operate(data.draw(st.sampled_from(OperatorAction)))
                code = FAILURE
        if code == SUCCESS and action in ("near", "full"):
            sequence, last = sequence + 1, near
        elif code is not None:
            sequence, time = 0, 0.0
            last = rig.position
        for state in rig.states(data.draw(st.integers(0, 600)), step=7):
            assert_within_limits(*state)


def assert_within_limits(
    position: tuple[float, ...], velocity: tuple[float, ...], acceleration: tuple[float, ...]
) -> None:
    for joint in range(2):
        assert math.isfinite(position[joint])
        assert abs(position[joint]) <= 2.0 + 1e-3
        assert abs(velocity[joint]) <= LIMITS.velocity[joint] * (1 + 1e-5)
        assert abs(acceleration[joint]) <= LIMITS.acceleration[joint] * MARGIN + 0.05


@pytest.mark.parametrize("profile_time", [0.01, 0.07, 1.23, 16.77, 59.99, 3599.99])
def test_times_on_a_grid_of_10_ms_survive_the_four_byte_real(profile_time: float) -> None:
    assert read_time(float32(profile_time)) == round(profile_time * 1e9)


def test_times_of_eight_byte_reals_are_taken_as_they_are() -> None:
    assert read_time(0.123456789) == 123_456_789


@pytest.mark.parametrize("with_times", [True, False])
def test_the_hardest_honest_stream_is_never_refused(with_times: bool) -> None:
    # Points 10 ms apart, full acceleration, switches between the points, up to the speed limit.
    rig = ControllerRig(start_rule=StartRule(points=2, lead=50 * MS, wait=20 * MS, patience=MS))
    a, top = LIMITS.acceleration[0], LIMITS.velocity[0]
    ramp, cruise = top / a, 0.1234
    total = 2 * ramp + cruise
    goal = top * (ramp + cruise)
    worst = 0.0
    for n in range(math.ceil(total / 0.01) + 1):
        t = min(n * 0.01, total)
        left = total - t
        if t < ramp:
            p, v, rate = a * t * t / 2, a * t, a
        elif left > ramp:
            p, v, rate = top * (t - ramp / 2), top, 0.0
        else:
            p, v, rate = goal - a * left * left / 2, a * left, -a
        joints = (float32(p), -float32(p))
        if with_times:
            point: Message = full_point(n, float32(t), joints, (v, -v), (rate, -rate))
        else:
            point = ratio_point(n, joints, float32(t - max(n - 1, 0) * 0.01))
        assert rig.code(point) == SUCCESS
        if n > 8:
            worst = max(worst, *(abs(s[2][0]) for s in rig.states(10)))
    worst = max(worst, *(abs(s[2][0]) for s in rig.states(200)))
    assert rig.position == pytest.approx((goal, -goal))
    assert not rig.violations
    assert not rig.status.in_error
    assert worst <= a * (1.005 if with_times else MARGIN + 0.01)
