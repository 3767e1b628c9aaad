"""All of a cell beside motion and programs: recordings, frames, tools, scene, signals, questions.

Owns how these parts are joined and what of the cell they are told. Decides nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from openpendant.motion.errors import StartInCollision
from openpendant.motion.frames.frame_tree import BASE, FLANGE
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import Scene
from openpendant.simplemsg.pendant import Capability

from .cell.robot_cell import RobotCell
from .events.effects import Effect
from .events.pending import Pending
from .kinematics.kinematics_service import KinematicsService
from .kinematics.question_rates import QuestionRates
from .positions.position_book import PositionBook
from .positions.position_service import PositionService
from .programs.interpreter.run_events import Offer
from .recording.recording_service import RecordingService
from .refusal import Refusal, refusal_of
from .scene.grasps import Grasps, Rearranged
from .scene.planning_scene import PlanningScene
from .scene.robot_environment import RobotEnvironment
from .scene.scene_monitor import SceneMonitor
from .scene.scene_service import SceneService
from .scene.signals import CellSignals
from .scene.trace import ToolTrace
from .settings.cell_settings import CellSettings
from .shapes.shapes_service import ShapesService

if TYPE_CHECKING:
    from openpendant.motion.scene.collision import Proximity

_TRACE_NS = 40_000_000


class CellEnvironment:
    """The parts of a cell beside its motion, as programs use them too."""

    def __init__(
        self,
        cell: RobotCell,
        view: RobotEnvironment,
        pending: Pending,
        settings: CellSettings,
        robot_name: str,
        positions: PositionBook,
        rates: QuestionRates | None = None,
    ) -> None:
        """Join the parts; from now on motions are checked against the scene.

        Args:
            rates: of questions on kinematics, for all cells of the server; of this cell alone
                where left out.
        """
        self._cell = cell
        self._view = view
        self.monitor = SceneMonitor(cell, settings.controller, pending)
        self.world = PlanningScene(settings.name, view, cell, pending, self)
        self.signals = CellSignals(is_offered=settings.controller.signals == "openpendant")
        self.trace = ToolTrace()
        self.recordings = RecordingService(
            cell,
            pending,
            lambda: view.tool_in_flange,
            robot_name=robot_name,
            state_period=settings.controller.state_period,
        )
        self.positions = positions
        rates = rates or QuestionRates()
        self.named = PositionService(cell, positions, view, pending, rates)
        self.grasps = Grasps(cell, view, self.world, self.signals)
        self.service = SceneService(
            *(cell, self.world, view, self.grasps, self.signals, self.trace, robot_name)
        )
        self.kinematics = KinematicsService(cell, view, pending, rates)
        self.shapes = ShapesService(pending, cell.motions.new_job_id, view.shapes)
        self._traced = 0
        self._reported = -1  # when the last report came that was taken
        cell.motions.scene = view.scene
        cell.motions.is_surely_free = view.is_surely_free

    @property
    def capabilities(self) -> Capability:
        """What a pendant may ask of it; signals where the controller has some for us."""
        offered = Capability.RECORDING | Capability.SCENE | Capability.GRASP
        offered |= Capability.KINEMATICS | Capability.POSITIONS | Capability.SHAPES
        return offered | Capability.SIGNALS if self.signals.is_offered else offered

    def place_of(self, frame: str, position: Sequence[float]) -> Pose:
        """Return where a frame is in base at (n,) joints.

        Raises:
            FrameUnknown: there is no such frame.
        """
        tree = self.world.frames
        if not tree.moving_between(frame, BASE):
            return tree.transform(frame, BASE)
        return tree.transform(frame, BASE, {FLANGE: self._view.flange(tuple(position))})

    def contact(
        self, then: Callable[[Refusal | None, int], list[Effect]], now: int
    ) -> list[Effect]:
        """Find what the robot touches where it stands, of what it must not touch."""
        position = self._cell.feedback.position
        if position is None:
            return then(None, now)

        def found(nearest: Proximity | None, at: int) -> list[Effect]:
            if nearest is None or not nearest.touching:
                return then(None, at)
            touched = StartInCollision(nearest.first, nearest.second, nearest.distance)
            return then(refusal_of(touched), at)

        return self.world.nearest(position, found, now)

    # For the planning scene.

    def planned_in(self, scene: Scene, now: int, asked: int) -> list[Effect]:
        """Plan in another scene from now on, and check the motion under way against it."""
        self._cell.motions.scene = scene
        return self.monitor.changed(scene, now, asked)

    def announced(self, now: int) -> list[Effect]:
        """Take the motion under way for unchecked from now on; `planned_in` will come."""
        return self.monitor.announced(now)

    def seen(self, *, is_whole: bool) -> None:
        """Let ways be proved free here only while the model has all that is planned around."""
        self._cell.motions.is_surely_free = self._view.is_surely_free if is_whole else None

    # What happens in the cell.

    def reported(self, now: int) -> list[Effect]:
        """Take note that the controller reported."""
        feedback = self._cell.feedback
        position = feedback.position
        if position is not None and feedback.received != self._reported:
            self._reported = feedback.received
            self.world.history.reported(now, position)
            if now - self._traced >= _TRACE_NS:
                self._traced = now
                # With the speed, which nobody asks for here: the state message asks for the same.
                self.trace.add(self._view.tool_motion(position, feedback.velocity)[0])
        recorder = self.recordings.recorder
        return [] if recorder.run is None else recorder.reported(feedback, now)

    @property
    def ticked(self) -> tuple[Callable[[int], list[Effect]], ...]:
        """What is to be told of each tick but the first, in this order."""
        signals = (self.signals.tick,) if self.signals.is_offered else ()
        return *self.recordings.ticked, *signals, self.monitor.tick

    def shut_down(self) -> list[Effect]:
        """Have written what is recorded."""
        return self.recordings.shut_down()

    # For programs.

    @property
    def offered_signals(self) -> Offer:
        """Which signals the controller has."""
        return self.signals.offer

    def input(self, signal: int, now: int) -> bool | Refusal:
        """Return the value of an input."""
        return self.signals.input(signal, now)

    def set_output(self, signal: int, value: bool, now: int) -> list[Effect] | Refusal:
        """Give an output a value."""
        return self.signals.set_output(signal, value, now)

    def attach(self, scene_object: str, now: int, then: Rearranged) -> list[Effect]:
        """Let the tool take an object within its reach."""
        return self.grasps.take_in_passing(scene_object, now, then)

    def detach(self, scene_object: str, now: int, then: Rearranged) -> list[Effect]:
        """Leave an object where it is."""
        return self.grasps.leave_in_passing(scene_object, now, then)
