"""OMPL planners: sampling planners of the OMPL library, by name.

Owns the use of ompl, which it imports when first used and which no other module uses. OMPL proposes
polylines; the caller checks them. A solution is passed on only where it is exact and leads from the
start to the goal, because some planners report others.

Effort is counted in positions checked, so that the same seed gives the same path on any machine;
time is only an outer limit. OMPL's seed is one number of the process: two searches may not run at
the same time. PRM and PRMstar are not offered: they divide their work by time, and a thread of
their own asks for the end of the search, so the same seed may give another path.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from importlib.util import find_spec
from typing import Any

import numpy as np

from ..errors import PlannerUnavailable
from ..pose import Array
from .rrt_connect import BUILT_IN, TreeSearch


class OmplPlanner(StrEnum):
    """The planners of the ompl wheel."""

    RRT_CONNECT = "RRTConnect"
    LBKPIECE1 = "LBKPIECE1"
    BKPIECE1 = "BKPIECE1"
    KPIECE1 = "KPIECE1"
    RRT = "RRT"
    FMT = "FMT"
    BFMT = "BFMT"
    RRT_STAR = "RRTstar"
    INFORMED_RRT_STAR = "InformedRRTstar"
    SORRT_STAR = "SORRTstar"
    BIT_STAR = "BITstar"
    AORRTC = "AORRTC"


_OPTIMISING = frozenset(
    {
        OmplPlanner.RRT_STAR,
        OmplPlanner.INFORMED_RRT_STAR,
        OmplPlanner.SORRT_STAR,
        OmplPlanner.BIT_STAR,
        OmplPlanner.AORRTC,
    }
)
"""Planners that improve their path until they are stopped."""

MOST_CHECKS = 1_000_000
MOST_CHECKS_TO_IMPROVE = 20_000

_PROCEED_EVERY = 64  # checks between two questions to the caller
_SAME_END = 1e-9  # rad or m


def ompl_is_installed() -> bool:
    """Return True if the library is installed, without importing it."""
    return find_spec("ompl") is not None


def planners() -> tuple[str, ...]:
    """Return the names of the planners that can be used here, the default first."""
    names = tuple(OmplPlanner) if ompl_is_installed() else (OmplPlanner.RRT_CONNECT,)
    return (*(name.value for name in names), BUILT_IN)


def search_with_ompl(
    planner: OmplPlanner,
    start: Array,
    goal: Array,
    lower: Array,
    upper: Array,
    position_free: Callable[[Array], bool],
    *,
    seed: int,
    step: float,
    resolution: float,
    proceed: Callable[[int], bool],
) -> TreeSearch:
    """Search a polyline from start to goal; its iterations are the positions checked.

    Args:
        start: (n,) free.
        goal: (n,) free.
        lower: (n,) least position of the box that is searched.
        upper: (n,) greatest position.
        position_free: returns True if a position is free.
        seed: the same number gives the same path; not negative.
        step: greatest length of an edge, for planners that have one.
        resolution: greatest distance of the checked positions on an edge.
        proceed: called with the number of positions checked; the search ends where it is False.

    Raises:
        PlannerUnavailable: ompl is not installed.
    """
    try:
        from ompl import base, geometric, util
    except ImportError:
        raise PlannerUnavailable(planner, ()) from None
    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(seed + 1)  # 0 would mean a random seed
    effort = _Effort(position_free, planner in _OPTIMISING, proceed, len(start))
    space = base.RealVectorStateSpace(len(start))
    bounds = base.RealVectorBounds(len(start))
    for joint, (low, high) in enumerate(zip(lower.tolist(), upper.tolist(), strict=True)):
        bounds.setLow(joint, low)
        bounds.setHigh(joint, high)
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    information = setup.getSpaceInformation()
    information.setStateValidityCheckingResolution(resolution / space.getMaximumExtent())
    setup.setStateValidityChecker(effort.state_free)
    setup.setStartAndGoalStates(_state(space, start), _state(space, goal))
    chosen = getattr(geometric, planner)(information)
    if hasattr(chosen, "setRange"):
        chosen.setRange(step)
    setup.setPlanner(chosen)
    # A planner that improves its path continues with its tree while it has no path yet.
    setup.solve(base.PlannerTerminationCondition(effort.is_spent))
    while not setup.haveExactSolutionPath() and effort.may_go_on():
        setup.solve(base.PlannerTerminationCondition(effort.is_spent))
    waypoints = None
    if setup.haveExactSolutionPath():
        states = setup.getSolutionPath().getStates()
        waypoints = np.array([[state[joint] for joint in range(len(start))] for state in states])
    return TreeSearch(_from_end_to_end(waypoints, start, goal), effort.checks)


class _Effort:
    """Counts the checks; holds nothing of ompl, whose objects would otherwise outlive the search.

    (ompl reports objects as leaked that are alive when the interpreter ends.)
    """

    def __init__(
        self,
        position_free: Callable[[Array], bool],
        improving: bool,
        proceed: Callable[[int], bool],
        dof: int,
    ) -> None:
        self.checks = 0
        self._position_free = position_free
        self._most = MOST_CHECKS_TO_IMPROVE if improving else MOST_CHECKS
        self._proceed = proceed
        self._stopped = False
        self._joints = range(dof)

    def state_free(self, state: Any) -> bool:
        self.checks += 1
        if self.checks % _PROCEED_EVERY == 0 and not self._proceed(self.checks):
            self._stopped = True
        return self._position_free(np.array([state[joint] for joint in self._joints]))

    def is_spent(self) -> bool:
        return self._stopped or self.checks >= self._most

    def may_go_on(self) -> bool:
        """Allow as many checks again, if that is not too many; return True if it is not."""
        self._most = min(2 * self._most, MOST_CHECKS)
        return not self.is_spent()


def _state(space: Any, position: Array) -> Any:
    state = space.allocState()
    for joint, value in enumerate(position.tolist()):
        state[joint] = value
    return state


def _from_end_to_end(waypoints: Array | None, start: Array, goal: Array) -> Array | None:
    if waypoints is None or len(waypoints) < 2:
        return None
    ends = np.abs(np.array([waypoints[0] - start, waypoints[-1] - goal])).max()
    if ends > _SAME_END:
        return None
    waypoints[0], waypoints[-1] = start, goal
    return waypoints
