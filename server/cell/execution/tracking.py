"""Tracking of a motion: how far the robot has come on its path, and whether it is on it.

Owns three things about the set-points that left and the reports that came. What is accepted
(`TrackingTolerances`): the figures of the cell's file where it names them, else those of a real
controller, or closer ones where the controller says that it is emulated. The robot's own time on
the trajectory (`TrackingMonitor`). The piece of the path where it can be by now (`PathTracking`).

The monitor: the server's clock says when a set-point is due; a controller may start later, run
slower or stand still, and must not be sent more than the lead ahead of where the robot really is.
A report tells where the robot was, not where its controller's clock is: servo and report are
behind that by the controller's lag. A planned motion, whose lead is much longer, is paced by the
reports as they are. The lead of a jog may be shorter than the lag, and then the controller would
run dry: a jog is paced by the clock that a robot has which lags as declared. And it is paced by a
robot that is seen: while no report comes, a stalled controller may stand where it was, so the
clock of a jog runs on for `unseen` only. What does not follow is told apart likewise. A planned
motion is behind its plan, and stays behind. A jog has no plan: a robot that stood for a while,
because its controller did, and goes on at the pace of its set-points follows them. It does not
while it keeps falling back.

The piece of the path ends where the newest set-point was due by the server's clock: what leaves
ahead of that does not count, for no robot reaches a set-point before it is due. It begins where a
report can still come from that is late: `LATEST_NS` and the joints' lag before the place where the
robot is due by its own time. That is the server's time less what it has been behind at least, in
this motion. And the piece never begins after the place where the robot was last seen: one that
falls behind on its path is the monitor's concern. So a report fits that was measured at any time
since the one before it, and one that is late in whatever order.

On the piece a robot fits where there is any point from which no joint is farther than its own
tolerance: its path tolerance, the noise, and the lag times its greatest commanded speed on the
piece. The joints of one arm never lag alike, so a flat bound would alarm.

Between samples the piece is straight. A controller that goes through both samples in 10 ms with an
acceleration of a is off that chord by a h²/8 at most: 1.25e-5 a, which is 0.25 mrad at 20 rad/s².
"""

from __future__ import annotations

import math
from collections import deque
from itertools import islice, repeat
from operator import sub
from typing import NamedTuple

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.trajectory.trajectory import Row

from ...settings.cell_settings import ControllerLink
from .feedback import Feedback

PER_RADIAN = 0.5
"""What counts as much on a sliding joint as 1 rad on a turning one [m]: 0.02 rad are 10 mm."""

RANGE_TOLERANCE = 0.02
"""How far beyond its range a joint may be reported [rad], 10 mm on a sliding one."""

EMULATED = {"path_tolerance": 0.01, "lag": 0.01, "noise": 0.0}
"""What holds on a controller that says it is emulated, unless the cell's file names the key."""


class TrackingTolerances(NamedTuple):
    """The deviations that are accepted in the reports of one motion.

    Attributes:
        path: (n,) distance of each joint from the path while it stands [rad or m].
        lag: how far each joint may be behind the set-points, each by itself [s].
        noise: of a reported position [rad or m].
        range: (n,) distance of each joint from its range [rad or m].
    """

    path: tuple[float, ...]
    lag: float
    noise: float
    range: tuple[float, ...]


def tracking_tolerances(
    link: ControllerLink, limits: JointLimits, *, says_emulated: bool
) -> TrackingTolerances:
    """Return what holds for a motion that begins now.

    Args:
        link: the cell's `[controller]` table; a key that its file names counts as it is.
    """
    close = EMULATED if says_emulated else {}
    path, lag, noise = (
        close[key] if key in close and key not in link.model_fields_set else getattr(link, key)
        for key in EMULATED
    )
    units = tuple(PER_RADIAN if slides else 1.0 for slides in limits.prismatic)
    return TrackingTolerances(
        tuple(path * unit for unit in units),
        lag,
        noise,
        tuple(RANGE_TOLERANCE * unit for unit in units),
    )


SAME_PLACE = 1e-3
"""Samples closer than this to the report are one place; the latest of them counts [rad or m]."""

LONGEST_LAG = 0.5
"""A robot so far behind the plan does not follow it [s]."""

_JOG_SPAN_NS = 1_000_000_000
"""How far a jogged robot is behind is what it fell back within this time: one that goes at less
than half its pace does not follow, nor one that stands for `LONGEST_LAG`."""

_SURELY = 1.0 - 1e-9
"""What rounding may do to a distance, many times over."""


class JogPace(NamedTuple):
    """The pacing of a jog's set-points.

    Attributes:
        lag: how far reports are behind the controller's clock where they may be [s].
        unseen: for so long after a report the robot is taken to go on [s].
    """

    lag: float
    unseen: float


class TrackingMonitor:
    """The robot's progress along the samples that left.

    Attributes:
        base: when the robot began the trajectory, as far as its reports tell [ns].
        clock: when its controller did, whose reports may be late by the declared lag [ns].
    """

    def __init__(self, started: int, jog: JogPace | None = None) -> None:
        """Assume that the robot starts at once, until its reports say otherwise.

        Args:
            started: when the first set-point leaves [ns].
        """
        self.base = self.clock = started
        self._started = started
        self._seen = started
        self._lag_ns = 0 if jog is None else round(jog.lag * 1e9)
        self._unseen_ns = None if jog is None else round(jog.unseen * 1e9)
        # Of a jog: reports of the last span with their bases, each less than all later ones [ns].
        self._recent = deque([(started, started)]) if jog else None
        # Of the samples that left, from the one that was nearest to the last report on.
        self._times: deque[int] = deque()  # ns
        self._places: deque[tuple[float, ...]] = deque()

    @property
    def reached(self) -> float:
        """Time of the sample that was nearest to the last report [s]; 0 before the first."""
        return self._times[0] / 1e9 if self._times else 0.0

    def sent(self, row: Row) -> None:
        """Note a sample that left."""
        self._times.append(round(row.time * 1e9))
        self._places.append(tuple(row.position))

    def earliest(self, time: float) -> int:
        """Return when a robot that began at once is due at `time` [s] of the trajectory [ns].

        No robot is due there sooner; one that is behind is due later by `lag`.
        """
        return self._started + round(time * 1e9)

    def time(self, now: int) -> int:
        """Return where the controller may be on the trajectory by now [ns]."""
        if self._unseen_ns is not None:
            now = min(now, self._seen + self._unseen_ns)
        return now - self.clock

    @property
    def lag(self) -> float:
        """How far the robot is behind the plan; in a jog, how far it just fell back [s]."""
        least = self._recent[0][1] if self._recent else self._started
        return (self.base - least) / 1e9

    def go_on(self, time: float, now: int) -> None:
        """Take note that the robot rested, and that the set-point of `time` [s] leaves now."""
        rested = max(now - self.base - round(time * 1e9), 0)
        self.base += rested
        self.clock += rested
        self._seen = now
        self._started += rested
        if self._recent is not None:
            self._recent.clear()
            self._recent.append((now, self.base))

    def update(self, feedback: Feedback) -> None:
        """Find the place of the last report on the trajectory, never before an earlier one.

        Where the report fits several samples, the latest counts: a dwell, a turn or a slow start
        must not look like a robot that stands still.
        """
        position = feedback.position
        times, places = self._times, self._places
        if position is None or not times or feedback.received < self._started:
            return
        self._seen = feedback.received
        for _ in range(self._place_of(position)):
            times.popleft()
            places.popleft()
        base = feedback.received - times[0]
        if len(times) == 1 and base > self.base:
            # It has reached all that was sent; how far beyond that it would be, nobody can see.
            base = self.base
        self.base = max(base, self._started)
        self.clock = max(self.base - self._lag_ns, self._started)
        if self._recent is not None:
            self._note(self._recent, feedback.received)

    def _note(self, recent: deque[tuple[int, int]], now: int) -> None:
        """Keep what is needed for the least base of the span that ends now."""
        while recent and recent[-1][1] >= self.base:
            recent.pop()
        recent.append((now, self.base))
        while recent[0][0] < now - _JOG_SPAN_NS:
            recent.popleft()

    def _place_of(self, position: tuple[float, ...]) -> int:
        """Return the number of the last sample that is nearly as near to a report as the nearest.

        The gap of a sample is that of the joint which is farthest away.
        """
        # Distances are sooner found than gaps, and tell most often: a gap is no greater than its
        # distance, and no less than a certain share of it. So is the least gap of the least.
        places = self._places
        distances = list(map(math.dist, places, repeat(position)))
        share = _SURELY / math.sqrt(len(position))
        least = min(distances)
        surely_near, surely_far = share * least + SAME_PLACE, least + SAME_PLACE
        for place in range(len(distances) - 1, -1, -1):
            distance = distances[place]
            if share * distance > surely_far:
                continue
            if distance <= surely_near:
                return place
            gap = _gap(places[place], position)
            if gap <= surely_near:
                return place
            if gap <= surely_far:
                break
        gaps = [_gap(sample, position) for sample in places]
        near = min(gaps) + SAME_PLACE
        return max(place for place, gap in enumerate(gaps) if gap <= near)


def _gap(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    gap: float = max(map(abs, map(sub, one, other)))
    return gap


LATEST_NS = 200_000_000
"""A report may be so late."""

_KEPT_NS = 300_000_000
"""Set-points are kept for so much longer: their speeds explain what two reports are apart."""

_CLOCK_RATE = 5e-4
"""A controller's clock may be faster than ours by so much: by `adjtime` alone either may be."""


class Deviation(NamedTuple):
    """The joint that is farthest beyond its tolerance, at the point of the path next to it.

    Attributes:
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
        """Return True if a report surely fits: the speeds at one sample are not the greatest."""
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
        """Return True if a report fits the way from a sample to the next, as far as due."""
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
