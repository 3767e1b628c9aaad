"""Motions as a list of segments: PTP, LIN, CIRC and spline, with frames and zones.

Owns the plain data of a segment. Knows no robot, no path and no time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from .circles import ToolTurn
from .pose import Pose
from .trajectory import Array

Target: TypeAlias = Pose | Sequence[float] | Array
"""A tool pose in the segment's frame, or a controller-side joint position (n,) [rad or m]."""

Point: TypeAlias = Sequence[float] | Array
"""(3,) coordinates in the segment's frame [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Ptp:
    """All joints straight to the target.

    Where a PTP meets a LIN or CIRC in a zone, either way round, the corner is rounded in joint
    space: the tool is on its line or circle outside the zone only.

    Attributes:
        target: where to.
        frame: `base` or `root`, the frame of a target that is a pose.
        zone: distance from the target, in joint space, at which to turn towards the next one [rad];
            0 for a stop there.
    """

    target: Target
    frame: str = "base"
    zone: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Lin:
    """The tool straight to the target, turning evenly.

    Attributes:
        target: where to; of a joint position the tool's place counts.
        frame: `base` or `root`, the frame of a target that is a pose.
        zone: distance from the target at which to turn towards the next one [m]; 0 for a stop.
    """

    target: Target
    frame: str = "base"
    zone: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class ThroughPoint:
    """The arc through a point to the target; the point's orientation is not asked for."""

    via: Point


@dataclass(frozen=True, slots=True, eq=False)
class AboutCentre:
    """The arc about a centre to the target; see `circles.arc_about`."""

    centre: Point
    normal: Point | None = None
    more_than_half: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class FullThroughPoints:
    """The full circle through two points, back to the start."""

    via: Point
    second_via: Point


@dataclass(frozen=True, slots=True, eq=False)
class FullAboutCentre:
    """The full circle about a centre, counter-clockwise about a normal."""

    centre: Point
    normal: Point


CircleWay: TypeAlias = ThroughPoint | AboutCentre | FullThroughPoints | FullAboutCentre


@dataclass(frozen=True, slots=True, eq=False)
class Circ:
    """The tool along a circle.

    Attributes:
        way: which circle.
        target: where an arc ends; None for a full circle, which ends where it began.
        turn: how the tool turns; the target's orientation is met by an even turn only.
        frame: `base` or `root`, the frame of the way's points and of a target that is a pose.
        zone: distance from the end at which to turn towards the next target [m]; 0 for a stop.
    """

    way: CircleWay
    target: Target | None = None
    turn: ToolTurn = ToolTurn.EVEN
    frame: str = "base"
    zone: float = 0.0


class SplineSpace(Enum):
    """Where a spline is smooth."""

    JOINTS = "joints"
    TOOL = "tool"


@dataclass(frozen=True, slots=True, eq=False)
class Spline:
    """A smooth curve through targets; it swings beyond the straight lines between them.

    Attributes:
        targets: where through and where to.
        space: whether the joints follow the curve, or the tool.
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
