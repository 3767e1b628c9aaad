"""Kinematics answers: what a pendant asks of the kinematics of its robot, answered.

Runs in the process for questions and nowhere else, because inverse kinematics holds the interpreter
for milliseconds. Owns what a question's frame, tool and link mean here, and the bytes of the reply;
`robot_report.kinematics_report` owns its fields.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from openpendant.motion.errors import BadArgument, MotionError, PoseUnreachable
from openpendant.motion.frames.frame_tree import BASE, FLANGE, ROOT
from openpendant.motion.kinematics.ik.ik_choices import WantedBranches, choices
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.robot_report.kinematics_report import (
    forward_report,
    inverse_report,
    jacobian_report,
    known_distance,
    links_report,
)
from openpendant.simplemsg.pendant.management.kinematics import (
    ForwardKinematics,
    InverseKinematics,
    ToolJacobian,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal, refusal_of
from ..jobs import KinematicsFound, KinematicsQuestion, PoseGoal
from .block_planning import collision_model

WithTool: TypeAlias = Callable[[PoseGoal | None], Kinematics]
"""Returns the kinematics of the robot with a tool's centre point, None for the flange."""

_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)


def answer_kinematics(
    kinematics: Kinematics, with_tool: WithTool, job: KinematicsQuestion
) -> KinematicsFound | Refusal:
    """Answer a question, or say why there is no answer."""
    try:
        told = _told(kinematics, with_tool, job)
    except PoseUnreachable as error:
        # Not the worse of both errors, as elsewhere: a page shows how far the pose is out of reach.
        missing = known_distance(error.best_position_error)
        return Refusal(VerdictCode.UNREACHABLE, str(error), value=missing)
    except MotionError as error:
        return refusal_of(error)
    return KinematicsFound(json.dumps(told, ensure_ascii=False, separators=(",", ":")))


def _told(kinematics: Kinematics, with_tool: WithTool, job: KinematicsQuestion) -> dict[str, Any]:
    asked, tooled = job.asked, with_tool(_tool(job))
    match asked:
        case ToolJacobian():
            return jacobian_report(tooled, job.start, asked.frame)
        case ForwardKinematics():
            frame = _frame(kinematics, job, asked.frame)
            # A tool hangs from the last link; the others are the same with and without it.
            arm = tooled if asked.link is None else kinematics
            told = forward_report(arm, job.start, frame, asked.link)
            if asked.all_links:
                told["links"] = links_report(kinematics, job.start, frame)
            return told
        case InverseKinematics():
            return _inverse(kinematics, tooled, job, asked)


def _inverse(
    kinematics: Kinematics, tooled: Kinematics, job: KinematicsQuestion, asked: InverseKinematics
) -> dict[str, Any]:
    orientation = asked.pose.get("orientation", _NO_ROTATION)
    target = Pose.from_values(asked.pose["position"], orientation)
    frame = _frame(kinematics, job, asked.frame)
    if frame is not None:
        target = frame.compose(target)
    found = choices(tooled, target, job.start, WantedBranches(asked.branches))
    if job.scene is None:
        return inverse_report(tooled, found)
    # Of the bare arm: a tool has no shape, and what is attached is in the scene.
    model = collision_model(kinematics, job.scene)

    def touches(position: Sequence[float]) -> tuple[str, str] | None:
        nearest = model.distance(position)
        return (nearest.first, nearest.second) if nearest and nearest.touching else None

    return inverse_report(tooled, found, touches)


def _frame(kinematics: Kinematics, job: KinematicsQuestion, name: str) -> Pose | None:
    """Return a frame in base; None for base itself.

    Raises:
        FrameUnknown: there is no such frame.
        BadArgument: the frame moves.
    """
    if name == BASE:
        return None
    if name == ROOT:
        return kinematics.to_base(Pose.identity(), ROOT)
    assert job.frames is not None
    return job.frames.standing_in_base(name)


def _tool(job: KinematicsQuestion) -> PoseGoal | None:
    """Return the centre point in the flange of the tool that a question is about.

    Raises:
        FrameUnknown: there is no such tool.
        BadArgument: it is a frame that is no tool.
    """
    name = job.asked.tool
    if name is None:
        return job.tool
    if name == FLANGE:
        return None
    assert job.frames is not None
    frame = job.frames[name]
    if frame.parent != FLANGE or frame.pose is None:
        raise BadArgument("tool", name, "a tool, or flange")
    position, orientation = frame.pose.position.tolist(), frame.pose.quaternion.tolist()
    return PoseGoal(tuple(position), tuple(orientation))
