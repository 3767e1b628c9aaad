"""The joint reports of the last quarter of a second, and how much time lies between two of them.

Owns the rule that a late report makes no alarm. A report tells when it arrived, not when it was
measured, so the speed between two is a matter of doubt where they waited on their way. But they
arrive in the order in which they were measured, and a controller measures them at a steady rhythm:
between report i and report k lie k - i periods, however bunched both arrive. The time between them
is taken to be the longer of that and the time between their arrivals. What a stalled sender left
out is not counted so; therefore the first report after a silence is neither judged nor compared
with. Knows no limit and no motion.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

JOINT_SPAN_NS = 50_000_000
"""Joint speeds are taken over so much time at least."""

POINT_SPAN_NS = 250_000_000
"""Speeds of tool and elbow are taken over so much time at least."""

_SILENCE = 2.5
"""A pause of so many periods is a silence."""

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
        points: where that puts the watched points of the arm [m]; empty while nobody asked.
    """

    time: int
    number: int
    position: Place
    points: tuple[Place, ...] = field(default=())


class ReportTiming:
    """The newest report and those that it is compared with.

    Attributes:
        newest: the report that was taken last.
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
        if silence:
            self.is_sure = silence <= _SILENCE * self._period
            self._learn(now, silence)
        if self.is_sure:
            recent.append(report)
        older = self._older
        while recent and recent[0].time <= now - JOINT_SPAN_NS:
            self.joint_base = recent.popleft()
            older.append(self.joint_base)
        while older and older[0].time <= now - POINT_SPAN_NS:
            self.point_base = older.popleft()
        return report

    def _learn(self, now: int, silence: int) -> None:
        since, number = self._anchor
        if silence > _LEARN_NS // 5:
            self._anchor = (now, self._count)  # whoever paused tells nothing of the rhythm
        elif now - since >= _LEARN_NS:
            self._period = (now - since) // (self._count - number)
            self._anchor = (now, self._count)

    def elapsed(self, base: TimedReport) -> float:
        """Return the longest time that may lie between an older report and the newest one [s]."""
        newest = self.newest
        assert newest is not None
        counted = (newest.number - base.number) * self._period
        return max(newest.time - base.time, counted) / 1e9
