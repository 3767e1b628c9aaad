"""Making of plans that are looked at before they are executed: samples, certificate and facts.

Owns what is told of a plan beside its samples, how long a plan may be, and how often a search tells
how far it has come. A motion to a goal is planned as any other; one around obstacles is searched in
the scene of the job, timed and certified likewise, and every plan is checked along its samples.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from openpendant.motion.description.limits import JointLimits, without_rounding
from openpendant.motion.errors import BadArgument, MotionError, NotTimeable
from openpendant.motion.frames.frame_tree import BASE
from openpendant.motion.kinematics.ik.ik import branch_of
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.planning.closest_approach import closest_approach
from openpendant.motion.planning.planner import (
    PlanningProgress,
    PlanningStage,
    free_joint_position,
    plan_free_path,
)
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import Scene
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import Certificate, certify
from openpendant.motion.trajectory.trajectory import MAX_DURATION, Trajectory, join
from openpendant.simplemsg.pendant import Motion
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal, refusal_of
from ..jobs import (
    FreePath,
    JointPathJob,
    LeastClearance,
    PlanAnswer,
    PlanFacts,
    PlanJob,
    PoseGoal,
    PoseJob,
    SearchProgress,
    SearchStage,
    WorstRatio,
)
from .block_planning import collision_model, collision_on
from .motion_planning import planned_motion, speed_caps

LONGEST = 120.0
"""Longest plan [s]."""

MOST_SAMPLES = 12_000
"""Samples of a plan at most."""

LARGEST_COORDINATE = 1e3
"""No tool is asked to go farther from its frame [m]; keeps overflow out of the planner."""

NORM_TOLERANCE = 1e-3
"""How far the length of a quaternion may be from 1, which it is then given."""

_TOLD_EVERY = 0.2
"""Time between two words of a search, so that there are at most five a second [s]."""

Tell: TypeAlias = Callable[[PlanAnswer], None]
"""Takes a word on a plan that is being made."""

_STAGES: Mapping[PlanningStage, SearchStage] = {
    PlanningStage.SEARCHING: SearchStage.SEARCHING,
    PlanningStage.SHORTENING: SearchStage.SHORTENING,
    PlanningStage.CHECKING: SearchStage.CHECKING,
}

_QUANTITIES = (
    "velocity",
    "acceleration",
    "mean_velocity",
    "mean_acceleration",
    "second_difference",
)
"""Quantities of a certificate that have a limit of their own."""


def make_plan(
    bare: Kinematics, tooled: Kinematics, job: PlanJob, tell: Tell
) -> tuple[tuple[Trajectory, Certificate], PlanFacts] | Refusal:
    """Return the samples of a plan with their certificate and what is told of them, or why not.

    Args:
        bare: kinematics of the robot, by which the scene is checked.
        tooled: the same with the selected tool.
    """
    try:
        made = _made(bare, tooled, job, tell)
    except NotTimeable as error:
        if error.lasts_too_long:
            return _refused_at_length(MAX_DURATION, "more than ")
        return refusal_of(error)
    except MotionError as error:
        return refusal_of(error)
    if isinstance(made, Refusal):
        return made
    trajectory, certificate = made
    too_long = _too_long(trajectory)
    if too_long is not None:
        return too_long
    return made, _facts(bare, tooled, job, trajectory, certificate)


def _made(
    bare: Kinematics, tooled: Kinematics, job: PlanJob, tell: Tell
) -> tuple[Trajectory, Certificate] | Refusal:
    motion = _placed(bare, job)
    if not isinstance(motion, FreePath):
        motion = _in_branch(tooled, motion, job.branch)
    least = _least_duration(tooled, motion)
    if least > LONGEST:
        # Found before a long path is timed, which takes seconds where it is slow.
        return _refused_at_length(least, "at least ")
    found: tuple[Trajectory, Certificate] | Refusal
    if isinstance(motion, FreePath):
        found = _searched(bare, tooled, job, motion, tell)
    else:
        found = planned_motion(tooled, motion)
    if isinstance(found, Refusal) or job.scene is None:
        return found
    return collision_on(bare, found[0].position, job.scene) or found


def _placed(kinematics: Kinematics, job: PlanJob) -> PoseJob | JointPathJob | FreePath:
    """Return the motion of a job with its poses in base.

    Raises:
        MotionError: a pose or a joint position is none.
    """
    motion = job.motion
    if isinstance(motion, JointPathJob):
        limits, reported = kinematics.limits, kinematics.limits.as_float32()
        for waypoint in motion.waypoints:
            limits.check_finite(waypoint, "the joint position")
        waypoints = tuple(without_rounding(each, limits, reported) for each in motion.waypoints)
        for waypoint in waypoints:
            limits.check_position(waypoint)
        return replace(motion, waypoints=waypoints)
    if isinstance(motion, PoseJob):
        goals = enumerate(motion.goals, start=1)
        return replace(
            motion, goals=tuple(_in_base(goal, at, job.place) for at, goal in goals), frame=BASE
        )
    if isinstance(motion.goal, PoseGoal):
        return replace(motion, goal=_in_base(motion.goal, 1, job.place))
    return motion


def _in_base(given: PoseGoal, number: int, place: PoseGoal | None) -> PoseGoal:
    """Return a pose of a frame in base.

    Raises:
        BadArgument: it lies too far away, or its quaternion has another length than 1.
    """
    farthest = max(given.position, key=abs)
    if abs(farthest) > LARGEST_COORDINATE:
        accepted = f"coordinates up to {LARGEST_COORDINATE:g} m"
        raise BadArgument(f"the farthest coordinate of pose {number}", farthest, accepted)
    norm = math.hypot(*given.orientation)
    if not abs(norm - 1.0) <= NORM_TOLERANCE:
        accepted = f"length 1 within {NORM_TOLERANCE:g}"
        raise BadArgument(f"quaternion of pose {number}", f"length {norm:g}", accepted)
    pose = Pose.from_values(given.position, given.orientation)
    if place is not None:
        pose = Pose.from_values(place.position, place.orientation).compose(pose)
    return PoseGoal(tuple(pose.position.tolist()), tuple(pose.quaternion.tolist()))


def _in_branch(
    kinematics: Kinematics, motion: PoseJob | JointPathJob, branch: int | None
) -> PoseJob | JointPathJob:
    """Return a motion to one pose as one to the joint position of a branch, where one is asked."""
    if branch is None or not isinstance(motion, PoseJob):
        return motion
    if motion.motion is not Motion.PTP or len(motion.goals) != 1:
        raise BadArgument("branch", branch, "a branch for a PTP motion to one pose")
    (goal,) = motion.goals
    pose = Pose.from_values(goal.position, goal.orientation)
    found = branch_of(kinematics, pose, motion.start, branch, frame=motion.frame)
    waypoint = tuple(found.joint_position.tolist())
    return JointPathJob(
        motion.job_id, motion.start, (waypoint,), motion.speed, motion.tool_speed, motion.tool
    )


def _searched(
    bare: Kinematics, tooled: Kinematics, job: PlanJob, motion: FreePath, tell: Tell
) -> tuple[Trajectory, Certificate]:
    """Search a way around obstacles, time and certify it.

    Raises:
        MotionError: there is none.
    """
    began = time.perf_counter()
    last_told = -_TOLD_EVERY

    def on_progress(progress: PlanningProgress) -> None:
        nonlocal last_told
        stage = _STAGES.get(progress.stage)
        passed = time.perf_counter() - began
        if stage is None or passed - last_told < _TOLD_EVERY:
            return
        last_told = passed
        fraction = min(passed / motion.time_limit, 1.0)
        tell(PlanAnswer(job.job_id, SearchProgress(stage, fraction), passed))

    # The tool is no body, so that the scene is that of the bare arm.
    collision = collision_model(bare, job.scene or Scene())
    goal = motion.goal
    if isinstance(goal, PoseGoal):
        goal = _free_goal(bare, tooled, job.scene or Scene(), goal, motion)
    path = plan_free_path(
        bare,
        collision,
        motion.start,
        goal,
        planner=motion.planner,
        seed=motion.seed,
        time_limit=motion.time_limit,
        margin=motion.margin,
        on_progress=on_progress,
        clock=time.perf_counter,
    )
    caps = speed_caps(tooled, motion.tool_speed)
    trajectory = time_path(path, bare.limits, speed=motion.speed, tool_speed=caps)
    return trajectory, certify(trajectory, bare.limits, start=motion.start, tool_speed=caps)


def _free_goal(
    bare: Kinematics, tooled: Kinematics, scene: Scene, goal: PoseGoal, motion: FreePath
) -> tuple[float, ...]:
    pose = Pose.from_values(goal.position, goal.orientation)
    model = collision_model(bare, scene)
    found = free_joint_position(
        model, pose, motion.start, random_seed=motion.seed, kinematics=tooled
    )
    return tuple(found.tolist())


def _least_duration(kinematics: Kinematics, motion: PoseJob | JointPathJob | FreePath) -> float:
    """Return a time that a motion takes in any case [s], which costs little to find.

    It is that of the joints that are known, at their greatest speeds, and of the straight way of
    the tool at its cap.
    """
    if isinstance(motion, FreePath):
        goals = [motion.goal]
    else:
        goals = list(motion.goals if isinstance(motion, PoseJob) else motion.waypoints)
    least, joints, tool = 0.0, motion.start, kinematics.forward(motion.start).position
    for goal in goals:
        if isinstance(goal, PoseGoal):
            place = np.array(goal.position)
        else:
            turned = zip(goal, joints, kinematics.limits.velocity, strict=True)
            least += max(abs(b - a) / (motion.speed * fastest) for b, a, fastest in turned)
            joints, place = goal, kinematics.forward(goal).position
        if motion.tool_speed is not None:
            least += float(np.linalg.norm(place - tool)) / motion.tool_speed
        tool = place
    return least


def _refused_at_length(duration: float, how: str) -> Refusal:
    text = f"the plan takes {how}{duration:.4g} s; accepted: {LONGEST:g} s"
    return Refusal(VerdictCode.PLAN_TOO_LONG, text, value=duration, limit=LONGEST)


def _too_long(trajectory: Trajectory) -> Refusal | None:
    duration, samples = trajectory.duration, len(trajectory)
    if duration <= LONGEST and samples <= MOST_SAMPLES:
        return None
    text = f"the plan takes {duration:.2f} s, {samples} samples; accepted: {LONGEST:g} s and"
    return Refusal(
        VerdictCode.PLAN_TOO_LONG, f"{text} {MOST_SAMPLES}", value=duration, limit=LONGEST
    )


def preview_of(
    walked: Sequence[Trajectory], limits: JointLimits
) -> tuple[Trajectory, Certificate] | None:
    """Return the motions of a program one behind the other; None where that makes no plan."""
    try:
        whole = join(walked)
        return None if _too_long(whole) else (whole, certify(whole, limits))
    except MotionError:
        # There are none, or one could not be planned and the walk went on behind it.
        return None


def _facts(
    bare: Kinematics,
    tooled: Kinematics,
    job: PlanJob,
    trajectory: Trajectory,
    certificate: Certificate,
) -> PlanFacts:
    motion = job.motion
    end = tooled.forward(trajectory.position[-1])
    return PlanFacts(
        motion.planner if isinstance(motion, FreePath) else _way_of(motion),
        motion.seed if isinstance(motion, FreePath) else 0,
        PoseGoal(tuple(end.position.tolist()), tuple(end.quaternion.tolist())),
        certificate.position_margin,
        worst_of(certificate),
        nearest_bodies(bare, trajectory, job.scene),
    )


def _way_of(motion: PoseJob | JointPathJob) -> str:
    return "lin" if isinstance(motion, PoseJob) and motion.motion is Motion.LIN else "ptp"


def worst_of(certificate: Certificate) -> tuple[WorstRatio, ...]:
    """Return the greatest value of each quantity that the samples were checked for."""
    extremes = [(name, getattr(certificate, name)) for name in _QUANTITIES]
    of_joints = [WorstRatio(each.joint, name, each.ratio, each.time) for name, each in extremes]
    of_points = [
        WorstRatio(each.point, "tool_speed", each.ratio, each.time)
        for each in certificate.tool_speed
    ]
    return (*of_joints, *of_points)


def nearest_bodies(
    bare: Kinematics, trajectory: Trajectory, scene: Scene | None
) -> LeastClearance | None:
    """Return where an object and another body come nearest; None where there is no object."""
    if scene is None:
        return None
    found = closest_approach(collision_model(bare, scene), trajectory.position)
    if found is None:
        return None
    at = float(trajectory.times[found.sample])
    return LeastClearance(found.distance, found.first, found.second, at)
