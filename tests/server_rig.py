"""A pendant server on a hand-driven clock: lists in, lists out, times in nanoseconds.

Owns the doubles that the server's core tests share: a scripted controller that follows its points
exactly and misbehaves as told, a planner that answers when asked, and pendants and ROS-I clients
that remember what they were told. Two joints with round limits: ±2 rad, 2 rad/s, 4 rad/s².
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TypeVar

from openpendant.motion.certificate import certify
from openpendant.motion.errors import MotionError
from openpendant.motion.limits import JointLimits
from openpendant.motion.ptp import plan_joint_move
from openpendant.server.core import Port, ServerCore
from openpendant.server.jobs import Job, JointPathJob, Planned, RosPathJob
from openpendant.server.outgoing import (
    Close,
    DropLink,
    Forward,
    ForwardStop,
    Keep,
    Outgoing,
    Plan,
    Send,
    Spread,
)
from openpendant.server.pendant_face import Identity
from openpendant.server.refusal import Refusal, refusal_of
from openpendant.server.robot_cell import ControllerPath
from openpendant.server.settings import CellSettings, make_settings
from openpendant.simplemsg import (
    CommType,
    ControllerMode,
    HeaderOnly,
    JointFeedback,
    JointTrajPt,
    JointTrajPtFull,
    Message,
    MsgType,
    Received,
    ReplyCode,
    Status,
    TriState,
    Unasked,
    ValidField,
    accepted,
    joint_array,
    refused,
)
from openpendant.simplemsg.pendant import (
    PROTOCOL_VERSION,
    Activity,
    Authority,
    AuthorityAction,
    Hello,
    JointMove,
    JointPath,
    JointWaypoint,
    Outcome,
    ResetStop,
    SoftwareStop,
    Verdict,
)
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
SUCCESS, FAILURE = ReplyCode.SUCCESS, ReplyCode.FAILURE

_M = TypeVar("_M", bound=Message)


class NoTool:
    """A tool that stays at the origin."""

    def tool_pose(self, position: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)

    def tool_speed(self, position: Sequence[float], velocity: Sequence[float]) -> float:
        return 0.0


class Fault(Enum):
    """What the controller does to a point instead of taking it."""

    REFUSE = "answers failure"
    WRONG_TYPE = "answers with another type"
    SILENT = "does not answer"
    LATE = "answers after 600 ms"
    TWICE = "answers twice"
    LINK_LOST = "closes the connection"


@dataclass
class ScriptedController:
    """Follows every point exactly at its time; a stop freezes it."""

    position: tuple[float, ...] = (0.0, 0.0)
    faults: dict[int, Fault] = field(default_factory=dict)
    reports: bool = True
    coasts: bool = False
    mode: int = ControllerMode.AUTO
    e_stopped: bool = False
    error_code: int = 0
    powered: bool = True
    awaited: int = 0
    points: list[JointTrajPtFull | JointTrajPt] = field(default_factory=list)
    _began: int = 0
    _times: list[int] = field(default_factory=list)
    _path: list[JointTrajPtFull] = field(default_factory=list)
    _stopped: bool = True

    def take(self, point: JointTrajPtFull, now: int) -> None:
        if point.sequence == 0:
            self._began, self._times, self._path = now, [], []
            self._stopped = False
        self._times.append(self._began + round(point.time * 1e9))
        self._path.append(point)

    def stop(self, now: int) -> None:
        if not self.coasts:
            self.position = self.state(now)[0]
            self._stopped = True

    def state(self, now: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return (position, velocity), two joints each."""
        if self._stopped or not self._path:
            return self.position, (0.0, 0.0)
        index = bisect_right(self._times, now) - 1
        if index < 0:
            return self.position, (0.0, 0.0)
        self.position = self._path[index].positions[:2]
        return self.position, self._path[index].velocities[:2]

    def feedback(self, now: int) -> JointFeedback:
        position, velocity = self.state(now)
        return JointFeedback(
            robot_id=0,
            valid_fields=ValidField.POSITION | ValidField.VELOCITY,
            time=now / 1e9,
            positions=joint_array(position),
            velocities=joint_array(velocity),
            accelerations=joint_array(()),
        )

    def status(self, now: int) -> Status:
        moves = any(self.state(now)[1])
        return Status(
            drives_powered=tri(self.powered),
            e_stopped=tri(self.e_stopped),
            error_code=self.error_code,
            in_error=tri(self.error_code != 0),
            in_motion=tri(moves),
            mode=self.mode,
            motion_possible=tri(not self.e_stopped and not self.error_code),
        )


def tri(value: bool) -> TriState:
    return TriState.TRUE if value else TriState.FALSE


class Shell(ABC):
    """What carries out a core's orders, and the clients that are connected to it."""

    core: ServerCore
    now: int

    def __init__(self) -> None:
        self._peers: dict[int, Peer] = {}

    @abstractmethod
    def perform(self, outgoing: list[Outgoing]) -> list[Outgoing]:
        """Carry out what the core asked for, as the application does; return it."""

    def _deliver(self, session: int, message: Message) -> None:
        peer = self._peers.get(session)
        if peer is not None:
            peer.got.append(message)

    def stranger(self, port: Port = Port.PENDANT, address: str = "127.0.0.1") -> Pendant:
        """Open a pendant connection that has not said hello."""
        pendant = Pendant(self, len(self._peers) + 1)
        self._open(pendant, port, address)
        return pendant

    def pendant(self, client: str = "tester", *, state_rate: float = 0.0) -> Pendant:
        pendant = self.stranger()
        pendant.hello(client, state_rate)
        pendant.got.clear()
        return pendant

    def holder(self, client: str = "holder") -> Pendant:
        """Return a pendant that holds the motion authority."""
        pendant = self.pendant(client)
        assert pendant.take() is VerdictCode.ACCEPTED
        return pendant

    def ros(self, address: str = "127.0.0.1", port: Port = Port.ROS_MOTION) -> RosClient:
        client = RosClient(self, len(self._peers) + 1)
        self._open(client, port, address)
        return client

    def _open(self, peer: Peer, port: Port, address: str) -> None:
        self._peers[peer.session] = peer
        self.perform(self.core.opened(peer.session, port, address, self.now))


class Peer:
    """One client's connection: what it sent is the core's business, what it got is kept here."""

    def __init__(self, rig: Shell, session: int) -> None:
        self.rig = rig
        self.session = session
        self.got: list[Message] = []
        self.closed_for: list[str] = []

    def send(self, message: Received) -> list[Message]:
        """Send a message and return what came back on this call stack."""
        before = len(self.got)
        self.rig.perform(self.rig.core.receive(self.session, message, self.rig.now))
        return self.got[before:]

    def close(self) -> None:
        self.rig.perform(self.rig.core.closed(self.session, self.rig.now))

    def all(self, kind: type[_M]) -> list[_M]:
        return [message for message in self.got if isinstance(message, kind)]


class Pendant(Peer):
    """A pendant with shorthands for its requests; each uses a fresh request id."""

    last_request = 0

    def _next(self) -> int:
        self.last_request += 1
        return self.last_request

    def hello(self, client: str = "tester", state_rate: float = 0.0) -> list[Message]:
        return self.send(hello(client, state_rate))

    def code(self, message: Message) -> VerdictCode | None:
        """Send a request and return the code of its own verdict, None if none came yet."""
        request_id = getattr(message, "request_id", 0)
        codes = [
            VerdictCode(answer.code)
            for answer in self.send(message)
            if isinstance(answer, Verdict) and answer.request_id == request_id
        ]
        assert len(codes) <= 1
        return codes[0] if codes else None

    def take(self) -> VerdictCode | None:
        return self.code(Authority(self._next(), AuthorityAction.REQUEST))

    def release(self) -> VerdictCode | None:
        return self.code(Authority(self._next(), AuthorityAction.RELEASE))

    def move(self, *joints: float, speed: float = 1.0) -> VerdictCode | None:
        return self.code(JointMove(self._next(), speed, joint_array(joints)))

    def path(self, *waypoints: Sequence[float], speed: float = 1.0) -> VerdictCode | None:
        points = tuple(JointWaypoint(joint_array(waypoint)) for waypoint in waypoints)
        return self.code(JointPath(self._next(), speed, points))

    def stop(self, reason: str = "enough") -> VerdictCode | None:
        return self.code(SoftwareStop(self._next(), reason))

    def reset(self) -> VerdictCode | None:
        return self.code(ResetStop(self._next()))

    def verdicts(self) -> list[tuple[int, VerdictCode]]:
        return [(item.request_id, VerdictCode(item.code)) for item in self.all(Verdict)]

    def outcomes(self) -> list[tuple[int, VerdictCode]]:
        return [(item.request_id, VerdictCode(item.code)) for item in self.all(Outcome)]


class RosClient(Peer):
    """A ROS-I motion connection."""

    def point(
        self,
        sequence: int,
        *joints: float,
        duration: float = 0.5,
        velocity: float = 0.1,
        comm_type: CommType = CommType.REQUEST,
    ) -> ReplyCode | None:
        """Send one point and return the code of its reply."""
        message = JointTrajPt(
            sequence, joint_array(joints), velocity, duration, comm_type=comm_type
        )
        return self.code(message)

    def code(self, message: Message) -> ReplyCode | None:
        replies = self.send(message)
        assert len(replies) <= 1
        return ReplyCode(replies[0].reply_code) if replies else None

    def trajectory(self, *positions: tuple[float, ...]) -> list[ReplyCode | None]:
        return [self.point(index, *joints) for index, joints in enumerate(positions)]

    def stop(self) -> ReplyCode | None:
        return self.point(-4)


class ServerRig(Shell):
    """A server core, its controller, its planner and its clients, on one clock."""

    def __init__(self, *, plans_at_once: bool = True, **settings: object) -> None:
        super().__init__()
        self.settings: CellSettings = make_settings(settings, "test")
        self.core = ServerCore(self.settings, LIMITS, IDENTITY, NoTool())
        self.controller = ScriptedController()
        self.plans_at_once = plans_at_once
        self.now = 1_000_000_000
        self.jobs: list[Job] = []
        self.log: list[tuple[int, Outgoing]] = []
        self._late: list[tuple[int, Message]] = []
        self._up = dict.fromkeys(ControllerPath, False)

    # The controller.

    def connect_controller(self) -> None:
        for path in ControllerPath:
            self.path(path, True)
        self.wait(20)

    def path(self, path: ControllerPath, up: bool) -> list[Outgoing]:
        self._up[path] = up
        if path is ControllerPath.MOTION:
            self.controller.awaited = 0
            self._late.clear()
        return self.perform(self.core.controller_path(path, up, self.now))

    def report(self) -> list[Outgoing]:
        """Have the controller send its joint state and status now."""
        out: list[Outgoing] = []
        for message in (self.controller.status(self.now), self.controller.feedback(self.now)):
            out += self.hear(ControllerPath.STATE, message)
        return out

    def hear(self, path: ControllerPath, message: Received) -> list[Outgoing]:
        pending = self.controller.awaited
        return self.perform(self.core.on_controller(path, message, pending, self.now))

    def reply(self, message: Message) -> list[Outgoing]:
        """Have the controller answer what it was asked; unasked if it was asked nothing."""
        if not self.controller.awaited:
            return self.hear(ControllerPath.MOTION, Unasked(message))
        self.controller.awaited -= 1
        return self.hear(ControllerPath.MOTION, message)

    def _command(self, message: Message) -> None:
        if not self._up[ControllerPath.MOTION]:
            return
        controller = self.controller
        controller.awaited += 1
        assert isinstance(message, JointTrajPt | JointTrajPtFull)
        if message.sequence == -4:
            controller.stop(self.now)
            self.reply(accepted(message))
            return
        controller.points.append(message)
        match controller.faults.get(message.sequence):
            case None:
                if isinstance(message, JointTrajPtFull):
                    controller.take(message, self.now)
                self.reply(accepted(message))
            case Fault.REFUSE:
                self.reply(refused(message))
            case Fault.WRONG_TYPE:
                self.reply(HeaderOnly(MsgType.PING))
            case Fault.LATE:
                self._late.append((self.now + 600 * MS, accepted(message)))
            case Fault.TWICE:
                if isinstance(message, JointTrajPtFull):
                    controller.take(message, self.now)
                self.reply(accepted(message))
                self.reply(accepted(message))
            case Fault.LINK_LOST:
                self.path(ControllerPath.MOTION, False)

    # The shell.

    def perform(self, outgoing: list[Outgoing]) -> list[Outgoing]:
        commands: deque[Message] = deque()
        for item in outgoing:
            self.log.append((self.now, item))
            match item:
                case Send(session=session, message=message):
                    self._deliver(session, message)
                case Spread(sessions=sessions, message=message):
                    for session in sessions:
                        self._deliver(session, message)
                case Close(session=session, reason=reason):
                    self._peers[session].closed_for.append(reason)
                case ForwardStop(message=message):
                    if self._up[ControllerPath.STOP]:
                        self.controller.stop(self.now)
                    commands.append(message)
                case Forward(message=message):
                    commands.append(message)
                case DropLink():
                    self.path(ControllerPath.MOTION, False)
                case Plan(job=job):
                    self.jobs.append(job)
                case Keep():
                    pass
        for command in commands:
            self._command(command)
        if self.plans_at_once and self.jobs:
            self.plan()
        return outgoing

    def plan(self, result: Refusal | None = None) -> list[Outgoing]:
        """Answer the oldest job: with a joint move to its last position, or with a refusal."""
        job = self.jobs.pop(0)
        return self.perform(self.core.planned(self.planned(job, result), self.now))

    @staticmethod
    def planned(job: Job, result: Refusal | None = None) -> Planned:
        if result is not None:
            return Planned(job.job_id, result, 0.01)
        assert isinstance(job, JointPathJob | RosPathJob)
        goal = job.waypoints[-1] if isinstance(job, JointPathJob) else job.points[-1].position
        try:
            trajectory = plan_joint_move(job.start, goal, LIMITS)
        except MotionError as error:
            return Planned(job.job_id, refusal_of(error), 0.01)
        return Planned(job.job_id, (trajectory, certify(trajectory, LIMITS)), 0.01)

    # Time.

    def wait(self, milliseconds: int) -> list[Outgoing]:
        """Let time pass in ticks; the controller reports just before each."""
        out: list[Outgoing] = []
        for _ in range(0, milliseconds, 10):
            self.now += TICK
            for due, message in [entry for entry in self._late if entry[0] <= self.now]:
                self._late.remove((due, message))
                self.reply(message)
            if self.controller.reports and self._up[ControllerPath.STATE]:
                out += self.report()
            out += self.tick()
        return out

    def tick(self) -> list[Outgoing]:
        return self.perform(self.core.tick(self.now))

    # What was seen.

    def activity(self) -> Activity:
        return self.core.cell.activity

    @property
    def points(self) -> list[JointTrajPtFull | JointTrajPt]:
        return self.controller.points

    @property
    def stops(self) -> list[int]:
        """Times at which a stop left."""
        return [time for time, item in self.log if isinstance(item, ForwardStop)]


def hello(client: str = "tester", state_rate: float = 0.0, cell: str = "") -> Hello:
    return Hello(PROTOCOL_VERSION, state_rate, cell, client)


def ready(*, plans_at_once: bool = True, **settings: object) -> ServerRig:
    """Return a rig whose controller is connected and stands at (0, 0)."""
    rig = ServerRig(plans_at_once=plans_at_once, **settings)
    rig.connect_controller()
    return rig
