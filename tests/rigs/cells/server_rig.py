"""A pendant server on a hand-driven clock: lists in, lists out, times in nanoseconds.

Joins the server's core with the scripted controller, the clients that are connected to it, and a
planner that answers when asked. Two joints with round limits: ±2 rad, 2 rad/s, 4 rad/s².
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from itertools import count
from typing import cast

from rigs.cells.memory_store import MemoryStore
from rigs.data.stored_documents import answer_of
from rigs.motion.simple_jogger import SimpleJogger
from rigs.peers.scripted_controller import Fault, ScriptedController
from rigs.peers.server_clients import Peer, Pendant, RosClient

from openpendant import simplemsg as wire
from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import FrameUnknown, MotionError
from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.jog import EscapeDirection, JogCaps, Jogger, JogTarget, JointJog, ToolJog
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.server.core.cell_core import CellCore
from openpendant.server.endpoints.pendant.access_requests import Identity
from openpendant.server.events import effects
from openpendant.server.events.events import (
    Answered,
    ControllerReport,
    Opened,
    PathChanged,
    Port,
    Tick,
)
from openpendant.server.planning import jobs
from openpendant.server.refusal import Refusal, refusal_of
from openpendant.server.settings.cell_settings import (
    CellSettings,
    ControllerPath,
    JogSettings,
    make_settings,
)
from openpendant.simplemsg.pendant import PROTOCOL_VERSION, Activity
from openpendant.simplemsg.verdicts import VerdictCode

MS = 1_000_000
TICK = 10 * MS
LIMITS = JointLimits(
    names=("shoulder", "elbow"),
    lower=(-2.0, -2.0),
    upper=(2.0, 2.0),
    velocity=(2.0, 2.0),
    acceleration=(4.0, 4.0),
    prismatic=(False, False),
)
IDENTITY = Identity("cell", "two-joints", "openpendant test")
SUCCESS, FAILURE = wire.ReplyCode.SUCCESS, wire.ReplyCode.FAILURE


class NoTool:
    """The mathematics of a robot whose tool stays at the origin; it is jogged by its joints."""

    def __init__(self, limits: JointLimits = LIMITS) -> None:
        self._limits = limits
        self.frames = FrameTree()
        self.tool_in_flange = None
        self.jog_model: object = "one for all"
        self.lever_arms = ((0.0,) * limits.dof,)

    def configuration(self, position: Sequence[float]) -> None:
        return None

    def tool_pose(self, position: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)

    def tool_motion(
        self, position: Sequence[float], velocity: Sequence[float]
    ) -> tuple[tuple[float, ...], tuple[float, ...], float]:
        return *self.tool_pose(position), 0.0

    def speed_points(self, position: Sequence[float]) -> tuple[tuple[float, ...], ...]:
        return ((0.0, 0.0, 0.0),)

    @property
    def named_positions(self) -> Mapping[str, jobs.JointVector]:
        return dict.fromkeys(("home", "zero"), (0.0,) * self._limits.dof)

    def begin(self, start: Sequence[float], caps: JogCaps) -> Jogger:
        # The cores use no more of a jogger than the simple one has.
        return cast("Jogger", SimpleJogger(self._limits, start, caps))

    def caps(self, override: float, settings: JogSettings, point_speed: float | None) -> JogCaps:
        top = settings.tool_speed if point_speed is None else point_speed
        return JogCaps(override, settings.joint_speed, top, settings.rotation_speed, False)

    def joints(self, rates: Sequence[float]) -> JogTarget:
        return JointJog(tuple(rates))

    def tool(self, values: Sequence[float], frame: str) -> JogTarget:
        if frame not in ("base", "tool"):
            raise FrameUnknown(frame, ("base", "tool"))
        return ToolJog(tuple(values[:3]), tuple(values[3:]))

    def escape_directions(self, position: Sequence[float]) -> list[EscapeDirection]:
        return []

    def leads_out(self, position: Sequence[float], values: Sequence[float], frame: str) -> bool:
        return False

    def stepped_pose(
        self, start: Sequence[float], values: Sequence[float], frame: str
    ) -> jobs.PoseGoal:
        if frame not in ("base", "tool"):
            raise FrameUnknown(frame, ("base", "tool"))
        return jobs.PoseGoal(tuple(values[:3]), (0.0, 0.0, 0.0, 1.0))


def job_of(asked: effects.Ask) -> jobs.Job:
    assert isinstance(asked.question, jobs.Job)
    return asked.question


def jobs_in(outgoing: Iterable[effects.Effect]) -> list[jobs.Job]:
    return [
        job_of(item)
        for item in outgoing
        if isinstance(item, effects.Ask) and item.backend is effects.Backend.PLANNER
    ]


def worked_out(outgoing: Iterable[effects.Effect]) -> list[effects.Effect]:
    """Return effects with what follows from them in its place."""
    out: list[effects.Effect] = []
    for item in outgoing:
        out += worked_out(item.step()) if isinstance(item, effects.Then) else [item]
    return out


class Shell(ABC):
    """What carries out a core's orders, and the clients that are connected to it."""

    core: CellCore
    now: int

    def __init__(self) -> None:
        self.store = MemoryStore()
        self._peers: dict[int, Peer] = {}
        self._numbers = count(1)

    def _run(self, asked: effects.Ask) -> None:
        """Have the store do what the core asked for, at once."""
        self.answered(asked, answer_of(self.store, asked.question))

    def answered(self, asked: effects.Ask, answer: object) -> list[effects.Effect]:
        return self.perform(self.core.handle(Answered(asked, answer), self.now))

    def planned(self, job: jobs.Job, planned: jobs.PlanAnswer) -> list[effects.Effect]:
        return self.answered(effects.Ask(job.job_id, job), planned)

    @abstractmethod
    def perform(self, outgoing: list[effects.Effect]) -> list[effects.Effect]:
        """Carry out what the core asked for, as the application does; return it."""

    def _deliver(self, session: int, message: wire.Message) -> None:
        peer = self._peers.get(session)
        if peer is not None:
            peer.got.append(message)

    def stranger(self, port: Port = Port.PENDANT, address: str = "127.0.0.1") -> Pendant:
        """Open a pendant connection that has not said hello."""
        pendant = Pendant(self, next(self._numbers))
        self._open(pendant, port, address)
        return pendant

    def pendant(
        self,
        client: str = "tester",
        *,
        state_rate: float = 0.0,
        version: int = PROTOCOL_VERSION,
    ) -> Pendant:
        pendant = self.stranger()
        pendant.hello(client, state_rate, version)
        pendant.got.clear()
        return pendant

    def holder(self, client: str = "holder") -> Pendant:
        pendant = self.pendant(client)
        assert pendant.take() is VerdictCode.ACCEPTED
        return pendant

    def ros(self, address: str = "127.0.0.1", port: Port = Port.ROS_MOTION) -> RosClient:
        client = RosClient(self, next(self._numbers))
        self._open(client, port, address)
        return client

    def _open(self, peer: Peer, port: Port, address: str) -> None:
        self._peers[peer.session] = peer
        self.perform(self.core.handle(Opened(peer.session, port, address), self.now))


class ServerRig(Shell):
    """A server core, its controller, its planner and its clients, on one clock."""

    def __init__(self, *, plans_at_once: bool = True, **settings: object) -> None:
        super().__init__()
        self.settings: CellSettings = make_settings(settings, "test")
        self.robot = NoTool()
        self.core = CellCore(self.settings, LIMITS, IDENTITY, self.robot)
        self.controller = ScriptedController()
        self.plans_at_once = plans_at_once
        self.now = 1_000_000_000
        self.jobs: list[jobs.Job] = []
        self.log: list[tuple[int, effects.Effect]] = []
        self._late: list[tuple[int, wire.Message]] = []
        self._up = dict.fromkeys(ControllerPath, False)

    # The controller.

    def connect_controller(self) -> None:
        for path in ControllerPath:
            self.path(path, True)
        self.wait(20)

    def path(self, path: ControllerPath, up: bool) -> list[effects.Effect]:
        self._up[path] = up
        if path is ControllerPath.MOTION:
            self.controller.awaited = 0
            self._late.clear()
        return self.perform(self.core.handle(PathChanged(path, up), self.now))

    def report(self) -> list[effects.Effect]:
        """Have the controller send its joint state and status now."""
        out: list[effects.Effect] = []
        for message in (self.controller.status(self.now), self.controller.feedback(self.now)):
            out += self.hear(ControllerPath.STATE, message)
        return out

    def hear(self, path: ControllerPath, message: wire.Received) -> list[effects.Effect]:
        pending = self.controller.awaited
        return self.perform(self.core.handle(ControllerReport(path, message, pending), self.now))

    def reply(self, message: wire.Message) -> list[effects.Effect]:
        """Have the controller answer what it was asked; unasked if it was asked nothing."""
        if not self.controller.awaited:
            return self.hear(ControllerPath.MOTION, wire.Unasked(message))
        self.controller.awaited -= 1
        return self.hear(ControllerPath.MOTION, message)

    def _command(self, message: wire.Message) -> None:
        if not self._up[ControllerPath.MOTION]:
            return
        controller = self.controller
        controller.awaited += 1
        assert isinstance(message, wire.JointTrajPt | wire.JointTrajPtFull)
        if message.sequence == -4:
            controller.stop(self.now)
            self.reply(wire.accepted(message))
            return
        controller.points.append(message)
        match controller.faults.get(message.sequence):
            case None:
                if isinstance(message, wire.JointTrajPtFull):
                    controller.take(message, self.now)
                self.reply(wire.accepted(message))
            case Fault.REFUSE:
                self.reply(wire.refused(message))
            case Fault.WRONG_TYPE:
                self.reply(wire.HeaderOnly(wire.MsgType.PING))
            case Fault.LATE:
                self._late.append((self.now + 600 * MS, wire.accepted(message)))
            case Fault.TWICE:
                if isinstance(message, wire.JointTrajPtFull):
                    controller.take(message, self.now)
                self.reply(wire.accepted(message))
                self.reply(wire.accepted(message))
            case Fault.LINK_LOST:
                self.path(ControllerPath.MOTION, False)

    # The shell.

    def perform(self, outgoing: list[effects.Effect]) -> list[effects.Effect]:
        commands: deque[wire.Message] = deque()
        requests: list[effects.Ask] = []
        outgoing = worked_out(outgoing)
        for item in outgoing:
            self.log.append((self.now, item))
            match item:
                case effects.Send(session=session, message=message):
                    self._deliver(session, message)
                case effects.Broadcast() | effects.Notify():
                    sessions, message = item.sessions, item.message
                    for session in sessions:
                        self._deliver(session, message)
                case effects.Close(session=session, reason=reason):
                    self._peers[session].closed_for.append(reason)
                case effects.SendStop(message=message):
                    if self._up[ControllerPath.STOP]:
                        self.controller.stop(self.now)
                    commands.append(message)
                case effects.SendToController(message=message):
                    commands.append(message)
                case effects.ReconnectController():
                    self.path(ControllerPath.MOTION, False)
                case effects.Ask(backend=effects.Backend.PLANNER):
                    self.jobs.append(job_of(item))
                case effects.Ask(backend=effects.Backend.STORE):
                    requests.append(item)
                case effects.StorePlan():
                    pass
        for command in commands:
            self._command(command)
        for asked in requests:
            self._run(asked)
        if self.plans_at_once and self.jobs:
            self.plan()
        return outgoing

    def plan(self, result: Refusal | None = None) -> list[effects.Effect]:
        """Answer the oldest job: with a joint move to its last position, or with a refusal."""
        job = self.jobs.pop(0)
        return self.planned(job, self.plan_of(job, result))

    @staticmethod
    def plan_of(job: jobs.Job, result: Refusal | None = None) -> jobs.PlanAnswer:
        if result is not None:
            return jobs.PlanAnswer(job.job_id, result, 0.01)
        if isinstance(job, jobs.ReadBody):
            return jobs.PlanAnswer(job.job_id, jobs.BodyRead(*job.read(job.body)), 0.01)
        assert isinstance(job, jobs.JointPathJob | jobs.RosPathJob)
        goal = job.waypoints[-1] if isinstance(job, jobs.JointPathJob) else job.points[-1].position
        try:
            trajectory = plan_joint_move(job.start, goal, LIMITS)
        except MotionError as error:
            return jobs.PlanAnswer(job.job_id, refusal_of(error), 0.01)
        return jobs.PlanAnswer(job.job_id, (trajectory, certify(trajectory, LIMITS)), 0.01)

    # Time.

    def wait(self, milliseconds: int) -> list[effects.Effect]:
        """Let time pass in ticks; the controller reports just before each."""
        out: list[effects.Effect] = []
        for _ in range(0, milliseconds, 10):
            self.now += TICK
            for due, message in [entry for entry in self._late if entry[0] <= self.now]:
                self._late.remove((due, message))
                self.reply(message)
            if self.controller.reports and self._up[ControllerPath.STATE]:
                out += self.report()
            out += self.tick()
        return out

    def tick(self) -> list[effects.Effect]:
        return self.perform(self.core.handle(Tick(), self.now))

    def come_to_rest(self) -> None:
        """Have the planner answer what waits for it, and the robot brake and be seen to."""
        if self.jobs:
            self.plan()
        self.controller.coasts = False
        self.controller.reports = True
        self.controller.stop(self.now)

    # What was seen.

    def activity(self) -> Activity:
        return self.core.cell.activity

    @property
    def points(self) -> list[wire.JointTrajPtFull | wire.JointTrajPt]:
        return self.controller.points

    @property
    def stops(self) -> list[int]:
        return [time for time, item in self.log if isinstance(item, effects.SendStop)]


def ready(*, plans_at_once: bool = True, **settings: object) -> ServerRig:
    """Return a rig whose controller is connected and stands at (0, 0)."""
    rig = ServerRig(plans_at_once=plans_at_once, **settings)
    rig.connect_controller()
    return rig
