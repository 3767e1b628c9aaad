"""Point teaching: the robot's position at the time of a request, as an edit of a program.

A taught point has joints, pose, frame, tool and configuration. Owns the conditions for teaching a
point: a fresh report, the robot at rest, also in a pause. Owns its frame and tool: the program's
own for a new point, those of the point for one that is touched up. Saves nothing and knows no
store.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

from openpendant.motion.errors import MotionError
from openpendant.motion.frames.frame_tree import BASE, TOOL, FrameTree
from openpendant.motion.pose import Pose
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.pendant.management import programs as op
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...refusal import Refusal, refusal_of
from ..editing.edits import RecordPoint, TouchUp
from ..language.points import ArmConfiguration, PointPose, TeachPoint
from ..language.program import Program, check_robot
from ..language.statements import Move


@dataclass(frozen=True, slots=True)
class Standing:
    """Position of a robot at the time of a request, with the frames and tools of that time.

    The point is made later, when its program has been read; a motion of the robot, a frame or a
    tool in the meantime does not move the point.

    Attributes:
        joints: (n,) joint positions, controller side [rad or m].
        tool: the centre point of the tool that was selected, in the base frame [m].
        frames: the frames and tools that were in force.
    """

    joints: tuple[float, ...]
    tool: Pose
    frames: FrameTree


def standing_now(cell: RobotCell, robot: RobotModel, now: int) -> Standing | Refusal:
    """Return where the robot stands, or why no point can be taught now."""
    feedback = cell.feedback
    if feedback.position is None or not feedback.is_fresh(now):
        return Refusal(VerdictCode.FEEDBACK_STALE)
    if not _stands(cell):
        return Refusal(VerdictCode.MOVING, "a point is taught while the robot stands")
    joints = tuple(feedback.position)
    return Standing(joints, Pose.from_values(*robot.tool_pose(joints)), robot.frames)


def taught_point(
    at: Standing, robot: RobotModel, name: str, frame: str, tool: str
) -> TeachPoint | Refusal:
    """Return the point where the robot stood, or why it has no such pose.

    Raises:
        ProgramError: the name cannot be that of a point.
    """
    try:
        pose = _pose(at, frame, tool)
    except MotionError as error:
        return refusal_of(error)
    return TeachPoint(name, at.joints, pose, _configuration(robot, at.joints))


def _stands(cell: RobotCell) -> bool:
    if cell.driving.activity is Activity.PAUSED:
        # Some controllers report a motion as long as they are sent points, even equal ones.
        return cell.feedback.joints_rest
    return cell.feedback.is_standing and not cell.is_busy


def _pose(at: Standing, frame: str, tool: str) -> PointPose:
    # The point's own tool, which may differ from the selected one.
    tip = at.frames.transform(tool, TOOL)
    pose = at.frames.transform(BASE, frame).compose(at.tool).compose(tip)
    x, y, z = pose.position.tolist()
    qx, qy, qz, qw = pose.quaternion.tolist()
    return PointPose((x, y, z), (qx, qy, qz, qw), frame, tool)


def _configuration(robot: RobotModel, joints: tuple[float, ...]) -> ArmConfiguration | None:
    found = robot.configuration(joints)
    if found is None:
        return None
    return ArmConfiguration(found.shoulder.value, found.elbow.value, found.wrist.value, found.turns)


class NotTaught(Exception):
    """A point cannot be taught; the refusal says why."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.sentence)
        self.refusal = refusal


class PointTeaching:
    """Teaches points of one robot."""

    def __init__(self, cell: RobotCell, robot: RobotModel, robot_name: str) -> None:
        self._cell = cell
        self._robot = robot
        self._robot_name = robot_name

    def standing(self, now: int) -> Standing | Refusal:
        """Return where the robot stands for a point asked for now, or why there is none."""
        return standing_now(self._cell, self._robot, now)

    def record(self, head: Program, asked: op.RecordPoint, at: Standing) -> RecordPoint:
        """Return the edit that adds a point where the robot stood.

        Args:
            head: the program; of its points one is enough, of its statements none.

        Raises:
            NotTaught: there is no such frame or tool.
            ProgramError: the program is of another robot, or the name is refused.
        """
        point = replace(self._taught(head, asked.point, at), comment=asked.comment)
        return RecordPoint(point, cast(Move | None, asked.move), asked.at)

    def touch_up(self, head: Program, asked: op.TouchUpPoint, at: Standing) -> TouchUp:
        """Return the edit that puts a point where the robot stood.

        Args:
            head: the program; of its points the one in question is enough.

        Raises:
            NotTaught: there is no such frame or tool.
            ProgramError: as of `record`, or there is no such point.
        """
        before = head.point(asked.point).pose
        point = self._taught(
            head,
            asked.point,
            at,
            frame=None if before is None else before.frame,
            tool=None if before is None else before.tool,
        )
        return TouchUp(point.name, point.joints, point.pose, point.configuration)

    def _taught(
        self,
        program: Program,
        name: str,
        at: Standing,
        frame: str | None = None,
        tool: str | None = None,
    ) -> TeachPoint:
        """Return the point where the robot stood, in the program's own frame if none is named."""
        check_robot(program, self._robot_name, self._cell.limits)
        point = taught_point(at, self._robot, name, frame or program.frame, tool or program.tool)
        if isinstance(point, Refusal):
            raise NotTaught(point)
        return point
