"""Single motions as pendants ask for them: joint moves, poses, paths, home.

Owns the order in which a request is examined: may this connection move at all, then its arguments,
then the plan; and the checks of these arguments, pure functions from a value to the refusal that
it deserves, None where it is in order. Joint positions are `joint_slots`' business, answers the
endpoint's, jogs are `jog_requests`'.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from openpendant.motion.errors import MotionError
from openpendant.motion.frames.frame_tree import BASE
from openpendant.motion.pose import Array, Pose
from openpendant.simplemsg import RealRecords
from openpendant.simplemsg.declaration import Record
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
from ...planning.waypoint_tables import JointWaypoints, PoseWaypoints
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


def pose_fault(goal: PoseGoal, number: int = 1) -> Refusal | None:
    """Return what is wrong with a tool pose: finite, not absurdly far, a quaternion of length 1.

    Args:
        number: of the pose in its path, for the text.
    """
    if not all(map(math.isfinite, (*goal.position, *goal.orientation))):
        return Refusal(VerdictCode.NOT_FINITE, f"pose {number} holds no finite numbers")
    farthest = max(goal.position, key=abs)
    if abs(farthest) > LARGEST_COORDINATE:
        text = f"pose {number} lies at {farthest:g} m; accepted: up to {LARGEST_COORDINATE:g}"
        return Refusal(VerdictCode.BAD_ARGUMENT, text, value=farthest, limit=LARGEST_COORDINATE)
    x, y, z, w = goal.orientation
    # Not by `sum`, which rounds otherwise than `path_fault` does.
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if abs(norm - 1.0) > _NORM_TOLERANCE:
        text = f"the quaternion of pose {number} has length {norm:g}; accepted: 1"
        return Refusal(VerdictCode.BAD_ARGUMENT, text, value=norm, limit=1.0)
    return None


def path_fault(poses: Array) -> Refusal | None:
    """Return what `pose_fault` says of the first pose of a path that is not sound.

    Args:
        poses: (m, 7) x, y, z [m] and quaternion x, y, z, w of each.
    """
    x, y, z, w = poses[:, 3:].T
    with np.errstate(invalid="ignore", over="ignore"):
        norm = np.sqrt(x * x + y * y + z * z + w * w)
        is_sound = np.abs(norm - 1.0) <= _NORM_TOLERANCE
        is_sound &= (np.abs(poses[:, :3]) <= LARGEST_COORDINATE).all(axis=1)
    if is_sound.all():
        return None  # what is not finite is beyond a bound
    first = int(np.argmin(is_sound))
    values = tuple(poses[first].tolist())
    return pose_fault(PoseGoal(values[:3], values[3:]), first + 1)


def table_of(records: Sequence[Record]) -> Array:
    """Return the reals of the records of a path, (m, w), one row a record."""
    if isinstance(records, RealRecords):
        with np.errstate(invalid="ignore"):  # of a number that is none
            table = np.frombuffer(records.data, records.real).astype(np.float64)
        return table.reshape(len(records), -1)
    rows = [[x for name in each.FIELDS for x in getattr(each, name)] for each in records]
    return np.array(rows, dtype=np.float64)


class PendantMotions:
    """All single motions of one cell."""

    def __init__(self, cell: RobotCell, robot: RobotModel, positions: PositionBook) -> None:
        """Start with no request in progress."""
        self._cell = cell
        self._robot = robot
        self._positions = positions

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

    def joint_path(self, session: int, message: JointPath, now: int) -> Refusal | list[Effect]:
        """Examine a path through joint positions, and have it planned."""
        cell = self._cell
        refusal = (
            check_interlocks(cell, session, now)
            or speed_fault(message.speed)
            or cell.slots.count_fault(message.joint_count)
        )
        if refusal is not None:
            return refusal
        positions = cell.slots.positions(table_of(message.waypoints))
        if isinstance(positions, Refusal):
            return positions
        job = JointPathJob(
            cell.motions.new_job_id(),
            cell.feedback.standing_at,
            JointWaypoints(positions),
            message.speed,
            self._tool_speed,
            self._robot.tool_in_flange,
        )
        return self._plan(MotionRequest(session, message.request_id), job, now)

    def pose_move(self, session: int, message: PoseMove, now: int) -> Refusal | list[Effect]:
        """Examine a move to a pose, and have it planned."""
        goal = PoseGoal(message.position, message.orientation)
        refusal = self._pose_request_fault(session, message, now) or pose_fault(goal)
        if refusal is not None:
            return refusal
        try:
            place = self._robot.frames.standing_in_base(message.frame)
            tool = place.compose(Pose.from_values(goal.position, goal.orientation))
        except MotionError as error:
            return refusal_of(error)
        position, quaternion = tuple(tool.position.tolist()), tuple(tool.quaternion.tolist())
        return self._move_tool(session, message, (PoseGoal(position, quaternion),), now)

    def pose_path(self, session: int, message: PosePath, now: int) -> Refusal | list[Effect]:
        """Examine a path through poses, and have it planned."""
        refusal = self._pose_request_fault(session, message, now)
        if refusal is not None:
            return refusal
        # All at once: one by one, as a pose move, 1,600 would take 40 ms of the event loop.
        poses = table_of(message.waypoints)
        refusal = path_fault(poses)
        if refusal is not None:
            return refusal
        try:
            in_base = self._robot.frames.standing_in_base(message.frame).compose_all(poses)
        except MotionError as error:
            return refusal_of(error)
        return self._move_tool(session, message, PoseWaypoints(in_base), now)

    def _pose_request_fault(
        self, session: int, message: PoseMove | PosePath, now: int
    ) -> Refusal | None:
        return (
            check_interlocks(self._cell, session, now)
            or speed_fault(message.speed)
            or motion_fault(message.motion)
        )

    def _move_tool(
        self, session: int, message: PoseMove | PosePath, goals: Sequence[PoseGoal], now: int
    ) -> list[Effect]:
        """Have a motion through poses in base planned."""
        job = PoseJob(
            self._cell.motions.new_job_id(),
            self._cell.feedback.standing_at,
            goals,
            BASE,
            Motion(message.motion),
            message.speed,
            self._tool_speed,
            self._robot.tool_in_flange,
        )
        return self._plan(MotionRequest(session, message.request_id), job, now)

    def home(self, session: int, message: Home, now: int) -> Refusal | list[Effect]:
        """Examine a move to a named position, and start it at once where it can be."""
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
