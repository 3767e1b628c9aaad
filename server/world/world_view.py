"""What frames, tools and scene ask of others: of the robot's mathematics, and of the cell."""

from __future__ import annotations

from typing import Protocol

from openpendant.motion.frames import FrameTree
from openpendant.motion.pose import Pose
from openpendant.motion.scene import Scene

from ..driving.joint_history import JointVector


class WorldView(Protocol):
    """What the world needs of the robot's mathematics.

    Attributes:
        frames: the named frames and tools in force.
        scene: what stands around, in force.
    """

    frames: FrameTree
    scene: Scene

    @property
    def flange_link(self) -> str:
        """Name of the link that tools are bolted to."""

    def surround(self, frames: FrameTree, scene: Scene) -> None:
        """Let frames, tools and scene rule from now on.

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
    """What the world needs to know of the cell, and tells it.

    Attributes:
        awaited: which frames and tools the store is asked about, in words; until it has answered
            no motion begins. Empty for none.
        unread: what the store keeps and could not be put in force, in words; until it is changed no
            motion begins either. Empty for nothing.
    """

    awaited: str
    unread: str

    def under_way(self) -> str:
        """Return what is planned or moves, in words; empty where nothing is."""
