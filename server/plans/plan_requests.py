"""Goals of plans as pendants give them: examined, and turned into the job of a planning process.

Owns what a goal may be: poses in any frame that the cell knows, also one that moves with the robot,
which then counts as it is where the plan begins; joint positions inside the limits; planners by
name. Decides nothing about the robot as it stands.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias, cast

from openpendant.motion.description.limits import JointLimits, without_rounding
from openpendant.motion.errors import BadArgument, MotionError
from openpendant.motion.frames.frame_tree import BASE
from openpendant.motion.planning.ompl_planner import OmplPlanner
from openpendant.motion.planning.rrt_connect import BUILT_IN
from openpendant.simplemsg.pendant import MAX_WAYPOINTS, Motion
from openpendant.simplemsg.pendant.management.plan_goals import (
    FreeAim,
    LinAim,
    PathAim,
    PlanGoal,
    PositionAim,
    PtpAim,
)
from openpendant.simplemsg.pendant.management.plans import MakePlan
from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.robot_model import RobotModel
from ..control import speed_fault
from ..environment import CellEnvironment
from ..planning.jobs import FreePath, JointPathJob, JointVector, PlanJob, PoseGoal, PoseJob
from ..positions.position_book import PositionBook
from ..refusal import Refusal, refusal_of

LONGEST_LABEL = 64
"""Characters of a label at most."""

FASTEST_TOOL = 10.0
"""Greatest cap of the tool speed that may be asked for [m/s]."""

SLOWEST = 1e-6
"""Least speed [m/s, or fraction] that may be asked for; any plan that moves is too long by then."""

PLANNERS = (*(each.value for each in OmplPlanner), BUILT_IN)
"""Every planner by its name, installed or not."""

_GivenPose: TypeAlias = Mapping[str, Any]


def request_fault(asked: MakePlan) -> Refusal | None:
    """Return what is wrong with the numbers of a request beside its goal."""
    if len(asked.label) > LONGEST_LABEL or not all(map(str.isprintable, asked.label)):
        text = f"label: {len(asked.label)} characters; accepted: {LONGEST_LABEL}, all of them shown"
        return Refusal(VerdictCode.BAD_ARGUMENT, text)
    cap = asked.tool_speed
    if cap is not None and not 0.0 < cap <= FASTEST_TOOL:
        text = f"tool speed {cap:g} m/s; accepted: above 0, up to {FASTEST_TOOL:g}"
        return Refusal(VerdictCode.BAD_ARGUMENT, text, value=cap, limit=FASTEST_TOOL)
    for what, value in (("speed", asked.speed), ("tool speed", cap)):
        # Smaller ones lie outside the numbers that a planner can reckon with.
        if value is not None and 0.0 < value < SLOWEST:
            text = f"{what} {value:g}; accepted: {SLOWEST:g} or more"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=value, limit=SLOWEST)
    return speed_fault(asked.speed)


class GoalReader:
    """Reader of the goals of one cell."""

    def __init__(
        self,
        limits: JointLimits,
        robot: RobotModel,
        environment: CellEnvironment | None,
        positions: PositionBook,
    ) -> None:
        """Read goals for a robot; without an environment it has its own frames only."""
        self._limits = limits
        self._robot = robot
        self._environment = environment
        self._positions = positions

    def joints(self, values: Sequence[float]) -> JointVector:
        """Return a joint position, as a state of 4-byte reals may have told it.

        Raises:
            MotionError: it is none of this robot, or outside its limits.
        """
        self._limits.check_finite(values, "the joint position")
        joints = without_rounding(values, self._limits, self._limits.as_float32())
        self._limits.check_position(joints)
        return tuple(map(float, joints))

    def motion(
        self, goal: PlanGoal, start: JointVector, speed: float, cap: float | None
    ) -> PlanJob | Refusal:
        """Return what is to be planned for a goal, as a job without number and scene.

        Whatever a path has many of is looked at in the planning process.

        Args:
            start: (n,) where the plan begins [rad or m].
            speed: fraction of the joints' greatest speeds.
            cap: of tool and elbow [m/s]; None for none.
        """
        try:
            return self._motion(goal, start, speed, cap)
        except MotionError as error:
            return refusal_of(error)

    def _motion(
        self, goal: PlanGoal, start: JointVector, speed: float, cap: float | None
    ) -> PlanJob | Refusal:
        how = speed, cap, self._robot.tool_in_flange

        def through(*joints: JointVector) -> PlanJob:
            return PlanJob(0, start, JointPathJob(0, start, joints, *how))

        def poses(given: Sequence[_GivenPose], frame: str, way: Motion) -> PoseJob:
            goals = tuple(PoseGoal(each["position"], each["orientation"]) for each in given)
            return PoseJob(0, start, goals, frame, way, *how)

        match goal:
            case PositionAim(name=name):
                found = self._positions.position_named(name)
                return found if isinstance(found, Refusal) else through(found)
            case LinAim(pose=pose, frame=frame):
                motion = poses([cast(_GivenPose, pose)], frame, Motion.LIN)
                return PlanJob(0, start, motion, place=self._place(frame, start))
            case PathAim():
                return self._path(goal, start, through, poses)
            case PtpAim():
                if goal.joints is None and goal.pose is not None:
                    motion = poses([cast(_GivenPose, goal.pose)], goal.frame, Motion.PTP)
                    place = self._place(goal.frame, start)
                    return PlanJob(0, start, motion, goal.branch, place=place)
                if goal.branch is not None:
                    raise BadArgument("branch", goal.branch, "a branch with a pose only")
                return through(self._only_joints(goal))
            case FreeAim():
                if goal.planner not in PLANNERS:
                    raise BadArgument("planner", goal.planner, ", ".join(PLANNERS))
                search = goal.planner, goal.seed, goal.time_limit, goal.margin
                if goal.joints is None and goal.pose is not None:
                    given = cast(_GivenPose, goal.pose)
                    aim = PoseGoal(given["position"], given["orientation"])
                    place = self._place(goal.frame, start)
                    return PlanJob(0, start, FreePath(start, aim, *search, *how), place=place)
                return PlanJob(0, start, FreePath(start, self._only_joints(goal), *search, *how))

    def _only_joints(self, goal: PtpAim | FreeAim) -> JointVector:
        """Return the joints of a goal that has no pose."""
        if goal.joints is None or goal.pose is not None:
            given = "without joints and pose" if goal.joints is None else "with joints and pose"
            raise BadArgument(
                f"a goal of kind {goal.kind}", given, "joints or pose, one of the two"
            )
        return self.joints(goal.joints)

    def _path(
        self,
        goal: PathAim,
        start: JointVector,
        through: Callable[..., PlanJob],
        poses: Callable[[Sequence[_GivenPose], str, Motion], PoseJob],
    ) -> PlanJob | Refusal:
        waypoints = goal.waypoints
        if len(waypoints) > MAX_WAYPOINTS:
            found = len(waypoints)
            text = f"{found} waypoints; accepted: {MAX_WAYPOINTS}"
            return Refusal(VerdictCode.TOO_LARGE, text, value=found, limit=MAX_WAYPOINTS)
        joints = [each for each in waypoints if isinstance(each, tuple)]
        if not joints:
            motion = Motion.LIN if goal.way == "lin" else Motion.PTP
            given = cast("tuple[_GivenPose, ...]", waypoints)
            job = poses(given, goal.frame, motion)
            return PlanJob(0, start, job, place=self._place(goal.frame, start))
        if len(joints) < len(waypoints):
            raise BadArgument("waypoints", "both", "joint positions, or poses")
        if goal.way == "lin":
            raise BadArgument("way", goal.way, "ptp through joint positions")
        return through(*joints)

    def _place(self, frame: str, start: JointVector) -> PoseGoal | None:
        """Return a frame as it is where the plan begins; None for base.

        Raises:
            MotionError: nobody knows the frame.
        """
        if frame == BASE:
            return None
        if self._environment is None:
            place = self._robot.frames.standing_in_base(frame)
        else:
            place = self._environment.place_of(frame, start)
        return PoseGoal(tuple(place.position.tolist()), tuple(place.quaternion.tolist()))
