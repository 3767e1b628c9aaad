"""Segment curves: the tool curve of a LIN, CIRC or spline segment.

Owns the step from a segment's targets and points, in its own frame, to a curve in the base frame.
Knows no joints but those of a target, and no time.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import BadArgument
from ..pose import Array, Pose
from .circles import (
    ToolArc,
    arc_about,
    arc_through,
    circle_about,
    circle_through,
)
from .segments import (
    AboutCentre,
    Circ,
    FullAboutCentre,
    FullThroughPoints,
    Lin,
    Point,
    Spline,
    Target,
    ThroughPoint,
)
from .tool_curves import ToolCurve, ToolLine, ToolSpline, check_point
from .tool_kinematics import ToolKinematics


def leg_curve(kinematics: ToolKinematics, start: Pose, segment: Lin | Circ) -> ToolCurve:
    """Return the tool's path along a line or a circle, in the base frame.

    Args:
        kinematics: the robot.
        start: present pose of the tool, in the base frame.
        segment: the line or circle; its zone is not used.

    Raises:
        NoMotion: the tool is there already.
        MotionError: the target, or as of `circle_curve`.
    """
    match segment:
        case Circ():
            return circle_curve(kinematics, start, segment)
        case Lin(target, frame):
            return ToolLine(start, pose_of(kinematics, target, frame))


def spline_curve(kinematics: ToolKinematics, start: Pose, spline: Spline) -> ToolSpline:
    """Return the tool's path through the targets of a spline, in the base frame."""
    through = [pose_of(kinematics, target, spline.frame) for target in spline.targets]
    return ToolSpline([start, *through])


def circle_curve(kinematics: ToolKinematics, start: Pose, circ: Circ) -> ToolArc:
    """Return the tool's path along a circle, in the base frame.

    Args:
        kinematics: the robot.
        start: present pose of the tool, in the base frame.
        circ: the circle; its zone is not used.

    Raises:
        BadCircle: its points determine no circle.
        BadArgument: an arc without a target, or a full circle with one.
        NotFinite: a coordinate is infinite or not a number.
        FrameUnknown: there is no such frame.
    """
    frame = kinematics.to_base(Pose.identity(), circ.frame)

    def in_base(point: Point, what: str) -> Array:
        moved: Array = frame.position + frame.rotation @ check_point(point, what)
        return moved

    if isinstance(circ.way, FullThroughPoints | FullAboutCentre):
        if circ.target is not None:
            raise BadArgument("target", circ.target, "none: a full circle ends where it began")
        target = start
    elif circ.target is None:
        raise BadArgument("target", None, "where the arc ends")
    else:
        target = pose_of(kinematics, circ.target, circ.frame)
    match circ.way:
        case ThroughPoint(via):
            circle = arc_through(start.position, in_base(via, "the via point"), target.position)
        case FullThroughPoints(via, second_via):
            circle = circle_through(
                start.position,
                in_base(via, "the via point"),
                in_base(second_via, "the second via point"),
            )
        case AboutCentre(centre, normal, more_than_half):
            circle = arc_about(
                start.position,
                in_base(centre, "the centre"),
                target.position,
                normal=None
                if normal is None
                else frame.rotation @ check_point(normal, "the normal"),
                more_than_half=more_than_half,
            )
        case FullAboutCentre(centre, normal):
            axis = frame.rotation @ check_point(normal, "the normal")
            circle = circle_about(start.position, in_base(centre, "the centre"), axis)
    return ToolArc(circle, start, target, circ.turn)


def pose_of(kinematics: ToolKinematics, target: Target, frame: str) -> Pose:
    """Return a target's pose in the base frame.

    Raises:
        OutOfRange: the target is a joint position outside its range.
        MotionError: it is malformed, or of no pose.
    """
    if isinstance(target, Pose):
        return kinematics.to_base(target, frame)
    kinematics.limits.check_position(numbers(target))
    return kinematics.forward(target)


def numbers(target: Sequence[float] | Array) -> list[float]:
    """Return a joint position as plain numbers."""
    return [float(value) for value in target]
