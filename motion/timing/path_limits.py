"""Path limits: the grid of a timing problem, and bounds of the path velocity without a solver.

Owns the grid, a bound on the path velocity, and a slow motion that always exists. Knows no solver
and no robot.
"""

from __future__ import annotations

import math

import numpy as np

from ..pose import Array

_PER_SPAN = 16
_LEAST_POINTS = 200
_END_POINTS = 4
_LEAST_STEP = 1e-6  # of the path's length; the solver fails on much smaller ones
_MOST_DIVIDED = 1600  # points besides one for each knot
_SLACK = 2.0  # factor on a bound; the error of the grid is less


def timing_grid(knots: Array) -> Array:
    """Return the path positions where limits are imposed: at the knots and between them.

    Sixteen points between two knots and two hundred in all. Where there are many knots each needs
    fewer, because the curve bends less between them, and the cost grows with the number of points.
    The first and the last step are divided further, because the acceleration from and to rest is
    constant on a step.
    """
    spans = len(knots) - 1
    count = max(min(_PER_SPAN, math.ceil(_MOST_DIVIDED / spans)), math.ceil(_LEAST_POINTS / spans))
    inner = np.arange(count) / count
    steady = (knots[:-1, np.newaxis] + np.diff(knots)[:, np.newaxis] * inner).ravel()
    end = knots[-1]
    ends = 0.25 ** np.arange(_END_POINTS, 0, -1)
    first, last = ends * steady[1], ends * (end - steady[-1])
    least = end * _LEAST_STEP
    return np.concatenate(
        ([0.0], first[first > least], steady[1:], end - last[last > least][::-1], [end])
    )


def rate_from_rest(grid: Array, slope: Array) -> Array:
    """Return a path velocity that the joints' accelerations cannot exceed from rest to rest.

    From d(q̇²/2)/dq = q̈ a joint that has covered the distance V since the motion began, or has yet
    to cover it, has q̇² <= 2 A V; and q̇ is the slope times the path velocity. It bounds no motion
    that the limits allow. Without it a solver's numbers may be thousands of times those of its
    answer, and it fails for rounding, as toppra did on short lines past a wrist singularity.

    Args:
        grid: (g,) path positions.
        slope: (g, n) first derivative of the path, each joint in units of its acceleration limit.

    Returns:
        (g,), infinite where no joint moves.
    """
    steepness = np.abs(slope)
    way = np.diff(grid)[:, np.newaxis] * (steepness[1:] + steepness[:-1]) / 2.0
    # Both are sums of small parts; a difference of sums would round the smallest to 0. At the ends,
    # where one is 0, it is that of the next place.
    run = np.cumsum(way, axis=0)
    left = np.cumsum(way[::-1], axis=0)[::-1]
    nearest = np.minimum(np.vstack((run[:1], run)), np.vstack((left, left[-1:])))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        squares = 2.0 * _SLACK * nearest / steepness**2
    rate: Array = np.sqrt(np.where(steepness > 0.0, squares, np.inf).min(axis=1))
    return rate


def steady_rate(grid: Array, slope: Array, bend: Array, greatest_rate: Array) -> Array:
    """Return a motion with one acceleration, one greatest rate and one deceleration.

    Half of each limit is given to |slope x''| and half to |bend x'²|, both by their greatest value
    anywhere, so that it exists for every path.

    Args:
        grid: (g,) from 0 to 1.
        slope: (g, n) first derivative of the path, each joint in units of its acceleration limit.
        bend: (g, n) second derivative likewise.
        greatest_rate: (g,) that the other limits allow.

    Returns:
        (g,) rates from rest to rest.
    """
    gain = 0.5 / float(np.abs(slope).max())
    with np.errstate(divide="ignore"):
        square = 0.5 / np.abs(bend).max()
    top = min(float(square), float(greatest_rate.min()) ** 2)
    rates: Array = np.sqrt(np.minimum(2.0 * gain * np.minimum(grid, 1.0 - grid), top))
    return rates
