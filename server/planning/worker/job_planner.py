"""Job planner: a certified trajectory or a refusal for each job, in a planning process.

Runs in a worker process and nowhere else, because inverse kinematics and TOPP-RA hold the
interpreter for milliseconds. Owns the planner of each kind of job; each answer passed the
certificate.

Owns the timing of a ROS-Industrial trajectory, never faster than it was asked: the approach to a
first point where the robot does not stand, and the rule of each segment.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache, lru_cache, partial

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import MotionError, NoMotion
from openpendant.motion.kinematics.serial import Kinematics, with_tool
from openpendant.motion.paths.segments import SegmentRule
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import Scene
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import Certificate, certify
from openpendant.motion.trajectory.joint_curves import COINCIDENT, JointSpline
from openpendant.motion.trajectory.trajectory import Trajectory, join

from ...programs.editing.program_tasks import perform
from ...refusal import Refusal, refusal_of
from ..jobs import (
    BlockJob,
    BodyRead,
    DryRunFound,
    DryRunJob,
    Job,
    JointPathJob,
    JointVector,
    KinematicsQuestion,
    PathFree,
    PlanAnswer,
    PlanJob,
    PlaybackPlan,
    PoseGoal,
    PoseJob,
    ProgramJob,
    ReadBody,
    RecordingJob,
    RosPathJob,
    RosPoint,
    ShapesQuestion,
    WayCheckJob,
)
from .block_planning import check_running, collision_on, plan_block_job
from .dry_run_planning import DryRuns, shortened
from .kinematics_answers import answer_kinematics
from .motion_planning import certified_motion, speed_caps
from .plan_making import Tell, make_plan, preview_of
from .recording_planning import RecordingUnplayable, plan_recording
from .shapes_answers import answer_shapes


def plan_ros_path(job: RosPathJob, limits: JointLimits) -> Trajectory:
    """Plan the motion that a ROS-I trajectory asks for.

    Returns:
        One trajectory from where the robot stands through all points: the approach to the first
        where it stands elsewhere, then the rest without a stop.

    Raises:
        NoMotion: the robot stands at the only point already.
        MotionError: the motion cannot be made.
    """
    first, *rest = job.points
    somewhere = [point for point in rest if not _coincide(point.position, first.position)]
    legs: list[Trajectory] = []
    start = job.start
    elsewhere = _distance(start, first.position) > job.approach_tolerance
    if elsewhere or not (somewhere or _coincide(start, first.position)):
        speed = min(job.approach_speed, first.speed_fraction)
        legs.append(_follow(start, [replace(first, speed_fraction=speed)], limits))
        start = first.position
    if somewhere:
        legs.append(_follow(start, rest, limits))
    if not legs:
        raise NoMotion
    return join(legs)


def _distance(one: JointVector, other: JointVector) -> float:
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


def _coincide(one: JointVector, other: JointVector) -> bool:
    return _distance(one, other) < COINCIDENT


def _follow(start: JointVector, points: Sequence[RosPoint], limits: JointLimits) -> Trajectory:
    """Run through points without a stop; a point that comes twice makes its way take longer."""
    path = JointSpline([start, *(point.position for point in points)], limits)
    rules = [SegmentRule(point.min_duration, point.speed_fraction) for point in points]
    return time_path(path, limits, segments=rules)


_SLICE = 0.2
"""Longest time that a slice of a dry run holds up the next job, besides one plan [s]."""

_dry_runs = DryRuns()


@cache
def kinematics_of(robot: str) -> Kinematics:
    """Return the kinematics of a robot; built once in each process."""
    return Kinematics(serial_robot(robot))


@lru_cache(maxsize=16)
def _tooled(robot: str, tool: PoseGoal | None) -> Kinematics:
    """Return the kinematics of a robot whose tool link is a tool centre point."""
    if tool is None:
        return kinematics_of(robot)
    tcp = Pose.from_values(tool.position, tool.orientation)
    return Kinematics(with_tool(serial_robot(robot), tcp))


def _say_nothing(word: PlanAnswer) -> None:
    """Take a word on a plan that nobody wants to hear."""


def answer(robot: str, job: Job, tell: Tell = _say_nothing) -> PlanAnswer:
    """Plan a job and certify the result.

    Args:
        tell: is told now and then how far a long search has come.

    Returns:
        The trajectory with its certificate, or the refusal; never raises for a motion that cannot
        be made.
    """
    started = time.perf_counter()
    if isinstance(job, ProgramJob):
        return PlanAnswer(job.job_id, perform(job.task), time.perf_counter() - started)
    if isinstance(job, ReadBody):
        read = BodyRead(*job.read(job.body))
        return PlanAnswer(job.job_id, read, time.perf_counter() - started)
    if isinstance(job, ShapesQuestion):
        shown = answer_shapes(robot, job.asked)
        return PlanAnswer(job.job_id, shown, time.perf_counter() - started)
    kinematics = kinematics_of(robot)
    if isinstance(job, KinematicsQuestion):
        told = answer_kinematics(kinematics, partial(_tooled, robot), job)
        return PlanAnswer(job.job_id, told, time.perf_counter() - started)
    if isinstance(job, DryRunJob):
        walked: list[Trajectory] = []
        found = _dry_runs.slice(
            kinematics, job, lambda: time.perf_counter() - started > _SLICE, walked
        )
        preview = None
        if isinstance(found, DryRunFound):
            found = shortened(found)
            preview = preview_of(walked, kinematics.limits) if job.samples else None
        return PlanAnswer(job.job_id, found, time.perf_counter() - started, preview=preview)
    if isinstance(job, WayCheckJob):
        return PlanAnswer(job.job_id, _looked(kinematics, job), time.perf_counter() - started)
    if isinstance(job, PlanJob):
        return _made(robot, kinematics, job, tell, started)
    playback: PlaybackPlan | None = None
    if isinstance(job, RecordingJob):
        result, playback = _played_back(_tooled(robot, job.tool), job)
    elif isinstance(job, PoseJob | JointPathJob):
        result = _certified(_tooled(robot, job.tool), job)
    else:
        result = _certified(kinematics, job)
    if isinstance(result, tuple) and job.scene is not None:
        result = _free(kinematics, result, job.scene)
    return PlanAnswer(job.job_id, result, time.perf_counter() - started, playback)


def _made(
    robot: str, kinematics: Kinematics, job: PlanJob, tell: Tell, started: float
) -> PlanAnswer:
    made = make_plan(kinematics, _tooled(robot, job.motion.tool), job, tell)
    passed = time.perf_counter() - started
    if isinstance(made, Refusal):
        return PlanAnswer(job.job_id, made, passed)
    certified, facts = made
    return PlanAnswer(job.job_id, certified, passed, facts=facts)


def _free(
    kinematics: Kinematics, certified: tuple[Trajectory, Certificate], scene: Scene
) -> tuple[Trajectory, Certificate] | Refusal:
    """Return a certified motion, or why it may not be made in a scene."""
    try:
        refusal = collision_on(kinematics, certified[0].position, scene)
    except MotionError as error:
        refusal = refusal_of(error)
    return refusal or certified


def _looked(kinematics: Kinematics, job: WayCheckJob) -> Refusal | PathFree:
    try:
        return check_running(kinematics, job)
    except MotionError as error:
        return refusal_of(error)


def _played_back(
    kinematics: Kinematics, job: RecordingJob
) -> tuple[tuple[Trajectory, Certificate] | Refusal, PlaybackPlan | None]:
    caps = speed_caps(kinematics, job.tool_speed)
    try:
        trajectory, account = plan_recording(kinematics, job, caps)
        certificate = certify(trajectory, kinematics.limits, start=job.start, tool_speed=caps)
    except RecordingUnplayable as unplayable:
        return unplayable.refusal, None
    except MotionError as error:
        return refusal_of(error), None
    return (trajectory, certificate), account


def _certified(
    kinematics: Kinematics, job: PoseJob | JointPathJob | RosPathJob | BlockJob
) -> tuple[Trajectory, Certificate] | Refusal:
    if isinstance(job, BlockJob):
        return plan_block_job(kinematics, job)
    if not isinstance(job, RosPathJob):
        return certified_motion(kinematics, job)
    try:
        trajectory = plan_ros_path(job, kinematics.limits)
        return trajectory, certify(trajectory, kinematics.limits, start=job.start)
    except MotionError as error:
        return refusal_of(error)


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
