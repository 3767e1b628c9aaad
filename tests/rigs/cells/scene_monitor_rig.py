"""A robot on its way whose scene changes, the monitor of that scene, and a pendant's hands."""

from rigs.cells.server_rig import ServerRig, jobs_in, ready
from rigs.motion.jog_pad import JogPad
from rigs.peers.server_clients import Pendant

from openpendant.motion.scene.scene import Box, Scene, SceneObject
from openpendant.server.events.effects import Ask, Effect
from openpendant.server.events.pending import Pending
from openpendant.server.planning.jobs import PathFree, PlanAnswer, WayCheckJob
from openpendant.server.refusal import Refusal
from openpendant.server.scene.scene_monitor import SceneMonitor
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode as V

BOX = Scene((SceneObject("box", Box((0.1, 0.1, 0.1))),))
EMPTY = Scene()
HIT = Refusal(V.PATH_IN_COLLISION, "box and elbow touch at 40.0% of the path")


class MonitoredRig:
    """A robot on its way, or its motion being planned, and the guard beside it."""

    def __init__(self, *, plans_at_once: bool = True, mode: str = "automatic") -> None:
        self.rig: ServerRig = ready(plans_at_once=plans_at_once, modes={"initial": mode})
        self.pad = JogPad(self.rig)
        self.pad.squeeze()
        self.pendant: Pendant = self.pad.pendant
        self.pendant.path((0.9, 0.9), (1.8, 1.8))
        self.pad.hold(300)
        self.pending = Pending()
        self.guard = SceneMonitor(self.rig.core.cell, ControllerLink(), self.pending)
        assert self.rig.activity() is (Activity.MOVING if plans_at_once else Activity.PLANNING)

    def job(self, outgoing: list[Effect] | None) -> WayCheckJob:
        assert outgoing is not None
        (job,) = jobs_in(outgoing)
        assert isinstance(job, WayCheckJob)
        return job

    def change_scene(self, scene: Scene) -> list[Effect]:
        """Let another scene be in force, and tell the guard of it."""
        self.rig.core.cell.motions.scene = scene
        return self.guard.changed(scene, self.rig.now)

    def change(self) -> WayCheckJob:
        return self.job(self.change_scene(BOX))

    def answer(self, job: WayCheckJob, result: PathFree | Refusal) -> list[Effect]:
        """Give the guard an answer, which may be one that it does not wait for any more."""
        planned = PlanAnswer(job.job_id, result, 0.01)
        return self.rig.perform(self.pending.resume(Ask(job.job_id, job), planned, self.rig.now))

    def wait(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, 10):
            self.pad.hold(10)
            self.rig.perform(self.guard.tick(self.rig.now))

    @property
    def is_held(self) -> bool:
        playing = self.rig.core.cell.motions.playing
        return playing is not None and playing.is_paused
