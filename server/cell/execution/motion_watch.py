"""Motion watch: comparison of each report of the robot with what was commanded.

Owns what of a report ends a motion (`MotionWatch`): a joint out of its range (`OVER_RANGE`), off
the path (`LEFT_THE_PATH`; which piece of it counts is `tracking`'s), or a joint, the tool or the
elbow too fast (`OVER_SPEED`). From a motion's first set-point to its end all of it; during a
stop's ramp, which leads off the path, range and speed. Pure: fed with each set-point that leaves
and each report that comes, and asked in the turn that reads the report. What follows from a
refusal is the cell's business.

Owns the rule that a late report makes no alarm (`ReportTiming`). A report tells when it arrived,
not when it was measured, so the speed between two is a matter of doubt where they waited on their
way. But they arrive in the order in which they were measured, and a controller measures them at a
steady rhythm: between report i and report k lie k - i periods, however bunched both arrive. The
time between them is taken to be the longer of that and the time between their arrivals. The latter
is longer by what the older one was late, as far as the reports of about 50 ms before it show that:
otherwise a report that waited and one left out behind it would look like a robot that is too fast.
What a stalled sender left out is not counted; therefore the first report after a silence is neither
judged nor compared with.

Owns what counts as a motion that nobody commanded (`StandstillWatch`): a joint that is reported
0.02 rad (10 mm on a sliding one) from where it was within the last second. It stops nothing,
because somebody may move the robot with the controller's own pendant; but whoever wonders
afterwards is to find it told.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from operator import le, mul, sub
from typing import Protocol

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.trajectory.trajectory import Row
from openpendant.simplemsg.verdicts import VerdictCode

from ...events.cell_events import UncommandedMotion
from ...refusal import Refusal
from .tracking import PER_RADIAN, Deviation, PathTracking, TrackingTolerances

JOINT_SPAN_NS = 50_000_000
"""Joint speeds are taken over so much time at least."""

POINT_SPAN_NS = 250_000_000
"""Speeds of tool and elbow are taken over so much time at least."""

_SILENCE = 2.5
"""A pause of so many periods is a silence."""

_MOST_LATE = _SILENCE - 1.0
"""So many periods is a report taken to be late at most."""

_LEARN_NS = 2_500_000_000
"""The rhythm is measured over so much time: reports that are up to 0.2 s late then put it 8 % wrong
at most, which is less than what is accepted of each speed."""

Place = tuple[float, ...]


@dataclass(slots=True)
class TimedReport:
    """One joint report.

    Attributes:
        time: when it arrived [ns].
        number: how many came before it.
        position: (n,) the joints [rad or m].
        late: how much later than by the rhythm it came [ns].
        points: where that puts the watched points of the arm [m]; empty while nobody asked.
    """

    time: int
    number: int
    position: Place
    late: int = 0
    points: tuple[Place, ...] = field(default=())


class ReportTiming:
    """The newest report and those that it is compared with.

    Attributes:
        is_sure: whether it may be compared: neither the first one, nor after a silence.
        joint_base: the youngest report that is at least `JOINT_SPAN_NS` older; None for none.
        point_base: the youngest that is at least `POINT_SPAN_NS` older; None for none.
    """

    def __init__(self, period: float) -> None:
        """Begin with no report.

        Args:
            period: how often the controller is said to report [s]; what it does is learned.
        """
        self._period = self._declared = round(period * 1e9)
        self.clear()

    def clear(self) -> None:
        """Forget all reports, because the connection was lost."""
        self.newest: TimedReport | None = None
        self.is_sure = False
        self.joint_base: TimedReport | None = None
        self.point_base: TimedReport | None = None
        self._recent: deque[TimedReport] = deque()  # younger than JOINT_SPAN_NS
        self._older: deque[TimedReport] = deque()  # younger than POINT_SPAN_NS
        self._gaps: deque[int] = deque(maxlen=3)  # between the newest reports
        self._count = 0
        self._period = self._declared
        self._anchor = (0, 0)  # time and number from which on the rhythm is measured

    def begin(self) -> None:
        """Compare with nothing older than the newest report, because a motion begins.

        How the robot came to where it stands is no concern of the motion.
        """
        self.joint_base = self.point_base = None
        self._recent.clear()
        self._older.clear()
        if self.newest is not None:
            self._recent.append(self.newest)

    def take(self, position: Place, now: int) -> TimedReport:
        """Take a report that arrives now; what is compared with is the newest of its turn."""
        before = self.newest
        report = self.newest = TimedReport(now, self._count, position)
        self._count += 1
        recent = self._recent
        if before is None:
            self._anchor = (now, self._count)
            return report
        silence = now - before.time
        self._gaps.append(silence)
        if silence:
            self.is_sure = silence <= _SILENCE * self._period
            since, number = self._anchor
            if silence > _LEARN_NS // 5:
                self._anchor = (now, self._count)  # whoever paused tells nothing of the rhythm
            elif now - since >= _LEARN_NS:
                self._period = (now - since) // (self._count - number)
                self._anchor = (now, self._count)
        if before.late or silence > self._period:  # else it is in time as the one before was
            report.late = self._lateness(report)
        if self.is_sure:
            recent.append(report)
        older = self._older
        while recent and recent[0].time <= now - JOINT_SPAN_NS:
            self.joint_base = recent.popleft()
            older.append(self.joint_base)
        while older and older[0].time <= now - POINT_SPAN_NS:
            self.point_base = older.popleft()
        return report

    def elapsed(self, base: TimedReport) -> float:
        """Return the time between a report and the newest, the longest by their rhythm [s]."""
        newest = self.newest
        assert newest is not None
        counted = (newest.number - base.number) * self._period
        return max(newest.time - base.time + base.late, counted) / 1e9

    def _lateness(self, report: TimedReport) -> int:
        """Return how late a report is [ns]: against the earliest of those of about 50 ms before.

        After one that was left out, all of the next 50 ms seem late, and speeds of the next 100 ms
        are judged more mildly, by 1.5 periods at most. A slower rhythm is no delay: three gaps in a
        row that are longer than the known period are taken for the rhythm that is to be learned.
        """
        period, late = max(self._period, min(self._gaps)), 0
        for each in self._recent:
            due = each.time + (report.number - each.number) * period
            late = max(late, report.time - due)
        return min(late, round(_MOST_LATE * self._period))


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
"""Returns the greatest speed of tool and elbow in the mode as it is now [m/s]; None for none."""


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
            timing: has taken each report before it is judged here.
            start: (n,) where the robot is as it begins; a joint outside its range may be there.
            points: tool and elbow; None where nobody knows them.
        """
        self._limits = limits
        self._tolerances = tolerances
        self._timing = timing
        self._points = points
        self._cap = cap
        self._greatest_cap: float | None = 0.0
        self._path: PathTracking | None = PathTracking(tolerances)
        self._last_speeds = [0.0] * len(start)  # greatest commanded before the stop
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


MOVED = 0.02
"""So far a joint goes that moves [rad]; a sliding one half as many metres."""

WITHIN_NS = 1_000_000_000
"""It moves that far within so much time; once it has not for as long, it stands again."""


class StandstillWatch:
    """The reports of a robot at rest."""

    def __init__(self, limits: JointLimits) -> None:
        """Begin with no report."""
        self._limits = limits
        self._moved = [MOVED * PER_RADIAN if slides else MOVED for slides in limits.prismatic]
        # Two places within half of the least way of a third are not that way apart.
        self._near = min(self._moved) / 2.0
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget where it was: it was commanded meanwhile, or not seen."""
        self._reports: deque[tuple[int, Place]] = deque()
        self._anchor: Place = ()
        self._anchored = 0
        self._is_told = False

    def take(self, position: Place, now: int) -> UncommandedMotion | None:
        """Take a report of a robot that is not commanded.

        Returns:
            That it moves; once, until it has stood for `WITHIN_NS`.
        """
        reports = self._reports
        while reports and reports[0][0] < now - WITHIN_NS:
            reports.popleft()
        if not self._anchor or math.dist(position, self._anchor) > self._near:
            self._anchor, self._anchored = position, now
        elif now - self._anchored > WITHIN_NS:
            self._is_told = False
        found = None if self._is_told else self._farthest(position, now)
        self._is_told |= found is not None
        reports.append((now, position))
        return found

    def _farthest(self, position: Place, now: int) -> UncommandedMotion | None:
        """Return the joint that has gone farthest beyond what counts, from any report kept."""
        worst, found = 1.0, None
        for time, place in self._reports:
            if time >= self._anchored:
                break  # from here on all are so near to the anchor that no two are far apart
            if math.dist(position, place) < self._near:
                continue
            joints = zip(position, place, self._moved, strict=True)
            for joint, (here, there, moved) in enumerate(joints):
                way = abs(here - there)
                if way >= worst * moved:
                    worst = way / moved
                    unit = self._limits.unit(joint)
                    found = UncommandedMotion(now, joint, way, (now - time) / 1e9, unit)
        return found
