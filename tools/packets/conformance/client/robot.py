"""A simple robot that follows the points of a client: straight from one to the next.

Owns where the robot of the scripted controller is at a time. It is no emulator: no acceleration, no
limits, no buffer; the judge looks at what the client sent, not at how well it can be followed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from openpendant.simplemsg import JOINT_SLOTS, joint_array

from .trajectories import BEGINNINGS, GroupPoint

SAME_PLACE = 1e-3
"""A robot this close to a point is there [rad or m]."""


class Drive(Enum):
    """State of the robot's drive."""

    ON = "it follows"
    STOPPED = "an emergency stop holds it"


@dataclass(frozen=True, slots=True)
class _Target:
    time: int
    positions: tuple[float, ...]


def _is_finite(part: GroupPoint) -> bool:
    """Return True if a point can be followed at all; the judge says what is wrong with it."""
    return all(map(math.isfinite, (*part.positions, part.time or 0.0, part.duration or 0.0)))


class FollowingRobot:
    """The robot's first group; others follow unseen.

    Attributes:
        drive: whether it follows points.
    """

    def __init__(self, positions: tuple[float, ...]) -> None:
        """Put the robot somewhere; missing joints stand at 0."""
        self.drive = Drive.ON
        self._start = _Target(0, joint_array(positions[:JOINT_SLOTS]))
        self._targets: list[_Target] = []
        self._began = 0

    def follow(self, sequence: int, part: GroupPoint, now: int) -> None:
        """Take a point as the next target."""
        if self.drive is Drive.STOPPED or not _is_finite(part):
            return
        if sequence in BEGINNINGS:
            self.stop(now)
            self._began = now
        if part.time is not None:
            due = self._began + round(part.time * 1e9)
        else:
            here = self._targets[-1] if self._targets else _Target(now, self.at(now))
            gap = max(abs(a - b) for a, b in zip(here.positions, part.positions, strict=True))
            # The stock client gives its first point 10 s, wherever the robot stands.
            rests = sequence in BEGINNINGS and gap <= SAME_PLACE
            due = max(here.time, now) + (0 if rests else round((part.duration or 0.0) * 1e9))
        self._targets.append(_Target(due, part.positions))

    def stop(self, now: int) -> None:
        """Stand still where it is and forget all targets."""
        self._start = _Target(now, self.at(now))
        self._targets.clear()

    def at(self, now: int) -> tuple[float, ...]:
        """Return where it is, (10,) [rad or m]."""
        before = self._start
        for target in self._targets:
            if now < target.time:
                share = (now - before.time) / (target.time - before.time)
                pairs = zip(before.positions, target.positions, strict=True)
                return tuple(a + max(0.0, share) * (b - a) for a, b in pairs)
            before = target
        return before.positions

    def moves(self, now: int) -> bool:
        """Return True if a target lies ahead."""
        return bool(self._targets) and now < self._targets[-1].time
