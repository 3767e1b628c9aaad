"""The pendant face: the conversation with pendant apps, as a pure core.

Owns hello, the translation of pendant requests into questions to the cell, and who is told what.
What may move when is the cell's business; how an answer is worded is `pendant_replies`'.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

from openpendant.simplemsg import (
    CommType,
    Malformed,
    Message,
    Received,
    ReplyCode,
    Unasked,
    refused,
)
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    PROTOCOL_VERSION,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    AuthorityReason,
    Capability,
    Hello,
    HelloReply,
    JointMove,
    JointPath,
    Management,
    Motion,
    PoseMove,
    PosePath,
    ResetStop,
    SoftwareStop,
    Subscribe,
)
from openpendant.simplemsg.standard import Ping
from openpendant.simplemsg.verdicts import VerdictCode

from .authority import Holder
from .jobs import JointPathJob, PoseGoal, PoseJob
from .management import answer_management
from .news import AuthorityMoved, Begun, Ended, News, Refused, Request, StopMoved
from .outgoing import Close, Outgoing, Send, Spread
from .peer_faults import MOST_FAULTS, PeerFaults
from .pendant_arguments import motion_fault, pose_fault, rate_fault, speed_fault
from .pendant_replies import (
    NAME_BYTES,
    REASON_BYTES,
    authority_changed,
    cut,
    outcome,
    stop_changed,
    verdict,
)
from .refusal import Refusal
from .robot_cell import RobotCell
from .settings import CellSettings
from .state_report import ToolView, state_message

_SECOND_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Identity:
    """What hello says of this server.

    Attributes:
        cell: name of the cell.
        robot: name of the robot.
        server: name and version of the program.
    """

    cell: str
    robot: str
    server: str


@dataclass(slots=True)
class _Listener:
    """One pendant's connection.

    Attributes:
        opened: when it was accepted [ns].
        heard: when its last message came [ns].
        faults: unknown and malformed frames of late.
        client: its name.
        welcomed: hello was answered.
        leaving: hello was refused; nothing more is taken.
        period_ns: between two state messages, 0 for none.
        due: when the next state message is [ns].
        dropped: state messages that it was too slow for.
    """

    opened: int
    heard: int
    faults: PeerFaults = field(default_factory=PeerFaults)
    client: str = ""
    welcomed: bool = False
    leaving: bool = False
    period_ns: int = 0
    due: int = 0
    dropped: int = 0


class PendantFace:
    """All pendant connections of a cell."""

    def __init__(
        self, cell: RobotCell, settings: CellSettings, identity: Identity, tool: ToolView
    ) -> None:
        """Make a face nobody is connected to."""
        self._cell = cell
        self._settings = settings
        self._identity = identity
        self._tool = tool
        self._listeners: dict[int, _Listener] = {}
        self._sequence = 0

    # Connections.

    def opened(self, session: int, now: int) -> None:
        """Take note of a new connection."""
        self._listeners[session] = _Listener(opened=now, heard=now)

    def closed(self, session: int, now: int) -> list[Outgoing]:
        """Take note that a connection ended; what it moved is stopped."""
        del self._listeners[session]
        change = self._cell.authority.release(session, AuthorityReason.CONNECTION_LOST)
        return self._cell.authority_gone(change, now)

    def skipped(self, session: int) -> None:
        """Count a state message that a connection was too slow for."""
        if session in self._listeners:
            self._listeners[session].dropped += 1

    # Messages.

    def receive(self, session: int, received: Received, now: int) -> list[Outgoing]:
        """Take one message of a pendant and return what follows from it."""
        listener = self._listeners[session]
        if listener.leaving:
            return []
        listener.heard = now
        match received:
            case Unasked():
                return []
            case Malformed():
                return self._malformed(session, listener, received, now)
        if listener.welcomed:
            match received:
                case JointMove(comm_type=CommType.REQUEST):
                    return self._joint_move(session, received, now)
                case AuthorityBeat(comm_type=CommType.TOPIC):
                    self._cell.authority.beat(session, now)
                    return []
                case SoftwareStop():
                    # Obeyed as a topic too: better a stop without an answer than none.
                    return self._software_stop(session, listener, received, now)
        if received.comm_type != CommType.REQUEST:
            return []
        match received:
            case Hello():
                return self._hello(session, listener, received, now)
            case Ping():
                return [Send(session, Ping(comm_type=CommType.REPLY, reply_code=ReplyCode.SUCCESS))]
        if not listener.welcomed:
            request_id = getattr(received, "request_id", 0)
            return [_verdict(session, request_id, Refusal(VerdictCode.HELLO_FIRST))]
        return self._request(session, listener, received, now)

    def _malformed(
        self, session: int, listener: _Listener, received: Malformed, now: int
    ) -> list[Outgoing]:
        out: list[Outgoing] = []
        if received.comm_type == CommType.REQUEST:
            refusal = Refusal(VerdictCode.MALFORMED, str(received.error))
            out.append(_verdict(session, 0, refusal))
        return out + _count_fault(session, listener, now)

    def _request(
        self, session: int, listener: _Listener, message: Message, now: int
    ) -> list[Outgoing]:
        """Answer any request of a welcomed pendant."""
        match message:
            case PoseMove():
                goal = PoseGoal(message.position, message.orientation)
                return self._pose_job(session, message, (goal,), now)
            case PosePath():
                goals = tuple(PoseGoal(at.position, at.orientation) for at in message.waypoints)
                return self._pose_job(session, message, goals, now)
            case JointPath():
                return self._joint_path(session, message, now)
            case ResetStop():
                return self._reset_stop(session, listener, message, now)
            case Authority():
                return self._authority(session, listener, message, now)
            case Subscribe():
                return self._subscribe(session, listener, message, now)
            case Management():
                answer = answer_management(message.body, self._cell, self._settings, now)
                reply = Management(
                    request_id=message.request_id,
                    body=answer.text,
                    comm_type=CommType.REPLY,
                    reply_code=ReplyCode.SUCCESS if answer.ok else ReplyCode.FAILURE,
                )
                return [Send(session, reply)]
        return [Send(session, refused(message)), *_count_fault(session, listener, now)]

    # Hello and state.

    def _hello(self, session: int, listener: _Listener, hello: Hello, now: int) -> list[Outgoing]:
        if listener.welcomed:
            refusal = Refusal(VerdictCode.BAD_ARGUMENT, "hello was said already")
            return [_verdict(session, 0, refusal)]
        refused_for = self._unwelcome(hello)
        if refused_for is not None:
            listener.leaving = True
            return [_verdict(session, 0, refused_for), Close(session, refused_for.sentence)]
        listener.welcomed = True
        listener.client = cut(hello.client, NAME_BYTES)
        self._set_rate(listener, hello.state_rate, now)
        reply = HelloReply(
            protocol_version=PROTOCOL_VERSION,
            session=session,
            capabilities=sum(Capability),
            max_frame=MAX_PENDANT_FRAME,
            dof=self._cell.limits.dof,
            tick_rate=float(self._settings.tick_rate),
            max_state_rate=self._max_rate,
            authority_timeout=self._settings.pendants.authority_timeout,
            cell=self._identity.cell,
            robot=cut(self._identity.robot, NAME_BYTES),
            server=cut(self._identity.server, NAME_BYTES),
        )
        return [Send(session, reply)]

    def _unwelcome(self, hello: Hello) -> Refusal | None:
        if hello.protocol_version != PROTOCOL_VERSION:
            text = f"the server speaks version {PROTOCOL_VERSION}, not {hello.protocol_version}"
            return Refusal(VerdictCode.VERSION, text)
        if hello.cell not in ("", self._identity.cell):
            text = f"no cell {hello.cell!r} here, only {self._identity.cell!r}"
            return Refusal(VerdictCode.UNKNOWN_CELL, text)
        return rate_fault(hello.state_rate)

    @property
    def _max_rate(self) -> float:
        return min(self._settings.pendants.max_state_rate, float(self._settings.tick_rate))

    def _set_rate(self, listener: _Listener, rate: float, now: int) -> None:
        listener.period_ns = round(_SECOND_NS / min(rate, self._max_rate)) if rate else 0
        listener.due = now

    def _subscribe(
        self, session: int, listener: _Listener, message: Subscribe, now: int
    ) -> list[Outgoing]:
        refusal = rate_fault(message.state_rate)
        if refusal is None:
            self._set_rate(listener, message.state_rate, now)
        return [_verdict(session, message.request_id, refusal)]

    # Authority and stop.

    def _authority(
        self, session: int, listener: _Listener, message: Authority, now: int
    ) -> list[Outgoing]:
        request_id = message.request_id
        match message.action:
            case AuthorityAction.REQUEST:
                holder = Holder(session, listener.client)
                taken = self._cell.take_authority(holder, now, beats=True)
                if isinstance(taken, Refusal):
                    return [_verdict(session, request_id, taken)]
                return [_verdict(session, request_id), *taken]
            case AuthorityAction.RELEASE:
                change = self._cell.authority.release(session, AuthorityReason.RELEASED)
                if change is None:
                    refusal = Refusal(VerdictCode.NOT_IN_CONTROL)
                    return [_verdict(session, request_id, refusal)]
                gone = self._cell.authority_gone(change, now)
                return [*gone, _verdict(session, request_id)]
        refusal = Refusal(VerdictCode.BAD_ARGUMENT, f"action {message.action}; accepted: 1 or 2")
        return [_verdict(session, request_id, refusal)]

    def _software_stop(
        self, session: int, listener: _Listener, message: SoftwareStop, now: int
    ) -> list[Outgoing]:
        by = Holder(session, listener.client)
        out = self._cell.software_stop(by, cut(message.reason, REASON_BYTES), now)
        if message.comm_type == CommType.REQUEST:
            out.append(_verdict(session, message.request_id))
        return out

    def _reset_stop(
        self, session: int, listener: _Listener, message: ResetStop, now: int
    ) -> list[Outgoing]:
        reset = self._cell.reset_stop(Holder(session, listener.client), now)
        if isinstance(reset, Refusal):
            return [_verdict(session, message.request_id, reset)]
        return [_verdict(session, message.request_id), *reset]

    # Motion.

    def _joint_move(self, session: int, message: JointMove, now: int) -> list[Outgoing]:
        refusal = (
            self._cell.check(session, now)
            or speed_fault(message.speed)
            or self._cell.slots.count_fault(message.joint_count)
        )
        goal = refusal or self._cell.slots.position(message.joints)
        if isinstance(goal, Refusal):
            return [_verdict(session, message.request_id, goal)]
        self._cell.authority.beat(session, now)
        request = Request(session, message.request_id)
        return self._cell.move_joints(request, goal, message.speed, now)

    def _joint_path(self, session: int, message: JointPath, now: int) -> list[Outgoing]:
        refusal = (
            self._cell.check(session, now)
            or speed_fault(message.speed)
            or self._cell.slots.count_fault(message.joint_count)
        )
        if refusal is not None:
            return [_verdict(session, message.request_id, refusal)]
        waypoints: list[tuple[float, ...]] = []
        for waypoint in message.waypoints:
            position = self._cell.slots.position(waypoint.joints)
            if isinstance(position, Refusal):
                return [_verdict(session, message.request_id, position)]
            waypoints.append(position)
        self._cell.authority.beat(session, now)
        job = JointPathJob(
            self._cell.new_job_id(), self._cell.standing_at, tuple(waypoints), message.speed
        )
        return self._cell.ask(Request(session, message.request_id), job)

    def _pose_job(
        self,
        session: int,
        message: PoseMove | PosePath,
        goals: tuple[PoseGoal, ...],
        now: int,
    ) -> list[Outgoing]:
        refusal = (
            self._cell.check(session, now)
            or speed_fault(message.speed)
            or motion_fault(message.motion)
            or pose_fault(goals)
        )
        if refusal is not None:
            return [_verdict(session, message.request_id, refusal)]
        self._cell.authority.beat(session, now)
        job = PoseJob(
            self._cell.new_job_id(),
            self._cell.standing_at,
            goals,
            message.frame,
            Motion(message.motion),
            message.speed,
        )
        return self._cell.ask(Request(session, message.request_id), job)

    # News and time.

    def news(self, news: News, now: int) -> list[Outgoing]:
        """Tell pendants what happened in the cell."""
        match news:
            case Begun(request=request) if request.session in self._listeners:
                return [_verdict(request.session, request.request_id)]
            case Refused(request=request) if request.session in self._listeners:
                return [_verdict(request.session, request.request_id, news.refusal)]
            case Ended(request=request) if request.session in self._listeners:
                return [Send(request.session, outcome(news))]
            case AuthorityMoved():
                return self._to_all(authority_changed(news))
            case StopMoved():
                return self._to_all(stop_changed(news))
        return []

    def _to_all(self, message: Message) -> list[Outgoing]:
        return [
            Send(session, message)
            for session, listener in self._listeners.items()
            if listener.welcomed
        ]

    def tick(self, now: int) -> list[Outgoing]:
        """Send state to whoever is due; end conversations that never began or fell silent."""
        pendants = self._settings.pendants
        hello_deadline = round(pendants.hello_deadline * _SECOND_NS)
        idle_timeout = round(pendants.idle_timeout * _SECOND_NS)
        out: list[Outgoing] = []
        due: list[int] = []
        for session, listener in self._listeners.items():
            if not listener.welcomed:
                if now - listener.opened > hello_deadline:
                    out.append(Close(session, "no hello in time"))
            elif now - listener.heard > idle_timeout:
                out.append(Close(session, "silent for too long"))
            elif listener.period_ns and now >= listener.due:
                listener.due = max(listener.due + listener.period_ns, now)
                due.append(session)
        return out + self._state(due, now) if due else out

    def _state(self, sessions: list[int], now: int) -> list[Outgoing]:
        """Return the state once for all; a pendant that was too slow gets its own drop counter."""
        self._sequence += 1
        state = state_message(self._cell, self._tool, self._sequence, now)
        dropped = {session: self._listeners[session].dropped for session in sessions}
        prompt = tuple(session for session in sessions if not dropped[session])
        out: list[Outgoing] = [Spread(prompt, state)] if prompt else []
        for session, count in dropped.items():
            if count:
                out.append(Spread((session,), dataclasses.replace(state, dropped=count)))
        return out


def _verdict(session: int, request_id: int, refusal: Refusal | None = None) -> Send:
    return Send(session, verdict(request_id, refusal))


def _count_fault(session: int, listener: _Listener, now: int) -> list[Outgoing]:
    if not listener.faults.add(now):
        return []
    return [Close(session, f"{MOST_FAULTS} unknown or malformed requests")]
