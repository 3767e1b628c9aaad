"""A robot on its way whose scene changes, the guard beside it, and the hands of who moves it."""

from __future__ import annotations

from jog_pad import JogPad
from server_clients import Pendant
from server_rig import ServerRig, ready

from openpendant.motion.scene import Box, Scene, SceneObject
from openpendant.server.outgoing import Outgoing, Plan
from openpendant.server.planning.jobs import Planned
from openpendant.server.planning.way_check_job import WayCheckJob, WayFree
from openpendant.server.refusal import Refusal
from openpendant.server.settings import ControllerLink
from openpendant.server.world.scene_guard import SceneGuard
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode as V

BOX = Scene((SceneObject("box", Box((0.1, 0.1, 0.1))),))
EMPTY = Scene()
HIT = Refusal(V.PATH_IN_COLLISION, "box and elbow touch at 40.0% of the path")


class GuardedRig:
    """A robot on its way, or its motion being planned, and the guard beside it."""

    def __init__(self, *, plans_at_once: bool = True, mode: str = "automatic") -> None:
        self.rig: ServerRig = ready(plans_at_once=plans_at_once, modes={"initial": mode})
        self.pad = JogPad(self.rig)
        self.pad.squeeze()
        self.pendant: Pendant = self.pad.pendant
        self.pendant.path((0.9, 0.9), (1.8, 1.8))
        self.pad.hold(300)
        self.guard = SceneGuard(self.rig.core.cell, ControllerLink())
        assert self.rig.activity() is (Activity.MOVING if plans_at_once else Activity.PLANNING)

    def job(self, outgoing: list[Outgoing] | None) -> WayCheckJob:
        assert outgoing is not None
        (plan,) = [each for each in outgoing if isinstance(each, Plan)]
        assert isinstance(plan.job, WayCheckJob)
        return plan.job

    def change_scene(self, scene: Scene) -> list[Outgoing]:
        """Let another scene be in force, and tell the guard of it."""
        self.rig.core.cell.motions.scene = scene
        return self.guard.changed(scene, self.rig.now)

    def change(self) -> WayCheckJob:
        return self.job(self.change_scene(BOX))

    def answer(self, job: WayCheckJob, result: WayFree | Refusal) -> list[Outgoing]:
        """Give the guard an answer, which may be one that it does not wait for any more."""
        out = self.guard.planned(Planned(job.job_id, result, 0.01), self.rig.now)
        return self.rig.perform(out or [])

    def wait(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, 10):
            self.pad.hold(10)
            self.rig.perform(self.guard.tick(self.rig.now))

    @property
    def is_held(self) -> bool:
        playing = self.rig.core.cell.motions.playing
        return playing is not None and playing.is_paused
