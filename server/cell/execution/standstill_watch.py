"""Whether a robot that nobody commands moves all the same.

Owns what counts as moving: a joint that is reported 0.02 rad (10 mm on a sliding one) from where it
was within the last second. It stops nothing, because somebody may move the robot with the
controller's own pendant; but whoever wonders afterwards is to find it told.
"""

from __future__ import annotations

import math
from collections import deque

from openpendant.motion.description.limits import JointLimits

from ...events.cell_events import UncommandedMotion
from .report_timing import Place
from .tracking_tolerances import PER_RADIAN

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
