"""TOPP-RA solver: the fastest rates along a path under linear limits at grid points, by toppra.

Owns the use of toppra, which no other module uses: the form of its limits (always its Interpolation
scheme), the way through the stages of a path that its solver solves one by one, and that it is
imported when first used, without the libraries that it imports for plots and for splines of its
own. Knows nothing of robots and of the motion between the grid points.

toppra has a loop over the stages too, which gives the same rates to the last bit. It took three
times as long, most of it in checks and in small arrays at each stage.
"""

from __future__ import annotations

import importlib
import math
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np

from ..pose import Array

_NOT_CALLED = ("matplotlib", "matplotlib.pyplot", "scipy", "scipy.interpolate", "scipy.sparse")
"""Libraries that toppra imports and nothing here calls: most of the time of its import."""

_TRIALS = 11
"""Of one stage, as in toppra."""

_LITTLE = 1e-8
"""Below what the solver finds, as in toppra [squares of rates]."""


def fastest_rates(grid: Array, slope: Array, bend: Array, greatest_rate: Array) -> Array | None:
    """Solve max x' along the path under |slope x'' + bend x'²| <= 1 and x' <= greatest_rate.

    Args:
        grid: (g,) from 0 to 1.
        slope: (g, n) first derivative of the path, each joint in units of its limit.
        bend: (g, n) second derivative likewise.
        greatest_rate: (g,), below 100, which is toppra's own bound.

    Returns:
        The (g,) rates from rest to rest, above 0 in between; None where the solver fails.
    """
    wrapper, linear = _toppra()
    limits = _Constraint(linear, slope, bend, greatest_rate)
    stages = wrapper([limits], _Domain, grid, solve_lp1d=True)
    stages.setup_solver()
    greatest = _greatest_squares(stages)
    squares = None if greatest is None else _squares_from_rest(stages, greatest)
    stages.close_solver()
    # NaN is not above 0 either.
    if squares is None or not all(square > 0.0 for square in squares[1:-1]):
        return None
    rate: Array = np.sqrt(squares)
    return rate


def _greatest_squares(stages: Any) -> list[float] | None:
    """Return for each grid point the greatest x'² from which the path can come to rest at its end.

    toppra's own loop solves for both bounds. There are no external forces here, so a path at rest
    may always stay at rest, and the lower bound is 0. None where the solver fails.
    """
    objective = np.array([1e-9, -1.0])
    greatest = [0.0]
    for stage in reversed(range(stages.get_no_stages())):
        _, square = stages.solve_stagewise_optim(
            stage, None, objective, math.nan, math.nan, 0.0, greatest[-1]
        )
        if math.isnan(square):
            return None
        greatest.append(square)
    return greatest[::-1]


def _squares_from_rest(stages: Any, greatest: list[float]) -> list[float] | None:
    """Return the squares x'² at the grid points of the fastest run from rest.

    As toppra's own loop does, a stage without a solution for rounding is tried again a little more
    slowly, and the next square is taken a little lower than the solver says. None where no trial
    helped.
    """
    squares = [0.0]
    for stage, (step, most) in enumerate(zip(stages.get_deltas(), greatest[1:], strict=True)):
        objective = np.array([-2.0 * step, -1.0])
        for _ in range(_TRIALS):
            square = squares[stage]
            gain, _ = stages.solve_stagewise_optim(
                stage, None, objective, square, square, 0.0, most
            )
            if not math.isnan(gain):
                break
            squares[stage] = max(square - _LITTLE, 0.999 * square)
        else:
            return None
        following = square + 2 * step * gain
        following = max(following - _LITTLE, 0.9999 * following)
        squares.append(min(most, max(0.0, following)))
    return squares


class _Domain:
    """Path as toppra asks for one whose derivatives it does not evaluate itself."""

    path_interval = (0.0, 1.0)


class _Constraint:
    """Limits on a grid, as toppra's canonical linear constraint.

    With x the square of the path velocity and u the path acceleration from a grid point to the
    next, it demands F (a u + b x) <= g, for a and b of the grid point and, x + 2 Δ u being the next
    point's square, of the next one too: that is the Interpolation scheme.
    """

    n_extra_vars = 0
    identical = True

    def __init__(self, linear: Any, slope: Array, bend: Array, greatest_rate: Array) -> None:
        self._type = linear
        self._slope, self._bend, self._greatest_rate = slope, bend, greatest_rate

    def get_constraint_type(self) -> Any:
        return self._type

    def get_no_extra_vars(self) -> int:
        return self.n_extra_vars

    def compute_constraint_params(self, path: Any, grid: Array) -> tuple[Any, ...]:
        ahead = self._slope[1:] + 2.0 * np.diff(grid)[:, np.newaxis] * self._bend[1:]
        a = np.hstack((self._slope, np.vstack((ahead, self._slope[-1]))))
        b = np.hstack((self._bend, np.vstack((self._bend[1:], self._bend[-1]))))
        rows = a.shape[1]
        both_signs = np.vstack((np.eye(rows), -np.eye(rows)))
        squares = np.column_stack((np.zeros(len(grid)), self._greatest_rate**2))
        return a, b, np.zeros_like(a), both_signs, np.ones(2 * rows), None, squares


@cache
def _toppra() -> tuple[Any, Any]:
    """Return toppra's solver of the stages of a path, and its word for `linear`."""
    with warnings.catch_warnings(), _loaded_when_called(_NOT_CALLED):
        warnings.simplefilter("ignore")
        from toppra.constraint import ConstraintType
        from toppra.solverwrapper.cy_seidel_solverwrapper import seidelWrapper
    return seidelWrapper, ConstraintType.CanonicalLinear


@contextmanager
def _loaded_when_called(names: tuple[str, ...]) -> Iterator[None]:
    """Make imports in this context bind stand-ins for modules of libraries that are not loaded yet.

    What was imported works as usual, and loads the library when it is first called; imports after
    the context get the real one. `importlib.util.LazyLoader` would not do: it loads parent packages
    at once, and a module as soon as a name is imported from it.
    """
    absent = [name for name in names if name.partition(".")[0] not in sys.modules]
    stand_ins = {name: _LoadedWhenCalled(name) for name in absent}
    for name, stand_in in stand_ins.items():
        parent, _, child = name.rpartition(".")
        if parent:
            setattr(stand_ins[parent], child, stand_in)
    sys.modules.update(stand_ins)
    try:
        yield
    finally:
        for name in stand_ins:
            del sys.modules[name]


class _LoadedWhenCalled(ModuleType):
    """Module whose every name is a `_Deferred`."""

    def __getattr__(self, name: str) -> _Deferred:
        # Attributes that the import system asks for must be absent unless they are real.
        if name.startswith("__"):
            raise AttributeError(name)
        return _Deferred(self.__name__, name)


class _Deferred:
    """Function or class of a module that is imported at the first call or attribute access."""

    def __init__(self, module: str, name: str) -> None:
        self._module, self._name = module, name

    def _real(self) -> Any:
        return getattr(importlib.import_module(self._module), self._name)

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return self._real()(*arguments, **options)

    def __getattr__(self, part: str) -> Any:
        return getattr(self._real(), part)
