"""Paths of a robot: the joint paths of a list of segments, of lines of the tool, and through poses.

Owns which segments are run without a stop: those joined by zones are one path, any other ends one.
Where lines in joint space meet curves of the tool, the zone is one in joint space. Owns also the
step from the targets and points of a LIN, CIRC or spline segment, in its own frame, to a curve of
the tool in the base frame. `start` is the (n,) joint position, or the pose in the base, where the
robot stands; the former is treated by `settle_start`. Targets are poses of the tool in `frame`,
which is `base` or `root`. Knows no timing. The server's event loop imports this module, so inverse
kinematics is imported only by the functions that search.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby, pairwise
from typing import TypeAlias

import numpy as np

from ..errors import (
    BadArgument,
    BranchChange,
    MotionError,
    NoMotion,
    NotFinite,
    OutOfRange,
    PlatformLimit,
    PoseUnreachable,
    SegmentRefused,
    ZoneTooLarge,
)
from ..pose import Array, Pose
from ..trajectory.joint_curves import JointLine, JointSpline, Path, settle_start
from .blending import LEAST_ZONE, JointPolyline, largest_joint_zone, tool_zone
from .path_chains import JointChain, ToolChain
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
from .tool_curves import (
    ToolArc,
    ToolCurve,
    ToolLine,
    ToolSpline,
    arc_about,
    arc_through,
    check_point,
    circle_about,
    circle_through,
)
from .tool_kinematics import ToolKinematics, check_workspace, joints_at, leg_of
from .tool_paths import follow_tool_curve

MOST_SEGMENTS = 10_000
"""Greatest number of segments that are planned at once."""

_Space: TypeAlias = type[Ptp | Lin | Spline]


def plan_path(
    kinematics: ToolKinematics, start: Sequence[float] | Array, segments: Sequence[Segment]
) -> list[Path]:
    """Return the joint paths of segments in sequence, with a stop between each two paths.

    Segments with zones between them are one path. A segment to where the robot stands already adds
    none. Every tool segment is solved as a whole before any motion.

    Args:
        segments: at least one and at most `MOST_SEGMENTS`.

    Raises:
        SegmentRefused: a segment, with its number and the reason; a fraction in it is that of the
            segment.
        ZoneTooLarge: a zone does not fit, or no segment follows that it could lead to; the
            waypoint is the number of the segment that it ends.
        NoMotion: no segment moves the robot.
        OutOfRange: the start is outside a joint's range.
        WrongJointCount, NotFinite: the start is not one finite value per joint.
        BadArgument: there are no segments, or too many.
    """
    if not 1 <= len(segments) <= MOST_SEGMENTS:
        raise BadArgument("segments", len(segments), f"1 to {MOST_SEGMENTS}")
    here = np.array(settle_start(start, kinematics.limits))
    paths: list[Path] = []
    for first, run in _runs(segments, joint_unit(kinematics)):
        try:
            path = _plan_run(kinematics, here, first, run)
        except NoMotion:
            continue
        paths.append(path)
        here = _end(path)
    if not paths:
        raise NoMotion
    return paths


def joint_unit(kinematics: ToolKinematics) -> str:
    """Return the unit of distances in joint space."""
    prismatic = kinematics.limits.prismatic
    if all(prismatic):
        return "m"
    return "rad or m" if any(prismatic) else "rad"


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
        if isinstance(segments[number + 1], Spline):
            reason = "a spline begins at rest; a zone joins PTP, LIN and CIRC"
            raise ZoneTooLarge(number, segment.zone, 0.0, unit, reason)
    return runs


def _check_zone(number: int, zone: float) -> None:
    if not math.isfinite(zone):
        raise SegmentRefused(number, NotFinite("the zone", 0))
    if zone != 0.0 and zone < LEAST_ZONE:
        accepted = f"0 for a stop, or {LEAST_ZONE:g} and more"
        raise SegmentRefused(number, BadArgument("zone", zone, accepted))


def _space(segment: Segment) -> _Space:
    match segment:
        case Ptp():
            return Ptp
        case Lin() | Circ():
            return Lin
        case Spline():
            return Spline


def _end(path: Path) -> Array:
    end: Array = path.evaluate(np.array([path.length]))[0]
    return end


def _plan_run(kinematics: ToolKinematics, here: Array, first: int, run: Sequence[Segment]) -> Path:
    """Return the path of one run: one part for each stretch of segments of one space."""
    parts: list[Path] = []
    place = 0
    for _, group in groupby(run, _space):
        part = list(group)
        rounded = (place > 0, place + len(part) < len(run))
        planner = _PartPlanner(kinematics, here, first + place, rounded)
        try:
            parts.append(planner.plan(part))
        except NoMotion:
            if len(part) == len(run):
                raise
            corner = max(place - 1, 0)
            unit = joint_unit(kinematics) if isinstance(run[corner], Ptp) else "m"
            reason = "a leg there has no length"
            raise ZoneTooLarge(first + corner, run[corner].zone, 0.0, unit, reason) from None
        here = _end(parts[-1])
        place += len(part)
    if len(parts) == 1:
        return parts[0]
    return _joined(kinematics, first, run, parts)


def _joined(
    kinematics: ToolKinematics, first: int, run: Sequence[Segment], parts: Sequence[Path]
) -> Path:
    """Return parts in different spaces as one path, with zones in joint space between them."""
    zones: list[float] = []
    corner = -1
    for number, (before, after) in enumerate(pairwise(parts)):
        corner += len(before.waypoint_knots) - 1
        more = len(after.waypoint_knots) > 2 or number + 2 < len(parts)
        largest = largest_joint_zone(before, after, rounded=(corner > 0, more))
        zone = run[corner].zone
        if isinstance(run[corner], Ptp):
            if zone > largest:
                reason = "it does not fit on the legs there"
                unit = joint_unit(kinematics)
                raise ZoneTooLarge(first + corner, zone, largest, unit, reason)
            zones.append(zone)
        else:
            zones.append(tool_zone(kinematics, before, zone, largest, first + corner))
    try:
        chain = JointChain(parts, zones, kinematics.limits)
    except OutOfRange as error:
        raise SegmentRefused(first, error) from error
    _check_way(kinematics, first, chain)
    return chain


def _check_way(kinematics: ToolKinematics, first: int, path: Path) -> None:
    """Refuse what `check_workspace` refuses, as its segment; `first` is the path's first one."""
    try:
        check_workspace(kinematics, path)
    except PlatformLimit as error:
        place, error.fraction = leg_of(path, error.fraction or 0.0)
        raise SegmentRefused(first + place, error) from error


class _PartPlanner:
    """Planner of consecutive segments in one space, from where the robot stands.

    Attributes:
        first: number of the first segment.
        rounded: for the start and the end, True if a zone to another space is there.
    """

    def __init__(
        self, kinematics: ToolKinematics, here: Array, first: int, rounded: tuple[bool, bool]
    ) -> None:
        self.kinematics = kinematics
        self.here = here
        self.first = first
        self.rounded = rounded

    def plan(self, part: Sequence[Segment]) -> Path:
        """Return the path; all segments are of one space."""
        zones = [segment.zone for segment in part[:-1]]
        match part[0]:
            case Spline() as spline:
                return self._spline(spline)
            case Ptp():
                path = self._joint_lines(part, zones)
                _check_way(self.kinematics, self.first, path)
                return path
        return self._tool_legs(part, zones)

    def _joint_lines(self, part: Sequence[Segment], zones: Sequence[float]) -> Path:
        limits = self.kinematics.limits
        waypoints = [self.here]
        for number, segment in enumerate(part, start=self.first):
            if isinstance(segment, Ptp):
                try:
                    waypoints.append(self._joints(segment.target, segment.frame, waypoints[-1]))
                except MotionError as error:
                    raise SegmentRefused(number, error) from error
        if not zones:
            return JointLine(waypoints[0], waypoints[1], limits)
        return JointPolyline(
            waypoints, zones, limits, first_waypoint=self.first, rounded=self.rounded
        )

    def _tool_legs(self, part: Sequence[Segment], zones: Sequence[float]) -> Path:
        pose = self.kinematics.forward(self.here)
        legs: list[ToolCurve] = []
        for place, segment in enumerate(part):
            try:
                if not isinstance(segment, Lin | Circ):
                    raise BadArgument("segment", segment, "Lin or Circ")
                leg = leg_curve(self.kinematics, pose, segment)
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
        chain = ToolChain(legs, zones, first_waypoint=self.first, rounded=self.rounded)
        try:
            return follow_tool_curve(self.kinematics, self.here, chain)
        except (OutOfRange, PoseUnreachable, BranchChange, PlatformLimit) as error:
            leg_number = 0
            if error.fraction is not None:
                leg_number, error.fraction = chain.where(error.fraction * chain.length)
            raise SegmentRefused(self.first + leg_number, error) from error

    def _spline(self, spline: Spline) -> Path:
        try:
            if not spline.targets:
                raise BadArgument("targets", 0, "at least one")
            if spline.space is SplineSpace.TOOL:
                pose = self.kinematics.forward(self.here)
                curve = spline_curve(self.kinematics, pose, spline)
                return follow_tool_curve(self.kinematics, self.here, curve)
            waypoints = [self.here]
            for target in spline.targets:
                waypoints.append(self._joints(target, spline.frame, waypoints[-1]))
            path = JointSpline(waypoints, self.kinematics.limits)
            check_workspace(self.kinematics, path)
        except NoMotion:
            raise
        except MotionError as error:
            raise SegmentRefused(self.first, error) from error
        return path

    def _joints(self, target: Target, frame: str, seed: Array) -> Array:
        """Return the joint position of a target, near the seed where it is a pose."""
        if isinstance(target, Pose):
            return joints_at(self.kinematics, target, seed, frame)
        self.kinematics.limits.check_position(numbers(target))
        return np.array(numbers(target))


def linear_path(
    kinematics: ToolKinematics, start: Sequence[float] | Array, target: Pose, *, frame: str = "base"
) -> JointSpline:
    """Return the path, with two waypoints, of the tool along a line with an even rotation.

    The whole path is solved before any motion; see `follow_tool_curve`.

    Raises:
        MotionError: as of `follow_tool_curve`, or the frame.
    """
    here = settle_start(start, kinematics.limits)
    line = ToolLine(kinematics.forward(here), kinematics.to_base(target, frame))
    return follow_tool_curve(kinematics, here, line)


def linear_legs(
    kinematics: ToolKinematics,
    start: Sequence[float] | Array,
    poses: Sequence[Pose],
    *,
    frame: str = "base",
) -> list[JointSpline]:
    """Return straight tool lines in sequence through several poses, one path for each.

    The legs meet at corners, so each has to be timed from rest to rest. A pose where the tool
    already is adds no leg.

    Args:
        poses: one or more tool poses in `frame`; positions in m.

    Raises:
        NoMotion: no pose adds a leg.
        BadArgument: there are no poses.
        MotionError: a leg is refused, as of `linear_path`.
    """
    if not poses:
        raise BadArgument("poses", 0, "at least one pose")
    legs: list[JointSpline] = []
    here = np.array(settle_start(start, kinematics.limits))
    for pose in poses:
        try:
            legs.append(linear_path(kinematics, here, pose, frame=frame))
        except NoMotion:
            continue
        here = legs[-1].goal
    if not legs:
        raise NoMotion
    return legs


def joint_path_through_poses(
    kinematics: ToolKinematics,
    start: Sequence[float] | Array,
    poses: Sequence[Pose],
    *,
    frame: str = "base",
) -> list[Array]:
    """Return the start, and a joint position for each pose, each near the one before.

    Raises:
        PoseUnreachable: a pose; its fraction counts the poses.
        OutOfRange: a pose is reached only outside a joint's range, with its fraction; or the start
            is.
        WrongJointCount, NotFinite: the start is not one finite value per joint.
        FrameUnknown: there is no such frame.
    """
    waypoints = [np.array(settle_start(start, kinematics.limits))]
    for number, pose in enumerate(poses, start=1):
        try:
            waypoints.append(joints_at(kinematics, pose, waypoints[-1], frame))
        except (OutOfRange, PlatformLimit, PoseUnreachable) as error:
            error.fraction = number / len(poses)
            raise
    return waypoints


def leg_curve(kinematics: ToolKinematics, start: Pose, segment: Lin | Circ) -> ToolCurve:
    """Return the tool's path along a line or a circle, in the base frame.

    Args:
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
