"""How far an arm reaches, by sampling: what a data sheet's figure can be compared with.

Owns the measure: the greatest distance of a point from where the axis of the first turning joint
stands when a rail under it is at its least position. Makers state it for the wrist's centre or for
the tool, so both are measured. The search is a random one with a fixed seed: a lower bound, right
to a few parts in a thousand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .kinematics import Array, Kinematics
from .pose import Pose
from .robot_schema import Joint

_SAMPLES = 300
_STEPS = 500
_FIRST_STEP = 0.3  # of each joint's range
_SHRINK = 0.985

_WRIST_AXES = 6  # arms of fewer turning joints have no wrist of their own


@dataclass(frozen=True, slots=True)
class Reach:
    """Greatest distances from the first turning axis [m]; `wrist` is None for arms without one."""

    tool: float
    wrist: float | None

    def nearest_to(self, stated: float) -> float:
        """Return the measure that differs least from a stated one [m]."""
        measures = [self.tool] if self.wrist is None else [self.tool, self.wrist]
        return min(measures, key=lambda each: abs(each - stated))


def reach(kinematics: Kinematics) -> Reach:
    """Search for a robot's reach inside its limits."""
    turning = [joint for joint in kinematics.robot.driven if not joint.prismatic]
    axis = _axis(kinematics, turning[0] if turning else kinematics.robot.moving[0])
    # The last two axes meet in the wrist's centre, which does not move with the last joint.
    wrist = turning[-2].child if len(turning) >= _WRIST_AXES else None
    return Reach(
        tool=_farthest(kinematics, axis, kinematics.robot.tool_link),
        wrist=None if wrist is None else _farthest(kinematics, axis, wrist),
    )


def _axis(kinematics: Kinematics, joint: Joint) -> tuple[Array, Array]:
    """Return a (3,) point on a joint's axis and its (3,) unit direction, in the root frame."""
    parent = kinematics.forward(kinematics.lower, "root", joint.parent)
    frame = parent.compose(Pose.from_rpy(joint.origin.xyz, joint.origin.rpy))
    direction = frame.rotation @ np.array(joint.axis)
    return frame.position, direction / np.linalg.norm(direction)


def _farthest(kinematics: Kinematics, axis: tuple[Array, Array], link: str) -> float:
    distance = _distance_from(kinematics, axis, link)
    random = np.random.default_rng(0)
    lower, upper = kinematics.lower, kinematics.upper
    best = max(random.uniform(lower, upper, (_SAMPLES, kinematics.dof)), key=distance)
    far, step = distance(best), _FIRST_STEP
    for _ in range(_STEPS):
        change = random.normal(0.0, step, kinematics.dof) * (upper - lower)
        trial = np.clip(best + change, lower, upper)
        if (length := distance(trial)) > far:
            best, far = trial, length
        else:
            step *= _SHRINK
    return far


def _distance_from(
    kinematics: Kinematics, axis: tuple[Array, Array], link: str
) -> Callable[[Array], float]:
    point, direction = axis

    def distance(joint_position: Array) -> float:
        offset = kinematics.forward(joint_position, "root", link).position - point
        return float(np.linalg.norm(offset - (offset @ direction) * direction))

    return distance
