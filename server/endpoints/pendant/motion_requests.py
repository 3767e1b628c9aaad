"""Single motions as pendants ask for them: joint moves, poses, paths, home.

Owns the order in which a request is examined: may this connection move at all, then its arguments,
then the plan; and the checks of these arguments, pure functions from a value to the refusal that
it deserves, None where it is in order. Joint positions are `joint_slots`' business, answers the
endpoint's, jogs are `jog_requests`'.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from openpendant.motion.errors import MotionError
from openpendant.motion.frames.frame_tree import BASE
from openpendant.motion.pose import Pose
from openpendant.simplemsg.pendant import Home, JointMove, JointPath, Motion, PoseMove, PosePath
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.interlocks import check_interlocks
from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...control import speed_fault
from ...events.cell_events import MotionRequest
from ...events.effects import Effect, Send
from ...events.replies import verdict
from ...planning.jobs import JointPathJob, JointVector, MotionJob, PoseGoal, PoseJob
from ...positions.position_book import PositionBook
from ...refusal import Refusal, refusal_of

LARGEST_COORDINATE = 1e3
"""No tool is asked to go farther from its frame [m]; keeps overflow out of the planner."""

_NORM_TOLERANCE = 0.01

AT_POSITION: Mapping[bool, float] = {False: 1e-4, True: 1e-5}
"""Greatest distance of a joint from a position where it is already, by prismatic [rad or m]."""


def motion_fault(motion: int) -> Refusal | None:
    """Return why the tool cannot get to a pose in such a way."""
    if motion in (Motion.PTP, Motion.LIN):
        return None
    return Refusal(VerdictCode.BAD_ARGUMENT, f"motion {motion}; accepted: 1 PTP, 2 LIN")


def pose_fault(goals: Sequence[PoseGoal]) -> Refusal | None:
    """Return what is wrong with tool poses: finite, not absurdly far, quaternions of length 1."""
    for number, goal in enumerate(goals, start=1):
        if not all(map(math.isfinite, (*goal.position, *goal.orientation))):
            return Refusal(VerdictCode.NOT_FINITE, f"pose {number} holds no finite numbers")
        farthest = max(goal.position, key=abs)
        if abs(farthest) > LARGEST_COORDINATE:
            text = f"pose {number} lies at {farthest:g} m; accepted: up to {LARGEST_COORDINATE:g}"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=farthest, limit=LARGEST_COORDINATE)
        norm = math.sqrt(sum(part * part for part in goal.orientation))
        if abs(norm - 1.0) > _NORM_TOLERANCE:
            text = f"the quaternion of pose {number} has length {norm:g}; accepted: 1"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=norm, limit=1.0)
    return None


class PendantMotions:
    """All single motions of one cell."""

    def __init__(self, cell: RobotCell, robot: RobotModel, positions: PositionBook) -> None:
        """Start with no request in progress."""
        self._cell = cell
        self._robot = robot
        self._positions = positions

    def ask(
        self, session: int, message: PoseMove | PosePath | JointPath | Home, now: int
    ) -> Refusal | list[Effect]:
        """Examine a request and have it planned; what needs no planning begins at once."""
        match message:
            case PoseMove():
                goals: tuple[PoseGoal, ...] = (PoseGoal(message.position, message.orientation),)
                return self._poses(session, message, goals, now)
            case PosePath():
                goals = tuple(PoseGoal(at.position, at.orientation) for at in message.waypoints)
                return self._poses(session, message, goals, now)
            case JointPath():
                return self._joint_path(session, message, now)
            case Home():
                return self._home(session, message, now)

    def joint_move(self, session: int, message: JointMove, now: int) -> Refusal | list[Effect]:
        """Examine a joint move, and start it at once where it needs no planning process."""
        refusal = (
            check_interlocks(self._cell, session, now)
            or speed_fault(message.speed)
            or self._cell.slots.count_fault(message.joint_count)
        )
        goal = refusal or self._cell.slots.position(message.joints)
        if isinstance(goal, Refusal):
            return goal
        return self._move_joints(session, message.request_id, goal, message.speed, now)

    def _move_joints(
        self, session: int, request_id: int, goal: JointVector, speed: float, now: int
    ) -> list[Effect]:
        cell = self._cell
        job = JointPathJob(
            cell.motions.new_job_id(),
            cell.feedback.standing_at,
            (goal,),
            speed,
            self._tool_speed,
            self._robot.tool_in_flange,
        )
        cell.authority.beat(session, now)
        return cell.motions.move_joints(MotionRequest(session, request_id), job, now)

    @property
    def _tool_speed(self) -> float | None:
        return self._cell.modes.tool_speed_cap(self._cell.feedback.mode)

    def _plan(self, request: MotionRequest, job: MotionJob, now: int) -> list[Effect]:
        self._cell.authority.beat(request.session, now)
        return self._cell.motions.ask(request, job)

    def _joint_path(self, session: int, message: JointPath, now: int) -> Refusal | list[Effect]:
        cell = self._cell
        refusal = (
            check_interlocks(cell, session, now)
            or speed_fault(message.speed)
            or cell.slots.count_fault(message.joint_count)
        )
        if refusal is not None:
            return refusal
        waypoints: list[JointVector] = []
        for waypoint in message.waypoints:
            position = cell.slots.position(waypoint.joints)
            if isinstance(position, Refusal):
                return position
            waypoints.append(position)
        job = JointPathJob(
            cell.motions.new_job_id(),
            cell.feedback.standing_at,
            tuple(waypoints),
            message.speed,
            self._tool_speed,
            self._robot.tool_in_flange,
        )
        return self._plan(MotionRequest(session, message.request_id), job, now)

    def _poses(
        self,
        session: int,
        message: PoseMove | PosePath,
        goals: tuple[PoseGoal, ...],
        now: int,
    ) -> Refusal | list[Effect]:
        cell = self._cell
        refusal = (
            check_interlocks(cell, session, now)
            or speed_fault(message.speed)
            or motion_fault(message.motion)
            or pose_fault(goals)
        )
        if refusal is not None:
            return refusal
        try:
            in_base = self._in_base(goals, message.frame)
        except MotionError as error:
            return refusal_of(error)
        job = PoseJob(
            cell.motions.new_job_id(),
            cell.feedback.standing_at,
            in_base,
            BASE,
            Motion(message.motion),
            message.speed,
            self._tool_speed,
            self._robot.tool_in_flange,
        )
        return self._plan(MotionRequest(session, message.request_id), job, now)

    def _in_base(self, goals: Sequence[PoseGoal], frame: str) -> tuple[PoseGoal, ...]:
        poses = [Pose.from_values(goal.position, goal.orientation) for goal in goals]
        return tuple(
            PoseGoal(tuple(tool.position.tolist()), tuple(tool.quaternion.tolist()))
            for tool in self._robot.frames.in_base(poses, frame)
        )

    def _home(self, session: int, message: Home, now: int) -> Refusal | list[Effect]:
        refusal = check_interlocks(self._cell, session, now) or speed_fault(message.speed)
        if refusal is not None:
            return refusal
        if message.target not in self._positions.of_robot and (
            reading := self._positions.read_once()
        ):
            busy = self._positions.being_read
            return [*reading, Send(session, verdict(message.request_id, busy))]
        goal = self._positions.position_named(message.target)
        if isinstance(goal, Refusal):
            return goal
        if self._stands_at(goal):
            self._cell.authority.beat(session, now)
            return self._cell.motions.arrive(MotionRequest(session, message.request_id), now)
        return self._move_joints(session, message.request_id, goal, message.speed, now)

    def _stands_at(self, goal: JointVector) -> bool:
        """Return True if every joint is so near a position that the robot counts as there."""
        here, prismatic = self._cell.feedback.standing_at, self._cell.limits.prismatic
        return all(
            abs(at - wanted) <= AT_POSITION[in_metres]
            for at, wanted, in_metres in zip(here, goal, prismatic, strict=True)
        )
