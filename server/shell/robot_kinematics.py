"""Mathematics of one robot, as the shell supplies them to the cores (`robot_model`)."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from openpendant.motion.description.robot import SerialRobot
from openpendant.motion.errors import BadArgument
from openpendant.motion.frames.frame_tree import BASE, TOOL, FrameTree
from openpendant.motion.jog import (
    EscapeDirection,
    JogCaps,
    Jogger,
    JogModel,
    JogTarget,
    JointJog,
    ToolJog,
    find_escapes,
    leads_out,
)
from openpendant.motion.jog.jog_commands import shifted, turned
from openpendant.motion.jog.line_speed_bounds import lever_arms
from openpendant.motion.kinematics.ik.configuration import Configuration, configuration_of
from openpendant.motion.kinematics.ik.singularity import condition
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.robot_report.robot_report import robot_data
from openpendant.motion.robot_report.shapes_report import shapes_report
from openpendant.motion.scene.clearance import ClearPath
from openpendant.motion.scene.collision import BuildStep, CollisionModel, Proximity
from openpendant.motion.scene.grasping import Grip, gripped, held_steps
from openpendant.motion.scene.scene import Scene
from openpendant.motion.steps import Stepwise
from openpendant.motion.trajectory.point_speed import elbow_link

from ..planning.jobs import JointVector, PoseGoal
from ..settings.cell_settings import JogSettings

_JointMotion = tuple[tuple[float, ...], tuple[float, ...]]
"""Position [rad or m] and velocity […/s] of all joints."""

_ToolMotion = tuple[tuple[float, ...], tuple[float, ...], float]
"""Place [m], quaternion and speed [m/s] of the tool in the base frame."""

MOST_PAIRS = 2_000
"""How many pairs of bodies a scene may have to be checked.

One look at all of them takes five milliseconds or so. The model of a scene is built on the event
loop, in steps of about a millisecond. On an arm of eight moving shapes 250 standing objects make so
many; each held one makes one more with each that stands.
"""

_PROOF = 50.0  # µs: the proof of clear ways for a model


@dataclass(frozen=True, slots=True)
class BuiltScene:
    """A scene with what its checks are made with.

    Attributes:
        scene: the objects, and what may touch.
        collision: the model of the robot among them.
        clear_path: proves ways clear on it.
    """

    scene: Scene
    collision: CollisionModel
    clear_path: ClearPath

    def parts_to_drop(self) -> list[object]:
        """Return all that takes long to be freed, to be dropped apart."""
        return self.collision.parts_to_drop()


class RobotKinematics:
    """Kinematics, frames and jog mathematics of a serial robot.

    Attributes:
        frames: the named frames and tools in force; `apply_scene` changes them.
        built: the scene in force with its model; likewise.
        tool_in_flange: the centre point of the selected tool; None for the flange itself.
        lever_arms: for the tool and the elbow, if any, (n,) how fast each joint can make it
            [m/rad or 1].
    """

    def __init__(self, robot: SerialRobot) -> None:
        """Build the models of a robot; takes a while."""
        self._robot = robot
        self._kinematics = Kinematics(robot)
        self._rest = np.zeros(self._kinematics.dof)
        self._elbow = elbow_link(self._kinematics)
        self.frames = FrameTree.of_robot(self._kinematics.to_base(Pose.identity(), "root"))
        collision = CollisionModel(self._kinematics)
        self.built = BuiltScene(Scene(), collision, ClearPath(collision))
        self._mount(Pose.identity())
        self._jogs = JogModel(self._kinematics, collision=collision)

    @property
    def scene(self) -> Scene:
        """The objects in force."""
        return self.built.scene

    def scene_steps(self, scene: Scene) -> Generator[BuildStep, None, BuiltScene]:
        """Build what a scene needs in steps, each announced before it is made; return it.

        What is in force stays as it is.

        Raises:
            MotionError: the scene does not fit the robot or is too large; before a step that
                `fits`, but for a mesh.
        """
        if scene == self.scene:
            yield BuildStep(0.0, fits=True)
            return self.built
        collision = yield from CollisionModel.in_steps(
            self._kinematics, scene, most_pairs=MOST_PAIRS, before=self.built.collision
        )
        yield BuildStep(_PROOF, fits=True)
        return BuiltScene(scene, collision, ClearPath(collision))

    def apply_scene(self, frames: FrameTree, built: BuiltScene) -> None:
        """Let frames, tools and scene rule from now on; a jog under way keeps those that it has."""
        tcp = frames[TOOL].pose or Pose.identity()
        self._jogs = JogModel(self._kinematics, tcp, built.collision)
        self.frames, self.built = frames, built
        self._mount(tcp)

    def _mount(self, tcp: Pose) -> None:
        """Let a tool rule whose centre point is there in the flange."""
        self._tcp = tcp
        kinematics, elbow = self._kinematics, self._elbow
        self._tool = kinematics.tool_frame(tcp)
        self.tool_in_flange: PoseGoal | None = None
        if self._tool.placement is not None:
            position, quaternion = tcp.position.tolist(), tcp.quaternion.tolist()
            self.tool_in_flange = PoseGoal(tuple(position), tuple(quaternion))
        self._speed_points = [self._tool.origin]
        offset = math.hypot(*tcp.position.tolist())
        self.lever_arms = [lever_arms(kinematics, self._robot.tool_link, offset)]
        if elbow is not None:
            self._speed_points.append(kinematics.link_point(elbow))
            self.lever_arms.append(lever_arms(kinematics, elbow))
        self._last_motion: tuple[_JointMotion, _ToolMotion] | None = None

    @property
    def specification(self) -> dict[str, Any]:
        """Limits, Denavit-Hartenberg table and home of the robot, as JSON can hold them."""
        return robot_data(self._robot)

    @property
    def shapes(self) -> dict[str, Any]:
        """What the robot looks like, as JSON can hold it."""
        return shapes_report(self._robot)

    @property
    def jog_model(self) -> JogModel:
        """What jogs that begin now are made with; another one once frames, tool or scene change."""
        return self._jogs

    @property
    def flange_link(self) -> str:
        """Name of the link that tools are bolted to."""
        return self._robot.tool_link

    def flange(self, position: Sequence[float]) -> Pose:
        """Return the flange in the base frame at (n,) joints."""
        return self._kinematics.forward(position)

    def link_pose(self, position: Sequence[float], link: str) -> Pose:
        """Return a link in the base frame at (n,) joints.

        Raises:
            FrameUnknown: there is no such link.
        """
        return self._kinematics.forward(position, link=link)

    def gripped(self, scene: Scene, name: str, position: Sequence[float], link: str | None) -> Grip:
        """Let a link take an object of a scene at (n,) joints; None for the selected tool's.

        Raises:
            MotionError: as of `motion.scene.grasping.gripped`.
        """
        return gripped(self._kinematics, self.frames, scene, name, position, link)

    def held_steps(self, before: Scene, after: Scene) -> Stepwise[None]:
        """Measure in steps what links hold in a scene and did not in the one before.

        Raises:
            NothingGripped: an object is beyond reach.
        """
        return held_steps(self._kinematics, self.frames, before, after)

    def nearest_steps(
        self, position: Sequence[float]
    ) -> Generator[BuildStep, None, Proximity | None]:
        """Find the nearest two bodies at (n,) joints in steps, each announced before it is made.

        Returns:
            None where there is nothing to check.
        """
        return self.built.collision.distance_in_steps(position)

    def is_surely_free(self, start: Sequence[float], goal: Sequence[float]) -> bool:
        """Return True if a straight move between (n,) joints surely touches nothing in the scene.

        Takes a millisecond or so at most; a no says only that more must be looked at.
        """
        return self.built.clear_path.is_sure(start, goal)

    def tool_pose(self, position: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return x, y, z [m] and quaternion x, y, z, w of the tool in the base frame."""
        place, _ = self._kinematics.tool_motion(np.array(position), self._rest, self._tool)
        return place

    def tool_motion(self, position: Sequence[float], velocity: Sequence[float]) -> _ToolMotion:
        """Return place [m], quaternion and speed [m/s] of the tool in the base frame."""
        # Several ask about one report, and a robot that stands reports the same again.
        asked = tuple(position), tuple(velocity)
        last = self._last_motion
        if last is None or last[0] != asked:
            joints, rates = np.array(position), np.array(velocity)
            (place, turn), speed = self._kinematics.tool_motion(joints, rates, self._tool)
            last = self._last_motion = asked, (place, turn, speed)
        return last[1]

    def speed_points(self, position: Sequence[float]) -> tuple[tuple[float, ...], ...]:
        """Return where tool and elbow, if any, are in the base frame [m]."""
        return self._kinematics.point_places(position, self._speed_points)

    def configuration(self, position: Sequence[float]) -> Configuration | None:
        """Return in which of the ways the arm stands; None where its family has no such words."""
        return configuration_of(self._kinematics, position)

    @property
    def named_positions(self) -> Mapping[str, JointVector]:
        """The joint positions that the robot's file names: `home`, `zero` and others."""
        return self._robot.named_positions

    def condition(self, position: Sequence[float]) -> float | None:
        """Return the condition number of the Jacobian at (n,) joints; None at a singularity."""
        found = condition(self._kinematics, position)
        return found if math.isfinite(found) else None

    def begin(self, start: Sequence[float], caps: JogCaps) -> Jogger:
        """Return a jogger that stands at `start` (n,)."""
        return Jogger(self._jogs, start, caps)

    def caps(self, override: float, settings: JogSettings, point_speed: float | None) -> JogCaps:
        """Return the caps of a jog; `point_speed` rules tool and elbow [m/s], None for nothing."""
        tool_speed = (
            settings.tool_speed if point_speed is None else min(settings.tool_speed, point_speed)
        )
        return JogCaps(override, settings.joint_speed, tool_speed, settings.rotation_speed, False)

    def joints(self, rates: Sequence[float]) -> JogTarget:
        """Return the target of a joint jog from (n,) shares, -1 to 1."""
        return JointJog(tuple(rates))

    def tool(self, values: Sequence[float], frame: str) -> ToolJog:
        """Return the target of a tool jog from (6,) shares along and about the frame's axes."""
        return ToolJog(tuple(values[:3]), tuple(values[3:]), self._axes(frame))

    def escape_directions(self, position: Sequence[float]) -> list[EscapeDirection]:
        """Return at what a jog stands at joints (n,), and which joint leads out of each."""
        return find_escapes(self._jogs, position)

    def leads_out(self, position: Sequence[float], values: Sequence[float], frame: str) -> bool:
        """Return True if a tool jog of (6,) shares leads out of all that it stands at."""
        return leads_out(self._jogs, position, self.tool(values, frame))

    def stepped_pose(self, start: Sequence[float], values: Sequence[float], frame: str) -> PoseGoal:
        """Return the tool in base after a (6,) increment [m, rad] of it from `start`.

        The turn is about one axis through the tool point, along (a, b, c) in the frame.
        """
        here = self._kinematics.forward(start).compose(self._tcp)
        axes = here if frame == TOOL else self._standing(frame)
        goal = turned(shifted(here, values[:3], axes), values[3:], axes)
        return PoseGoal(tuple(goal.position.tolist()), tuple(goal.quaternion.tolist()))

    def _axes(self, frame: str) -> tuple[float, float, float, float] | None:
        """Return the axes of a frame in base; None for the tool's own, which move along."""
        if frame == TOOL:
            return None
        x, y, z, w = self._standing(frame).quaternion.tolist()
        return x, y, z, w

    def _standing(self, frame: str) -> Pose:
        """Return a frame that stands still, in base."""
        if self.frames.moving_between(frame, BASE):
            raise BadArgument("frame", frame, "base, root, tool or a frame that stands still")
        return self.frames.transform(frame, BASE)
