import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.example_counts import counts, few
from rigs.motion.loaded_robots import SERIAL, serial_robot
from rigs.motion.nearness import assert_near
from rigs.motion.refusals import Refusal, refusals

from openpendant.motion import errors
from openpendant.motion.description.limits import JointLimits
from openpendant.motion.paths.blending import (
    LEAST_ZONE,
    JointPolyline,
    check_zones,
    place_of_rate,
    rates,
    runs,
    turning,
)
from openpendant.motion.paths.path_chains import JointChain
from openpendant.motion.pose import Array
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointLine, JointSpline

CORNER = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]
SPEED, GAIN = 2.0, 8.0
TWO = JointLimits(("a", "b"), (-3.0,) * 2, (3.0,) * 2, (SPEED,) * 2, (GAIN,) * 2, (False,) * 2)


def waypoints_and_zones(seed: int, count: int, joints: int) -> tuple[Array, list[float]]:
    """Waypoints in the unit cube with zones that just fit, or less."""
    random = np.random.default_rng(seed)
    points = random.uniform(-1.0, 1.0, (count, joints))
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    room = np.minimum(lengths[:-1], lengths[1:]) / 2.0
    zones = np.maximum(room * random.choice([1e-3, 0.1, 0.5, 1.0], count - 2), LEAST_ZONE)
    return points, zones.tolist()


def off_the_polyline(places: Array, points: Array) -> float:
    """The greatest distance of places (m, n) from the straight lines between points (w, n)."""
    nearest = np.full(len(places), math.inf)
    for start, end in pairwise(points):
        along = end - start
        fraction = np.clip((places - start) @ along / (along @ along), 0.0, 1.0)
        off = np.linalg.norm(places - start - np.outer(fraction, along), axis=1)
        nearest = np.minimum(nearest, off)
    return float(nearest.max())


@pytest.mark.parametrize("zone", [1e-4, 0.02, 0.1, 0.5, 1.0])
def test_a_right_angle_is_left_and_joined_at_the_zone_and_passed_by_the_law(zone: float) -> None:
    path = JointPolyline(CORNER, [zone])
    places = path.evaluate(np.linspace(0.0, path.length, 4001))

    middle = path.evaluate(path.knots[path.waypoint_knots])[1]

    assert path.evaluate(np.array([1.0 - zone]))[0] == pytest.approx([1.0 - zone, 0.0])
    assert path.evaluate(np.array([1.0 + zone]))[0] == pytest.approx([1.0, zone])
    off = 3.0 / 16.0 * zone
    assert middle == pytest.approx([1.0 - off, off])
    assert off_the_polyline(places, np.array(CORNER)) == pytest.approx(off, abs=1e-9)


@pytest.mark.parametrize("degrees", [1.0, 30.0, 90.0, 150.0, 179.0])
def test_any_corner_is_passed_at_the_distance_of_the_formula(degrees: float) -> None:
    turn, zone = math.radians(degrees), 0.2
    path = JointPolyline([[0.0, 0.0], [1.0, 0.0], [1.0 + math.cos(turn), math.sin(turn)]], [zone])
    middle = path.evaluate(path.knots[path.waypoint_knots[1:2]])[0]
    assert math.dist(middle, CORNER[1]) == pytest.approx(3.0 / 8.0 * zone * math.sin(turn / 2.0))


@given(seed=st.integers(0, 10**6), count=st.integers(2, 12), joints=st.integers(2, 7))
def test_the_derivatives_are_those_of_the_position(seed: int, count: int, joints: int) -> None:
    path = JointPolyline(*waypoints_and_zones(seed, count, joints))
    s = np.random.default_rng(seed).uniform(0.0, path.length, 50)
    off = np.abs(s[:, np.newaxis] - path.knots).min(axis=1)
    s, step = s[off > 2e-7], 1e-7
    slope = (path.evaluate(s + step) - path.evaluate(s - step)) / (2.0 * step)
    bend = (path.evaluate(s + step, 1) - path.evaluate(s - step, 1)) / (2.0 * step)
    assert path.evaluate(s, 1) == pytest.approx(slope, abs=1e-6)
    assert path.evaluate(s, 2) == pytest.approx(bend, abs=1e-4, rel=1e-6)


@given(seed=st.integers(0, 10**6), count=st.integers(3, 12))
def test_position_slope_and_curvature_have_no_step_at_any_knot(seed: int, count: int) -> None:
    points, zones = waypoints_and_zones(seed, count, 4)
    path = JointPolyline(points, zones)
    knots, sharpest = path.knots[1:-1], 1.5 / min(zones)
    for order, scale in ((0, 1.0), (1, 1.0), (2, sharpest)):
        before = path.evaluate(knots - 1e-12, order)
        assert path.evaluate(knots + 1e-12, order) == pytest.approx(before, abs=1e-7 * scale)


@given(seed=st.integers(0, 10**6), count=st.integers(3, 12))
def test_the_path_stays_in_the_hull_of_its_polyline(seed: int, count: int) -> None:
    points, zones = waypoints_and_zones(seed, count, 3)
    path = JointPolyline(points, zones)
    places = path.evaluate(np.linspace(0.0, path.length, 1000))

    least, greatest = path.extent()

    assert (places >= least - 1e-12).all()
    assert (places <= greatest + 1e-12).all()
    assert (least >= points.min(axis=0) - 1e-12).all()
    assert (greatest <= points.max(axis=0) + 1e-12).all()
    assert off_the_polyline(places, points) <= 3.0 / 16.0 * max(zones) + 1e-9
    assert np.array_equal(path.evaluate(path.knots[[0, -1]]), points[[0, -1]])


def test_the_extent_is_that_of_the_zone_where_a_motion_turns_back() -> None:
    least, greatest = JointPolyline([[0.0], [1.0], [0.25]], [0.5]).extent()
    assert (float(least[0]), float(greatest[0])) == pytest.approx((0.0, 13.0 / 16.0))


def fastest_around(leg: float, zone: float) -> float:
    """The least time around a right angle, by the phase plane.

    From the corner, where the zone bends most and no joint can change its speed, the joints speed
    up as hard as they can; backwards from the end they do too; the way to the corner is the same.
    """
    step, square, least = leg / 20_000.0, 4.0 / 3.0 * zone * GAIN, 0.0
    for s in np.arange(step / 2.0, leg, step).tolist():
        t = min(0.5 + s / (2.0 * zone), 1.0)
        coming, bend = t * t * (3.0 - 2.0 * t), 3.0 * t * (1.0 - t) / zone
        gain = (GAIN - bend * square) / coming
        if coming < 1.0:
            gain = min(gain, (GAIN + bend * square) / (1.0 - coming))
        square = min(square + 2.0 * gain * step, (SPEED / coming) ** 2)
        least += step / math.sqrt(min(square, 2.0 * GAIN * (leg - s)))
    return 2.0 * least


@pytest.mark.parametrize("leg", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("zone", [0.005, 0.02, 0.1])
def test_a_corner_is_run_nearly_as_fast_as_can_be(leg: float, zone: float) -> None:
    path = JointPolyline([[0.0, 0.0], [leg, 0.0], [leg, leg]], [zone], TWO)
    duration = time_path(path, TWO, sample_period=1e-3).duration
    least = fastest_around(leg, zone)
    assert least <= duration + 1e-3
    assert duration <= 1.02 * least + 1e-3


@few(6)
@given(seed=st.integers(0, 10**6), count=st.integers(3, 15))
def test_a_timed_path_keeps_limits_between_samples_without_a_stop(seed: int, count: int) -> None:
    path = JointPolyline(*waypoints_and_zones(seed, count, 2), TWO)
    trajectory = time_path(path, TWO, sample_period=1e-3)
    certify(trajectory, TWO)
    assert np.abs(trajectory.acceleration).max() <= GAIN * (1.0 + 1e-3)
    assert np.abs(np.diff(trajectory.velocity, axis=0)).max() <= GAIN * 1e-3 * (1.0 + 1e-3)
    assert (np.diff(trajectory.waypoint_times) > 0.0).all()


@pytest.mark.parametrize("count", counts(1, 300))
@pytest.mark.parametrize("name", SERIAL)
def test_random_paths_with_zones_are_certified(name: str, count: int) -> None:
    limits = serial_robot(name).limits
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    for seed in range(SERIAL.index(name), SERIAL.index(name) + count):
        points, zones = waypoints_and_zones(seed, int(seed % 9) + 3, limits.dof)
        points = (lower + upper) / 2.0 + points * (upper - lower) / 2.0
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        shares = np.random.default_rng(seed).uniform(0.01, 0.5, len(zones))
        zones = (np.minimum(lengths[:-1], lengths[1:]) * shares).tolist()

        trajectory = time_path(JointPolyline(points, zones, limits), limits)

        certify(trajectory, limits, start=points[0])
        assert (np.diff(trajectory.waypoint_times) > 0.0).all()


@pytest.mark.parametrize(
    ("lengths", "zones", "waypoint", "largest"),
    [
        ([1.0, 1.0], [1.1], 0, 1.0),
        ([1.0, 0.3], [0.5], 0, 0.3),
        ([1.0, 1.0, 1.0], [0.6, 0.3], None, 0.0),
        ([1.0, 1.0, 1.0], [0.6, 0.6], 0, 0.5),
        ([1.0, 1.0, 1.0], [0.8, 0.3], 0, 0.7),
        ([1.0, 1.0, 1.0], [0.3, 0.8], 1, 0.7),
        ([1.0, 1.0, 1.0], [0.5, 0.5], None, 0.0),
        ([1.0, 0.0], [0.1], 0, 0.0),
    ],
)
def test_a_zone_that_does_not_fit_is_refused_with_the_largest_that_does(
    lengths: list[float], zones: list[float], waypoint: int | None, largest: float
) -> None:
    if waypoint is None:
        check_zones(lengths, zones, "m")
        return
    with pytest.raises(errors.ZoneTooLarge) as refusal:
        check_zones(lengths, zones, "m", first_waypoint=7)

    error = refusal.value
    assert (error.waypoint, error.zone, error.unit) == (7 + waypoint, zones[waypoint], "m")
    assert error.largest == pytest.approx(largest)
    if largest:
        check_zones(lengths, [min(zone, largest) for zone in zones], "m")


@pytest.mark.parametrize(
    ("points", "zones", "error"),
    [
        ([], [], errors.BadArgument),
        ([[0.0, 0.0]], [], errors.BadArgument),
        (CORNER, [], errors.BadArgument),
        (CORNER, [0.1, 0.1], errors.BadArgument),
        (CORNER, [-0.1], errors.BadArgument),
        (CORNER, [0.0], errors.BadArgument),
        (CORNER, [9e-5], errors.BadArgument),
        (CORNER, [math.nan], errors.NotFinite),
        (CORNER, [math.inf], errors.NotFinite),
        (CORNER, [1.1], errors.ZoneTooLarge),
        ([CORNER[0], CORNER[0]], [], errors.NoMotion),
        ([CORNER[0], [9e-6, 0.0]], [], errors.NoMotion),
        ([CORNER[0], CORNER[1], CORNER[1]], [0.1], errors.ZoneTooLarge),
        ([[0.0, 0.0], [1.0, math.nan], [1.0, 1.0]], [0.1], errors.NotFinite),
        ([[0.0, 0.0], [1.0], [1.0, 1.0]], [0.1], errors.WrongJointCount),
        ([[0.0, 0.0], [3.1, 0.0], [1.0, 1.0]], [0.1], errors.OutOfRange),
    ],
)
def test_what_is_no_path_with_zones_is_refused(
    points: list[list[float]], zones: list[float], error: type[errors.MotionError]
) -> None:
    with pytest.raises(error):
        JointPolyline(points, zones, TWO)


@pytest.mark.parametrize("rest", [0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3])
def test_a_leg_that_its_zones_leave_almost_nothing_of_is_timed_like_any_other(rest: float) -> None:
    points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    trajectory = time_path(JointPolyline(points, [0.5, 0.5 - rest], TWO), TWO)
    certify(trajectory, TWO)
    assert np.array_equal(trajectory.position[-1], points[-1])


def test_turning_back_within_a_zone_stays_short_of_the_corner() -> None:
    trajectory = time_path(JointPolyline([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]], [0.2], TWO), TWO)
    certify(trajectory, TWO)
    assert float(trajectory.position[:, 0].max()) == pytest.approx(1.0 - 3.0 / 8.0 * 0.2, abs=1e-3)


def test_a_thousand_corners_are_one_motion() -> None:
    turns = np.cumsum(np.random.default_rng(4).choice([-1.0, 1.0], 1001) * math.pi / 3.0)
    steps = 0.05 * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    points = np.cumsum(steps, axis=0)
    points -= points.mean(axis=0)
    certify(time_path(JointPolyline(points, [0.02] * 999, TWO), TWO), TWO)


HALF = 0.3
T = np.linspace(0.0, 1.0, 101)
STEP = 1e-6


def test_the_first_leg_runs_out_as_the_second_begins() -> None:
    left, gone = runs(np.array([0.0, 0.5, 1.0]), HALF)
    assert left == pytest.approx([HALF, 3.0 / 16.0 * HALF, 0.0])
    assert gone == pytest.approx([0.0, 3.0 / 16.0 * HALF, HALF])


def test_the_rates_are_the_derivatives_of_the_runs_and_add_up_to_one() -> None:
    per_parameter = 2.0 * STEP * 2.0 * HALF
    before, after = runs(T - STEP, HALF), runs(T + STEP, HALF)
    leaving, coming = rates(T)
    assert leaving == pytest.approx((before[0] - after[0]) / per_parameter, abs=1e-8)
    assert coming == pytest.approx((after[1] - before[1]) / per_parameter, abs=1e-8)
    assert leaving + coming == pytest.approx(np.ones_like(T))


def test_the_turning_is_the_derivative_of_the_second_rate_and_none_at_both_ends() -> None:
    change = (rates(T + STEP)[1] - rates(T - STEP)[1]) / (2.0 * STEP * 2.0 * HALF)
    assert turning(T, HALF) == pytest.approx(change, abs=1e-8)
    assert turning(T[[0, -1]], HALF) == pytest.approx([0.0, 0.0])


def test_a_rate_is_found_where_it_is() -> None:
    assert place_of_rate(rates(T)[1]) == pytest.approx(T, abs=1e-7)


LINE = JointLine([0.0, 0.0], [1.0, 0.0])
CURVE = JointSpline([[1.0, 0.0], [1.2, 0.5], [1.0, 1.0]])
BACK = JointLine([1.0, 1.0], [0.0, 1.0])
S: Array = np.zeros(1)
CORNERED = JointPolyline(CORNER, [0.1])


def chain(*zones: float) -> JointChain:
    return JointChain([LINE, CURVE, BACK], zones, TWO)


def test_outside_its_zones_each_path_is_what_it_was() -> None:
    joined = chain(0.2, 0.3)

    for path, start, begin, end in (
        (LINE, 0.0, 0.0, 0.8),
        (CURVE, LINE.length, 0.2, CURVE.length - 0.3),
        (BACK, LINE.length + CURVE.length, 0.3, BACK.length),
    ):
        along = np.linspace(begin, end, 20)
        for order in (0, 1, 2):
            assert_near(joined.evaluate(start + along, order), path.evaluate(along, order), 1e-10)


def test_derivatives_are_those_of_the_positions_and_have_no_step() -> None:
    joined = chain(0.2, 0.3)
    s, step = np.linspace(1e-4, joined.length - 1e-4, 4001), 1e-5
    for order in (0, 1):
        ahead, behind = joined.evaluate(s + step, order), joined.evaluate(s - step, order)
        rate = (ahead - behind) / (2.0 * step)
        np.testing.assert_allclose(joined.evaluate(s, order + 1), rate, atol=2e-3)


def test_the_ends_are_exact_and_each_corner_is_a_waypoint() -> None:
    joined = chain(0.2, 0.3)
    ends = joined.evaluate(np.array([0.0, joined.length]))
    assert ends.tolist() == [[0.0, 0.0], [0.0, 1.0]]
    assert joined.goal.tolist() == [0.0, 1.0]
    wanted = np.cumsum([0.0, LINE.length, CURVE.length / 2, CURVE.length / 2, BACK.length])
    assert joined.knots[joined.waypoint_knots] == pytest.approx(wanted, abs=1e-4)
    assert (np.diff(joined.knots) > 0.0).all()


@pytest.mark.parametrize("zones", [(0.01, 0.01), (0.2, 0.3), (1.0, 0.07)])
def test_the_motion_is_certified_and_time_goes_on_strictly(zones: tuple[float, float]) -> None:
    trajectory = time_path(chain(*zones), TWO)
    certify(trajectory, TWO, start=[0.0, 0.0])
    assert (np.diff(trajectory.waypoint_times) > 0.0).all()


def test_a_way_back_on_itself_is_certified_too() -> None:
    there, back = JointLine([0.0, 0.0], [1.0, 0.5]), JointLine([1.0, 0.5], [0.0, 0.0])
    certify(time_path(JointChain([there, back], [0.4], TWO), TWO), TWO)


def test_no_zone_leaves_the_extent() -> None:
    joined = chain(0.2, 0.3)
    least, greatest = joined.extent()
    places = joined.evaluate(np.linspace(0.0, joined.length, 5000))
    assert (places >= least - 1e-12).all()
    assert (places <= greatest + 1e-12).all()


def test_a_zone_out_of_a_joints_range_is_refused() -> None:
    # The first runs into the corner from above while the second leaves it upwards.
    first = JointSpline([[0.0, 0.0], [0.5, 0.8], [1.0, 0.5]])
    second = JointSpline([[1.0, 0.5], [1.5, 0.8], [2.0, 0.0]])
    top = float(max(path.extent()[1][1] for path in (first, second)))
    narrow = replace(TWO, upper=(3.0, top))
    JointChain([first, second], [0.05], narrow)
    with pytest.raises(errors.OutOfRange) as refusal:
        JointChain([first, second], [first.length / 2.0], narrow)
    assert refusal.value.joint == "b"


@refusals(
    ("a zone less", lambda: chain(0.2), errors.BadArgument, "zones"),
    ("beyond the last", lambda: chain(0.2, 1.1), errors.BadArgument, "zones"),
    ("before the first", lambda: chain(1.1, 0.1), errors.BadArgument, "zones"),
    ("that meet", lambda: chain(0.6, 0.6), errors.BadArgument, "zones"),
    ("a third derivative", lambda: CORNERED.evaluate(S, 3), errors.BadArgument, "order"),
    ("of a chain", lambda: chain(0.2, 0.3).evaluate(S, 3), errors.BadArgument, "0, 1 or 2"),
)
def test_what_no_zones_give_is_refused(refusal: Refusal) -> None:
    refusal.check()
