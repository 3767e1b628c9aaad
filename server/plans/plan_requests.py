"""Goals of plans as pendants give them: examined, and turned into the job of a planning process.

Owns what a goal may be: poses in any frame that the cell knows, also one that moves with the robot,
which then counts as it is where the plan begins; joint positions inside the limits; planners by
name. Decides nothing about the robot as it stands.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import BadArgument, MotionError
from openpendant.motion.frames.frame_tree import BASE
from openpendant.motion.planning.ompl_planner import OmplPlanner
from openpendant.motion.planning.rrt_connect import BUILT_IN
from openpendant.motion.pose import Pose
from openpendant.simplemsg.pendant import MAX_WAYPOINTS, Motion
from openpendant.simplemsg.pendant.management.plan_goals import (
    FreeGoal,
    LinGoal,
    PathGoal,
    PlanGoal,
    PositionGoal,
    PtpGoal,
)
from openpendant.simplemsg.pendant.management.plans import MakePlan
from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.robot_model import RobotModel
from ..control import speed_fault
from ..environment import CellEnvironment
from ..planning.jobs import FreePath, JointPathJob, JointVector, PoseGoal, PoseJob
from ..refusal import Refusal, refusal_of

LARGEST_COORDINATE = 1e3
"""No tool is asked to go farther from its frame [m]; keeps overflow out of the planner."""

NORM_TOLERANCE = 1e-3
"""How far the length of a quaternion may be from 1, which it is then given."""

LONGEST_LABEL = 64
"""Characters of a label at most."""

FASTEST_TOOL = 10.0
"""Greatest cap of the tool speed that may be asked for [m/s]."""

PLANNERS = (*(each.value for each in OmplPlanner), BUILT_IN)
"""Every planner by its name, installed or not."""

Planned: TypeAlias = PoseJob | JointPathJob | FreePath
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
    return speed_fault(asked.speed)


class GoalReader:
    """Reader of the goals of one cell."""

    def __init__(
        self, limits: JointLimits, robot: RobotModel, environment: CellEnvironment | None
    ) -> None:
        """Read goals for a robot; without an environment it has its own frames only."""
        self._limits = limits
        self._robot = robot
        self._environment = environment

    def joints(self, values: Sequence[float]) -> JointVector:
        """Return a joint position.

        Raises:
            MotionError: it is none of this robot, or outside its limits.
        """
        self._limits.check_position(values)
        return tuple(map(float, values))

    def motion(
        self, goal: PlanGoal, start: JointVector, speed: float, cap: float | None
    ) -> tuple[Planned, int | None] | Refusal:
        """Return what is to be planned for a goal, and the branch that is asked for.

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
    ) -> tuple[Planned, int | None] | Refusal:
        tool = self._robot.tool_in_flange
        match goal:
            case PositionGoal(name=name):
                joints = self._robot.named_position(name)
                return JointPathJob(0, start, (joints,), speed, cap, tool), None
            case LinGoal(pose=pose, frame=frame):
                goals = self._poses([pose], frame, start)
                return PoseJob(0, start, goals, BASE, Motion.LIN, speed, cap, tool), None
            case PathGoal():
                return self._path(goal, start, speed, cap)
            case PtpGoal():
                aim = self._aim(goal, start)
                if not isinstance(aim, PoseGoal):
                    return JointPathJob(0, start, (aim,), speed, cap, tool), None
                job = PoseJob(0, start, (aim,), BASE, Motion.PTP, speed, cap, tool)
                return job, goal.branch
            case FreeGoal():
                if goal.planner not in PLANNERS:
                    raise BadArgument("planner", goal.planner, ", ".join(PLANNERS))
                aim = self._aim(goal, start)
                how = goal.planner, goal.seed, goal.time_limit, goal.margin
                return FreePath(start, aim, *how, speed, cap, tool), None

    def _aim(self, goal: PtpGoal | FreeGoal, start: JointVector) -> JointVector | PoseGoal:
        """Return the joints or the pose that a goal names, of which it has to name one."""
        if (goal.joints is None) == (goal.pose is None):
            raise BadArgument("goal", goal.kind, "joints or pose, one of the two")
        if goal.pose is None:
            assert goal.joints is not None
            if isinstance(goal, PtpGoal) and goal.branch is not None:
                raise BadArgument("branch", goal.branch, "a branch with a pose only")
            return self.joints(goal.joints)
        (pose,) = self._poses([goal.pose], goal.frame, start)
        return pose

    def _path(
        self, goal: PathGoal, start: JointVector, speed: float, cap: float | None
    ) -> tuple[Planned, int | None] | Refusal:
        tool, waypoints = self._robot.tool_in_flange, goal.waypoints
        if len(waypoints) > MAX_WAYPOINTS:
            found = len(waypoints)
            text = f"{found} waypoints; accepted: {MAX_WAYPOINTS}"
            return Refusal(VerdictCode.TOO_LARGE, text, value=found, limit=MAX_WAYPOINTS)
        poses = [each for each in waypoints if not isinstance(each, tuple)]
        if not poses:
            if goal.way == "lin":
                raise BadArgument("way", goal.way, "ptp through joint positions")
            joints = tuple(self.joints(each) for each in waypoints if isinstance(each, tuple))
            return JointPathJob(0, start, joints, speed, cap, tool), None
        if len(poses) < len(waypoints):
            raise BadArgument("waypoints", "both", "joint positions, or poses")
        motion = Motion.LIN if goal.way == "lin" else Motion.PTP
        goals = self._poses(poses, goal.frame, start)
        return PoseJob(0, start, goals, BASE, motion, speed, cap, tool), None

    def _poses(
        self, given: Sequence[_GivenPose], frame: str, start: JointVector
    ) -> tuple[PoseGoal, ...]:
        """Return poses of the tool in base.

        Raises:
            MotionError: a pose is none, or nobody knows the frame.
        """
        poses = [_pose(each, number) for number, each in enumerate(given, start=1)]
        if self._environment is None:
            in_base = self._robot.frames.in_base(poses, frame)
        else:
            in_base = self._environment.in_base(poses, frame, start)
        return tuple(
            PoseGoal(tuple(each.position.tolist()), tuple(each.quaternion.tolist()))
            for each in in_base
        )


def _pose(given: _GivenPose, number: int) -> Pose:
    """Return a pose whose numbers are finite.

    Raises:
        BadArgument: it lies too far away, or its quaternion has another length than 1.
    """
    farthest = max(given["position"], key=abs)
    if abs(farthest) > LARGEST_COORDINATE:
        accepted = f"coordinates up to {LARGEST_COORDINATE:g} m"
        raise BadArgument(f"pose {number}", farthest, accepted)
    norm = math.sqrt(sum(part * part for part in given["orientation"]))
    if not abs(norm - 1.0) <= NORM_TOLERANCE:
        raise BadArgument(f"quaternion of pose {number}", f"length {norm:g}", "length 1")
    return Pose.from_values(given["position"], given["orientation"])
