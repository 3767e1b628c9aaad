"""From a list of segments to the paths that run them.

Owns which segments are run without a stop (those joined by zones are one path, any other ends one),
and which curve each is. Knows no timing. The server's event loop imports this module, so inverse
kinematics is imported only by the function that searches.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from .circles import (
    ToolArc,
    arc_about,
    arc_through,
    circle_about,
    circle_through,
)
from .errors import (
    BadArgument,
    BranchChange,
    MotionError,
    NoMotion,
    NotFinite,
    OutOfRange,
    SegmentRefused,
    Unreachable,
    ZoneTooLarge,
)
from .joint_curves import JointLine, JointSpline, Path, settle_start
from .pose import Pose
from .segments import (
    AboutCentre,
    Circ,
    FullAboutCentre,
    FullThroughPoints,
    Lin,
    Point,
    Ptp,
    Segment,
    Spline,
    SplineSpace,
    Target,
    ThroughPoint,
)
from .tool_chain import ToolChain
from .tool_curves import ToolCurve, ToolLine, ToolSpline, check_point
from .tool_paths import follow_tool_curve
from .trajectory import Array
from .zones import LEAST_ZONE, JointPolyline

if TYPE_CHECKING:
    from .kinematics import Kinematics

MOST_SEGMENTS = 10_000
"""Longest list that is planned at once."""


def plan_path(
    kinematics: Kinematics, start: Sequence[float] | Array, segments: Sequence[Segment]
) -> list[Path]:
    """Return the joint paths that run segments in turn, with a stop between each two paths.

    Segments with zones between them are one path. A segment to where the robot stands already adds
    none. Every tool segment is solved as a whole before any motion.

    Args:
        kinematics: the robot.
        start: (n,) where the robot stands; see `settle_start`.
        segments: at least one and at most `MOST_SEGMENTS`.

    Raises:
        SegmentRefused: a segment, with its number and the reason; a fraction in it is that of the
            segment.
        ZoneTooLarge: a zone does not fit, or nothing follows that it could turn towards; the
            waypoint is the number of the segment that it ends.
        NoMotion: no segment moves the robot.
        OutOfRange: the start is outside a joint's range.
        WrongJointCount: the start does not have one value per joint.
        NotFinite: the start holds an infinity or a NaN.
        BadArgument: there are no segments, or too many.
    """
    if not 1 <= len(segments) <= MOST_SEGMENTS:
        raise BadArgument("segments", len(segments), f"1 to {MOST_SEGMENTS}")
    here = np.array(settle_start(start, kinematics.limits))
    paths: list[Path] = []
    for first, run in _runs(segments, "rad or m" if any(kinematics.limits.prismatic) else "rad"):
        try:
            path = _RunPlanner(kinematics, here, first).plan(run)
        except NoMotion:
            continue
        paths.append(path)
        here = path.evaluate(np.array([path.length]))[0]
    if not paths:
        raise NoMotion
    return paths


def circle_curve(kinematics: Kinematics, start: Pose, circ: Circ) -> ToolArc:
    """Return the tool's way along a circle, in the base frame.

    Args:
        kinematics: the robot.
        start: where the tool is, in the base frame.
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
        target = _pose_of(kinematics, circ.target, circ.frame)
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


def _runs(segments: Sequence[Segment], joint_unit: str) -> list[tuple[int, list[Segment]]]:
    """Return the segments that are run without a stop, each run with the number of its first."""
    runs: list[tuple[int, list[Segment]]] = []
    joined = False
    for number, segment in enumerate(segments):
        _check_zone(number, segment.zone)
        if joined:
            runs[-1][1].append(segment)
        else:
            runs.append((number, [segment]))
        joined = segment.zone > 0.0
        if not joined:
            continue
        unit = joint_unit if isinstance(segment, Ptp) else "m"
        if number + 1 == len(segments):
            reason = "it is the end of the motion"
            raise ZoneTooLarge(number, segment.zone, 0.0, unit, reason)
        if _space(segment) is not _space(segments[number + 1]):
            reason = "a zone joins PTP with PTP, or LIN and CIRC with LIN and CIRC"
            raise ZoneTooLarge(number, segment.zone, 0.0, unit, reason)
    return runs


def _check_zone(number: int, zone: float) -> None:
    if not math.isfinite(zone):
        raise SegmentRefused(number, NotFinite("the zone", 0))
    if zone != 0.0 and zone < LEAST_ZONE:
        accepted = f"0 for a stop, or {LEAST_ZONE:g} and more"
        raise SegmentRefused(number, BadArgument("zone", zone, accepted))


def _space(segment: Segment) -> type[Ptp | Lin | Spline]:
    match segment:
        case Ptp():
            return Ptp
        case Lin() | Circ():
            return Lin
        case Spline():
            return Spline


class _RunPlanner:
    """The path of one run, from where the robot stands."""

    def __init__(self, kinematics: Kinematics, here: Array, first: int) -> None:
        self.kinematics = kinematics
        self.here = here
        self.first = first

    def plan(self, run: Sequence[Segment]) -> Path:
        """Return the path; all segments are of one space."""
        zones = [segment.zone for segment in run[:-1]]
        match run[0]:
            case Spline() as spline:
                return self._spline(spline)
            case Ptp():
                return self._joint_lines(run, zones)
        return self._tool_legs(run, zones)

    def _joint_lines(self, run: Sequence[Segment], zones: Sequence[float]) -> Path:
        limits = self.kinematics.limits
        waypoints = [self.here]
        for number, segment in enumerate(run, start=self.first):
            if isinstance(segment, Ptp):
                try:
                    waypoints.append(self._joints(segment.target, segment.frame, waypoints[-1]))
                except MotionError as error:
                    raise SegmentRefused(number, error) from error
        if not zones:
            return JointLine(waypoints[0], waypoints[1], limits)
        return JointPolyline(waypoints, zones, limits, first_waypoint=self.first)

    def _tool_legs(self, run: Sequence[Segment], zones: Sequence[float]) -> Path:
        pose = self.kinematics.forward(self.here)
        legs: list[ToolCurve] = []
        for place, segment in enumerate(run):
            try:
                leg = self._leg(segment, pose)
            except NoMotion:
                if not zones:
                    raise
                corner = max(place - 1, 0)
                reason = "a leg there has no length"
                number = self.first + corner
                raise ZoneTooLarge(number, zones[corner], 0.0, "m", reason) from None
            except MotionError as error:
                raise SegmentRefused(self.first + place, error) from error
            legs.append(leg)
            rotation, position = leg.place(np.array([leg.length]))
            pose = Pose.from_matrix(rotation[0], position[0])
        return self._followed(ToolChain(legs, zones, first_waypoint=self.first))

    def _leg(self, segment: Segment, start: Pose) -> ToolCurve:
        match segment:
            case Circ():
                return circle_curve(self.kinematics, start, segment)
            case Lin():
                return ToolLine(start, _pose_of(self.kinematics, segment.target, segment.frame))
        raise BadArgument("segment", segment, "Lin or Circ")

    def _followed(self, chain: ToolChain) -> Path:
        try:
            return follow_tool_curve(self.kinematics, self.here, chain)
        except (OutOfRange, Unreachable, BranchChange) as error:
            leg = 0
            if error.fraction is not None:
                leg, error.fraction = chain.where(error.fraction * chain.length)
            self._refuse(leg, error)

    def _spline(self, spline: Spline) -> Path:
        try:
            if not spline.targets:
                raise BadArgument("targets", 0, "at least one")
            if spline.space is SplineSpace.TOOL:
                poses = [self.kinematics.forward(self.here)]
                poses += [_pose_of(self.kinematics, each, spline.frame) for each in spline.targets]
                return follow_tool_curve(self.kinematics, self.here, ToolSpline(poses))
            waypoints = [self.here]
            for target in spline.targets:
                waypoints.append(self._joints(target, spline.frame, waypoints[-1]))
            return JointSpline(waypoints, self.kinematics.limits)
        except NoMotion:
            raise
        except MotionError as error:
            self._refuse(0, error)

    def _joints(self, target: Target, frame: str, seed: Array) -> Array:
        """Return the joint position of a target, near the seed where it is a pose."""
        if isinstance(target, Pose):
            from .ik import solve

            return solve(self.kinematics, target, seed, frame=frame).joint_position
        self.kinematics.limits.check_position(_numbers(target))
        return np.array(_numbers(target))

    def _refuse(self, place: int, error: MotionError) -> NoReturn:
        raise SegmentRefused(self.first + place, error) from error


def _pose_of(kinematics: Kinematics, target: Target, frame: str) -> Pose:
    """Return a target's pose in the base frame."""
    if isinstance(target, Pose):
        return kinematics.to_base(target, frame)
    kinematics.limits.check_position(_numbers(target))
    return kinematics.forward(target)


def _numbers(target: Sequence[float] | Array) -> list[float]:
    return [float(value) for value in target]
