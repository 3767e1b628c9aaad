"""A point as it is taught: where the robot stands, with pose, frame, tool and configuration.

Owns when a point may be taught: from a fresh report, at rest, also in a pause. Knows no program and
no store.
"""

from __future__ import annotations

from openpendant.motion.errors import MotionError
from openpendant.motion.frames import BASE, FLANGE
from openpendant.motion.pose import Pose
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode

from ..programs.points import ArmConfiguration, PointPose, TeachPoint
from ..refusal import Refusal, refusal_of
from ..robot_cell import RobotCell
from ..robot_view import RobotView


def taught_point(
    cell: RobotCell, robot: RobotView, name: str, frame: str, tool: str, now: int
) -> TeachPoint | Refusal:
    """Return the point where the robot stands.

    Args:
        cell: knows where it stands.
        robot: its mathematics, frames and tools.
        name: of the point.
        frame: name of the frame of its pose.
        tool: name of the tool.
        now: monotonic time, ns.

    Raises:
        ProgramError: the name cannot be that of a point.
    """
    feedback = cell.feedback
    if feedback.position is None or not feedback.is_fresh(now):
        return Refusal(VerdictCode.FEEDBACK_STALE)
    if not _stands(cell):
        return Refusal(VerdictCode.MOVING, "a point is taught while the robot stands")
    try:
        pose = _pose(robot, feedback.position, frame, tool)
    except MotionError as error:
        return refusal_of(error)
    configuration = _configuration(robot, feedback.position)
    return TeachPoint(name, tuple(feedback.position), pose, configuration)


def _stands(cell: RobotCell) -> bool:
    if cell.motion_activity is Activity.PAUSED:
        # Some controllers call it a motion as long as they are sent points, also without way.
        return cell.feedback.joints_rest
    return cell.feedback.is_standing and not cell.is_busy


def _pose(robot: RobotView, joints: tuple[float, ...], frame: str, tool: str) -> PointPose:
    frames = robot.frames
    flange = Pose.from_values(*robot.tool_pose(joints))
    tip = frames.transform(tool, FLANGE)
    pose = frames.transform(BASE, frame).compose(flange).compose(tip)
    x, y, z = pose.position.tolist()
    qx, qy, qz, qw = pose.quaternion.tolist()
    return PointPose((x, y, z), (qx, qy, qz, qw), frame, tool)


def _configuration(robot: RobotView, joints: tuple[float, ...]) -> ArmConfiguration | None:
    found = robot.configuration(joints)
    if found is None:
        return None
    return ArmConfiguration(found.shoulder.value, found.elbow.value, found.wrist.value, found.turns)
