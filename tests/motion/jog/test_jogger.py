"""Changes of aim while a robot moves, releases, the way back, and of what robots there are jogs."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs.data.example_counts import counts
from rigs.motion.jog_referee import Referee, referee
from rigs.motion.jogged_robots import (
    FAST,
    REDUCED,
    UR5_BENT,
    model,
    random_place,
    random_press,
    robot,
)

from openpendant.motion.errors import BadArgument
from openpendant.motion.jog import JogCaps, Jogger, JogSlowdown, JointJog, ToolJog, jog_model
from openpendant.motion.jog.jogger import MOST_POINTS, TOLERANCE, UndoPath
from openpendant.motion.paths.mechanism import Mechanism

ALONG_X, ALONG_Y = ToolJog((1.0, 0.0, 0.0)), ToolJog((0.0, 1.0, 0.0))
TURNING = JointJog((0.0, 0.0, 0.0, 0.0, 0.0, 1.0))


@pytest.fixture
def watched() -> Referee:
    """A jog of the UR5 along x, for half a second."""
    found = referee()
    found.run(ALONG_X, 50)
    return found


def tool_speeds(watched: Referee) -> list[float]:
    places = [robot("ur5").forward(step.position).position for step in watched.steps]
    return [math.dist(a, b) / watched.dt for a, b in pairwise(places)]


def test_another_direction_is_bent_into_without_a_stop(watched: Referee) -> None:
    watched.run(ALONG_Y, 60)
    assert min(tool_speeds(watched)[40:]) > 0.1
    before, after = (robot("ur5").forward(each.position) for each in watched.steps[-2:])
    velocity = after.position - before.position
    assert velocity[1] / 0.01 == pytest.approx(0.25, rel=0.01)
    assert abs(velocity[0]) < 1e-6


def test_a_second_key_joins_without_a_stop(watched: Referee) -> None:
    watched.run(ToolJog((1.0, 0.0, 0.0), (0.0, 0.0, 0.5)), 60)
    assert min(tool_speeds(watched)[40:]) > 0.2


def test_a_reversal_comes_to_rest_first_and_keeps_the_line(watched: Referee) -> None:
    watched.run(ToolJog((-1.0, 0.0, 0.0)), 100)
    assert any(step.at_rest for step in watched.steps[51:])
    back = robot("ur5").forward(watched.position).position
    began = robot("ur5").forward(UR5_BENT).position
    assert np.abs(back - began)[1:].max() < 1e-5


@pytest.mark.parametrize("order", [(TURNING, ALONG_X), (ALONG_X, TURNING)])
def test_between_joints_and_tool_the_robot_rests(order: tuple[JointJog, ToolJog]) -> None:
    watched = referee()
    watched.run(order[0], 50)
    watched.run(order[1], 80)
    assert any(step.at_rest for step in watched.steps[51:])
    assert not watched.steps[-1].at_rest


def test_a_release_on_a_line_stays_on_it_and_stops_within_5_cm() -> None:
    watched = referee()
    moving = watched.run(ALONG_X, 50)
    rest = watched.rest(None)
    places = [robot("ur5").forward(q).position for q in (moving.position, rest.position)]
    assert np.abs((places[1] - places[0])[1:]).max() < 1e-5
    assert 0.0 < math.dist(*places) < 0.05


def test_less_override_brakes_on_the_line(watched: Referee) -> None:
    watched.jogger.limit(JogCaps(override=0.2))
    watched.run(ALONG_X, 40)
    speeds = tool_speeds(watched)
    assert speeds[-1] == pytest.approx(0.05, rel=1e-3)
    assert min(speeds[50:]) > 0.045


def test_reduced_speed_holds_from_the_stop_that_its_choice_makes() -> None:
    watched = referee(caps=FAST)
    watched.run(ALONG_X, 40)
    watched.jogger.limit(JogCaps(tool_speed=1.0, rotation_speed=1.0))
    watched.run(ALONG_X, 60)
    watched.reduced = True
    watched.run(ALONG_X, 40)
    assert not watched.steps[-1].at_rest


def test_nothing_asked_is_rest() -> None:
    watched = referee()
    for target in (None, JointJog((0.0,) * 6), ToolJog()):
        step = watched.run(target, 3)
        assert step.at_rest
        assert step.cause is None
        assert step.position == UR5_BENT


def test_the_same_presses_give_the_same_set_points() -> None:
    runs = []
    for _ in range(2):
        watched = referee()
        for target in (ALONG_X, ALONG_Y, TURNING, None):
            watched.run(target, 25)
        runs.append([step.position for step in watched.steps])
    assert runs[0] == runs[1]


def test_a_rate_that_the_joints_cannot_keep_is_told_with_the_joint() -> None:
    start = [*robot("kuka_kr5_arc").home_position[:4], 0.25, 0.3]
    caps = JogCaps(tool_speed=5.0, rotation_speed=20.0, reduced=False)
    watched = referee("kuka_kr5_arc", start, caps)
    watched.run(ToolJog(angular=(0.0, 0.0, 1.0), axes=None), 80)
    told = [step.cause for step in watched.steps if step.reason is JogSlowdown.JOINT_SPEED]
    assert told
    assert told[0] is not None
    assert told[0].joint == 5
    assert told[0].value > told[0].limit


@pytest.mark.parametrize("count", counts(4, 80))
@pytest.mark.parametrize("name", ["abb_irb2400", "kuka_iiwa14", "fanuc_m410ib", "motoman_gp7"])
def test_promises_11_and_15_hold_whatever_is_asked_when(name: str, count: int) -> None:
    random = np.random.default_rng(11)
    dof = robot(name).limits.dof
    for number in range(count):
        caps = REDUCED if number % 2 else FAST
        dt = (0.004, 0.01, 0.02)[number % 3]
        watched = referee(name, random_place(name, random), caps, dt)
        for _ in range(8):
            target = None if random.random() < 0.15 else random_press(dof, random)
            watched.run(target, int(random.integers(1, 25)))
        watched.rest(None)


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
def test_every_set_point_is_within_the_tolerance(steps: list[tuple[float, ...]]) -> None:
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
    assert (way.way_back()[0], way.way_back()[-1]) == (places[-1], (0.0, 0.0))


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


def test_a_tolerance_of_nothing_is_refused() -> None:
    with pytest.raises(BadArgument, match="tolerance"):
        UndoPath((0.0,), (1.0,), 0.0)


@pytest.mark.parametrize("name", ["ur5", "stewart_classroom"])
def test_a_chain_and_a_platform_are_jogged_with_their_own_limits(name: str) -> None:
    assert jog_model(robot(name)).limits is robot(name).limits


def test_what_is_neither_is_refused_with_what_is_accepted() -> None:
    delta = type("DeltaMechanism", (), {})()
    accepted = "DeltaMechanism.*accepted: a SerialMechanism or a PlatformMechanism"
    with pytest.raises(BadArgument, match=accepted):
        jog_model(cast(Mechanism, delta))
