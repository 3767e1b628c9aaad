import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.example_counts import few
from rigs.motion.refusals import Refusal, refusals

from openpendant.motion import errors
from openpendant.motion.paths import tool_curves
from openpendant.motion.paths.path_chains import ToolChain
from openpendant.motion.paths.tool_curves import (
    arc_about,
    arc_through,
    check_point,
    circle_about,
    circle_through,
)
from openpendant.motion.pose import Array, Pose

KINDS = ("line", "turn", "arc", "arc with the path", "spline", "chain")


def random_pose(random: np.random.Generator) -> Pose:
    return Pose(random.uniform(-1.0, 1.0, 3), random.normal(size=4))


def curve_of(kind: str, seed: int) -> tool_curves.ToolCurve:
    random = np.random.default_rng(seed)
    start, middle, end, last = (random_pose(random) for _ in range(4))
    through = arc_through(start.position, middle.position, end.position)
    match kind:
        case "line":
            return tool_curves.ToolLine(start, end)
        case "turn":
            return tool_curves.ToolLine(start, Pose(start.position, end.quaternion))
        case "arc":
            return tool_curves.ToolArc(through, start, end)
        case "arc with the path":
            return tool_curves.ToolArc(through, start, end, tool_curves.ToolTurn.WITH_THE_PATH)
        case "spline":
            return tool_curves.ToolSpline([start, middle, end, last])
    legs: list[tool_curves.ToolCurve] = [
        tool_curves.ToolLine(last, start),
        tool_curves.ToolArc(through, start, end),
        tool_curves.ToolLine(end, last),
    ]
    half = min(leg.length for leg in legs) / 2.0
    return ToolChain(legs, (half * random.uniform(0.1, 1.0, 2)).tolist())


@pytest.mark.parametrize("kind", KINDS)
@few(5)
@given(seed=st.integers(0, 10**6))
def test_the_derivative_is_that_of_the_places(kind: str, seed: int) -> None:
    curve, step = curve_of(kind, seed), 1e-6
    s = np.linspace(0.01, 0.99, 41) * curve.length
    before, at, after = (curve.place(s + offset) for offset in (-step, 0.0, step))
    linear = (after.position - before.position) / (2.0 * step)
    spin = (after.rotation - before.rotation) / (2.0 * step) @ at.rotation.transpose(0, 2, 1)
    angular = np.stack((spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]), axis=1)
    assert curve.motion(s) == pytest.approx(np.hstack((linear, angular)), abs=1e-5, rel=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_rotations_stay_rotations_and_waypoints_lie_on_the_curve(kind: str) -> None:
    curve = curve_of(kind, 5)
    rotation = curve.place(np.linspace(0.0, curve.length, 50)).rotation
    unit = rotation @ rotation.transpose(0, 2, 1)
    assert unit == pytest.approx(np.tile(np.eye(3), (50, 1, 1)), abs=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(np.ones(50))
    assert (curve.joins[0], curve.joins[-1]) == (0.0, curve.length)
    assert (np.diff(curve.joins) > 0.0).all()
    assert set(curve.waypoints.tolist()) <= set(curve.joins.tolist())


@given(seed=st.integers(0, 10**6), fraction=st.floats(0.0, 1.0))
def test_a_line_is_what_slerp_says(seed: int, fraction: float) -> None:
    random = np.random.default_rng(seed)
    start, end = random_pose(random), random_pose(random)
    line = tool_curves.ToolLine(start, end)
    rotation, position = line.place(np.array([fraction * line.length]))
    pose = start.interpolate(end, fraction)
    assert position[0] == pytest.approx(pose.position, abs=1e-12)
    assert rotation[0] == pytest.approx(pose.rotation, abs=1e-9)


def test_an_arc_runs_at_unit_speed() -> None:
    arc = curve_of("arc", 3)
    speeds = np.linalg.norm(arc.motion(np.linspace(0.0, arc.length, 20))[:, :3], axis=1)
    assert speeds == pytest.approx(np.ones(20))


def test_a_spline_passes_its_poses_the_short_way_round() -> None:
    random = np.random.default_rng(2)
    poses = [random_pose(random) for _ in range(5)]
    spline = tool_curves.ToolSpline(poses)
    rotations, positions = spline.place(spline.waypoints)
    for pose, rotation, position in zip(poses, rotations, positions, strict=True):
        assert position == pytest.approx(pose.position, abs=1e-12)
        assert rotation == pytest.approx(pose.rotation, abs=1e-9)


def test_no_turn_and_small_turns_are_exact() -> None:
    turned = tool_curves.turned_by(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1e-9]]))
    assert np.array_equal(turned[0], np.eye(3))
    assert turned[1][1, 0] == pytest.approx(1e-9, rel=1e-9)


def at_x(x: float) -> Pose:
    return Pose.from_rpy([x, 0.0, 0.0], [0.0, 0.0, 0.0])


RIGHT_ANGLE = [
    Pose.from_rpy([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
    Pose.from_rpy([1.0, 0.0, 0.0], [0.0, 0.0, 0.6]),
    Pose.from_rpy([1.0, 1.0, 0.0], [0.0, 0.5, 0.6]),
]


def right_angle(zone: float) -> ToolChain:
    first, corner, last = RIGHT_ANGLE
    legs = [tool_curves.ToolLine(first, corner), tool_curves.ToolLine(corner, last)]
    return ToolChain(legs, [zone])


@pytest.mark.parametrize("zone", [0.01, 0.2, 1.0])
def test_a_corner_is_passed_at_the_distance_of_the_formula(zone: float) -> None:
    chain = right_angle(zone)
    corner = chain.place(chain.waypoints[1:2]).position[0]
    distance = math.dist(corner, RIGHT_ANGLE[1].position)
    assert distance == pytest.approx(3.0 * zone / 8.0 * math.sin(math.pi / 4.0))


def test_outside_its_zones_a_chain_is_its_legs() -> None:
    chain, first = right_angle(0.2), tool_curves.ToolLine(*RIGHT_ANGLE[:2])
    s = np.linspace(0.0, 0.8, 9)
    assert chain.place(s).position == pytest.approx(first.place(s).position, abs=1e-15)
    assert chain.place(s).rotation == pytest.approx(first.place(s).rotation, abs=1e-15)


@pytest.mark.parametrize("length", [0.1, 0.3, 2.0])
def test_a_chain_has_no_gap_at_the_edges_of_its_zones(length: float) -> None:
    first = tool_curves.ToolLine(at_x(0.0), at_x(0.1))
    chain = ToolChain([first, tool_curves.ToolLine(at_x(0.1), at_x(0.1 + length))], [0.02])
    edges = np.array([0.08, 0.12, 0.1 + 0.02, 0.1 - 0.02])
    s = np.concatenate((edges, np.nextafter(edges, 0.0), np.nextafter(edges, 1.0)))
    assert chain.place(s).position[:, 0] == pytest.approx(s, abs=1e-12)


def test_slope_and_curvature_have_no_step_where_a_zone_begins_and_ends() -> None:
    random = np.random.default_rng(8)
    poses = [random_pose(random) for _ in range(4)]
    circle = arc_through(*(pose.position for pose in poses[1:]))
    arc = tool_curves.ToolArc(circle, poses[1], poses[3])
    chain = ToolChain([tool_curves.ToolLine(poses[0], poses[1]), arc], [0.2])
    edges, step = chain.waypoints[1] + np.array([-0.2, 0.2]), 1e-6
    here, before, after = (chain.motion(edges + offset) for offset in (0.0, -step, step))
    assert before == pytest.approx(after, abs=1e-4)
    assert (here - before) / step == pytest.approx((after - here) / step, abs=1e-3)


@pytest.mark.parametrize(
    ("s", "leg", "fraction"), [(0.5, 0, 0.5), (0.99, 0, 0.99), (1.01, 1, 0.01), (2.0, 1, 1.0)]
)
def test_a_place_of_a_chain_belongs_to_a_leg(s: float, leg: int, fraction: float) -> None:
    place = right_angle(0.2).where(s)
    assert place.leg == leg
    assert place.fraction == pytest.approx(fraction)


def test_a_zone_next_to_a_turn_on_the_spot_is_refused() -> None:
    first, corner, last = RIGHT_ANGLE
    spin = tool_curves.ToolLine(corner, Pose(corner.position, last.quaternion))
    with pytest.raises(errors.ZoneTooLarge, match="turn on the spot") as refusal:
        ToolChain([tool_curves.ToolLine(first, corner), spin], [0.1], first_waypoint=4)
    assert (refusal.value.waypoint, refusal.value.largest) == (4, 0.0)


EAST: Array = np.array([1.0, 0.0, 0.0])
NORTH: Array = np.array([0.0, 1.0, 0.0])
WEST, SOUTH = -EAST, -NORTH
ORIGIN: Array = np.zeros(3)
UP: Array = np.array([0.0, 0.0, 1.0])
QUARTER = math.pi / 2.0


def at_angle(degrees: float) -> Array:
    angle = math.radians(degrees)
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def end_of(circle: tool_curves.Circle) -> Array:
    end: Array = circle.positions(np.array([circle.sweep]))[0]
    return end


@pytest.mark.parametrize(
    ("via", "end", "degrees"),
    [
        (45, 90, 90),
        (90, 180, 180),
        (10, 270, 270),
        (300, 350, 350),
        (-45, -90, 90),
        (5, -5, 355),
    ],
)
def test_an_arc_through_a_point_goes_past_it(via: float, end: float, degrees: float) -> None:
    arc = arc_through(EAST, at_angle(via), at_angle(end))
    assert arc.radius == pytest.approx(1.0)
    assert arc.centre == pytest.approx(ORIGIN, abs=1e-12)
    assert math.degrees(arc.sweep) == pytest.approx(degrees)
    assert end_of(arc) == pytest.approx(at_angle(end), abs=1e-12)
    assert arc.normal[2] == pytest.approx(math.copysign(1.0, via))


@pytest.mark.parametrize(
    ("end", "more_than_half", "degrees"),
    [
        (90, False, 90),
        (90, True, 270),
        (-120, False, 120),
        (-120, True, 240),
        (179, False, 179),
    ],
)
def test_an_arc_about_a_centre_is_less_or_more_than_half_a_turn(
    end: float, more_than_half: bool, degrees: float
) -> None:
    arc = arc_about(EAST, ORIGIN, at_angle(end), more_than_half=more_than_half)
    assert math.degrees(arc.sweep) == pytest.approx(degrees)
    assert end_of(arc) == pytest.approx(at_angle(end), abs=1e-12)


@pytest.mark.parametrize(
    ("end", "normal", "degrees"), [(90, 1.0, 90), (90, -5.0, 270), (180, 1.0, 180), (180, -1, 180)]
)
def test_a_normal_decides_the_direction_and_gives_half_a_turn_its_plane(
    end: float, normal: float, degrees: float
) -> None:
    arc = arc_about(EAST, ORIGIN, at_angle(end), normal=normal * UP)
    assert math.degrees(arc.sweep) == pytest.approx(degrees)
    assert end_of(arc) == pytest.approx(at_angle(end), abs=1e-12)
    assert arc.normal @ (normal * UP) > 0.0


def test_a_centre_that_is_slightly_off_is_moved_so_that_both_ends_are_met() -> None:
    end = at_angle(70) * 1.00005
    arc = arc_about(EAST, np.array([0.00003, 0.0, 0.0]), end)
    assert arc.positions(np.zeros(1))[0] == pytest.approx(EAST, abs=1e-15)
    assert end_of(arc) == pytest.approx(end, abs=1e-12)
    assert arc.centre == pytest.approx(ORIGIN, abs=1e-4)


@pytest.mark.parametrize(
    "circle",
    [
        circle_about(EAST, ORIGIN, 0.2 * UP),
        circle_through(EAST, NORTH, WEST),
    ],
    ids=["about", "through"],
)
def test_a_full_circle_comes_back_to_its_start(circle: tool_curves.Circle) -> None:
    assert circle.sweep == 2.0 * math.pi
    assert end_of(circle) == pytest.approx(EAST, abs=1e-12)
    assert circle.positions(np.array([QUARTER]))[0] == pytest.approx(NORTH, abs=1e-12)


def test_a_full_circle_runs_in_the_order_of_its_points() -> None:
    circle = circle_through(EAST, SOUTH, NORTH)
    assert circle.positions(np.array([QUARTER]))[0] == pytest.approx(SOUTH, abs=1e-12)


@pytest.mark.parametrize(
    ("points", "fault", "value"),
    [
        ((EAST, EAST, WEST), errors.CircleFault.COINCIDENT, 0.0),
        ((EAST, NORTH, NORTH + 5e-5 * EAST), errors.CircleFault.COINCIDENT, 5e-5),
        ((EAST, NORTH, EAST + 9e-5 * UP), errors.CircleFault.COINCIDENT, 9e-5),
        ((EAST, ORIGIN, WEST), errors.CircleFault.COLLINEAR, 0.0),
        ((EAST, 3.0 * EAST, WEST), errors.CircleFault.COLLINEAR, 0.0),
        ((EAST, 5e-7 * UP, WEST), errors.CircleFault.COLLINEAR, 5e-7),
        ((EAST, 1e-3 * UP, WEST), errors.CircleFault.TOO_LARGE, 500.0005),
        ((2e-4 * EAST, 2e-4 * NORTH, 2e-4 * WEST), errors.CircleFault.TOO_SMALL, 2e-4),
    ],
)
def test_points_of_no_arc_are_refused_with_their_numbers(
    points: tuple[Array, Array, Array], fault: errors.CircleFault, value: float
) -> None:
    with pytest.raises(errors.BadCircle) as refusal:
        arc_through(*points)
    assert refusal.value.fault is fault
    assert refusal.value.measured == pytest.approx(value, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("centre", "end", "fault", "value", "limit"),
    [
        (0.1 * EAST, WEST, errors.CircleFault.NOT_EQUIDISTANT, 1.1, 0.9),
        (ORIGIN, NORTH * 1.0002, errors.CircleFault.NOT_EQUIDISTANT, 1.0002, 1.0),
        (ORIGIN, WEST, errors.CircleFault.NO_NORMAL, 0.0, 1e-4),
        (ORIGIN, EAST, errors.CircleFault.COINCIDENT, 0.0, 1e-4),
        (EAST, EAST, errors.CircleFault.TOO_SMALL, 0.0, 1e-3),
        (200.0 * NORTH, WEST, errors.CircleFault.TOO_LARGE, math.hypot(200.0, 1.0), 100.0),
    ],
)
def test_a_centre_of_no_arc_is_refused_with_its_numbers(
    centre: Array, end: Array, fault: errors.CircleFault, value: float, limit: float
) -> None:
    with pytest.raises(errors.BadCircle) as refusal:
        arc_about(EAST, centre, end)
    assert refusal.value.fault is fault
    assert (refusal.value.measured, refusal.value.bound) == pytest.approx((value, limit), abs=1e-9)


def test_a_refusal_names_both_radii_in_millimetres() -> None:
    told = r"1e\+03 mm from the start and 1\.1e\+03 mm|from the end"
    with pytest.raises(errors.BadCircle, match=told):
        arc_about(EAST, ORIGIN, 1.1 * NORTH)


@pytest.mark.parametrize(
    ("normal", "named"), [(ORIGIN, "length"), (EAST, "right angle"), (UP + 0.1 * EAST, "0.0995 m")]
)
def test_a_normal_that_is_none_is_refused(normal: Array, named: str) -> None:
    with pytest.raises(errors.BadArgument, match=named):
        circle_about(EAST, ORIGIN, normal)
    with pytest.raises(errors.BadArgument, match=named):
        arc_about(EAST, ORIGIN, WEST, normal=normal)


POSE = random_pose(np.random.default_rng(1))
NEAR = Pose(np.add(POSE.position, (1e-8, 0.0, 0.0)), POSE.quaternion)
NAN, INF = math.nan, math.inf


@refusals(
    ("a line of no length", lambda: tool_curves.ToolLine(POSE, POSE), errors.NoMotion, ""),
    ("one of 1e-8 m", lambda: tool_curves.ToolLine(POSE, NEAR), errors.NoMotion, ""),
    ("a spline of none", lambda: tool_curves.ToolSpline([POSE, POSE]), errors.NoMotion, ""),
    ("a chain of nothing", lambda: ToolChain([], []), errors.BadArgument, "legs"),
    ("two", lambda: check_point([0.0, 1.0], "the point"), errors.BadArgument, ""),
    ("NaN", lambda: check_point([0.0, NAN, 1.0], "the point"), errors.NotFinite, ""),
    ("far", lambda: check_point([0.0, 1e7, 0.0], "the point"), errors.BadArgument, ""),
    ("NaN via", lambda: arc_through(EAST, [NAN, 0, 0], NORTH), errors.NotFinite, ""),
    ("endless via", lambda: arc_through(EAST, [INF, 0, 0], NORTH), errors.NotFinite, ""),
    ("NaN centre", lambda: arc_about(EAST, [0, NAN, 0], NORTH), errors.NotFinite, ""),
    ("endless centre", lambda: arc_about(EAST, [0, INF, 0], NORTH), errors.NotFinite, ""),
    ("NaN normal", lambda: circle_about(EAST, ORIGIN, [0, 0, NAN]), errors.NotFinite, ""),
    ("endless normal", lambda: circle_about(EAST, ORIGIN, [0, 0, INF]), errors.NotFinite, ""),
    ("via of two", lambda: circle_through(EAST, [0, 1], WEST), errors.BadArgument, "three"),
    (
        "a normal and the longer way",
        lambda: arc_about(EAST, ORIGIN, NORTH, normal=UP, more_than_half=True),
        errors.BadArgument,
        "more_than_half",
    ),
)
def test_what_gives_no_curve_is_refused(refusal: Refusal) -> None:
    refusal.check()


@pytest.mark.parametrize(
    ("turn", "rpy"),
    [
        (tool_curves.ToolTurn.EVEN, (0.0, 0.4, 0.0)),
        (tool_curves.ToolTurn.CONSTANT, (0.0, 0.0, 0.0)),
        (tool_curves.ToolTurn.WITH_THE_PATH, (0.0, 0.0, QUARTER)),
    ],
)
def test_the_tool_turns_as_asked(turn: tool_curves.ToolTurn, rpy: tuple[float, ...]) -> None:
    start, target = Pose.from_rpy(EAST, [0.0] * 3), Pose.from_rpy(NORTH, [0.0, 0.4, 0.0])
    arc = tool_curves.ToolArc(arc_about(EAST, ORIGIN, NORTH), start, target, turn)
    place = arc.place(np.array([arc.length]))
    assert place.position[0] == pytest.approx(NORTH, abs=1e-12)
    assert place.rotation[0] == pytest.approx(Pose.from_rpy(NORTH, rpy).rotation, abs=1e-12)


@given(seed=st.integers(0, 10**6))
def test_any_three_points_lie_on_their_arc_in_their_order(seed: int) -> None:
    start, via, end = np.random.default_rng(seed).uniform(-1.0, 1.0, (3, 3))
    arc = arc_through(start, via, end)
    radii = [math.dist(arc.centre, point) for point in (start, via, end)]
    assert radii == pytest.approx([arc.radius] * 3, rel=1e-9)
    x, y = (via - arc.centre) @ arc.first, (via - arc.centre) @ arc.second
    assert 0.0 < math.atan2(y, x) % (2.0 * math.pi) < arc.sweep
    assert end_of(arc) == pytest.approx(end, abs=1e-9)
