"""How toppra is used: with the rates of its own loop, and imported late, quietly, and in part."""

import math
import subprocess
import sys
import textwrap
from typing import Any

import numpy as np
import pytest

from openpendant.motion.pose import Array
from openpendant.motion.timing import toppra_solver
from openpendant.motion.timing.toppra_solver import fastest_rates

TIME_A_PATH = """
import sys
from openpendant.motion.trajectory.joint_curves import JointLine
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.description.robot import serial_robot
assert not {"toppra", "matplotlib", "scipy", "pinocchio"} & set(sys.modules)
time_path(JointLine([0.0] * 6, [0.1] * 6), serial_robot("ur5").limits)
assert "toppra" in sys.modules
"""


def problem(seed: int) -> tuple[Array, Array, Array, Array]:
    """Return grid, slope, bend and greatest rates of a path of three joints that turn back."""
    random = np.random.default_rng(seed)
    grid = np.linspace(0.0, 1.0, 60)
    waves, phases = random.uniform(1.0, 9.0, 3), random.uniform(0.0, 6.0, 3)
    angles = waves * grid[:, np.newaxis] + phases
    return grid, np.cos(angles), -waves * np.sin(angles), random.uniform(0.3, 3.0, 60)


def rates_by_toppra(grid: Array, slope: Array, bend: Array, greatest_rate: Array) -> Array:
    """Return the rates of toppra's own loop."""
    _, linear = toppra_solver._toppra()
    from toppra.algorithm import TOPPRA

    limits = toppra_solver._Constraint(linear, slope, bend, greatest_rate)
    loop = TOPPRA([limits], toppra_solver._Domain, gridpoints=grid, solver_wrapper="seidel")
    _, rates, _ = loop.compute_parameterization(0.0, 0.0)
    found: Array = rates
    return found


@pytest.mark.parametrize("seed", range(4))
def test_the_rates_are_to_the_last_bit_those_of_toppra_s_own_loop(seed: int) -> None:
    found = fastest_rates(*problem(seed))
    assert found is not None
    assert found.tolist() == rates_by_toppra(*problem(seed)).tolist()


class StagesThatFail:
    """Solver of three stages, which on the way forward fails some times at the second."""

    def __init__(self, failures: int) -> None:
        self.left = failures
        self.asked: list[float] = []

    def setup_solver(self) -> None:
        pass

    def close_solver(self) -> None:
        pass

    def get_no_stages(self) -> int:
        return 3

    def get_deltas(self) -> list[float]:
        return [0.5, 0.5, 0.5]

    def solve_stagewise_optim(
        self, stage: int, _: None, objective: Array, least: float, *rest: float
    ) -> tuple[float, float]:
        if math.isnan(least):
            return 0.0, 4.0
        if stage == 1:
            self.asked.append(least)
            self.left -= 1
        return (math.nan if stage == 1 and self.left >= 0 else 1.0), least


@pytest.mark.parametrize(("failures", "is_solved"), [(0, True), (10, True), (11, False)])
def test_a_stage_that_fails_for_rounding_is_tried_ten_times_more_and_a_little_slower(
    failures: int, is_solved: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    stages = StagesThatFail(failures)

    def solver(*_: Any, **__: Any) -> StagesThatFail:
        return stages

    monkeypatch.setattr(toppra_solver, "_toppra", lambda: (solver, None))
    found = fastest_rates(*problem(0))
    assert (found is not None) == is_solved
    lower = [1.0 - 1e-8 * (tried + 1) for tried in range(min(failures, 10) + 1)]
    assert stages.asked == pytest.approx(lower, abs=1e-10, rel=0.0)


def run(program: str) -> tuple[int, str]:
    """Run a program in an interpreter of its own; return its code, and what it complains of."""
    command = [sys.executable, "-W", "error", "-c", textwrap.dedent(program)]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    return ran.returncode, ran.stderr


def test_toppra_is_loaded_by_the_first_path_and_without_a_warning_plots_or_splines() -> None:
    assert run(TIME_A_PATH + "assert not {'matplotlib', 'scipy'} & set(sys.modules)") == (0, "")


def test_what_toppra_does_with_scipy_and_matplotlib_works_for_whoever_asks_it() -> None:
    program = (
        TIME_A_PATH
        + """
import os
os.environ["MPLBACKEND"] = "Agg"
import numpy as np
import toppra
from toppra import constraint
path = toppra.SplineInterpolator([0.0, 0.5, 1.0], np.array([[0.0], [1.0], [0.5]]))
assert abs(path(0.5)[0] - 1.0) < 1e-12
assert toppra.SimplePath([0, 1], np.array([[0.0], [1.0]]))(1.0)[0] == 1.0
limits = [
    constraint.JointVelocityConstraint([[-1.0, 1.0]]),
    constraint.JointAccelerationConstraint([[-1.0, 1.0]]),
]
solver = toppra.algorithm.TOPPRA(limits, path, parametrizer="ParametrizeConstAccel")
solver.compute_trajectory().plot_parametrization()
import matplotlib.pyplot, scipy.interpolate
assert len(matplotlib.pyplot.gcf().axes) == 4
"""
    )
    assert run(program) == (0, "")


def test_libraries_that_are_loaded_already_are_the_ones_that_toppra_gets() -> None:
    program = (
        TIME_A_PATH.replace(
            'assert not {"toppra", "matplotlib", "scipy", "pinocchio"} & set(sys.modules)',
            "import scipy.interpolate",
        )
        + """
import toppra.interpolator
assert toppra.interpolator.CubicSpline is scipy.interpolate.CubicSpline
assert "matplotlib" not in sys.modules
"""
    )
    assert run(program) == (0, "")
