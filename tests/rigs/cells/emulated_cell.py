"""A server core joined with the emulator's core by two lists, every message through the codec.

No sockets and no loop: one virtual clock drives both ends, so that the bytes that the controller
would see, 4-byte reals included, are the same in every run.
"""

import dataclasses
from collections import deque
from collections.abc import Callable
from functools import cache

from rigs.cells.server_rig import IDENTITY, MS, Shell, job_of, worked_out

from openpendant import simplemsg as wire
from openpendant.controller_emulator.shell.build import build_controller
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.motion.description.robot import serial_robot
from openpendant.server.access.connection_loads import ConnectionLoad, LoadQuestion
from openpendant.server.core.cell_core import CellCore
from openpendant.server.endpoints.pendant.access_requests import CoreAccess
from openpendant.server.events import effects
from openpendant.server.events.events import ControllerReport, PathChanged, Tick
from openpendant.server.planning import jobs
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.settings.cell_settings import ControllerPath, make_settings
from openpendant.server.shell.robot_kinematics import RobotKinematics

_CODEC = wire.Codec(wire.PENDANT, wire.ByteOrder.LITTLE, 4)
_LINKS = {ControllerPath.MOTION: 1, ControllerPath.STOP: 2}

Reported = Callable[[tuple[float, ...], int], tuple[float, ...]]
"""From where the emulated robot is, (n,), and the time [ns] to where it is reported to be."""


class EmulatedCell(Shell):
    """One cell with an emulated robot; 10 ms ticks, the controller runs at 5 ms.

    Attributes:
        reported: stands between emulator and server, so that the robot seems to be elsewhere.
        held: what the store is asked for, where it answers only when told to.
        lines: what was logged.
        unread: bytes that each client has not read.
    """

    reported: Reported | None = None
    unread = 0
    held: deque[effects.Ask] | None = None

    def __init__(
        self,
        robot: str = "ur5",
        *,
        start: str = "home",
        has_surroundings: bool = False,
        access: CoreAccess | None = None,
        **settings: object,
    ) -> None:
        """Join both ends; with surroundings the robot has a scene, signals and recordings.

        Without `access` everybody may do everything.
        """
        super().__init__()
        self.lines: list[str] = []
        self.robot = robot
        self.now = 1_000_000_000
        self.limits = serial_robot(robot).limits
        emulator = EmulatorSettings.model_validate({"robot": robot, "start": start})
        self.controller = build_controller(emulator, self.now)
        # Frames and scene are put into the mathematics, so that no two cells may share them.
        own = RobotKinematics(serial_robot(robot)) if has_surroundings else None
        self.core = CellCore(
            make_settings({"robot": robot, **settings}, "test"),
            self.limits,
            dataclasses.replace(IDENTITY, robot=serial_robot(robot).name),
            _mathematics(robot) if own is None else own,
            own,
            access,
        )
        self.sent: list[wire.Message] = []
        self._links: dict[int, ControllerPath] = {}
        self._awaited = dict.fromkeys(ControllerPath, 0)
        self._last_link = 0
        for path in ControllerPath:
            self.connect(path)
        self.wait(30)

    def connect(self, path: ControllerPath) -> None:
        if path is not ControllerPath.STATE:
            self._last_link += 1
            self._links[self._last_link] = path
            self.controller.connected(self._last_link, self.now)
        self._awaited[path] = 0
        self.perform(self.core.handle(PathChanged(path, True), self.now))

    def disconnect(self, path: ControllerPath) -> None:
        for link in [link for link, kind in self._links.items() if kind is path]:
            del self._links[link]
            self._from_controller(self.controller.disconnected(link, self.now))
        self.perform(self.core.handle(PathChanged(path, False), self.now))

    def perform(self, outgoing: list[effects.Effect]) -> list[effects.Effect]:
        commands: deque[tuple[ControllerPath, wire.Message]] = deque()
        questions: list[effects.Ask] = []
        replies: list[wire.Message] = []
        outgoing = worked_out(outgoing)
        for item in outgoing:
            match item:
                case effects.Send(session=session, message=message):
                    self._deliver(session, _through_wire(message))
                case effects.Broadcast() | effects.Notify():
                    sessions, message = item.sessions, item.message
                    for session in sessions:
                        self._deliver(session, _through_wire(message))
                case effects.Close(session=session, reason=reason):
                    self._peers[session].closed_for.append(reason)
                case effects.SendToController(message=message):
                    commands.append((ControllerPath.MOTION, message))
                case effects.SendStop(message=message):
                    commands += [(path, message) for path in _LINKS]
                case effects.ReconnectController():
                    self.disconnect(ControllerPath.MOTION)
                case effects.QueryController(message=message):
                    reply = self.controller.answer(_through_wire(message), self.now)
                    assert reply is not None
                    replies.append(_through_wire(reply))
                case effects.Ask(backend=effects.Backend.STORE | effects.Backend.PLANNER):
                    questions.append(item)
                case effects.Ask(question=LoadQuestion()):
                    questions.append(item)
                case effects.LogLine(text=text):
                    self.lines.append(text)
        for path, message in commands:
            self._to_controller(path, message)
        for reply in replies:
            self.perform(
                self.core.handle(ControllerReport(ControllerPath.STATE, reply, 0), self.now)
            )
        for question in questions:
            if question.backend is effects.Backend.STORE:
                self._run(question)
            elif isinstance(question.question, LoadQuestion):
                self.answered(question, dict.fromkeys(question.question.sessions, self.load()))
            else:
                self.answered(question, self.work_out(job_of(question)))
        return outgoing

    def work_out(self, job: jobs.Job) -> jobs.PlanAnswer:
        """Do what a planning process would."""
        return answer(self.robot, job)

    def load(self) -> ConnectionLoad:
        """What each connection takes."""
        return ConnectionLoad(unread=self.unread)

    def _run(self, asked: effects.Ask) -> None:
        if self.held is None:
            super()._run(asked)
        else:
            self.held.append(asked)

    def answer(self, requests: int) -> None:
        """Have the store answer the oldest of what is held."""
        assert self.held is not None
        for _ in range(requests):
            super()._run(self.held.popleft())

    def answer_all(self) -> None:
        """Have the store answer all that is held, and from now on at once."""
        held, self.held = self.held or (), None
        for asked in held:
            super()._run(asked)

    def _to_controller(self, path: ControllerPath, message: wire.Message) -> None:
        for link in [link for link, kind in self._links.items() if kind is path]:
            self._awaited[path] += 1
            assert (
                path is not ControllerPath.MOTION or self._awaited[path] <= 1 or _is_stop(message)
            )
            self.sent.append(message)
            self._from_controller(self.controller.handle(link, _through_wire(message), self.now))

    def _from_controller(self, outgoing: list[tuple[int, wire.Message]]) -> None:
        for link, message in outgoing:
            path = self._links.get(link)
            if path is not None:
                received: wire.Received = _through_wire(message)
                if message.comm_type == wire.CommType.REPLY:
                    if self._awaited[path]:
                        self._awaited[path] -= 1
                    else:
                        received = wire.Unasked(message)
                self._hear(path, received)

    def _hear(self, path: ControllerPath, received: wire.Received) -> None:
        event = ControllerReport(path, received, self._awaited[path])
        self.perform(self.core.handle(event, self.now))

    def wait(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, 5):
            self.now += 5 * MS
            self._from_controller(self.controller.advance(self.now))
            if self.now % (10 * MS) == 0:
                for message in self.controller.state_messages(self.now):
                    self._hear(ControllerPath.STATE, _through_wire(self._as_reported(message)))
                self.perform(self.core.handle(Tick(), self.now))

    def _as_reported(self, message: wire.Message) -> wire.Message:
        dof = self.limits.dof
        if self.reported is None:
            return message
        match message:
            case wire.JointFeedback(positions=true):
                position = wire.joint_array(self.reported(true[:dof], self.now))
                return dataclasses.replace(message, positions=position)
            case wire.JointPosition(joints=true):
                return wire.JointPosition(0, wire.joint_array(self.reported(true[:dof], self.now)))
        return message

    @property
    def position(self) -> tuple[float, ...]:
        return self.controller.motion(self.now)[0]


@cache
def _mathematics(robot: str) -> RobotKinematics:
    return RobotKinematics(serial_robot(robot))


def _is_stop(message: wire.Message) -> bool:
    return getattr(message, "sequence", None) == -4


def _through_wire(message: wire.Message) -> wire.Message:
    return _CODEC.decode(_CODEC.encode(message))
