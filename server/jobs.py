"""Questions to the planning process, and its answers; plain data that can be pickled."""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.motion.certificate import Certificate
from openpendant.motion.trajectory import Trajectory
from openpendant.simplemsg.pendant import Motion

from .refusal import Refusal

JointVector = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PoseGoal:
    """A tool pose to reach.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w; normalised by the planner.
    """

    position: tuple[float, ...]
    orientation: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PoseJob:
    """Move the tool through one pose or several.

    Attributes:
        job_id: number of the job.
        start: (n,) where the robot stands, controller side [rad or m].
        goals: the poses in order.
        frame: name of their frame.
        motion: PTP passes them in joint space without stopping, LIN stops at each.
        speed: fraction of the joints' speed limits.
    """

    job_id: int
    start: JointVector
    goals: tuple[PoseGoal, ...]
    frame: str
    motion: Motion
    speed: float


@dataclass(frozen=True, slots=True)
class JointPathJob:
    """Move through joint positions without stopping.

    Attributes:
        job_id: number of the job.
        start: (n,) where the robot stands, controller side [rad or m].
        waypoints: (n,) each, start excluded.
        speed: fraction of the joints' speed limits.
    """

    job_id: int
    start: JointVector
    waypoints: tuple[JointVector, ...]
    speed: float


@dataclass(frozen=True, slots=True)
class RosPoint:
    """One point of a ROS-Industrial trajectory.

    Attributes:
        position: (n,) controller side [rad or m].
        min_duration: least time of the segment that ends here [s]; None where it was not given.
        speed_fraction: largest fraction of the joints' speed limits on that segment.
    """

    position: JointVector
    min_duration: float | None
    speed_fraction: float


@dataclass(frozen=True, slots=True)
class RosPathJob:
    """Follow a ROS-Industrial trajectory, never faster than it was asked.

    Attributes:
        job_id: number of the job.
        start: (n,) where the robot stands, controller side [rad or m].
        points: the points in order.
        approach_speed: fraction of the speed limits for getting to a first point elsewhere.
        approach_tolerance: a first point closer than this to where it stands needs no approach.
    """

    job_id: int
    start: JointVector
    points: tuple[RosPoint, ...]
    approach_speed: float
    approach_tolerance: float


Job = PoseJob | JointPathJob | RosPathJob


@dataclass(frozen=True, slots=True)
class Planned:
    """The answer to a job.

    Attributes:
        job_id: number of the job.
        result: a trajectory with its certificate, or why there is none.
        plan_time: wall time that planning took [s].
    """

    job_id: int
    result: tuple[Trajectory, Certificate] | Refusal
    plan_time: float
