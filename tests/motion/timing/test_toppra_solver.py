"""How toppra is imported: late, quietly, and without libraries that nothing here has it call."""

import subprocess
import sys
import textwrap

TIME_A_PATH = """
import sys
from openpendant.motion.trajectory.joint_curves import JointLine
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.description.robot import serial_robot
assert not {"toppra", "matplotlib", "scipy", "pinocchio"} & set(sys.modules)
time_path(JointLine([0.0] * 6, [0.1] * 6), serial_robot("ur5").limits)
assert "toppra" in sys.modules
"""


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
