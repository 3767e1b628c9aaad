"""A pose that a job names: one to reach, or the tool in the flange; plain data."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PoseGoal:
    """A tool pose to reach.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w; normalised by the planner.
    """

    position: tuple[float, ...]
    orientation: tuple[float, ...]
