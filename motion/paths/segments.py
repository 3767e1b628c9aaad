"""Segments of a motion as plain data: PTP, LIN, CIRC and spline, with frames, zones and rules.

Owns the fields of a segment, and the rule that a user may set for the path from one waypoint to the
next: its least duration and its greatest speed. Owns the accepted values of a rule and its
translation from waypoints to the knots of a path, where waypoints that coincide share one. Knows no
robot, no limits, and not how a path is timed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import TypeAlias

from ..errors import BadArgument
from ..pose import Array, Pose
from ..trajectory.joint_curves import Path
from ..trajectory.trajectory import MAX_DURATION
from .tool_curves import ToolTurn

Target: TypeAlias = Pose | Sequence[float] | Array
"""A tool pose in the segment's frame, or a controller-side joint position (n,) [rad or m]."""

Point: TypeAlias = Sequence[float] | Array
"""(3,) coordinates in the segment's frame [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Ptp:
    """Straight motion of all joints to the target.

    Where a PTP meets a LIN or CIRC in a zone, in either order, the corner is rounded in joint
    space: the tool is on its line or circle outside the zone only.

    Attributes:
        target: pose or joint position at the end.
        frame: `base` or `root`, the frame of a target that is a pose.
        zone: distance from the target, in joint space, at which the next segment may begin [rad];
            0 for a stop there.
    """

    target: Target
    frame: str = "base"
    zone: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Lin:
    """Straight motion of the tool to the target, with an even rotation.

    Attributes:
        target: pose at the end; of a joint position, the tool's pose there.
        frame: `base` or `root`, the frame of a target that is a pose.
        zone: distance from the target at which the next segment may begin [m]; 0 for a stop.
    """

    target: Target
    frame: str = "base"
    zone: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class ThroughPoint:
    """Arc through a point to the target; the point's orientation is not used."""

    via: Point


@dataclass(frozen=True, slots=True, eq=False)
class AboutCentre:
    """Arc about a centre to the target; see `tool_curves.arc_about`."""

    centre: Point
    normal: Point | None = None
    more_than_half: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class FullThroughPoints:
    """Full circle through two points, back to the start."""

    via: Point
    second_via: Point


@dataclass(frozen=True, slots=True, eq=False)
class FullAboutCentre:
    """Full circle about a centre, counter-clockwise about a normal."""

    centre: Point
    normal: Point


CircleWay: TypeAlias = ThroughPoint | AboutCentre | FullThroughPoints | FullAboutCentre


@dataclass(frozen=True, slots=True, eq=False)
class Circ:
    """Motion of the tool along a circle.

    Attributes:
        target: end of an arc; None for a full circle, which ends where it began.
        turn: rotation of the tool; only an even rotation reaches the target's orientation.
        frame: `base` or `root`, the frame of the circle's points and of a target that is a pose.
        zone: distance from the end at which the next segment may begin [m]; 0 for a stop.
    """

    way: CircleWay
    target: Target | None = None
    turn: ToolTurn = ToolTurn.EVEN
    frame: str = "base"
    zone: float = 0.0


class SplineSpace(Enum):
    """Space in which a spline is smooth."""

    JOINTS = "joints"
    TOOL = "tool"


@dataclass(frozen=True, slots=True, eq=False)
class Spline:
    """Smooth curve through targets; it swings beyond the straight lines between them.

    Attributes:
        targets: points of the curve, the last its end.
        space: the space in which the curve is smooth.
        frame: `base` or `root`, the frame of targets that are poses.
    """

    targets: Sequence[Target]
    space: SplineSpace = SplineSpace.JOINTS
    frame: str = "base"

    @property
    def zone(self) -> float:
        """0: the motion stops at the end of a spline."""
        return 0.0


Segment: TypeAlias = Ptp | Lin | Circ | Spline


@dataclass(frozen=True, slots=True)
class SegmentRule:
    """Rule for the path from one waypoint to the next.

    Attributes:
        min_duration: least duration of that part [s].
        speed_fraction: greatest fraction of a joint's velocity limit there, 0 to 1.
    """

    min_duration: float | None = None
    speed_fraction: float | None = None


@dataclass(frozen=True, slots=True)
class RuleSpan:
    """Rule for the path between two knots.

    Attributes:
        first: index of the knot where it begins.
        last: index of the knot where it ends, greater than `first`.
        min_duration: least duration of the part in between [s].
        speed_fraction: of the velocity limits, above 0 and at most 1.
    """

    first: int
    last: int
    min_duration: float
    speed_fraction: float


def folded(path: Path, segments: Sequence[SegmentRule] | None) -> list[RuleSpan]:
    """Return the rules by knots; rules of parts without length go to the next part that has one.

    Args:
        path: the path whose waypoints the rules lie between.
        segments: one rule for the part up to each waypoint after the first, or none at all.

    Raises:
        BadArgument: the number of rules, or a value in one.
    """
    if segments is None:
        return []
    places = path.waypoint_knots.tolist()
    if len(segments) != len(places) - 1:
        raise BadArgument("segments", len(segments), f"{len(places) - 1} rules, one for each way")
    stretches: list[RuleSpan] = []
    waiting = 0.0
    for rule, first, last in zip(segments, places, places[1:], strict=False):
        duration, fraction = _checked(rule)
        waiting += duration
        if first < last:
            stretches.append(RuleSpan(first, last, waiting, fraction))
            waiting = 0.0
    if waiting:
        end = stretches.pop()
        stretches.append(replace(end, min_duration=end.min_duration + waiting))
    return stretches


def _checked(rule: SegmentRule) -> tuple[float, float]:
    duration = 0.0 if rule.min_duration is None else rule.min_duration
    fraction = 1.0 if rule.speed_fraction is None else rule.speed_fraction
    if not 0.0 <= duration <= MAX_DURATION:
        raise BadArgument("min_duration", duration, f"0 to {MAX_DURATION:g} s")
    if not 0.0 < fraction <= 1.0:
        raise BadArgument("speed_fraction", fraction, "more than 0 and at most 1")
    return duration, fraction
