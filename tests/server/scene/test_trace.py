from __future__ import annotations

import math

from openpendant.server.scene.trace import ToolTrace


def test_a_straight_way_is_its_two_ends() -> None:
    trace = ToolTrace()
    for step in range(40):
        trace.add((0.01 * step, 0.0, 0.5))
    assert trace.points == [(0.0, 0.0, 0.5), (0.39, 0.0, 0.5)]


def test_a_circle_is_kept_to_the_tolerance() -> None:
    trace = ToolTrace(tolerance=1e-3)
    places = [(math.cos(n / 500), math.sin(n / 500), 0.0) for n in range(3_000)]
    for place in places:
        trace.add(place)
    assert len(trace.points) < 200
    chords = zip(trace.points, trace.points[1:], strict=False)
    middles = [math.hypot((a[0] + b[0]) / 2, (a[1] + b[1]) / 2) for a, b in chords]
    assert min(middles) > 1 - 3e-3


def test_a_robot_that_stands_adds_nothing() -> None:
    trace = ToolTrace()
    for _ in range(100):
        trace.add((0.1, 0.2, 0.3))
    assert len(trace.points) == 1


def test_memory_is_bounded_and_the_latest_way_stays_whole() -> None:
    trace = ToolTrace(most=100)
    for step in range(10_000):
        trace.add((0.01 * step, 0.01 * (step % 2), 0.0))
    assert len(trace.points) <= 100
    assert trace.points[-1] == (0.01 * 9_999, 0.01, 0.0)


def test_no_place_is_farther_from_what_is_kept_than_the_tolerance() -> None:
    # Slowly to the side, so that what is told of all dropped places at once adds up and is redone.
    trace = ToolTrace(tolerance=1e-3)
    places = [(0.004 * n, 0.02 * math.sin(0.03 * n), 1e-4 * (n % 3)) for n in range(400)]
    for place in places:
        trace.add(place)
    assert 2 < len(trace.points) < 60
    pieces = list(zip(trace.points, trace.points[1:], strict=False))
    for x, y, z in places:
        begin, end = next(piece for piece in pieces if x <= piece[1][0])
        share = (x - begin[0]) / (end[0] - begin[0])
        beside = [a + share * (b - a) for a, b in zip(begin, end, strict=True)]
        assert math.dist((x, y, z), beside) <= 1.01e-3
