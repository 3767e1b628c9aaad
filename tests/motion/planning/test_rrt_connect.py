import numpy as np
import pytest
from numpy.typing import NDArray

from openpendant.motion.planning.rrt_connect import rrt_connect, shorten

Array = NDArray[np.float64]

LOWER, UPPER = np.full(2, -2.0), np.full(2, 2.0)
START, GOAL = np.array([-1.0, 0.0]), np.array([1.0, 0.0])


def around_the_disc(start: Array, end: Array) -> bool:
    """A disc of radius 0.5 lies in the middle of the plane."""
    points = start + np.linspace(0.0, 1.0, 50)[:, np.newaxis] * (end - start)
    return bool((np.linalg.norm(points, axis=1) > 0.5).all())


def through_no_wall(start: Array, end: Array) -> bool:
    return bool(start[0] * end[0] > 0.0)


def length(waypoints: Array) -> float:
    return float(np.linalg.norm(np.diff(waypoints, axis=0), axis=1).sum())


@pytest.mark.parametrize("seed", range(10))
def test_a_way_around_is_found_and_shortened(seed: int) -> None:
    random = np.random.default_rng(seed)
    found = rrt_connect(START, GOAL, LOWER, UPPER, around_the_disc, random=random).waypoints
    assert found is not None
    short = shorten(found, around_the_disc, random=random)
    for waypoints in (found, short):
        np.testing.assert_array_equal(waypoints[[0, -1]], [START, GOAL])
        assert all(map(around_the_disc, waypoints[:-1], waypoints[1:]))
    # The shortest way: two tangents of the disc and the arc between them.
    assert 2.256 < length(short) < min(length(found) + 1e-12, 2.8)


def test_the_same_seed_gives_the_same_way() -> None:
    ways = [
        rrt_connect(
            START, GOAL, LOWER, UPPER, around_the_disc, random=np.random.default_rng(seed)
        ).waypoints
        for seed in (3, 3, 4)
    ]
    assert ways[0] is not None
    assert ways[2] is not None
    np.testing.assert_array_equal(ways[0], ways[1])
    assert not np.array_equal(ways[0], ways[2])


def test_a_free_line_needs_no_search() -> None:
    random = np.random.default_rng(0)
    aside = np.array([-1.0, 1.0])
    found = rrt_connect(START, aside, LOWER, UPPER, around_the_disc, random=random)
    assert found.iterations == 0
    assert found.waypoints is not None
    np.testing.assert_array_equal(found.waypoints, [START, aside])


def test_a_closed_way_ends_after_the_iterations_allowed() -> None:
    random = np.random.default_rng(0)
    found = rrt_connect(START, GOAL, LOWER, UPPER, through_no_wall, random=random, iterations=50)
    assert (found.waypoints, found.iterations) == (None, 50)


def test_the_caller_may_end_the_search() -> None:
    random = np.random.default_rng(0)
    found = rrt_connect(
        START, GOAL, LOWER, UPPER, through_no_wall, random=random, proceed=lambda i: i < 7
    )
    assert (found.waypoints, found.iterations) == (None, 7)
