"""Interface of the cores to a robot's mathematics.

The shell supplies it, so that the cores load no kinematics and their tests can do without.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from ..planning.jobs import JointVector, PoseGoal
from ..settings.cell_settings import JogSettings

if TYPE_CHECKING:
    from openpendant.motion.frames.frame_tree import FrameTree
    from openpendant.motion.jog import EscapeDirection, JogCaps, Jogger, JogTarget
    from openpendant.motion.kinematics.ik.configuration import Configuration


class RobotModel(Protocol):
    """The mathematics of one robot. Joint vectors are controller side, (n,) [rad or m]."""

    frames: FrameTree

    @property
    def tool_in_flange(self) -> PoseGoal | None:
        """The centre point of the selected tool in the flange; None for the flange itself."""

    @property
    def jog_model(self) -> object:
        """What jogs that begin now are made with; another one once frames, tool or scene change."""

    @property
    def lever_arms(self) -> Sequence[Sequence[float]]:
        """For the tool and the elbow, if any, (n,) how fast each joint can make it [m/rad or 1]."""

    def speed_points(self, position: Sequence[float]) -> tuple[tuple[float, ...], ...]:
        """Return where tool and elbow, if any, are in the base frame [m]."""

    def configuration(self, position: Sequence[float]) -> Configuration | None:
        """Return in which of the ways the arm stands; None where the robot has no such words."""

    def tool_pose(self, position: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return x, y, z [m] and quaternion x, y, z, w of the tool in the base frame."""

    def tool_motion(
        self, position: Sequence[float], velocity: Sequence[float]
    ) -> tuple[tuple[float, ...], tuple[float, ...], float]:
        """Return place [m], quaternion and speed [m/s] of the tool in the base frame."""

    @property
    def named_positions(self) -> Mapping[str, JointVector]:
        """The joint positions that the robot's file names: `home`, `zero` and others."""

    def begin(self, start: Sequence[float], caps: JogCaps) -> Jogger:
        """Return a jogger that stands at `start` (n,)."""

    def caps(self, override: float, settings: JogSettings, point_speed: float | None) -> JogCaps:
        """Return the caps of a jog; `point_speed` rules tool and elbow [m/s], None for nothing."""

    def joints(self, rates: Sequence[float]) -> JogTarget:
        """Return the target of a joint jog from (n,) shares, -1 to 1.

        Raises:
            MotionError: a share is none.
        """

    def tool(self, values: Sequence[float], frame: str) -> JogTarget:
        """Return the target of a tool jog from (6,) shares along and about the frame's axes.

        Raises:
            MotionError: a share is none, or nobody knows the frame.
        """

    def escape_directions(self, position: Sequence[float]) -> list[EscapeDirection]:
        """Return at what a jog stands at joints (n,), and which joint leads out of each."""

    def leads_out(self, position: Sequence[float], values: Sequence[float], frame: str) -> bool:
        """Return True if a tool jog of (6,) shares leads out of all that it stands at.

        Raises:
            MotionError: nobody knows the frame any more.
        """

    def stepped_pose(self, start: Sequence[float], values: Sequence[float], frame: str) -> PoseGoal:
        """Return the tool in base after a (6,) increment of it [m, rad] from joints `start`.

        Raises:
            MotionError: a value is none, or nobody knows the frame.
        """
