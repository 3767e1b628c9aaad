"""How the last motion of a cell is taken back, where it was a jog.

Owns what an undo goes along. It belongs to one motion and is asked for only while that motion is
the last that began, so a request that was refused leaves it as it was, and any other motion, after
which the robot is no longer where the way ends, leaves none. Whether something else moved the robot
since is `trajectory_execution`'s to tell.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...planning.jobs import JointVector

Waypoints = tuple[JointVector, ...]
"""Joint positions (n,) to go to one after the other, controller side [rad or m]."""


@dataclass(frozen=True, slots=True)
class UndoPlan:
    """What a motion says of its undo when it is asked for.

    Attributes:
        waypoints: returns those back to where the jog began, the start last.
        is_undo: the motion goes along them itself, so that only what it left out is still to go.
    """

    waypoints: Callable[[], Waypoints]
    is_undo: bool = False

    def left(self, passed: int, *, has_arrived: bool) -> Waypoints:
        """Return what is still to go; empty where nothing is.

        Args:
            passed: how many waypoints the set-points of the motion have passed.
            has_arrived: the robot stood at the motion's end.
        """
        way = self.waypoints()
        if not self.is_undo:
            return way
        if has_arrived:
            return ()
        # Set-points run ahead of the robot: all may have left before it was stopped on the way.
        return way[min(passed, len(way) - 1) :]
