"""The law of all zones, against its own definition."""

import numpy as np
import pytest

from openpendant.motion.paths.blending import place_of_rate, rates, runs, turning

ZONE = 0.3
T = np.linspace(0.0, 1.0, 101)
STEP = 1e-6


def test_the_first_leg_runs_out_as_the_second_begins() -> None:
    left, gone = runs(np.array([0.0, 0.5, 1.0]), ZONE)
    assert left == pytest.approx([ZONE, 3.0 / 16.0 * ZONE, 0.0])
    assert gone == pytest.approx([0.0, 3.0 / 16.0 * ZONE, ZONE])


def test_the_rates_are_the_derivatives_of_the_runs_and_add_up_to_one() -> None:
    per_parameter = 2.0 * STEP * 2.0 * ZONE
    before, after = runs(T - STEP, ZONE), runs(T + STEP, ZONE)
    leaving, coming = rates(T)
    assert leaving == pytest.approx((before[0] - after[0]) / per_parameter, abs=1e-8)
    assert coming == pytest.approx((after[1] - before[1]) / per_parameter, abs=1e-8)
    assert leaving + coming == pytest.approx(np.ones_like(T))


def test_the_turning_is_the_derivative_of_the_second_rate_and_none_at_both_ends() -> None:
    change = (rates(T + STEP)[1] - rates(T - STEP)[1]) / (2.0 * STEP * 2.0 * ZONE)
    assert turning(T, ZONE) == pytest.approx(change, abs=1e-8)
    assert turning(T[[0, -1]], ZONE) == pytest.approx([0.0, 0.0])


def test_a_rate_is_found_where_it_is() -> None:
    assert place_of_rate(rates(T)[1]) == pytest.approx(T, abs=1e-7)
