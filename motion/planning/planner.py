"""Collision-free planner: a joint path from one position to another without contact.

Owns the order of the work: refuse a start or goal in contact, search, shorten, round the corners,
and check the resulting path as it will be driven. Search and shortening check single positions and
keep a margin. Only the last check decides, and where it finds a contact the work is repeated at a
finer resolution. A path that has not passed it is never returned. Owns also the choice of a goal
for a tool pose: the joint position that inverse kinematics finds from where the robot stands if it
is free, else the first free one from random seeds. Joint positions are (n,) [rad or m]; a start is
treated by `settle_start`.

The effort is counted in samples, so that the same seed gives the same path on any machine; time is
only an outer limit. (OMPL, where it is installed, and the built-in search give different paths.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ..errors import (
    BadArgument,
    GoalInCollision,
    NoMotion,
    NoPathFound,
    PlannerUnavailable,
    PoseUnreachable,
    StartInCollision,
)
from ..kinematics.ik.ik import solve
from ..kinematics.serial import Kinematics
from ..paths.blending import LEAST_ZONE, JointPolyline
from ..pose import Array, Pose
from ..scene.collision import CollisionModel, Proximity
from ..trajectory.joint_curves import COINCIDENT, settle_start
from .ompl_planner import OmplPlanner, ompl_is_installed, planners, search_with_ompl
from .path_check import EdgeChecker, first_contact
from .rrt_connect import BUILT_IN, STEP, TreeSearch, rrt_connect, shorten

DEFAULT_PLANNER = "RRTConnect"

MARGIN = 0.005
"""Distance that is kept from bodies where start and goal keep twice as much [m]."""
MOST_MARGIN = 0.05
"""Greatest distance that may be asked for [m]."""
EDGE_RESOLUTION = 0.03
"""Distance of the positions checked on an edge, in the first attempt [rad or m]."""
TIME_LIMIT = 5.0
"""Longest time of a plan [s]."""

_ATTEMPTS = 4  # attempts, each at half the step of the one before
_GREATEST_ZONE = 0.5  # rad or m
_SEARCHED = math.pi  # rad or m beyond start and goal: one revolution of a joint in all


class PlanningStage(StrEnum):
    """Stage of a plan."""

    SEARCHING = "searching"
    SHORTENING = "shortening"
    CHECKING = "checking"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class PlanningProgress:
    """Progress of a plan.

    Attributes:
        attempt: from 1; each further one works at a finer resolution.
        iterations: of the search, all attempts together.
        seconds: since the start; None without a clock.
        time_limit: greatest duration [s].
    """

    stage: PlanningStage
    attempt: int
    iterations: int
    seconds: float | None
    time_limit: float


def plan_free_path(
    kinematics: Kinematics,
    collision: CollisionModel,
    start: Sequence[float] | Array,
    goal: Sequence[float] | Array,
    *,
    planner: str = DEFAULT_PLANNER,
    seed: int = 0,
    time_limit: float = TIME_LIMIT,
    margin: float = MARGIN,
    on_progress: Callable[[PlanningProgress], None] | None = None,
    clock: Callable[[], float] | None = None,
) -> JointPolyline:
    """Plan a joint path without contact: lines with zones between, to be timed by `time_path`.

    Args:
        collision: the same robot in its scene.
        planner: one of `planners()`.
        seed: the same number gives the same path; 0 to 2³¹ - 1.
        time_limit: greatest duration by `clock` [s].
        margin: distance that is kept from bodies where start and goal keep twice as much [m]; 0 to
            0.05.
        on_progress: called now and then; what it raises ends the plan.
        clock: returns seconds; without one only the number of samples is bounded.

    Raises:
        StartInCollision: the robot touches something at the start.
        GoalInCollision: it would at the goal.
        NoPathFound: the search ended without a path.
        PlannerUnavailable: there is no such planner here.
        NoMotion: the robot is already there.
        OutOfRange: start or goal is outside a joint's range.
        WrongJointCount, NotFinite: start or goal is not one finite value per joint.
        BadArgument: the seed, the time limit or the margin.
    """
    if planner not in planners():
        raise PlannerUnavailable(planner, planners())
    if not 0 <= seed < 1 << 31:
        raise BadArgument("seed", seed, "0 to 2147483647")
    if not 0.0 < time_limit <= 3600.0:
        raise BadArgument("time_limit", time_limit, "more than 0 and at most 3600 s")
    if not 0.0 <= margin <= MOST_MARGIN:
        raise BadArgument("margin", margin, f"0 to {MOST_MARGIN:g} m")
    first = np.array(settle_start(start, kinematics.limits))
    last = np.array([float(value) for value in goal])
    kinematics.limits.check_position(last.tolist())
    if np.abs(last - first).max() < COINCIDENT:
        raise NoMotion
    margin = _margin(collision, first, last, margin)
    report = _Report(planner, time_limit, on_progress, clock)
    for attempt in range(_ATTEMPTS):
        report.attempt = attempt + 1
        edges = EdgeChecker(collision, EDGE_RESOLUTION / 2**attempt, margin)
        # Each attempt has its own random sequence, so that none depends on how long others took.
        random = np.random.default_rng((seed, attempt))
        found = _search(planner, kinematics, edges, first, last, random, report)
        report.iterations += found.iterations
        if found.waypoints is None:
            break
        report.tell(PlanningStage.SHORTENING)
        waypoints = shorten(found.waypoints, edges.free, random=random)
        report.tell(PlanningStage.CHECKING)
        path = _as_driven(collision, waypoints)
        if path is not None:
            report.tell(PlanningStage.DONE)
            return path
        if report.left() <= 0.0:
            break
    raise NoPathFound(planner, report.seconds(), report.iterations)


class _Report:
    """Progress reports of a plan, and its time limit."""

    def __init__(
        self,
        planner: str,
        time_limit: float,
        on_progress: Callable[[PlanningProgress], None] | None,
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
        """Return the time left [s]; 0 or less when it is used up."""
        return self._time_limit - (self.seconds() or 0.0)

    def tell(self, stage: PlanningStage, iterations: int = 0) -> None:
        """Report the stage of the plan; `iterations` are those of a search under way."""
        if self._on_progress is not None:
            done = self.iterations + iterations
            self._on_progress(
                PlanningProgress(stage, self.attempt, done, self.seconds(), self._time_limit)
            )

    def proceed(self, iterations: int) -> bool:
        """Report on a search under way; return True if it may continue."""
        self.tell(PlanningStage.SEARCHING, iterations)
        return self.left() > 0.0


def _margin(collision: CollisionModel, start: Array, goal: Array, margin: float) -> float:
    """Return the distance to keep from bodies, at most half of that of start and goal."""
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
) -> TreeSearch:
    report.tell(PlanningStage.SEARCHING)
    if edges.free(start, goal):
        return TreeSearch(np.array([start, goal]), 0)
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
    """Return the path with the widest zones that touch nothing; None if something does.

    A zone is halved until its corner is free. The polyline is free, so a small enough zone is too,
    unless the search has missed a contact; therefore the whole path is checked once more.
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


SEEDS = 16
"""Random joint positions from which further solutions are sought."""


def free_joint_position(
    collision: CollisionModel,
    pose: Pose,
    near: Sequence[float] | Array,
    *,
    frame: str = "base",
    random_seed: int = 0,
    kinematics: Kinematics | None = None,
) -> Array:
    """Return an (n,) joint position that reaches a pose without contact.

    Args:
        kinematics: of the same robot with the tool that the pose is of; that of the collision
            model where left out.

    Raises:
        PoseUnreachable: no joint position reaches the pose.
        GoalInCollision: all that were found touch; of the nearest one.
        FrameUnknown: there is no such frame.
    """
    kinematics = kinematics or collision.kinematics
    first = solve(kinematics, pose, near, frame=frame, random_seed=random_seed).joint_position
    if not collision.collides(first):
        return first
    random = np.random.default_rng(random_seed)
    for _ in range(SEEDS):
        seed = random.uniform(kinematics.lower, kinematics.upper)
        try:
            found = solve(kinematics, pose, seed, frame=frame, random_seed=random_seed)
        except PoseUnreachable:
            continue
        if not collision.collides(found.joint_position):
            return found.joint_position
    contact = collision.contacts(first)[0]
    raise GoalInCollision(contact.first, contact.second, contact.distance)
