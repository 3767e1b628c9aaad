"""Whether a robot is on the path that it was commanded: the piece of it where it can be by now.

Owns which piece that is. It ends where the newest set-point was due by the server's clock: what
leaves ahead of that does not count, for no robot reaches a set-point before it is due. It begins
where a report can still come from that is late: `LATEST` and the joints' lag before the place where
the robot is due by its own time. That is the server's time less what it has been behind at least,
in this motion. And the piece never begins after the place where the robot was last seen: one that
falls behind on its path is no concern of this module (`tracking_monitor` ends that). So a report
fits that was measured at any time since the one before it, and one that is late in whatever order.

On the piece a robot fits where there is any point from which no joint is farther than its own
tolerance: its path tolerance, the noise, and the lag times its greatest commanded speed on the
piece. The joints of one arm never lag alike, so a flat bound would alarm.

Between samples the piece is straight. A controller that goes through both samples in 10 ms with an
acceleration of a is off that chord by a h²/8 at most: 1.25e-5 a, which is 0.25 mrad at 20 rad/s².
"""

from __future__ import annotations

import math
from collections import deque
from itertools import islice
from typing import NamedTuple

from openpendant.motion.trajectory.trajectory import Row

from .tracking_tolerances import TrackingTolerances

LATEST_NS = 200_000_000
"""A report may be so late."""

_KEPT_NS = 300_000_000
"""Set-points are kept for so much longer: their speeds explain what two reports are apart."""

_CLOCK_RATE = 5e-4
"""A controller's clock may be faster than ours by so much: by `adjtime` alone either may be."""


class Deviation(NamedTuple):
    """The joint that is farthest beyond its tolerance, at the point of the path next to it.

    Attributes:
        joint: its index.
        value: its distance from there [rad or m].
        limit: what is accepted [rad or m].
        speed: its greatest commanded speed on the piece [rad/s or m/s].
    """

    joint: int
    value: float
    limit: float
    speed: float


class PathTracking:
    """The set-points of one motion that left, and where the robot is along them."""

    def __init__(self, tolerances: TrackingTolerances) -> None:
        """Begin with no set-point; then every report fits."""
        self._standing = [each + tolerances.noise for each in tolerances.path]
        self._closest = min(self._standing)
        self._lag = tolerances.lag
        self._lag_ns = round(tolerances.lag * 1e9)
        self._span_ns = LATEST_NS + self._lag_ns
        # From the first that may still count on.
        self._times: deque[int] = deque()  # when each is due at the earliest [ns]
        self._places: deque[list[float]] = deque()
        self._speeds: deque[list[float]] = deque()  # as commanded, signs included
        self._at = 0  # number of the sample where the robot was seen last
        self._began = 0
        self._behind: int | None = None  # least that it has been behind, once it has set off [ns]

    def commanded(self, due: int, row: Row) -> None:
        """Take note of a set-point that leaves.

        Args:
            due: when it is due at the earliest [ns].
            row: the set-point.
        """
        if not self._times:
            self._began = due
        self._times.append(due)
        self._places.append(row.position)
        self._speeds.append(row.velocity)

    def deviation(self, position: tuple[float, ...], now: int) -> Deviation | None:
        """Return how a report does not fit the piece that counts; None where it fits.

        Args:
            position: (n,) as reported [rad or m].
            now: when the report arrived [ns].
        """
        times = self._times
        if not times:
            return None
        until = now + round((now - self._began) * _CLOCK_RATE)
        at = self._descend(position, until)
        if self._is_close(position, at):
            self._seen_at(at, now)
            return None
        if times[at] == times[-1] and times[at] <= until and any(self._speeds[at]):
            # The server owes it the next set-point. What a robot does that has run dry is its
            # controller's business, which ends the motion; its speed and range are still watched.
            return None
        return self._searched(position, until, now)

    def _descend(self, position: tuple[float, ...], until: int) -> int:
        """Return the sample next to a report, going on from the last one as long as that nears."""
        times, places, at = self._times, self._places, self._at
        gap = math.dist(places[at], position)
        while at + 1 < len(times) and times[at + 1] <= until:
            further = math.dist(places[at + 1], position)
            if further > gap:
                break
            gap, at = further, at + 1
        return at

    def _is_close(self, position: tuple[float, ...], at: int) -> bool:
        """Tell whether a report surely fits: the speeds at one sample are not the greatest."""
        place = self._places[at]
        if math.dist(place, position) <= self._closest:
            return True
        lag = self._lag
        joints = zip(position, place, self._speeds[at], self._standing, strict=True)
        for reported, commanded, speed, standing in joints:
            if not abs(reported - commanded) <= standing + lag * abs(speed):
                return False
        return True

    def _seen_at(self, at: int, now: int) -> None:
        """Note where the robot was seen, and forget what no later report can come from."""
        self._at = at
        times = self._times
        if at:
            behind = now - times[at]
            if self._behind is None or behind < self._behind:
                self._behind = behind
        forgotten = self._since(now) - _KEPT_NS
        while len(times) > 1 and times[1] <= forgotten:
            times.popleft()
            self._places.popleft()
            self._speeds.popleft()
            self._at -= 1

    def _since(self, now: int) -> int:
        """Return from when on the set-points count [ns]."""
        seen = self._times[self._at] - self._lag_ns
        return seen if self._behind is None else min(seen, now - self._behind - self._span_ns)

    def _searched(self, position: tuple[float, ...], until: int, now: int) -> Deviation | None:
        """Look at the whole piece, first from where the robot was seen last on."""
        since, times = self._since(now), self._times
        first = 0
        while first < self._at and times[first + 1] <= since:
            first += 1
        last = self._at  # the last sample that is due
        while last + 1 < len(times) and times[last + 1] <= until:
            last += 1
        before = first  # what a joint lags by it may have begun sooner
        while before and times[before] > since - self._lag_ns:
            before -= 1
        speeds = self.greatest_speeds(before, last + 2)
        most = [a + self._lag * b for a, b in zip(self._standing, speeds, strict=True)]
        for number in (*range(self._at, last + 1), *range(first, self._at)):
            if self._passes(number, position, most, until):
                self._seen_at(max(number, self._at), now)
                return None
        return self._worst(range(first, last + 1), position, most, speeds)

    def greatest_speeds(self, first: int = 0, end: int | None = None) -> list[float]:
        """Return the (n,) greatest commanded speeds of the samples from one up to before another.

        Of all that are kept where nothing is given: those of the last half second, or more where
        the robot is behind, and those that left ahead.
        """
        speeds = islice(self._speeds, first, end)
        return [max(map(abs, of_joint)) for of_joint in zip(*speeds, strict=True)]

    def _passes(
        self, number: int, position: tuple[float, ...], most: list[float], until: int
    ) -> bool:
        """Tell whether the way from a sample to the next, as far as due, fits a report anywhere."""
        here, times = self._places[number], self._times
        there, most_share = here, 0.0
        if number + 1 < len(times):
            there = self._places[number + 1]
            # What is due lies before `until`; two set-points never have one time.
            most_share = (until - times[number]) / (times[number + 1] - times[number])
        least, greatest = 0.0, min(max(most_share, 0.0), 1.0)
        # Each joint fits in an interval of the way; the report where all have a share in common.
        for reported, begin, end, room in zip(position, here, there, most, strict=True):
            gap, way = reported - begin, end - begin
            if way == 0.0:
                if not abs(gap) <= room:
                    return False
                continue
            near, far = (gap - room) / way, (gap + room) / way
            if way < 0.0:
                near, far = far, near
            # Written so that a value that is not a number fits nowhere.
            if not (near <= greatest and far >= least):
                return False
            least, greatest = max(least, near), min(greatest, far)
        return True

    def _worst(
        self, numbers: range, position: tuple[float, ...], most: list[float], speeds: list[float]
    ) -> Deviation:
        """Return the joint that keeps a report from the sample which it fits best."""
        worst: tuple[float, int, float] | None = None
        for number in numbers:
            joints = zip(position, self._places[number], most, strict=True)
            gaps = [abs(reported - place) for reported, place, _ in joints]
            shares = [gap / room for gap, room in zip(gaps, most, strict=True)]
            share = max(shares)
            if worst is None or share < worst[0]:
                joint = shares.index(share)
                worst = share, joint, gaps[joint]
        assert worst is not None
        _, joint, value = worst
        return Deviation(joint, value, most[joint], speeds[joint])
