"""Core of one cell: both endpoints and the robot cell behind them, pure.

Every event comes in through `handle` with its time and goes out as a list of `Effect`, so a
packet's way from the transport to the controller is one call stack. No socket, clock, file or
thread in here. Beside `handle` only `fail` changes anything: after a fault of ours nothing in here
can be trusted, so the core stops the robot once and is deaf.

Owns which message of a controller is an answer that was owed, one that nobody asked for, a
question to us, or a report, on each of the three connections. What follows from it is the cell's
business.

Owns what a server does that finds its event loop stood still: it latches a stop (promise 26,
`LoopMonitor`). The watchdog process, which stops the robot meanwhile, has its own rule in
`watchdog_protocol`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg import (
    CommType,
    Malformed,
    Ping,
    ReplyCode,
    Unasked,
    accepted,
    message_type,
    refused,
)
from openpendant.simplemsg.pendant import Activity, OperatorEvent
from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.robot_cell import SERVER, RobotCell
from ..cell.robot_model import RobotModel
from ..endpoints.pendant.access_requests import CoreAccess, Identity
from ..endpoints.pendant.lobby import CellGlance, LobbyCell
from ..endpoints.pendant.pendant_endpoint import PendantEndpoint
from ..endpoints.ros.ros_endpoint import RosEndpoint
from ..endpoints.ros.ros_trajectory import RosPort
from ..environment import CellEnvironment
from ..events.cell_events import (
    AuthorityTransferred,
    CellEvent,
    Interruption,
    MotionEnded,
    MotionEvent,
    MotionOwner,
    MotionRefused,
    OperatingModeChanged,
    ProgramEnded,
    ProgramStarted,
    StopLatch,
    StopLatchChanged,
    UncommandedMotionSeen,
)
from ..events.effects import AnswerController, Ask, Backend, Close, Effect, Send, SendStop
from ..events.events import (
    Answered,
    ClientFailed,
    Closed,
    ControllerGarbled,
    ControllerReport,
    Event,
    Misdirected,
    NoticesMissed,
    Opened,
    PathChanged,
    Port,
    Received,
    Regranted,
    ShutDown,
    Skipped,
    StopReceived,
    Tick,
    WatchdogStopped,
)
from ..events.pending import Pending
from ..events.replies import stop_changed, verdict
from ..planning.jobs import MotionJob
from ..plans.plan_space import PlanSpace
from ..positions.position_book import PositionBook
from ..refusal import Refusal
from ..scene.robot_environment import RobotEnvironment
from ..settings.cell_settings import CellSettings, ControllerPath
from ..store.documents import Heading
from ..store.requests import Request as StoreRequest
from ..uplinks import dialect_of
from .audit_trail import AuditTrail

# Each report of each robot comes by here, and members of an enumeration are slow to look up.
_REPLY, _REQUEST = CommType.REPLY, CommType.REQUEST
_NO_MESSAGE = (Unasked, Malformed)
_MOTION, _STATE = ControllerPath.MOTION, ControllerPath.STATE
_IDENTITY = OperatorEvent.PLACE.msg_type

_ROS_PORTS = {Port.ROS_MOTION: RosPort.MOTION, Port.ROS_STATE: RosPort.STATE}


_Subscriber: TypeAlias = Callable[[CellEvent, int], list[Effect]]
"""Takes an event of the cell and the time [ns]; returns what follows."""


class LoopMonitor:
    """The server's own look at its clock: was the loop away for longer than the watchdog waits?

    Attributes:
        late_from: of an event from then on `lateness` is asked [ns]; of none before the first tick.
    """

    def __init__(self, real_ns: int, emulated_ns: int) -> None:
        """Make a watch that has seen no tick.

        Args:
            real_ns: how long the watchdog waits where the controller may be a real one.
            emulated_ns: the same where it says that it is emulated.
        """
        self._deadlines_ns = real_ns, emulated_ns
        self.late_from: float = math.inf
        self._ticked = 0

    def tick(self, now: int, *, says_emulated: bool) -> None:
        """Take note of a tick."""
        self._ticked = now
        self.late_from = now + self._deadlines_ns[says_emulated]

    def stopped(self) -> None:
        """Take note that the watchdog has stopped the robots, whatever the clock says here.

        It measures when beats arrive, so of a delay close to the deadline it may judge otherwise.
        """
        self.late_from = -math.inf

    def lateness(self, now: int) -> int:
        """Return for how long the loop was away [ns], and take note that this was found out.

        To be asked before anything is done about an event from `late_from` on: the first one after
        a freeze is as likely an answer of the controller as a tick, and no set-point may leave
        because of it.
        """
        late = now - self._ticked
        self.tick(now, says_emulated=False)
        return late


def late_refusal(late: int) -> Refusal:
    """Return why a motion is ended by a server that was away for `late` [ns]."""
    text = f"the server did not tick for {late / 1e6:.0f} ms; the robot was stopped"
    return Refusal(VerdictCode.SERVER_LATE, text, value=late / 1e9)


class CellCore:
    """All connections of one cell, and the cell.

    Attributes:
        pendants: the pendant endpoint.
        ros: the ROS-Industrial endpoint.
        fault: why it serves nobody any more; None while it does.
        environment: recordings, frames, tools, scene and signals; None where it has none.
    """

    def __init__(
        self,
        settings: CellSettings,
        limits: JointLimits,
        identity: Identity,
        robot: RobotModel,
        environment: RobotEnvironment | None = None,
        access: CoreAccess | None = None,
        is_read_apart: Callable[[int], bool] = lambda session: False,
        plan_space: PlanSpace | None = None,
    ) -> None:
        """Make a server nobody is connected to.

        Args:
            environment: the same of the robot in its scene; where left out, the cell has no
                frames, scene, signals and recordings, and no collision is looked for.
            access: who the pendants are; where left out, whoever is on this machine may do all.
            is_read_apart: whether a large body of a session is read in a planning process; where
                left out, all are read at once.
            plan_space: room for the plans of all cells; one of this cell's own where left out.
        """
        access = access or CoreAccess()
        self.name = identity.cell
        self.fault: Refusal | None = None
        self._pending = Pending()
        self.cell = RobotCell(settings, limits, self.publish, self._pending, robot)
        positions = PositionBook(
            *(settings.name, robot.named_positions, limits, self._pending),
            is_stored=environment is not None,
        )
        self.environment: CellEnvironment | None = None
        if environment is not None:
            self.environment = CellEnvironment(
                *(self.cell, environment, self._pending, settings, identity.robot),
                *(positions, access.questions),
            )
        self.pendants = PendantEndpoint(
            self.cell,
            settings,
            identity,
            robot,
            self._pending,
            access,
            self.environment,
            is_read_apart,
            PlanSpace() if plan_space is None else plan_space,
            positions,
        )
        about = identity.cell, identity.robot, identity.display
        access.lobby.join(LobbyCell(*about, glance=self._glance))
        self._trail = AuditTrail(access.record, access.login, self.cell, self.name)
        self.ros = RosEndpoint(self.cell, settings)
        self._endpoint_of: dict[int, PendantEndpoint | RosEndpoint] = {}
        rule = settings.watchdog
        self._loop = LoopMonitor(
            round(rule.real_deadline * 1e9), round(rule.emulated_deadline * 1e9)
        )
        self._was_told = False  # the watchdog: that the robot may move before the next tick
        self._handlers = self._event_table()
        # The order is that of the bytes that leave.
        self._ticked: tuple[Callable[[int], list[Effect]], ...] = (
            *(() if self.environment is None else (self._load,)),
            *(self.cell.tick, self.ros.tick, self.pendants.tick),
        )
        programs, announcing = self.pendants.programs.executor, self.pendants.announcing
        recordings = None if self.environment is None else self.environment.recordings
        self._owners: dict[MotionOwner, _Subscriber] = {
            MotionOwner.PENDANT: announcing.on_cell_event,
            MotionOwner.PLAN: self.pendants.plans.on_cell_event,
            MotionOwner.PROGRAM: programs.on_cell_event,
            MotionOwner.ROS: self.ros.on_cell_event,
        }
        waiting: tuple[_Subscriber, ...] = (programs.on_cell_event,)
        if recordings is not None:
            self._owners[MotionOwner.RECORDING] = recordings.on_cell_event
            waiting += (recordings.on_cell_event,)
        # Each event to those alone whom it concerns; the order is that of the bytes that leave.
        self._subscribers: Mapping[type[CellEvent], tuple[_Subscriber, ...]] = {
            AuthorityTransferred: (announcing.on_cell_event, *waiting),
            StopLatchChanged: (announcing.on_cell_event, *waiting),
            OperatingModeChanged: (announcing.on_cell_event, *waiting),
            Interruption: (*waiting, self.ros.on_cell_event),
            # Of these the audit trail alone takes note.
            ProgramStarted: (),
            ProgramEnded: (),
            UncommandedMotionSeen: (),
        }
        # A second one, so that a stop can be made whatever became of the cell's own.
        self._last_resort = dialect_of(settings.controller).uplink(
            settings.controller, limits.velocity
        )

    def _glance(self) -> CellGlance:
        """Return what anybody may be told of the cell before he has chosen it."""
        holder = None if self.fault is not None else self.cell.authority.holder
        name = "" if holder is None else holder.client
        return CellGlance(name, self.is_moving, self.cell.is_known_emulated)

    def publish(self, event: CellEvent, now: int) -> list[Effect]:
        """Tell whom an event of the cell concerns: a motion's owner, or its subscribers."""
        self._trail.on_cell_event(event, now)  # first, whatever the others make of it
        if isinstance(event, MotionEvent):
            if not isinstance(event, MotionRefused):
                self.cell.ended = event.refusal if isinstance(event, MotionEnded) else None
            return self._owners[event.request.owner](event, now)
        subscribers = self._subscribers[type(event)]
        return [item for subscriber in subscribers for item in subscriber(event, now)]

    def handle(self, event: Event, now: int) -> list[Effect]:
        """Take an event; return what follows from it, in order."""
        if self.fault is not None:
            if isinstance(event, Opened | ClientFailed):
                return [Close(event.session, self.fault.sentence)]
            return []
        # Asked here, and not in the monitor, because each tick and each message comes by.
        if now >= self._loop.late_from and event.checks_freeze:
            late = self._after_a_freeze(now)
            return self.pendants.as_told(late + self._handlers[type(event)](event, now))
        return self.pendants.as_told(self._handlers[type(event)](event, now))

    def _event_table(self) -> Mapping[type[Event], Callable[[Any, int], list[Effect]]]:
        """Return who takes which event."""
        return {
            Opened: self._on_opened,
            Closed: self._on_closed,
            StopReceived: self._on_stop,
            Received: self._on_received,
            Misdirected: self._on_misdirected,
            ClientFailed: self._on_client_failed,
            Skipped: self._on_skipped,
            NoticesMissed: self._on_notices_missed,
            Regranted: self._on_regranted,
            PathChanged: self._on_path_changed,
            ControllerReport: self._on_report,
            ControllerGarbled: self._on_garbled,
            Answered: self._on_answered,
            Tick: self._on_tick,
            WatchdogStopped: self._on_watchdog_stopped,
            ShutDown: self._on_shut_down,
        }

    def asked(self, backend: Backend, number: int) -> Ask | None:
        """Return a question of the cell that is not answered yet; None where there is none."""
        return self._pending.find(backend, number)

    # Clients.

    def may_stop(self, session: int) -> bool:
        """Return True if a STOP of a client may act before its turn."""
        endpoint = self._endpoint_of.get(session)
        return endpoint is not None and endpoint.may_stop(session)

    def _on_opened(self, event: Opened, now: int) -> list[Effect]:
        if event.port is Port.PENDANT:
            self._endpoint_of[event.session] = self.pendants
            self.pendants.opened(event.session, event.address, now)
            return []
        self._endpoint_of[event.session] = self.ros
        return self.ros.opened(event.session, _ROS_PORTS[event.port], event.address, now)

    def _on_closed(self, event: Closed, now: int) -> list[Effect]:
        endpoint = self._endpoint_of.pop(event.session, None)
        return [] if endpoint is None else endpoint.closed(event.session, now)

    def _on_stop(self, event: StopReceived, now: int) -> list[Effect]:
        endpoint = self._endpoint_of.get(event.session)
        return [] if endpoint is None else endpoint.stop_first(event.session, event.message, now)

    def _on_received(self, event: Received, now: int) -> list[Effect]:
        endpoint = self._endpoint_of.get(event.session)
        return [] if endpoint is None else endpoint.receive(event.session, event.message, now)

    def _on_misdirected(self, event: Misdirected, now: int) -> list[Effect]:
        # A guest holds nothing, so nothing follows from its leaving.
        self._on_closed(Closed(event.session), now)
        answer = Send(event.session, verdict(0, event.refusal))
        return [answer, Close(event.session, event.refusal.sentence)]

    def _on_client_failed(self, event: ClientFailed, now: int) -> list[Effect]:
        text = f"a fault of the server, incident {event.incident} of its log"
        stop = Refusal(VerdictCode.PROTECTIVE_STOP, text)
        return [*self.cell.protective_stop(stop, now), Close(event.session, text)]

    def _on_skipped(self, event: Skipped, now: int) -> list[Effect]:
        for session in event.sessions:
            if self._endpoint_of.get(session) is self.pendants:
                self.pendants.skipped(session)
        return []

    def _on_notices_missed(self, event: NoticesMissed, now: int) -> list[Effect]:
        self.pendants.notices.missed(event.sessions)
        return []

    def _on_regranted(self, event: Regranted, now: int) -> list[Effect]:
        is_here = self._endpoint_of.get(event.session) is self.pendants
        return self.pendants.regranted(event.session, now) if is_here else []

    # The controller.

    def _on_path_changed(self, event: PathChanged, now: int) -> list[Effect]:
        out = self.cell.path_changed(event.path, event.up, now)
        if event.path is not ControllerPath.STATE:
            return out
        out += self.pendants.controller.changed()
        if self.environment is None:
            return out
        return out + self.environment.signals.link_changed(event.up, now)

    def _on_report(self, event: ControllerReport, now: int) -> list[Effect]:
        """Hand a message of the controller to whom it is for."""
        cell, environment = self.cell, self.environment
        path, received = event.path, event.message
        if isinstance(received, _NO_MESSAGE):
            return self._bad_message(path, received, now)
        is_motion = path is _MOTION
        kind = received.comm_type
        if kind == _REPLY:
            if is_motion:
                return cell.driving.answered(received, event.pending, now)
            if path is _STATE and message_type(received) == _IDENTITY:
                return self._identified(received.reply_code, now)
            if environment is None or path is not _STATE:
                return []
            return environment.signals.answered(received, now)
        if kind == _REQUEST:
            # But for a ping a controller has nothing to ask of us; an answer is still owed.
            is_ping = isinstance(received, Ping)
            return [AnswerController(path, accepted(received) if is_ping else refused(received))]
        if path is not _STATE:
            return []
        out = cell.reported(received, now)
        return out if environment is None else out + environment.reported(now)

    def _bad_message(
        self, path: ControllerPath, received: Unasked | Malformed, now: int
    ) -> list[Effect]:
        """Take what is no message: an answer that nobody asked for, or one that cannot be read."""
        if path is _STATE:
            return self._misidentified(received, now)
        driving = self.cell.driving
        if path is not _MOTION:
            return []
        if isinstance(received, Unasked):
            return driving.on_bad_reply("the controller answered although nothing was asked", now)
        if received.comm_type != _REPLY:
            return []
        return driving.on_bad_reply(str(received.error), now)

    def _misidentified(self, received: Unasked | Malformed, now: int) -> list[Effect]:
        """Take a second or an unreadable answer to whether the controller is emulated."""
        if isinstance(received, Malformed):
            is_answer = received.msg_type == _IDENTITY and received.comm_type == _REPLY
            return self._identified(ReplyCode.FAILURE, now) if is_answer else []
        again = received.message
        return self._identified(again.reply_code, now) if message_type(again) == _IDENTITY else []

    def _identified(self, reply_code: int, now: int) -> list[Effect]:
        """Take the answer to whether the controller is emulated; tell what is new of it."""
        return self.cell.identified(reply_code, now) + self.pendants.controller.changed()

    def _on_garbled(self, event: ControllerGarbled, now: int) -> list[Effect]:
        if event.path is ControllerPath.STOP:
            return []
        return self.cell.driving.on_bad_reply(event.problem, now)

    # The server's own parts.

    def _on_answered(self, event: Answered, now: int) -> list[Effect]:
        if isinstance(event.answer, Heading):
            self._trail.saved(event.answer, now)
        out = self._pending.resume(event.ask, event.answer, now)
        if isinstance(event.ask.question, StoreRequest):
            out += self.pendants.notices.acknowledged(event.ask.question, event.answer)
        if self.environment is None or not isinstance(event.ask.question, MotionJob):
            return out
        monitor = self.environment.monitor
        return out + monitor.motion_started(now) if monitor.is_planned_before else out

    def _on_tick(self, event: Tick, now: int) -> list[Effect]:
        self._loop.tick(now, says_emulated=self.cell.feedback.says_emulated)
        out: list[Effect] = []
        for tick in self._ticked:
            out += tick(now)
        self._was_told = self.may_move
        return out

    def _load(self, now: int) -> list[Effect]:
        """Load frames, tools and scene with the first tick, when all parts are there."""
        assert self.environment is not None
        self._ticked = (*self.environment.ticked, *self._ticked[1:])
        return self.environment.world.load()

    def _on_watchdog_stopped(self, event: WatchdogStopped, now: int) -> list[Effect]:
        if self.cell.stop is None:
            self._loop.stopped()
        return []

    def _on_shut_down(self, event: ShutDown, now: int) -> list[Effect]:
        out = self.cell.shut_down(now) + self.pendants.programs.executor.shut_down(now)
        return out if self.environment is None else out + self.environment.shut_down()

    def _after_a_freeze(self, now: int) -> list[Effect]:
        """Latch a stop after the event loop stood still, where the watchdog has sent one meanwhile.

        What began since it was told counts.
        """
        late = late_refusal(self._loop.lateness(now))
        may = self._was_told or self.may_move
        return self.cell.protective_stop(late, now) if may else []

    @property
    def may_move(self) -> bool:
        """Whether the robot moves, or will by what was asked already: a freeze stops it then.

        One that stands with nothing queued is let alone, whoever is in control.
        """
        cell = self.cell
        is_asked = cell.program is not None or cell.driving.activity is not Activity.IDLE
        return self.fault is None and (is_asked or cell.is_moving)

    @property
    def is_moving(self) -> bool:
        """Whether the robot moves, as far as anyone knows."""
        return self.fault is None and self.cell.is_moving

    def fail(self, problem: str, now: int) -> list[Effect]:
        """Stop the robot and part with everybody, because something in here went wrong.

        Returns:
            The stop first; nothing where it failed before.
        """
        if self.fault is not None:
            return []
        text = f"a fault of the server ended cell {self.name!r}: {problem}"
        self.fault = fault = Refusal(VerdictCode.CELL_FAULTED, text)
        stop = StopLatch(SERVER, fault.sentence, now, is_protective=True)
        told = stop_changed(StopLatchChanged(stop, SERVER))
        out: list[Effect] = [SendStop(self._last_resort.stop(now, is_sent=False))]
        for session, endpoint in self._endpoint_of.items():
            if endpoint is self.pendants:
                out.append(Send(session, told))
            out.append(Close(session, fault.sentence))
        self._endpoint_of.clear()
        return out
