"""How far the robot has come on the trajectory that it is being sent.

Owns the estimate of the robot's own time on the trajectory. The server's clock says when a
set-point is due; a controller may start later, run slower or stand still, and must not be sent more
than the lead ahead of where the robot really is.

A report tells where the robot was, not where its controller's clock is: servo and report are behind
that by the controller's lag. A planned motion, whose lead is much longer, is paced by the reports
as they are. The lead of a jog may be shorter than the lag, and then the controller would run dry:
a jog is paced by the clock that a robot has which lags as declared. And it is paced by a robot that
is seen: while no report comes, a stalled controller may stand where it was, so the clock of a jog
runs on for `unseen` only.

What does not follow is told apart likewise. A planned motion is behind its plan, and stays behind.
A jog has no plan: a robot that stood for a while, because its controller did, and goes on at the
pace of its set-points follows them. It does not while it keeps falling back.
"""

from __future__ import annotations

import math
from collections import deque
from itertools import repeat
from operator import sub
from typing import NamedTuple

from openpendant.motion.trajectory.trajectory import Row

from .feedback import Feedback

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
    """How the set-points of a jog are paced.

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
            jog: how a jog is paced; None for a planned motion.
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
