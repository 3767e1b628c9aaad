"""Kinematics report: forward kinematics, Jacobian and inverse kinematics as data.

Owns the names of the fields and the forms in which a pose, a Jacobian and an answer are told, on
the wire and by the command line alike: matrix, roll-pitch-yaw, rotation vector, order of rows.
Joints are counted from 0, controller side; SI units and radians; plain numbers that JSON can hold,
every bit of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from ..description.limits import JointLimits
from ..kinematics.ik.configuration import Configuration, configuration_of
from ..kinematics.ik.ik_choices import Choices, IkChoice
from ..kinematics.ik.singularity import dexterity
from ..kinematics.serial import Kinematics
from ..orientation import are_angles_unique, roll_pitch_yaw, vector_of_quaternion
from ..pose import Pose

_INFINITE = 1e9
"""A condition number from here on stands for infinity: sixteen digits tell no greater one."""

ORDER = "linear-first"
"""Rows of a Jacobian: vx, vy, vz, ωx, ωy, ωz."""


def pose_report(pose: Pose) -> dict[str, Any]:
    """Return a pose as position [m] and quaternion, 4 × 4 matrix, angles and rotation vector."""
    rotation = pose.rotation
    return {
        "position": pose.position.tolist(),
        "orientation": pose.quaternion.tolist(),
        "matrix": pose.to_matrix().tolist(),
        "rpy": roll_pitch_yaw(rotation).tolist(),
        "rpy_unique": are_angles_unique(rotation),
        "axis_angle": vector_of_quaternion(pose.quaternion).tolist(),
    }


def forward_report(
    kinematics: Kinematics,
    position: Sequence[float],
    frame: Pose | None = None,
    link: str | None = None,
) -> dict[str, Any]:
    """Return where the tool, or a link, is at a (n,) joint position, and how the arm stands.

    Args:
        frame: the frame that poses are wanted in, in base; None for base.

    Raises:
        FrameUnknown: there is no such link.
        WrongJointCount, NotFinite: not one finite value per driven joint.
    """
    pose = in_frame(kinematics.forward(position, link=link), frame)
    return {
        **pose_report(pose),
        "configuration": configuration_report(configuration_of(kinematics, position)),
        "limits": outside_report(kinematics.limits, position),
    }


def links_report(
    kinematics: Kinematics, position: Sequence[float], frame: Pose | None = None
) -> list[dict[str, Any]]:
    """Return where each link is, from the root to the tool."""
    told = []
    for link in kinematics.robot.links:
        pose = in_frame(kinematics.forward(position, link=link), frame)
        place = {"position": pose.position.tolist(), "orientation": pose.quaternion.tolist()}
        told.append({"link": link, **place})
    return told


def in_frame(pose: Pose, frame: Pose | None) -> Pose:
    """Return in a frame, itself given in base, a pose that is given in base."""
    return pose if frame is None else frame.inverse().compose(pose)


def outside_report(limits: JointLimits, position: Sequence[float]) -> list[dict[str, Any]]:
    """Return the joints of a (n,) position that are outside their limits [rad or m]."""
    rows = zip(position, limits.lower, limits.upper, strict=True)
    return [
        {"joint": joint, "value": value, "lower": lower, "upper": upper}
        for joint, (value, lower, upper) in enumerate(rows)
        if not lower <= value <= upper
    ]


def configuration_report(flags: Configuration | None) -> dict[str, Any] | None:
    """Return the flags of an arm; None where it has none."""
    if flags is None:
        return None
    return {
        "shoulder": flags.shoulder.value,
        "elbow": flags.elbow.value,
        "wrist": flags.wrist.value,
        "turns": None if flags.turns is None else list(flags.turns),
    }


def jacobian_report(
    kinematics: Kinematics, position: Sequence[float], frame: str = "base"
) -> dict[str, Any]:
    """Return the Jacobian of the tool centre point along the axes of `base` or `root`.

    Condition, manipulability and singularity are those of `singularity.dexterity`, so of the
    Jacobian whose lengths are divided by the arm's size, which is told too [m].

    Raises:
        MotionError: as of `Kinematics.jacobian`.
    """
    jacobian = kinematics.jacobian(position, frame)
    about = dexterity(kinematics, position)
    names = kinematics.limits.names
    return {
        "jacobian": jacobian.tolist(),
        "order": ORDER,
        "condition": about.condition if about.condition < _INFINITE else None,
        "manipulability": about.manipulability,
        "nearest_singularity": {
            "kind": about.kind.value,
            "distance": about.distance,
            "unit": about.unit,
            "joints": [names.index(name) for name in about.joints],
        },
        "size": kinematics.size,
    }


Touches = Callable[[Sequence[float]], tuple[str, str] | None]
"""Returns which two bodies touch at a (n,) joint position; None for none."""


def inverse_report(
    kinematics: Kinematics, found: Choices, touches: Touches | None = None
) -> dict[str, Any]:
    """Return the answers of inverse kinematics.

    Args:
        touches: looks for contacts at each; where left out, none are looked for.
    """
    return {
        "solutions": [_solution(kinematics, choice, touches) for choice in found.listed],
        "total": found.total,
        "complete": found.is_complete,
    }


def _solution(kinematics: Kinematics, choice: IkChoice, touches: Touches | None) -> dict[str, Any]:
    solution = choice.solution
    joints = solution.joint_position.tolist()
    contact = None if touches is None else touches(joints)
    return {
        "branch": choice.branch,
        "joints": joints,
        "configuration": configuration_report(solution.configuration),
        "distance": choice.distance,
        "position_error": solution.position_error,
        "rotation_error": solution.rotation_error,
        "nearest_limit": _nearest_limit(kinematics.limits, joints),
        "touches": None if contact is None else list(contact),
    }


def _nearest_limit(limits: JointLimits, position: Sequence[float]) -> dict[str, Any]:
    """Return the joint that is nearest to an end of its range, and how far from it [rad or m]."""
    rows = zip(position, limits.lower, limits.upper, strict=True)
    margins = [min(value - lower, upper - value) for value, lower, upper in rows]
    joint = min(range(len(margins)), key=margins.__getitem__)
    return {"joint": joint, "margin": max(margins[joint], 0.0) + 0.0}


def known_distance(error: float) -> float:
    """Return how far the nearest position stays from a pose [m]; 0 where that is not known."""
    return error if math.isfinite(error) else 0.0
