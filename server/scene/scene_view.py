"""Interfaces that the planning scene needs: to the robot's mathematics, and to the cell.

Protocols only; `robot_model` holds those that every motion needs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import Scene

from ..cell.execution.feedback import JointVector
from ..planning.jobs import PoseGoal

if TYPE_CHECKING:
    from openpendant.motion.scene.collision import Proximity


class SceneModel(Protocol):
    """The robot's mathematics, as far as the planning scene needs them.

    Attributes:
        frames: the named frames and tools in force.
        scene: the objects in force.
    """

    frames: FrameTree
    scene: Scene

    @property
    def flange_link(self) -> str:
        """Name of the link that tools are bolted to."""

    def surround(self, frames: FrameTree, scene: Scene) -> None:
        """Put frames, tools and scene in force.

        Raises:
            MotionError: the scene does not fit the robot; all stays as it was.
        """

    def flange(self, position: JointVector) -> Pose:
        """Return the flange in the base frame at (n,) joints."""

    def link_pose(self, position: JointVector, link: str) -> Pose:
        """Return a link of the robot in the base frame at (n,) joints.

        Raises:
            FrameUnknown: there is no such link.
        """


class Ground(Protocol):
    """The cell, as far as the planning scene asks it and reports to it."""

    def show_scene(self, awaited: str, unread: str) -> None:
        """Take the reasons why no motion may start.

        Args:
            awaited: which frames and tools the store is asked about, in words; empty for none.
            unread: what the store keeps and could not be put in force, in words; empty for nothing.
        """

    def under_way(self) -> str:
        """Return what is planned or moves, in words; empty where nothing is."""


class RobotEnvironment(SceneModel, Protocol):
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
        """Return True if a straight move between (n,) joints surely touches nothing in the scene.

        Takes about 1 ms at most; False means only that the full check is needed.
        """

    def tool_motion(
        self, position: Sequence[float], velocity: Sequence[float]
    ) -> tuple[tuple[float, ...], tuple[float, ...], float]:
        """Return place [m], quaternion and speed [m/s] of the tool in the base frame."""
