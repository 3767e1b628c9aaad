import math
from collections.abc import Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs.motion.jogged_robots import REDUCED, UR5_BENT, model

from openpendant.motion.errors import BadArgument
from openpendant.motion.jog import Jogger, JointJog, ToolJog
from openpendant.motion.jog.jogger import MOST_POINTS, TOLERANCE, UndoPath

UNITS = (1.0, 1.0)


def farthest(way: UndoPath, places: Sequence[tuple[float, ...]]) -> float:
    """How far a place is from the pieces that were kept, at most, by a search of its own."""
    kept = way.waypoints()
    pieces = list(zip(kept, kept[1:] or kept, strict=False))
    return max(min(apart(place, *piece) for piece in pieces) for place in places)


def apart(place: Sequence[float], start: Sequence[float], end: Sequence[float]) -> float:
    """The greatest distance of a joint from a piece, least along it: convex, so by thirds."""

    def at(share: float) -> float:
        joints = zip(start, end, place, strict=True)
        return max(abs(p - (1.0 - share) * a - share * b) for a, b, p in joints)

    low, high = 0.0, 1.0
    for _ in range(40):
        third = (high - low) / 3.0
        if at(low + third) < at(high - third):
            high -= third
        else:
            low += third
    return at(low)


def test_a_straight_way_is_kept_as_few_points() -> None:
    way = UndoPath((0.0, 0.0), UNITS)
    for step in range(1, 101):
        way.add((step * 0.01, step * 0.02))
    assert len(way.waypoints()) < 10
    assert way.waypoints()[-1] == (1.0, 2.0)
    assert way.way_back()[0] == (1.0, 2.0)
    assert way.way_back()[-1] == (0.0, 0.0)


def test_standing_adds_nothing() -> None:
    way = UndoPath((0.1, 0.2), UNITS)
    for _ in range(5):
        way.add((0.1, 0.2))
    assert way.waypoints() == [(0.1, 0.2)]


@settings(max_examples=25)
@given(st.lists(st.tuples(*[st.floats(-0.1, 0.1)] * 2), min_size=1, max_size=150))
def test_every_set_point_is_within_the_tolerance_of_what_is_kept(
    steps: list[tuple[float, ...]],
) -> None:
    way, place, places = UndoPath((0.0, 0.0), UNITS), (0.0, 0.0), []
    for dx, dy in steps:
        place = (place[0] + dx, place[1] + dy)
        way.add(place)
        places.append(place)
    assert way.tolerance == TOLERANCE
    assert farthest(way, places) <= TOLERANCE + 1e-6
    assert way.waypoints()[-1] == places[-1] or places[-1] == (0.0, 0.0)


def test_a_long_way_is_thinned_and_says_so() -> None:
    way, places = UndoPath((0.0, 0.0), UNITS), []
    for step in range(1, 4_000):
        angle = step * 0.1
        place = (math.cos(angle) * 0.5 + step * 1e-4, math.sin(angle) * 0.5)
        way.add(place)
        places.append(place)
    assert len(way.waypoints()) <= MOST_POINTS + 1
    assert TOLERANCE < way.tolerance < 0.5
    assert farthest(way, places[::800]) <= way.tolerance + 1e-3


def test_the_way_of_a_jog_leads_back_to_its_start() -> None:
    jogger = Jogger(model("ur5"), UR5_BENT, REDUCED)
    way = UndoPath(UR5_BENT, model("ur5").unit)
    for target in (ToolJog((1.0, 0.0, 0.0)), JointJog((0.0, 0.0, 0.0, 0.0, 1.0, 0.0))):
        jogger.aim(target)
        for _ in range(60):
            way.add(jogger.step(0.01).position)
    back = way.way_back()
    assert back[0] == tuple(jogger.position)
    assert back[-1] == tuple(UR5_BENT)
    assert len(back) < 30


def test_a_way_of_minutes_ends_where_the_robot_stands() -> None:
    way = UndoPath((0.0, 0.0), UNITS)
    for step in range(1, 20_001):
        way.add((math.sin(step * 0.01), step * 1e-4))
    assert way.way_back()[0] == (math.sin(200.0), 2.0)
    assert way.way_back()[-1] == (0.0, 0.0)


def test_a_tolerance_of_nothing_is_refused() -> None:
    with pytest.raises(BadArgument, match="tolerance"):
        UndoPath((0.0,), (1.0,), 0.0)
