"""The pendant face: the conversation with pendant apps, as a pure core.

Owns hello, authority, stop and mode as pendants ask for them, and who is told what. Requests for
motion go to `motions` and `jog.desk`; what may move when is the cell's business; how an
answer is worded is `pendant_replies`'.
"""

from __future__ import annotations

import dataclasses
import math
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
    Enabling,
    Hello,
    HelloReply,
    Home,
    JogBeat,
    JogRelease,
    JogStart,
    JogStep,
    JogUndo,
    JointMove,
    JointPath,
    Login,
    Management,
    MotionControl,
    MotionControlAction,
    Pairing,
    PoseMove,
    PosePath,
    ProgramRun,
    ResetStop,
    SetAccount,
    SetMode,
    SetSpeed,
    SoftwareStop,
    Subscribe,
)
from openpendant.simplemsg.standard import Ping
from openpendant.simplemsg.verdicts import VerdictCode

from ..access.desk import AccessDesk, CoreAccess
from ..access.operations import PREFIXES as ACCESS_PREFIXES
from ..access.permissions import operation_of
from ..access.roles import Permission
from ..authority import Holder
from ..jog.desk import JogDesk
from ..news import AuthorityMoved, Begun, Ended, ModeMoved, News, Refused, StopMoved
from ..outgoing import Close, Outgoing, Send, Spread
from ..peer_faults import MOST_FAULTS, PeerFaults
from ..playback.cell_programs import CellPrograms
from ..playback.desk import ProgramDesk
from ..playback.operations import Asker, author_name, is_about_programs
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..robot_view import RobotView
from ..settings import CellSettings
from ..store.questions import AskStore
from ..world.cell_surroundings import CellSurroundings, is_about_surroundings
from .arguments import rate_fault
from .management import answer_management
from .motions import PendantMotions
from .replies import (
    NAME_BYTES,
    REASON_BYTES,
    authority_changed,
    authority_wanted,
    cut,
    jog_ended,
    mode_changed,
    outcome,
    stop_changed,
    verdict,
)
from .state_report import state_message

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
        address: of the peer.
        faults: unknown and malformed frames of late.
        client: its name, as others are shown it.
        hello_name: its name as its hello says.
        looks_on: it may see the state of the cell.
        welcomed: hello was answered.
        leaving: hello was refused; nothing more is taken.
        period_ns: between two state messages, 0 for none.
        due: when the next state message is [ns].
        dropped: state messages that it was too slow for.
    """

    opened: int
    heard: int
    address: str
    faults: PeerFaults = field(default_factory=PeerFaults)
    client: str = ""
    hello_name: str = ""
    looks_on: bool = False
    welcomed: bool = False
    leaving: bool = False
    period_ns: int = 0
    due: int = 0
    dropped: int = 0


class PendantFace:
    """All pendant connections of a cell."""

    def __init__(
        self,
        cell: RobotCell,
        settings: CellSettings,
        identity: Identity,
        robot: RobotView,
        ask: AskStore,
        access: CoreAccess,
    ) -> None:
        """Make a face nobody is connected to.

        Args:
            cell: the cell.
            settings: its configuration.
            identity: what hello says.
            robot: the mathematics of the robot.
            ask: asks the store.
            access: who the pendants are.
        """
        self.access = AccessDesk(access, identity.cell, self.regranted)
        self._cell = cell
        self._settings = settings
        self._identity = identity
        self._robot = robot
        self._motions = PendantMotions(cell, robot)
        self._jogs = JogDesk(cell, settings.jog, robot)
        self._around: CellSurroundings | None = None
        self.programs = CellPrograms(
            cell,
            robot,
            ask,
            self._to_all,
            cell_name=identity.cell,
            robot_name=identity.robot,
        )
        self._listeners: dict[int, _Listener] = {}
        self._sequence = 0

    def surround(self, around: CellSurroundings) -> None:
        """Answer requests about the cell's surroundings, and let programs use them."""
        self._around = around
        self.programs.desk.surroundings = around

    # Connections.

    def opened(self, session: int, address: str, now: int) -> None:
        """Take note of a new connection."""
        self._listeners[session] = _Listener(opened=now, heard=now, address=address)

    def closed(self, session: int, now: int) -> list[Outgoing]:
        """Take note that a connection ended; what it moved is stopped."""
        del self._listeners[session]
        self._jogs.closed(session)
        self.programs.closed(session)
        self._cell.modes.forget(session)
        change = self._cell.authority.release(session, AuthorityReason.CONNECTION_LOST)
        out = self._cell.authority_gone(change, now)
        self.access.closed(session, now)
        return out

    def regranted(self, session: int, now: int) -> list[Outgoing]:
        """Follow a change of what a pendant may do; somebody else does not keep the authority."""
        listener = self._listeners.get(session)
        if listener is None or not listener.welcomed:
            return []
        listener.client = self.access.name_of(session, listener.hello_name)
        listener.looks_on = self.access.may(session, Permission.OBSERVE)
        holder = self._cell.authority.holder
        if holder is None or holder.session != session:
            return []
        if holder.client == listener.client and self.access.may(session, Permission.MOVE):
            return []
        change = self._cell.authority.release(session, AuthorityReason.LOGGED_OUT)
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
                case JogBeat(comm_type=CommType.TOPIC):
                    self._jogs.beat(session, received.press, received.beat, now)
                    return []
                case Enabling(comm_type=CommType.TOPIC):
                    self._cell.modes.enable(session, received.position, now)
                    return []
                case JointMove(comm_type=CommType.REQUEST):
                    refusal = self.access.refusal(session, received, now)
                    if refusal is not None:
                        return [_verdict(session, received.request_id, refusal)]
                    moved = self._motions.joint_move(session, received, now)
                    return _answered(session, received.request_id, moved)
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
        refusal = self.access.refusal(session, message, now)
        if refusal is not None:
            return self._turned_away(session, listener, message, refusal)
        match message:
            case Login():
                return self.access.log_in(session, message, now)
            case Pairing():
                return self.access.pairing(session, message, now)
            case SetAccount():
                return self.access.set_account(session, message, now)
            case Management() if operation_of(message.body).startswith(ACCESS_PREFIXES):
                asker = Asker(session, message.request_id, listener.client)
                return self.access.operation(message.body, asker, now)
            case PoseMove() | PosePath() | JointPath() | Home():
                moved = self._motions.ask(session, message, now)
                return _answered(session, message.request_id, moved)
            case JogStart():
                return _answered(
                    session, message.request_id, self._jogs.start(session, message, now)
                )
            case JogStep():
                return _answered(
                    session, message.request_id, self._jogs.step(session, message, now)
                )
            case JogUndo():
                return _answered(
                    session, message.request_id, self._jogs.undo(session, message, now)
                )
            case JogRelease():
                refusal = self._jogs.release(session, message.press, now)
                return [_verdict(session, message.request_id, refusal)]
            case SetMode() | SetSpeed() | MotionControl():
                return self._control(session, listener, message, now)
            case ResetStop():
                return self._reset_stop(session, listener, message, now)
            case Authority():
                return self._authority(session, listener, message, now)
            case Subscribe():
                return self._subscribe(session, listener, message, now)
            case ProgramRun():
                by = Holder(session, listener.client)
                run = self.programs.desk.start(by, message, now)
                return _answered(session, message.request_id, run)
            case Management() if self._around is not None and is_about_surroundings(message.body):
                author = author_name(session, listener.client)
                asker = Asker(session, message.request_id, author)
                return self._around.operation(message.body, asker, now)
            case Management() if is_about_programs(message.body):
                author = author_name(session, listener.client)
                asker = Asker(session, message.request_id, author)
                return self.programs.operation(message.body, asker, now)
            case Management():
                answer = answer_management(message.body, self._cell, self._settings, now, session)
                reply = Management(
                    request_id=message.request_id,
                    body=answer.text,
                    comm_type=CommType.REPLY,
                    reply_code=ReplyCode.SUCCESS if answer.ok else ReplyCode.FAILURE,
                )
                return [Send(session, reply)]
        return [Send(session, refused(message)), *_count_fault(session, listener, now)]

    @staticmethod
    def _turned_away(
        session: int, listener: _Listener, message: Message, refusal: Refusal
    ) -> list[Outgoing]:
        """Refuse a request to a pendant that may not make it."""
        if isinstance(message, Management):
            return Asker(session, message.request_id, listener.client).refuse(refusal)
        request_id = getattr(message, "request_id", 0)
        return [_verdict(session, request_id, refusal)]

    def _control(
        self,
        session: int,
        listener: _Listener,
        message: SetMode | SetSpeed | MotionControl,
        now: int,
    ) -> list[Outgoing]:
        """Set mode or speed, or pause, resume or end what runs."""
        by = Holder(session, listener.client)
        out: list[Outgoing] | Refusal | None
        match message:
            case SetMode():
                out = self._cell.set_mode(by, message.mode, now)
            case SetSpeed():
                out = self._cell.set_speed(by, message.override, message.tool_speed, now)
                self._jogs.respeed(now)
            case MotionControl(action=MotionControlAction.PAUSE):
                out = self._running.pause(by, now)
            case MotionControl(action=MotionControlAction.RESUME):
                out = self._running.resume(by, now)
            case MotionControl(action=MotionControlAction.PROGRAM_STOP):
                out = self._running.program_stop(by, now)
            case _:
                text = f"action {message.action}; accepted: 1 pause, 2 resume, 3 program stop"
                out = Refusal(VerdictCode.BAD_ARGUMENT, text)
        refusal = out if isinstance(out, Refusal) else None
        done = out if isinstance(out, list) else []
        return [*done, _verdict(session, message.request_id, refusal)]

    @property
    def _running(self) -> RobotCell | ProgramDesk:
        """What a pause, a resume and a program stop act on."""
        desk = self.programs.desk
        return desk if desk.is_under_way else self._cell

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
        listener.client = listener.hello_name = cut(hello.client, NAME_BYTES)
        self.access.welcomed(session, listener.address, listener.client, now)
        listener.looks_on = self.access.may(session, Permission.OBSERVE)
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
                return self._take(session, listener, request_id, now)
            case AuthorityAction.FORCE:
                return self._take(session, listener, request_id, now, force=True)
            case AuthorityAction.RELEASE:
                change = self._cell.authority.release(session, AuthorityReason.RELEASED)
                if change is None:
                    refusal = Refusal(VerdictCode.NOT_IN_CONTROL)
                    return [_verdict(session, request_id, refusal)]
                gone = self._cell.authority_gone(change, now)
                return [*gone, _verdict(session, request_id)]
        text = f"action {message.action}; accepted: 1 request, 2 release, 3 take over"
        return [_verdict(session, request_id, Refusal(VerdictCode.BAD_ARGUMENT, text))]

    def _take(
        self, session: int, listener: _Listener, request_id: int, now: int, *, force: bool = False
    ) -> list[Outgoing]:
        """Give the authority to a pendant; where another has it, tell that one who asks."""
        asker = Holder(session, listener.client)
        before = self._cell.authority.holder
        taken = self._cell.take_authority(asker, now, beats=True, force=force)
        if not isinstance(taken, Refusal):
            # A take-over stops what moves, and the stop leaves first.
            return [*taken, _verdict(session, request_id)]
        out: list[Outgoing] = [_verdict(session, request_id, taken)]
        if before is not None and before.session in self._listeners:
            out.append(Send(before.session, authority_wanted(asker)))
        return out

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

    # News and time.

    def news(self, news: News, now: int) -> list[Outgoing]:
        """Tell pendants what happened in the cell, and the program that runs."""
        if isinstance(news, Begun | Refused | Ended) and news.request.program:
            return self.programs.desk.news(news, now)
        return self._told(news) + self.programs.desk.news(news, now)

    def _told(self, news: News) -> list[Outgoing]:
        match news:
            case Begun(request=request) if request.session in self._listeners:
                return [_verdict(request.session, request.request_id)]
            case Refused(request=request) if request.session in self._listeners:
                return [_verdict(request.session, request.request_id, news.refusal)]
            case Ended(request=request) if request.session in self._listeners:
                return [*self._jog_account(news), Send(request.session, outcome(news))]
            case ModeMoved():
                return self._to_all(mode_changed(news))
            case AuthorityMoved():
                return self._to_all(authority_changed(news))
            case StopMoved():
                return self._to_all(stop_changed(news))
        return []

    def _jog_account(self, news: Ended) -> list[Outgoing]:
        """Tell a pendant how its jog came to rest, before its outcome."""
        account = news.jog
        if account is None:
            return []
        began, ended = (self._robot.tool_pose(at)[0] for at in (account.began_at, account.ended_at))
        return [Send(news.request.session, jog_ended(account, math.dist(began, ended)))]

    def _to_all(self, message: Message) -> list[Outgoing]:
        return [
            Send(session, message)
            for session, listener in self._listeners.items()
            if listener.welcomed and listener.looks_on
        ]

    def tick(self, now: int) -> list[Outgoing]:
        """Send state to whoever is due; end conversations that never began or fell silent."""
        self._jogs.tick(now)
        programs = self.programs.desk.tick(now)
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
            elif listener.period_ns and listener.looks_on and now >= listener.due:
                listener.due = max(listener.due + listener.period_ns, now)
                due.append(session)
        return programs + out + (self._state(due, now) if due else [])

    def _state(self, sessions: list[int], now: int) -> list[Outgoing]:
        """Return the state once for all; a pendant that was too slow gets its own drop counter."""
        self._sequence += 1
        self._jogs.states.sent(self._sequence, now)
        state = state_message(self._cell, self._robot, self._sequence, now)
        dropped = {session: self._listeners[session].dropped for session in sessions}
        prompt = tuple(session for session in sessions if not dropped[session])
        out: list[Outgoing] = [Spread(prompt, state)] if prompt else []
        for session, count in dropped.items():
            if count:
                out.append(Spread((session,), dataclasses.replace(state, dropped=count)))
        return out


def _answered(session: int, request_id: int, result: Refusal | list[Outgoing]) -> list[Outgoing]:
    """Return the verdict of a refusal; what was taken is answered by news."""
    return [_verdict(session, request_id, result)] if isinstance(result, Refusal) else result


def _verdict(session: int, request_id: int, refusal: Refusal | None = None) -> Send:
    return Send(session, verdict(request_id, refusal))


def _count_fault(session: int, listener: _Listener, now: int) -> list[Outgoing]:
    if not listener.faults.add(now):
        return []
    return [Close(session, f"{MOST_FAULTS} unknown or malformed requests")]
