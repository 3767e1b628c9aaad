"""A way from one joint position to another that touches nothing.

Owns the order of the work: refuse what stands in contact, search, shorten, round the corners, and
check what comes out as it will be driven. Searching and shortening look at single positions and
keep a margin; only the last check decides, and where it objects the work is done again more finely.
A path that it has not passed is never returned.

The effort is counted in samples, so that the same seed gives the same path on any machine; time is
only an outer cap. (OMPL, where it is installed, and the built-in search give different paths.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from .collision import CollisionModel, Proximity
from .edge_check import EdgeChecker
from .errors import (
    BadArgument,
    GoalInCollision,
    NoMotion,
    NoPathFound,
    PlannerUnavailable,
    StartInCollision,
)
from .joint_curves import COINCIDENT, settle_start
from .kinematics import Kinematics
from .ompl_planner import OmplPlanner, ompl_is_installed, search_with_ompl
from .path_check import first_contact
from .rrt_connect import STEP, Search, rrt_connect
from .shortcuts import shorten
from .trajectory import Array
from .zones import LEAST_ZONE, JointPolyline

DEFAULT_PLANNER = "RRTConnect"
BUILT_IN = "BuiltInRRTConnect"
"""The search that needs no OMPL, under this name also where OMPL is installed."""

MARGIN = 0.005
"""The distance that is kept where start and goal keep twice as much [m]."""
EDGE_RESOLUTION = 0.03
"""Distance of the positions looked at on an edge [rad or m], in the first attempt."""
TIME_LIMIT = 5.0
"""Seconds."""

_ATTEMPTS = 4  # each at half the resolution of the one before
_GREATEST_ZONE = 0.5  # rad or m
_SEARCHED = math.pi  # rad or m beyond start and goal: a full turn of a joint in all


class Stage(StrEnum):
    """What a planner is at."""

    SEARCHING = "searching"
    SHORTENING = "shortening"
    CHECKING = "checking"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a plan is.

    Attributes:
        stage: what is being done.
        attempt: from 1; a further one works more finely.
        iterations: of the search, all attempts together.
        seconds: since the start; None where no clock was given.
        time_limit: seconds at most.
    """

    stage: Stage
    attempt: int
    iterations: int
    seconds: float | None
    time_limit: float


def planners() -> tuple[str, ...]:
    """Return the names of the planners that can be used here, the default first."""
    names = tuple(OmplPlanner) if ompl_is_installed() else (OmplPlanner.RRT_CONNECT,)
    return (*(name.value for name in names), BUILT_IN)


def plan_free_path(
    kinematics: Kinematics,
    collision: CollisionModel,
    start: Sequence[float] | Array,
    goal: Sequence[float] | Array,
    *,
    planner: str = DEFAULT_PLANNER,
    seed: int = 0,
    time_limit: float = TIME_LIMIT,
    on_progress: Callable[[Progress], None] | None = None,
    clock: Callable[[], float] | None = None,
) -> JointPolyline:
    """Plan a joint path on which nothing touches.

    Args:
        kinematics: the robot.
        collision: the same robot in its scene.
        start: (n,) where the robot stands; see `settle_start`.
        goal: (n,) where to go.
        planner: one of `planners()`.
        seed: same number, same path; 0 to 2³¹ - 1.
        time_limit: seconds at most by `clock`.
        on_progress: called now and then; what it raises ends the plan.
        clock: tells seconds; without one only the number of samples is bounded.

    Returns:
        Lines in joint space with zones between, to be timed by `time_path`.

    Raises:
        StartInCollision: the robot touches something at the start.
        GoalInCollision: it would at the goal.
        NoPathFound: the search ended without a path.
        PlannerUnavailable: there is no such planner here.
        NoMotion: the robot is already there.
        OutOfRange: start or goal is outside a joint's range.
        WrongJointCount: start or goal does not have one value per joint.
        NotFinite: start or goal holds an infinity or a NaN.
        BadArgument: the seed or the time limit.
    """
    if planner not in planners():
        raise PlannerUnavailable(planner, planners())
    if not 0 <= seed < 1 << 31:
        raise BadArgument("seed", seed, "0 to 2147483647")
    if not 0.0 < time_limit <= 3600.0:
        raise BadArgument("time_limit", time_limit, "more than 0 and at most 3600 s")
    first = np.array(settle_start(start, kinematics.limits))
    last = np.array([float(value) for value in goal])
    kinematics.limits.check_position(last.tolist())
    if np.abs(last - first).max() < COINCIDENT:
        raise NoMotion
    margin = _margin(collision, first, last)
    report = _Report(planner, time_limit, on_progress, clock)
    for attempt in range(_ATTEMPTS):
        report.attempt = attempt + 1
        edges = EdgeChecker(collision, EDGE_RESOLUTION / 2**attempt, margin)
        # A sequence of its own for each attempt, so that none depends on how long others took.
        random = np.random.default_rng((seed, attempt))
        found = _search(planner, kinematics, edges, first, last, random, report)
        report.iterations += found.iterations
        if found.waypoints is None:
            break
        report.tell(Stage.SHORTENING)
        waypoints = shorten(found.waypoints, edges.free, random=random)
        report.tell(Stage.CHECKING)
        path = _as_driven(collision, waypoints)
        if path is not None:
            report.tell(Stage.DONE)
            return path
        if report.left() <= 0.0:
            break
    raise NoPathFound(planner, report.seconds(), report.iterations)


class _Report:
    """What is told while planning, and whether there is time left."""

    def __init__(
        self,
        planner: str,
        time_limit: float,
        on_progress: Callable[[Progress], None] | None,
        clock: Callable[[], float] | None,
    ) -> None:
        self.planner = planner
        self.attempt = 1
        self.iterations = 0
        self._time_limit = time_limit
        self._on_progress = on_progress
        self._clock = clock
        self._began = 0.0 if clock is None else clock()

    def seconds(self) -> float | None:
        """Return the time since the start; None without a clock."""
        return None if self._clock is None else self._clock() - self._began

    def left(self) -> float:
        """Return the time that is left; not positive where there is none."""
        return self._time_limit - (self.seconds() or 0.0)

    def tell(self, stage: Stage, iterations: int = 0) -> None:
        """Tell where the plan is; `iterations` are those of a search under way."""
        if self._on_progress is not None:
            done = self.iterations + iterations
            self._on_progress(Progress(stage, self.attempt, done, self.seconds(), self._time_limit))

    def proceed(self, iterations: int) -> bool:
        """Tell of a search under way, and return whether it may go on."""
        self.tell(Stage.SEARCHING, iterations)
        return self.left() > 0.0


def _margin(collision: CollisionModel, start: Array, goal: Array) -> float:
    """Return the distance to keep, half of what start and goal have at most.

    Raises:
        StartInCollision: the start has none.
        GoalInCollision: the goal has none.
    """
    margin = MARGIN
    for position, refusal in ((start, StartInCollision), (goal, GoalInCollision)):
        nearest: Proximity | None = collision.distance(position)
        if nearest is None:
            continue
        if nearest.touching:
            raise refusal(nearest.first, nearest.second, nearest.distance)
        margin = min(margin, nearest.distance / 2.0)
    return margin


def _search(
    planner: str,
    kinematics: Kinematics,
    edges: EdgeChecker,
    start: Array,
    goal: Array,
    random: np.random.Generator,
    report: _Report,
) -> Search:
    report.tell(Stage.SEARCHING)
    if edges.free(start, goal):
        return Search(np.array([start, goal]), 0)
    lower = np.maximum(kinematics.lower, np.minimum(start, goal) - _SEARCHED)
    upper = np.minimum(kinematics.upper, np.maximum(start, goal) + _SEARCHED)
    if planner == BUILT_IN or not ompl_is_installed():
        return rrt_connect(
            start, goal, lower, upper, edges.free, random=random, proceed=report.proceed
        )
    return search_with_ompl(
        OmplPlanner(planner),
        start,
        goal,
        lower,
        upper,
        edges.position_free,
        seed=int(random.integers(1 << 31)),
        step=STEP,
        resolution=edges.resolution,
        proceed=report.proceed,
    )


def _as_driven(collision: CollisionModel, waypoints: Array) -> JointPolyline | None:
    """Return the path with the widest zones that nothing touches in; None if something does.

    A zone is halved until its corner is free. As the polyline is, a small enough one is, unless the
    search has overlooked a contact; the whole path is therefore checked once more.
    """
    lengths = np.sqrt((np.diff(waypoints, axis=0) ** 2).sum(axis=1))
    zones: list[float] = []
    for corner in range(1, len(waypoints) - 1):
        zone = _free_zone(collision, waypoints[corner - 1 : corner + 2], lengths[corner - 1 :])
        if zone is None:
            return None
        zones.append(zone)
    path = JointPolyline(waypoints, zones)
    return path if first_contact(collision, path) is None else None


def _free_zone(collision: CollisionModel, around: Array, lengths: Array) -> float | None:
    """Return the widest free zone at the middle of three waypoints."""
    before, corner, after = around
    into, out_of = (corner - before) / lengths[0], (after - corner) / lengths[1]
    zone = min(_GREATEST_ZONE, float(lengths[:2].min()) / 2.0)
    while zone >= LEAST_ZONE:
        bent = JointPolyline([corner - zone * into, corner, corner + zone * out_of], [zone])
        if first_contact(collision, bent) is None:
            return zone
        zone /= 2.0
    return None
