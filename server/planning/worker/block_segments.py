"""Block segments: the segments for `motion` of a block of a program's moves.

Owns which of a point's two descriptions is used: a point of the robot's own frames goes to its
joints, which also give the arm's configuration; a point of a user's frame goes to its pose, because
the frame may have moved since. A via point's pose, else the place of its joints, gives a circle.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from openpendant.motion.paths.segments import (
    Circ,
    Lin,
    Ptp,
    Segment,
    Spline,
    SplineSpace,
    Target,
    ThroughPoint,
)
from openpendant.motion.pose import Pose

from ...programs.interpreter.motion_blocks import BlockMove, MotionBlock
from ...programs.language.points import JointVector, PointPose, TeachPoint
from ...programs.language.statements import Way

OWN_FRAMES = frozenset({"base", "root"})
"""Frames of the robot, which never move."""

ToBase: TypeAlias = Callable[[PointPose], Pose]
"""Returns the pose of the planner's tool in the base frame for a pose of a tool in a frame."""

Forward: TypeAlias = Callable[[JointVector], Pose]
"""Returns the pose of the planner's tool in the base frame for a joint position."""


def segments_of(block: MotionBlock, to_base: ToBase, forward: Forward) -> list[Segment]:
    """Return the segments of a block, one for each move.

    Args:
        block: the moves; their speeds are not in the segments.

    Raises:
        MotionError: a frame or a tool is unknown.
    """
    return [_segment(move, to_base, forward) for move in block.moves]


def _segment(each: BlockMove, to_base: ToBase, forward: Forward) -> Segment:
    target, zone = _target(each.target, to_base), each.move.zone
    match each.move.way:
        case Way.PTP:
            return Ptp(target, zone=zone)
        case Way.LIN:
            return Lin(target, zone=zone)
        case Way.CIRC:
            via = _target(each.via[0], to_base)
            pose = via if isinstance(via, Pose) else forward(each.via[0].joints)
            return Circ(ThroughPoint(pose.position), target, zone=zone)
        case Way.SPLINE:
            through = [_target(point, to_base) for point in each.via]
            return Spline([*through, target], SplineSpace.JOINTS)


def _target(point: TeachPoint, to_base: ToBase) -> Target:
    if point.pose is None or point.pose.frame in OWN_FRAMES:
        return point.joints
    return to_base(point.pose)
