"""TOPP-RA used plainly on 1,000 grid points: what a motion's duration is compared with."""

import math
from typing import Any

import numpy as np

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.pose import Array
from openpendant.motion.trajectory.joint_curves import JointSpline


def duration(path: JointSpline, limits: JointLimits) -> float:
    """The duration that toppra gives, which may break limits between its grid points [s]."""
    return _solved(path, limits)[2]


def certified_duration(path: JointSpline, limits: JointLimits, period: float) -> float:
    """The same, slowed down as a whole until limits hold in between, in whole periods [s]."""
    grid, rate, found = _solved(path, limits)
    shares = np.linspace(0.0, 1.0, 11)[:, np.newaxis]
    square = rate[:-1] ** 2 * (1.0 - shares) + rate[1:] ** 2 * shares
    gain = np.broadcast_to(np.diff(rate**2) / (2.0 * np.diff(grid)), square.shape)
    s = (grid[:-1] + shares * np.diff(grid)).ravel()
    slope, bend = path.evaluate(s, 1), path.evaluate(s, 2)
    squares, gains = square.ravel()[:, np.newaxis], gain.ravel()[:, np.newaxis]
    speeds = np.abs(slope) * np.sqrt(squares) / limits.velocity
    sharpness = np.abs(slope * gains + bend * squares) / limits.acceleration
    slower = max(1.0, float(speeds.max()), math.sqrt(float(sharpness.max())))
    return math.ceil(found * slower / period) * period


def _solved(path: JointSpline, limits: JointLimits) -> tuple[Array, Array, float]:
    from toppra.algorithm import TOPPRA
    from toppra.constraint import (
        DiscretizationType,
        JointAccelerationConstraint,
        JointVelocityConstraint,
    )

    class Curve:
        dof = limits.dof
        path_interval = (0.0, path.length)

        def __call__(self, s: Array, order: int = 0) -> Array:
            return path.evaluate(np.asarray(s), order)

    scheme = DiscretizationType.Interpolation
    velocity, acceleration = (
        np.array(bounds)[:, np.newaxis] * [-1.0, 1.0]
        for bounds in (limits.velocity, limits.acceleration)
    )
    grid = np.unique(np.concatenate((np.linspace(0.0, path.length, 1000), path.knots)))
    rules: list[Any] = [
        JointVelocityConstraint(velocity),
        JointAccelerationConstraint(acceleration, discretization_scheme=scheme),
    ]
    solver = TOPPRA(rules, Curve(), gridpoints=grid, solver_wrapper="seidel")
    _, rate, _ = solver.compute_parameterization(0.0, 0.0)
    return grid, rate, float((2.0 * np.diff(grid) / (rate[1:] + rate[:-1])).sum())
