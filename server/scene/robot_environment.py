"""Interfaces of the planning scene: the robot's mathematics in a scene, and who watches motions."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import Scene
from openpendant.motion.steps import Stepwise

from ..cell.execution.feedback import JointVector
from ..events.effects import Effect
from ..planning.jobs import PoseGoal
from ..refusal import Refusal

if TYPE_CHECKING:
    from openpendant.motion.scene.collision import BuildStep, Proximity
    from openpendant.motion.scene.grasping import Grip


class SceneModel(Protocol):
    """The robot's mathematics, as far as the planning scene needs them."""

    frames: FrameTree

    @property
    def built(self) -> Any:
        """The scene in force with what its checks are made with."""

    @property
    def scene(self) -> Scene:
        """The scene in force."""

    @property
    def flange_link(self) -> str:
        """Name of the link that tools are bolted to."""

    def scene_steps(self, scene: Scene) -> Generator[BuildStep, None, Any]:
        """Build a scene in steps, each announced before it is made; return it for `apply_scene`.

        Raises:
            MotionError: the scene does not fit the robot; before a step that `fits`, but for a mesh
                that cannot be read.
        """

    def apply_scene(self, frames: FrameTree, built: Any) -> None:
        """Put frames, tools and a scene that is built in force."""

    def nearest_steps(
        self, position: Sequence[float]
    ) -> Generator[BuildStep, None, Proximity | None]:
        """Find the nearest two bodies at (n,) joints in steps, each announced before it is made.

        Returns:
            None where there is nothing to check.
        """

    def flange(self, position: JointVector) -> Pose:
        """Return the flange in the base frame at (n,) joints."""

    def link_pose(self, position: JointVector, link: str) -> Pose:
        """Return a link of the robot in the base frame at (n,) joints.

        Raises:
            FrameUnknown: there is no such link.
        """

    def gripped(self, scene: Scene, name: str, position: JointVector, link: str | None) -> Grip:
        """Let a link take an object of a scene at (n,) joints; None for the selected tool's.

        Raises:
            MotionError: there is no such object or link, one holds it, or it is beyond reach.
        """

    def held_steps(self, before: Scene, after: Scene) -> Stepwise[None]:
        """Measure in steps what links hold in a scene and did not in the one before.

        Raises:
            NothingGripped: an object is beyond reach.
        """


class Ground(Protocol):
    """The cell, as far as the planning scene asks it and reports to it."""

    def show_scene(self, awaited: str, unread: str, unbuilt: str) -> None:
        """Take the reasons why no motion may start.

        Args:
            awaited: what the store is asked about, or being put in force, in words; empty for none.
            unread: what the store keeps and could not be put in force, in words; empty for nothing.
            unbuilt: what a jog would not see yet, in words; empty for nothing.
        """

    def under_way(self) -> str:
        """Return what is planned or moves, in words; empty where nothing is."""


class RobotEnvironment(SceneModel, Protocol):
    """The mathematics of one robot in its scene."""

    @property
    def specification(self) -> Mapping[str, Any]:
        """Limits, Denavit-Hartenberg table and home of the robot, as JSON can hold them."""

    @property
    def shapes(self) -> Mapping[str, Any]:
        """What the robot looks like, as JSON can hold it."""

    @property
    def tool_in_flange(self) -> PoseGoal | None:
        """The centre point of the selected tool in the flange; None for the flange itself."""

    def is_surely_free(self, start: Sequence[float], goal: Sequence[float]) -> bool:
        """Return True if a straight move between (n,) joints surely touches nothing in the scene.

        Takes about 1 ms at most; False means only that the full check is needed.
        """

    def tool_motion(
        self, position: Sequence[float], velocity: Sequence[float]
    ) -> tuple[tuple[float, ...], tuple[float, ...], float]:
        """Return place [m], quaternion and speed [m/s] of the tool in the base frame."""

    def tool_pose(self, position: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return x, y, z [m] and quaternion x, y, z, w of the tool in the base frame."""

    def condition(self, position: Sequence[float]) -> float | None:
        """Return the condition number of the Jacobian at (n,) joints; None at a singularity."""


Told: TypeAlias = Callable[[int | Refusal, int], list[Effect]]
"""Takes the new revision of a document, or why it was not changed, and the time."""

FrameChange: TypeAlias = Callable[[FrameTree], FrameTree]
SceneChange: TypeAlias = Callable[[Scene], Scene]
InForce: TypeAlias = Callable[[Refusal | None, int], list[Effect]]
"""Takes why a scene was not put in force, None where it was, and the time."""


class Watcher(Protocol):
    """The parts of the cell that have to know of a changed scene."""

    def planned_in(self, scene: Scene, now: int, asked: int) -> list[Effect]:
        """Plan in another scene from now on, and check the motion under way against it.

        Args:
            asked: when the change was asked for [ns]; from then the time for the check runs.
        """

    def announced(self, now: int) -> list[Effect]:
        """Take the motion under way for unchecked from now on; `planned_in` will come.

        What is being added may be in its way, and it is not known yet whether that fits.
        """

    def seen(self, *, is_whole: bool) -> None:
        """Take note whether the model in force has all that is planned around."""
