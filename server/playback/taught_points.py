"""A point as it is taught: where the robot stands, with pose, frame, tool and configuration.

Owns when a point may be taught: from a fresh report, at rest, also in a pause. Knows no program and
no store.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.motion.errors import MotionError
from openpendant.motion.frames import BASE, TOOL, FrameTree
from openpendant.motion.pose import Pose
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode

from ..programs.points import ArmConfiguration, PointPose, TeachPoint
from ..refusal import Refusal, refusal_of
from ..robot_cell import RobotCell
from ..robot_view import RobotView


@dataclass(frozen=True, slots=True)
class Standing:
    """Where a robot stood when somebody asked, and the frames and tools of that moment.

    A point is made of it later, when its program has been read; what moves meanwhile, the robot,
    a frame or a tool, does not move the point.

    Attributes:
        joints: (n,) joint positions, controller side [rad or m].
        tool: the centre point of the tool that was selected, in the base frame [m].
        frames: the frames and tools that were in force.
    """

    joints: tuple[float, ...]
    tool: Pose
    frames: FrameTree


def standing_now(cell: RobotCell, robot: RobotView, now: int) -> Standing | Refusal:
    """Return where the robot stands, or why no point can be taught now.

    Args:
        cell: knows where it stands.
        robot: its mathematics, frames and tools.
        now: monotonic time, ns.
    """
    feedback = cell.feedback
    if feedback.position is None or not feedback.is_fresh(now):
        return Refusal(VerdictCode.FEEDBACK_STALE)
    if not _stands(cell):
        return Refusal(VerdictCode.MOVING, "a point is taught while the robot stands")
    joints = tuple(feedback.position)
    return Standing(joints, Pose.from_values(*robot.tool_pose(joints)), robot.frames)


def taught_point(
    at: Standing, robot: RobotView, name: str, frame: str, tool: str
) -> TeachPoint | Refusal:
    """Return the point where the robot stood, or why it has no such pose.

    Args:
        at: where it stood.
        robot: its mathematics.
        name: of the point.
        frame: name of the frame of its pose.
        tool: name of the tool.

    Raises:
        ProgramError: the name cannot be that of a point.
    """
    try:
        pose = _pose(at, frame, tool)
    except MotionError as error:
        return refusal_of(error)
    return TeachPoint(name, at.joints, pose, _configuration(robot, at.joints))


def _stands(cell: RobotCell) -> bool:
    if cell.motion_activity is Activity.PAUSED:
        # Some controllers call it a motion as long as they are sent points, also without way.
        return cell.feedback.joints_rest
    return cell.feedback.is_standing and not cell.is_busy


def _pose(at: Standing, frame: str, tool: str) -> PointPose:
    # The point's tool, which need not be the one that was selected.
    tip = at.frames.transform(tool, TOOL)
    pose = at.frames.transform(BASE, frame).compose(at.tool).compose(tip)
    x, y, z = pose.position.tolist()
    qx, qy, qz, qw = pose.quaternion.tolist()
    return PointPose((x, y, z), (qx, qy, qz, qw), frame, tool)


def _configuration(robot: RobotView, joints: tuple[float, ...]) -> ArmConfiguration | None:
    found = robot.configuration(joints)
    if found is None:
        return None
    return ArmConfiguration(found.shoulder.value, found.elbow.value, found.wrist.value, found.turns)
