"""Compares the robot that is reported with the one that was commanded, report by report.

Owns what of a report ends a motion: a joint out of its range (`OVER_RANGE`), off the path
(`LEFT_THE_PATH`; which piece of it counts is `path_tracking`'s), or a joint, the tool or the elbow
too fast (`OVER_SPEED`; which reports are compared is `report_timing`'s). From a motion's first
set-point to its end all of it; during a stop's ramp, which leads off the path, range and speed.

Pure: fed with each set-point that leaves and each report that comes, and asked in the turn that
reads the report. What follows from a refusal is the cell's business.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from operator import le, mul, sub
from typing import Protocol

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.trajectory.trajectory import Row
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from .path_tracking import Deviation, PathTracking
from .report_timing import Place, ReportTiming, TimedReport
from .tracking_tolerances import TrackingTolerances

SPEED_SLACK = 1.1
"""A limit of speed may be exceeded by a tenth: reports come no more regularly than that."""

_SURELY = 1.0 - 1e-9  # what rounding may do to a distance, many times over


class ArmPoints(Protocol):
    """The points of an arm whose speed the mode caps: the selected tool's centre and the elbow."""

    @property
    def lever_arms(self) -> Sequence[Sequence[float]]:
        """For each point (n,) how fast each joint can make it, wherever they are [m/rad or 1]."""

    def speed_points(self, position: Sequence[float]) -> tuple[Place, ...]:
        """Return where the points are at (n,) joints, in the base frame [m]."""


POINTS = ("the tool", "the elbow")
"""What the points of `ArmPoints` are, in their order."""

Cap = Callable[[], float | None]
"""Tells the greatest speed of tool and elbow in the mode as it is now [m/s]; None for none."""


class MotionWatch:
    """One motion as it is commanded and reported."""

    def __init__(
        self,
        limits: JointLimits,
        tolerances: TrackingTolerances,
        timing: ReportTiming,
        start: Place,
        points: ArmPoints | None = None,
        cap: Cap = lambda: None,
    ) -> None:
        """Begin with no set-point.

        Args:
            limits: the robot's joint limits.
            tolerances: what is accepted.
            timing: has taken each report before it is judged here.
            start: (n,) where the robot is as it begins; a joint outside its range may be there.
            points: tool and elbow; None where nobody knows them.
            cap: of their speed.
        """
        self._limits = limits
        self._tolerances = tolerances
        self._timing = timing
        self._points = points
        self._cap = cap
        self._greatest_cap: float | None = 0.0
        self._path: PathTracking | None = PathTracking(tolerances)
        self._last_speeds = [0.0] * limits.dof  # greatest commanded before the stop
        beyond = tolerances.range
        ends = zip(limits.lower, limits.upper, start, beyond, strict=True)
        self._ends = [(min(low, at) - room, max(up, at) + room) for low, up, at, room in ends]
        self._seen_at, self._room = start, -1.0
        self._fastest = [SPEED_SLACK * speed for speed in limits.velocity]
        self._slowest = min(self._fastest) * _SURELY

    def commanded(self, due: int, row: Row) -> None:
        """Take note of a set-point that leaves, due at a time at the earliest [ns]."""
        if self._path is not None:
            self._path.commanded(due, row)

    def stopping(self) -> None:
        """Take note that the robot was told to stop: from now on it ramps off its path."""
        if self._path is not None:
            self._last_speeds = self._path.greatest_speeds()
            self._path = None

    def judge(self, report: TimedReport) -> Refusal | None:
        """Return why a report ends the motion; None where it does not.

        The range comes first and the speed last: a joint that jumps out of its range is off its
        path and too fast as well.
        """
        refusal = self._out_of_range(report.position)
        if refusal is None and self._path is not None:
            deviation = self._path.deviation(report.position, report.time)
            refusal = None if deviation is None else self._left(deviation)
        return refusal or self._too_fast(report)

    # Range.

    def _out_of_range(self, position: Place) -> Refusal | None:
        # No joint leaves its range that has gone no farther, since all were looked at, than the one
        # next to its end was away from it then; the plain distance is no less than any joint's way.
        if math.dist(position, self._seen_at) <= self._room:
            return None
        ends = zip(position, self._ends, strict=True)
        for joint, (value, (lower, upper)) in enumerate(ends):
            if not lower <= value <= upper:
                bound = lower if value < lower else upper
                room, unit = self._tolerances.range[joint], self._limits.unit(joint)
                text = (
                    f"joint {joint + 1} is reported at {value:.4f} {unit}, accepted to {bound:.4f}:"
                    f" its range, or where it began, and {room:g} {unit} more"
                )
                return Refusal(VerdictCode.OVER_RANGE, text, joint, value, bound)
        pairs = zip(position, self._ends, strict=True)
        self._room = min(min(at - low, up - at) for at, (low, up) in pairs) * _SURELY
        self._seen_at = position
        return None

    # Path.

    def _left(self, found: Deviation) -> Refusal:
        joint, (path, lag, noise, _) = found.joint, self._tolerances
        unit = self._limits.unit(joint)
        text = (
            f"joint {joint + 1} is reported {found.value:.4f} {unit} off its path, accepted"
            f" {found.limit:.4f}: path_tolerance {path[joint]:g} {unit}, lag {lag:g} s at"
            f" {found.speed:.3f} {unit}/s, noise {noise:g} {unit}"
        )
        return Refusal(VerdictCode.LEFT_THE_PATH, text, joint, found.value, found.limit)

    # Speed.

    def _too_fast(self, report: TimedReport) -> Refusal | None:
        timing = self._timing
        if not timing.is_sure:
            return None
        refusal = None
        if (base := timing.joint_base) is not None:
            refusal = self._joint_too_fast(report, base, timing.elapsed(base))
        if refusal is None and (base := timing.point_base) is not None:
            refusal = self._point_too_fast(report, base, timing.elapsed(base))
        return refusal

    def _joint_too_fast(
        self, report: TimedReport, base: TimedReport, time: float
    ) -> Refusal | None:
        if math.dist(report.position, base.position) <= self._slowest * time:
            return None
        noise = 2.0 * self._tolerances.noise
        joints = zip(report.position, base.position, self._fastest, strict=True)
        for joint, (now, before, fastest) in enumerate(joints):
            way = abs(now - before)
            if not way <= fastest * time + noise:
                speed, most = way / time, fastest + noise / time
                limit, unit = self._limits.velocity[joint], self._limits.unit(joint)
                text = (
                    f"joint {joint + 1} is reported at {speed:.3f} {unit}/s over {time * 1e3:.0f}"
                    f" ms, accepted {most:.3f}: its limit of {limit:g} {unit}/s, a tenth more, and"
                    f" noise {self._tolerances.noise:g} {unit}"
                )
                return Refusal(VerdictCode.OVER_SPEED, text, joint, speed, most)
        return None

    def _point_too_fast(
        self, report: TimedReport, base: TimedReport, time: float
    ) -> Refusal | None:
        if self._points is None or (cap := self._cap_so_far()) is None:
            return None
        levers = self._points.lever_arms
        noise = 2.0 * self._tolerances.noise
        rooms = [SPEED_SLACK * cap * time + noise * sum(each) for each in levers]
        # Links being rigid, a point goes no farther than its levers carry it: that is found sooner
        # than where it is.
        joints = list(map(abs, map(sub, report.position, base.position)))
        if all(_dot(each, joints) <= room for each, room in zip(levers, rooms, strict=True)):
            return None
        for each in (base, report):
            each.points = each.points or self._points.speed_points(each.position)
        ways = list(map(math.dist, report.points, base.points))
        if all(map(le, ways, rooms)):
            return None
        for name, way, room, lever in zip(POINTS, ways, rooms, levers, strict=False):
            most = room + self._explained(lever, cap, time)
            if not way <= most:
                text = (
                    f"{name} is reported at {way / time:.3f} m/s over {time * 1e3:.0f} ms, accepted"
                    f" {most / time:.3f}: the cap of {cap:g} m/s, a tenth more, and what lag"
                    f" {self._tolerances.lag:g} s and noise {self._tolerances.noise:g} add"
                )
                return Refusal(VerdictCode.OVER_SPEED, text, value=way / time, limit=most / time)
        return None

    def _cap_so_far(self) -> float | None:
        """Return the greatest cap since the motion began.

        What has left, and the ramp after it, kept to the cap of its time: one that is lowered while
        it moves slows it down by the planned way, and a change of the mode stops it.
        """
        cap, most = self._cap(), self._greatest_cap
        self._greatest_cap = None if cap is None or most is None else max(cap, most)
        return self._greatest_cap

    def _explained(self, levers: Sequence[float], cap: float, time: float) -> float:
        """Return how much farther than by cap and noise a point may go in a time by the lags [m].

        The tool is slow where the ways of two fast joints cancel out; where one of them is behind
        its set-points by as much of its speed as it may, and the other is not, they do not. And in
        the ramp of a stop each joint brakes for itself, so that nothing need cancel out any more.
        """
        if self._path is not None:
            return self._tolerances.lag * _dot(levers, self._path.greatest_speeds())
        fastest = _dot(levers, self._last_speeds)
        return self._tolerances.lag * fastest + SPEED_SLACK * max(fastest - cap, 0.0) * time


def _dot(one: Sequence[float], other: Sequence[float]) -> float:
    total: float = sum(map(mul, one, other))
    return total
