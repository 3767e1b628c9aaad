import numpy as np
import pytest

from openpendant.motion.timing.parameterization import rate_from_rest, steady_rate, timing_grid

GRID = timing_grid(np.array([0.0, 0.5, 1.0]))


def test_the_grid_holds_every_knot_and_grows() -> None:
    knots = np.array([0.0, 0.1, 0.7, 1.0])
    grid = timing_grid(knots)
    assert np.isin(knots, grid).all()
    assert (np.diff(grid) > 0.0).all()


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e-12])
def test_no_motion_from_rest_to_rest_is_faster_than_the_bound(scale: float) -> None:
    # One joint alone, whatever the unit: x'² = 2 s / slope until the middle, then back.
    slope = np.full((len(GRID), 1), scale)
    fastest = np.sqrt(2.0 * np.minimum(GRID, 1.0 - GRID) / scale)
    bound = rate_from_rest(GRID, slope)
    assert (bound >= fastest).all()
    assert bound[1:-1] == pytest.approx(np.sqrt(2.0) * fastest[1:-1])


def test_a_joint_that_stands_still_at_the_end_bounds_nothing_there() -> None:
    slope = np.column_stack((np.ones(len(GRID)), np.where(GRID < 0.5, 1.0, 1e-17)))
    assert (rate_from_rest(GRID, slope) > 0.0).all()


def test_the_steady_motion_keeps_the_limits_everywhere() -> None:
    slope = np.column_stack((np.cos(9.0 * GRID), np.sin(5.0 * GRID)))
    bend = np.column_stack((-9.0 * np.sin(9.0 * GRID), 5.0 * np.cos(5.0 * GRID)))

    rate = steady_rate(GRID, slope, bend, np.full(len(GRID), 0.2))

    gain = np.diff(rate**2) / (2.0 * np.diff(GRID))
    for square in (rate[:-1] ** 2, rate[1:] ** 2):
        used = slope[:-1] * gain[:, np.newaxis] + bend[:-1] * square[:, np.newaxis]
        assert np.abs(used).max() <= 1.0 + 1e-9
    assert rate.max() <= 0.2
    assert (rate[0], rate[-1]) == (0.0, 0.0)
    assert (rate[1:-1] > 0.0).all()
