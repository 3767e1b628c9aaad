"""What frames, tools and scene ask of a robot's mathematics, beside what every motion asks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from ..planning.pose_goal import PoseGoal
from .world_view import WorldView

if TYPE_CHECKING:
    from openpendant.motion.collision import Proximity


class RobotSurroundings(WorldView, Protocol):
    """The mathematics of one robot in its scene."""

    @property
    def specification(self) -> Mapping[str, Any]:
        """Limits, Denavit-Hartenberg table and home of the robot, as JSON can hold them."""

    @property
    def tool_in_flange(self) -> PoseGoal | None:
        """The centre point of the selected tool in the flange; None for the flange itself."""

    def nearest(self, position: Sequence[float]) -> Proximity | None:
        """Return the nearest two bodies at (n,) joints; None where there is nothing to check."""

    def is_surely_free(self, start: Sequence[float], goal: Sequence[float]) -> bool:
        """Tell whether a straight move between (n,) joints surely touches nothing in the scene.

        Takes a millisecond or so at most; a no says only that more must be looked at.
        """

    def tool_motion(
        self, position: Sequence[float], velocity: Sequence[float]
    ) -> tuple[tuple[float, ...], tuple[float, ...], float]:
        """Return place [m], quaternion and speed [m/s] of the tool in the base frame."""
