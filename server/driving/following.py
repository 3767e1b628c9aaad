"""How far the robot has come on the trajectory that it is being sent.

Owns the estimate of the robot's own time on the trajectory. The server's clock says when a
set-point is due; a controller may start later, run slower or stand still, and must not be sent more
than the lead ahead of where the robot really is.
"""

from __future__ import annotations

import math
from collections import deque
from operator import sub

from openpendant.motion.trajectory import Row

from .feedback import Feedback

SAME_PLACE = 1e-3
"""Samples closer than this to the report are one place; the latest of them counts [rad or m]."""

LONGEST_LAG = 0.5
"""A robot so far behind the plan does not follow it [s]."""

_SURELY = 1.0 - 1e-9
"""What rounding may do to a distance, many times over."""


class Following:
    """The robot's progress along the samples that left.

    Attributes:
        base: when the robot began the trajectory, as far as its reports tell [ns].
    """

    def __init__(self, started: int) -> None:
        """Assume that the robot starts at once, until its reports say otherwise."""
        self.base = started
        self._started = started
        self._sent: deque[Row] = deque()

    def sent(self, row: Row) -> None:
        """Note a sample that left."""
        self._sent.append(row)

    @property
    def lag(self) -> float:
        """How far the robot is behind the server's clock [s]."""
        return (self.base - self._started) / 1e9

    def go_on(self, time: float, now: int) -> None:
        """Take note that the robot rested, and that the set-point of `time` [s] leaves now."""
        rested = max(now - self.base - round(time * 1e9), 0)
        self.base += rested
        self._started += rested

    def update(self, feedback: Feedback) -> None:
        """Find the place of the last report on the trajectory, never before an earlier one.

        Where the report fits several samples, the latest counts: a dwell, a turn or a slow start
        must not look like a robot that stands still.
        """
        position = feedback.position
        if position is None or not self._sent or feedback.received < self._started:
            return
        for _ in range(self._place_of(position)):
            self._sent.popleft()
        robot_time = self._sent[0].time
        if len(self._sent) == 1:
            # It has reached all that was sent; how far beyond that it would be, nobody can see.
            self.base = min(self.base, feedback.received - round(robot_time * 1e9))
            self.base = max(self.base, self._started)
            return
        self.base = max(feedback.received - round(robot_time * 1e9), self._started)

    def _place_of(self, position: tuple[float, ...]) -> int:
        """Return the number of the last sample that is nearly as near to a report as the nearest.

        The gap of a sample is that of the joint which is farthest away.
        """
        near = math.inf
        places: list[tuple[float, int]] = []
        # Most samples are far: their distance, much sooner found than the gap, tells that the gap,
        # which is no less than a certain share of it, is too great.
        share = _SURELY / math.sqrt(len(position))
        for place, row in enumerate(self._sent):
            if share * math.dist(row.position, position) > near:
                continue
            gap = max(map(abs, map(sub, row.position, position)))
            if gap <= near:
                places.append((gap, place))
                if gap + SAME_PLACE < near:
                    near = gap + SAME_PLACE
        while places[-1][0] > near:
            places.pop()
        return places[-1][1]
