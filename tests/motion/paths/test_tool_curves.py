import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from rigs.data.example_counts import few

from openpendant.motion.errors import BadArgument, NoMotion, NotFinite, ZoneTooLarge
from openpendant.motion.paths.path_chains import ToolChain
from openpendant.motion.paths.tool_curves import (
    ToolArc,
    ToolCurve,
    ToolLine,
    ToolSpline,
    ToolTurn,
    arc_through,
    check_point,
    turned_by,
)
from openpendant.motion.pose import Pose

Array = NDArray[np.float64]

KINDS = ("line", "turn", "arc", "arc with the path", "spline", "chain")


def random_pose(random: np.random.Generator) -> Pose:
    return Pose(random.uniform(-1.0, 1.0, 3), random.normal(size=4))


def curve_of(kind: str, seed: int) -> ToolCurve:
    random = np.random.default_rng(seed)
    start, middle, end, last = (random_pose(random) for _ in range(4))
    through = arc_through(start.position, middle.position, end.position)
    match kind:
        case "line":
            return ToolLine(start, end)
        case "turn":
            return ToolLine(start, Pose(start.position, end.quaternion))
        case "arc":
            return ToolArc(through, start, end)
        case "arc with the path":
            return ToolArc(through, start, end, ToolTurn.WITH_THE_PATH)
        case "spline":
            return ToolSpline([start, middle, end, last])
    legs: list[ToolCurve] = [
        ToolLine(last, start),
        ToolArc(through, start, end),
        ToolLine(end, last),
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
    line = ToolLine(start, end)
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
    spline = ToolSpline(poses)
    rotations, positions = spline.place(spline.waypoints)
    for pose, rotation, position in zip(poses, rotations, positions, strict=True):
        assert position == pytest.approx(pose.position, abs=1e-12)
        assert rotation == pytest.approx(pose.rotation, abs=1e-9)


def test_a_curve_without_length_is_no_motion() -> None:
    pose = random_pose(np.random.default_rng(1))
    with pytest.raises(NoMotion):
        ToolLine(pose, pose)
    with pytest.raises(NoMotion):
        ToolSpline([pose, pose])


@pytest.mark.parametrize(
    ("point", "error"),
    [
        ([0.0, 1.0], BadArgument),
        ([0.0, math.nan, 1.0], NotFinite),
        ([0.0, 1e7, 0.0], BadArgument),
    ],
)
def test_what_is_no_point_is_refused(
    point: list[float], error: type[BadArgument | NotFinite]
) -> None:
    with pytest.raises(error):
        check_point(point, "the point")


def test_no_turn_and_small_turns_are_exact() -> None:
    turned = turned_by(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1e-9]]))
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
    return ToolChain([ToolLine(first, corner), ToolLine(corner, last)], [zone])


@pytest.mark.parametrize("zone", [0.01, 0.2, 1.0])
def test_a_corner_is_passed_at_the_distance_of_the_formula(zone: float) -> None:
    chain = right_angle(zone)
    corner = chain.place(chain.waypoints[1:2]).position[0]
    distance = math.dist(corner, RIGHT_ANGLE[1].position)
    assert distance == pytest.approx(3.0 * zone / 8.0 * math.sin(math.pi / 4.0))


def test_outside_its_zones_a_chain_is_its_legs() -> None:
    chain, first = right_angle(0.2), ToolLine(*RIGHT_ANGLE[:2])
    s = np.linspace(0.0, 0.8, 9)
    assert chain.place(s).position == pytest.approx(first.place(s).position, abs=1e-15)
    assert chain.place(s).rotation == pytest.approx(first.place(s).rotation, abs=1e-15)


@pytest.mark.parametrize("length", [0.1, 0.3, 2.0])
def test_a_chain_has_no_gap_at_the_edges_of_its_zones(length: float) -> None:
    first = ToolLine(at_x(0.0), at_x(0.1))
    chain = ToolChain([first, ToolLine(at_x(0.1), at_x(0.1 + length))], [0.02])
    edges = np.array([0.08, 0.12, 0.1 + 0.02, 0.1 - 0.02])
    s = np.concatenate((edges, np.nextafter(edges, 0.0), np.nextafter(edges, 1.0)))
    assert chain.place(s).position[:, 0] == pytest.approx(s, abs=1e-12)


def test_slope_and_curvature_have_no_step_where_a_zone_begins_and_ends() -> None:
    random = np.random.default_rng(8)
    poses = [random_pose(random) for _ in range(4)]
    arc = ToolArc(arc_through(*(pose.position for pose in poses[1:])), poses[1], poses[3])
    chain = ToolChain([ToolLine(poses[0], poses[1]), arc], [0.2])
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
    spin = ToolLine(corner, Pose(corner.position, last.quaternion))
    with pytest.raises(ZoneTooLarge, match="turn on the spot") as refusal:
        ToolChain([ToolLine(first, corner), spin], [0.1], first_waypoint=4)
    assert (refusal.value.waypoint, refusal.value.largest) == (4, 0.0)


def test_a_chain_of_nothing_is_refused() -> None:
    with pytest.raises(BadArgument, match="legs"):
        ToolChain([], [])
