"""What the planning process does: from a job to a certified trajectory or a refusal.

Runs in a worker process and nowhere else, because inverse kinematics and TOPP-RA hold the
interpreter for milliseconds. Owns which planner a job needs; each answer passed the certificate.
"""

from __future__ import annotations

import time
from functools import cache

import numpy as np

from openpendant.motion.certificate import certify
from openpendant.motion.errors import MotionError
from openpendant.motion.kinematics import Kinematics
from openpendant.motion.paths import JointSpline, joint_path_through_poses, linear_legs
from openpendant.motion.pose import Pose
from openpendant.motion.ptp import plan_joint_move
from openpendant.motion.robot import serial_robot
from openpendant.motion.timing import time_legs, time_path
from openpendant.motion.trajectory import Trajectory
from openpendant.simplemsg.pendant import Motion

from .jobs import Job, JointPathJob, Planned, PoseJob, RosPathJob
from .refusal import refusal_of
from .ros_planning import plan_ros_path


@cache
def kinematics_of(robot: str) -> Kinematics:
    """Return the kinematics of a robot; made once in each process."""
    return Kinematics(serial_robot(robot))


def answer(robot: str, job: Job) -> Planned:
    """Plan a job and certify the result.

    Args:
        robot: name or file of the robot.
        job: what to plan.

    Returns:
        The trajectory with its certificate, or the refusal; never raises for a motion that cannot
        be made.
    """
    began = time.perf_counter()
    kinematics = kinematics_of(robot)
    try:
        trajectory = _plan(kinematics, job)
        certificate = certify(trajectory, kinematics.limits, start=job.start)
    except MotionError as error:
        return Planned(job.job_id, refusal_of(error), time.perf_counter() - began)
    return Planned(job.job_id, (trajectory, certificate), time.perf_counter() - began)


def warm_up(robot: str) -> None:
    """Load the libraries and run each once, so that the first job is as fast as the next."""
    kinematics = kinematics_of(robot)
    home = serial_robot(robot).home_position
    limits = kinematics.limits
    aside = tuple(
        value + (0.01 if value + 0.01 <= upper else -0.01)
        for value, upper in zip(home, limits.upper, strict=True)
    )
    answer(robot, JointPathJob(0, home, (aside, home), speed=0.5))


def _plan(kinematics: Kinematics, job: Job) -> Trajectory:
    limits = kinematics.limits
    match job:
        case JointPathJob():
            path = JointSpline([job.start, *job.waypoints], limits)
            return time_path(path, limits, speed=job.speed)
        case RosPathJob():
            return plan_ros_path(job, limits)
        case PoseJob():
            return _plan_poses(kinematics, job)


def _plan_poses(kinematics: Kinematics, job: PoseJob) -> Trajectory:
    limits = kinematics.limits
    poses = [Pose.from_values(goal.position, goal.orientation) for goal in job.goals]
    if job.motion is Motion.LIN:
        legs = linear_legs(kinematics, job.start, poses, frame=job.frame)
        return time_legs(legs, limits, speed=job.speed)
    waypoints = joint_path_through_poses(kinematics, job.start, poses, frame=job.frame)
    if len(poses) == 1:
        return plan_joint_move(job.start, waypoints[-1], limits, speed=job.speed)
    return time_path(JointSpline(np.array(waypoints), limits), limits, speed=job.speed)
