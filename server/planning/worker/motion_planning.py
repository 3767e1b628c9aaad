"""Motion planning: a certified trajectory for a motion to joint positions or poses, or a refusal.

Owns how such a motion is made: in a straight joint line in closed form where no cap of the tool
speed rules, else along a curve through the joint positions, or in straight lines of the tool with a
stop at each. A contact with the scene is not looked for here.
"""

from __future__ import annotations

import numpy as np

from openpendant.motion.errors import MotionError
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths.paths import joint_path_through_poses, linear_legs
from openpendant.motion.pose import Pose
from openpendant.motion.timing.parameterization import time_legs, time_path
from openpendant.motion.trajectory.certificate import Certificate, certify
from openpendant.motion.trajectory.joint_curves import JointSpline
from openpendant.motion.trajectory.point_speed import ToolSpeedLimit, reduced_speed
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.simplemsg.pendant import Motion

from ...refusal import Refusal, refusal_of
from ..jobs import JointPathJob, PoseJob


def certified_motion(
    kinematics: Kinematics, job: PoseJob | JointPathJob
) -> tuple[Trajectory, Certificate] | Refusal:
    """Return the certified trajectory of a motion, or why there is none.

    Args:
        kinematics: of the robot with the job's tool.
    """
    try:
        return planned_motion(kinematics, job)
    except MotionError as error:
        return refusal_of(error)


def planned_motion(
    kinematics: Kinematics, job: PoseJob | JointPathJob
) -> tuple[Trajectory, Certificate]:
    """As `certified_motion`.

    Raises:
        MotionError: there is none.
    """
    trajectory = _plan(kinematics, job)
    caps = speed_caps(kinematics, job.tool_speed)
    proof = certify(trajectory, kinematics.limits, start=job.start, tool_speed=caps)
    return trajectory, proof


def _plan(kinematics: Kinematics, job: PoseJob | JointPathJob) -> Trajectory:
    if isinstance(job, PoseJob):
        return _plan_poses(kinematics, job)
    limits, caps = kinematics.limits, speed_caps(kinematics, job.tool_speed)
    if len(job.waypoints) == 1 and not caps:
        return plan_joint_move(job.start, job.waypoints[0], limits, speed=job.speed)
    path = JointSpline([job.start, *job.waypoints], limits)
    return time_path(path, limits, speed=job.speed, tool_speed=caps)


def _plan_poses(kinematics: Kinematics, job: PoseJob) -> Trajectory:
    limits = kinematics.limits
    poses = [Pose.from_values(goal.position, goal.orientation) for goal in job.goals]
    caps = speed_caps(kinematics, job.tool_speed)
    if job.motion is Motion.LIN:
        legs = linear_legs(kinematics, job.start, poses, frame=job.frame)
        return time_legs(legs, limits, speed=job.speed, tool_speed=caps)
    waypoints = joint_path_through_poses(kinematics, job.start, poses, frame=job.frame)
    if len(poses) == 1 and not caps:
        return plan_joint_move(job.start, waypoints[-1], limits, speed=job.speed)
    path = JointSpline(np.array(waypoints), limits)
    return time_path(path, limits, speed=job.speed, tool_speed=caps)


def speed_caps(kinematics: Kinematics, tool_speed: float | None) -> tuple[ToolSpeedLimit, ...]:
    """Return the speed limits of tool and elbow for a cap [m/s]; none for None."""
    return () if tool_speed is None else reduced_speed(kinematics, tool_speed)
