"""All of a cell beside motion and programs: recordings, frames, tools, scene, signals, trace.

Owns how these parts are joined, which of them answers a management request, and what of the cell
they are told. Decides nothing.
"""

from __future__ import annotations

import json

from pydantic import ValidationError

from openpendant.motion.errors import StartInCollision
from openpendant.motion.scene import Scene
from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import Capability
from openpendant.simplemsg.verdicts import VerdictCode

from ..news import News
from ..outgoing import Outgoing
from ..pendant.management_bodies import body_fault
from ..planning.jobs import Planned
from ..playback.operations import Asker
from ..recording.desk import RecordingDesk
from ..recording.operations import PREFIX, RECORDING_OPERATION
from ..refusal import Refusal, refusal_of
from ..robot_cell import RobotCell
from ..settings import CellSettings
from ..store.questions import AskStore
from .desk import WorldDesk
from .offered_signals import Offer
from .operations import WORLD_OPERATION
from .robot_surroundings import RobotSurroundings
from .scene_guard import SceneGuard
from .signals import CellSignals
from .trace import ToolTrace
from .world import World

_TRACE_NS = 40_000_000


class CellSurroundings:
    """What belongs to a cell beside its motion; what a program does beside moving, too.

    Attributes:
        world: frames, tools and scene.
        signals: inputs and outputs.
        recordings: recordings.
        trace: the way of the tool.
    """

    def __init__(
        self,
        cell: RobotCell,
        view: RobotSurroundings,
        ask: AskStore,
        settings: CellSettings,
        robot_name: str,
    ) -> None:
        """Join the parts; from now on motions are checked against the scene."""
        self._cell = cell
        self._view = view
        self._guard = SceneGuard(cell, settings.controller)
        self.world = World(settings.name, view, cell, ask, self._scene_changed)
        self.signals = CellSignals(is_offered=settings.controller.signals == "openpendant")
        self.trace = ToolTrace()
        self.recordings = RecordingDesk(
            cell,
            ask,
            lambda: view.tool_in_flange,
            robot_name=robot_name,
            state_period=settings.controller.state_period,
        )
        self._desk = WorldDesk(cell, self.world, view, self.signals, self.trace, robot_name)
        self._traced = 0
        self._reported = -1  # when the last report came that was taken
        self._is_loaded = False
        cell.motions.scene = view.scene
        cell.motions.is_surely_free = view.is_surely_free

    @property
    def capabilities(self) -> Capability:
        """What a pendant may ask of it; signals where the controller has some for us."""
        offered = Capability.RECORDING | Capability.SCENE
        return offered | Capability.SIGNALS if self.signals.is_offered else offered

    def contact(self) -> Refusal | None:
        """Return what the robot touches where it stands, of what it must not touch."""
        position = self._cell.feedback.position
        nearest = None if position is None else self._view.nearest(position)
        if nearest is None or not nearest.touching:
            return None
        return refusal_of(StartInCollision(nearest.first, nearest.second, nearest.distance))

    def _scene_changed(self, scene: Scene, now: int) -> list[Outgoing]:
        self._cell.motions.scene = scene
        return self._guard.changed(scene, now)

    # Requests.

    def operation(self, body: bytes, asker: Asker, now: int) -> list[Outgoing]:
        """Carry out a management request; the answer may come later."""
        try:
            if json.loads(body)["op"].startswith(PREFIX):
                return self.recordings.handle(RECORDING_OPERATION.validate_json(body), asker, now)
            return self._desk.handle(WORLD_OPERATION.validate_json(body), asker, now)
        except ValidationError as error:
            return asker.refuse(body_fault(error))

    # What happens in the cell.

    def reported(self, now: int) -> list[Outgoing]:
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
        return self.recordings.recorder.reported(feedback, now)

    def state_link(self, up: bool, now: int) -> list[Outgoing]:
        """Take note that the controller's state connection came or went."""
        return self.signals.link_changed(up, now)

    def answered(self, reply: Message, now: int) -> list[Outgoing]:
        """Take an answer on the controller's state connection."""
        return self.signals.answered(reply, now)

    def planned(self, planned: Planned, now: int) -> list[Outgoing] | None:
        """Take an answer of the planning process; None where the cell waits for it."""
        self.recordings.planned(planned)
        return self._guard.planned(planned, now)

    def began(self, now: int) -> list[Outgoing]:
        """Take note that the cell took a plan."""
        return self._guard.began(now)

    def news(self, news: News) -> list[Outgoing] | None:
        """Tell whoever plays a recording; None where the news is about something else."""
        return self.recordings.news(news)

    def dropped_by(self, news: News) -> list[Outgoing]:
        """Drop what waits to move where news ends that; whoever asked is told."""
        return self.recordings.dropped_by(news)

    def tick(self, now: int) -> list[Outgoing]:
        """Read signals, hold a motion whose way is not known to be free, see to recordings."""
        if not self._is_loaded:
            self._is_loaded = True
            return self.world.load()
        return self.recordings.tick(now) + self.signals.tick(now) + self._guard.tick(now)

    def shut_down(self) -> list[Outgoing]:
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

    def set_output(self, signal: int, value: bool, now: int) -> list[Outgoing] | Refusal:
        """Give an output a value."""
        return self.signals.set_output(signal, value, now)

    def attach(self, scene_object: str, now: int) -> list[Outgoing] | Refusal:
        """Let the tool carry an object."""
        position = self._cell.feedback.position
        if position is None:
            return Refusal(VerdictCode.FEEDBACK_STALE)
        return self.world.carry(scene_object, position, now)

    def detach(self, scene_object: str, now: int) -> list[Outgoing] | Refusal:
        """Leave an object where it is."""
        position = self._cell.feedback.position
        if position is None:
            return Refusal(VerdictCode.FEEDBACK_STALE)
        return self.world.put_down(scene_object, position, now)
