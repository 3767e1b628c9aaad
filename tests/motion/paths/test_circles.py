import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from openpendant.motion.errors import BadArgument, BadCircle, CircleFault, NotFinite
from openpendant.motion.paths.tool_curves import (
    Circle,
    ToolArc,
    ToolTurn,
    arc_about,
    arc_through,
    circle_about,
    circle_through,
)
from openpendant.motion.pose import Pose

Array = NDArray[np.float64]

EAST: Array = np.array([1.0, 0.0, 0.0])
NORTH: Array = np.array([0.0, 1.0, 0.0])
WEST, SOUTH = -EAST, -NORTH
ORIGIN: Array = np.zeros(3)
UP: Array = np.array([0.0, 0.0, 1.0])
QUARTER = math.pi / 2.0


def at_angle(degrees: float) -> Array:
    angle = math.radians(degrees)
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def end_of(circle: Circle) -> Array:
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
def test_an_arc_through_a_point_goes_the_way_that_passes_it(
    via: float, end: float, degrees: float
) -> None:
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
def test_a_full_circle_comes_back_to_its_start(circle: Circle) -> None:
    assert circle.sweep == 2.0 * math.pi
    assert end_of(circle) == pytest.approx(EAST, abs=1e-12)
    assert circle.positions(np.array([QUARTER]))[0] == pytest.approx(NORTH, abs=1e-12)


def test_a_full_circle_runs_in_the_order_of_its_points() -> None:
    circle = circle_through(EAST, SOUTH, NORTH)
    assert circle.positions(np.array([QUARTER]))[0] == pytest.approx(SOUTH, abs=1e-12)


@pytest.mark.parametrize(
    ("points", "fault", "value"),
    [
        ((EAST, EAST, WEST), CircleFault.COINCIDENT, 0.0),
        ((EAST, NORTH, NORTH + 5e-5 * EAST), CircleFault.COINCIDENT, 5e-5),
        ((EAST, NORTH, EAST + 9e-5 * UP), CircleFault.COINCIDENT, 9e-5),
        ((EAST, ORIGIN, WEST), CircleFault.COLLINEAR, 0.0),
        ((EAST, 3.0 * EAST, WEST), CircleFault.COLLINEAR, 0.0),
        ((EAST, 5e-7 * UP, WEST), CircleFault.COLLINEAR, 5e-7),
        ((EAST, 1e-3 * UP, WEST), CircleFault.TOO_LARGE, 500.0005),
        ((2e-4 * EAST, 2e-4 * NORTH, 2e-4 * WEST), CircleFault.TOO_SMALL, 2e-4),
    ],
)
def test_points_of_no_arc_are_refused_with_their_numbers(
    points: tuple[Array, Array, Array], fault: CircleFault, value: float
) -> None:
    with pytest.raises(BadCircle) as refusal:
        arc_through(*points)
    assert refusal.value.fault is fault
    assert refusal.value.measured == pytest.approx(value, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("centre", "end", "fault", "value", "limit"),
    [
        (0.1 * EAST, WEST, CircleFault.NOT_EQUIDISTANT, 1.1, 0.9),
        (ORIGIN, NORTH * 1.0002, CircleFault.NOT_EQUIDISTANT, 1.0002, 1.0),
        (ORIGIN, WEST, CircleFault.NO_NORMAL, 0.0, 1e-4),
        (ORIGIN, EAST, CircleFault.COINCIDENT, 0.0, 1e-4),
        (EAST, EAST, CircleFault.TOO_SMALL, 0.0, 1e-3),
        (200.0 * NORTH, WEST, CircleFault.TOO_LARGE, math.hypot(200.0, 1.0), 100.0),
    ],
)
def test_a_centre_of_no_arc_is_refused_with_its_numbers(
    centre: Array, end: Array, fault: CircleFault, value: float, limit: float
) -> None:
    with pytest.raises(BadCircle) as refusal:
        arc_about(EAST, centre, end)
    assert refusal.value.fault is fault
    assert (refusal.value.measured, refusal.value.bound) == pytest.approx((value, limit), abs=1e-9)


def test_a_refusal_names_both_radii_in_millimetres() -> None:
    with pytest.raises(BadCircle, match=r"1e\+03 mm from the start and 1\.1e\+03 mm|from the end"):
        arc_about(EAST, ORIGIN, 1.1 * NORTH)


@pytest.mark.parametrize(
    ("normal", "named"), [(ORIGIN, "length"), (EAST, "right angle"), (UP + 0.1 * EAST, "0.0995 m")]
)
def test_a_normal_that_is_none_is_refused(normal: Array, named: str) -> None:
    with pytest.raises(BadArgument, match=named):
        circle_about(EAST, ORIGIN, normal)
    with pytest.raises(BadArgument, match=named):
        arc_about(EAST, ORIGIN, WEST, normal=normal)


def test_a_normal_and_the_longer_way_together_are_refused() -> None:
    with pytest.raises(BadArgument, match="more_than_half"):
        arc_about(EAST, ORIGIN, NORTH, normal=UP, more_than_half=True)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_points_that_are_not_finite_are_refused(bad: float) -> None:
    with pytest.raises(NotFinite):
        arc_through(EAST, [bad, 0.0, 0.0], NORTH)
    with pytest.raises(NotFinite):
        arc_about(EAST, [0.0, bad, 0.0], NORTH)
    with pytest.raises(NotFinite):
        circle_about(EAST, ORIGIN, [0.0, 0.0, bad])
    with pytest.raises(BadArgument, match="three"):
        circle_through(EAST, [0.0, 1.0], WEST)


@pytest.mark.parametrize(
    ("turn", "rpy"),
    [
        (ToolTurn.EVEN, (0.0, 0.4, 0.0)),
        (ToolTurn.CONSTANT, (0.0, 0.0, 0.0)),
        (ToolTurn.WITH_THE_PATH, (0.0, 0.0, QUARTER)),
    ],
)
def test_the_tool_turns_as_asked(turn: ToolTurn, rpy: tuple[float, float, float]) -> None:
    start, target = Pose.from_rpy(EAST, [0.0] * 3), Pose.from_rpy(NORTH, [0.0, 0.4, 0.0])
    arc = ToolArc(arc_about(EAST, ORIGIN, NORTH), start, target, turn)
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
