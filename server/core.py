"""The pendant server as one pure core: both faces and the cell behind them.

Every event comes in as a call with its time and goes out as a list of `Outgoing`, so a packet's way
from the transport to the controller is one call stack. No socket, clock, file or thread in here.
After a fault of ours nothing in here can be trusted: the core stops the robot once and is deaf.
"""

from __future__ import annotations

from enum import Enum

from openpendant.motion.limits import JointLimits
from openpendant.simplemsg import Arrival, Message, Received
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode

from .access.audit_trail import AuditTrail
from .access.desk import CoreAccess
from .controller_messages import heard
from .controller_path import ControllerPath
from .errands import Errands
from .news import Begun, Ended, LatchedStop, News, StopMoved
from .outgoing import Close, ForwardStop, Outgoing, Send
from .pendant.face import PendantFace
from .pendant.greeting import Identity
from .pendant.replies import stop_changed
from .planning.jobs import Planned
from .refusal import Refusal
from .robot_cell import SERVER, RobotCell
from .robot_view import RobotView
from .ros.face import RosFace
from .ros.link import RosPort
from .settings import CellSettings
from .store.documents import Heading
from .store.requests import Answer as StoreAnswer
from .uplinks.generic import GenericUplink
from .watchdog.tick_watch import TickWatch, late_refusal
from .world.cell_surroundings import CellSurroundings
from .world.robot_surroundings import RobotSurroundings


class Port(Enum):
    """What a connection was accepted for."""

    PENDANT = "pendant protocol"
    ROS_MOTION = "ROS-Industrial motion"
    ROS_STATE = "ROS-Industrial state"


_ROS_PORTS = {Port.ROS_MOTION: RosPort.MOTION, Port.ROS_STATE: RosPort.STATE}


class ServerCore:
    """All connections of one cell, and the cell.

    Attributes:
        name: of the cell.
        cell: the robot cell.
        pendants: the pendant face.
        ros: the ROS-Industrial face.
        fault: why it serves nobody any more; None while it does.
        surroundings: recordings, frames, tools, scene and signals; None where it has none.
    """

    def __init__(
        self,
        settings: CellSettings,
        limits: JointLimits,
        identity: Identity,
        robot: RobotView,
        surroundings: RobotSurroundings | None = None,
        access: CoreAccess | None = None,
    ) -> None:
        """Make a server nobody is connected to.

        Args:
            settings: the cell's configuration.
            limits: the robot's joint limits, controller side.
            identity: what hello says.
            robot: the mathematics of the robot.
            surroundings: the same of the robot in its scene; where left out, the cell has no
                frames, scene, signals and recordings, and no collision is looked for.
            access: who the pendants are; where left out, whoever is on this machine may do all.
        """
        access = access or CoreAccess()
        self.name = identity.cell
        self.fault: Refusal | None = None
        self.cell = RobotCell(settings, limits, self._news)
        self.cell.watch_points(robot)
        self._errands = Errands()
        self.surroundings: CellSurroundings | None = None
        if surroundings is not None:
            self.surroundings = CellSurroundings(
                self.cell, surroundings, self._errands.ask, settings, identity.robot
            )
        self.pendants = PendantFace(self.cell, settings, identity, robot, self._errands.ask, access)
        self._trail = AuditTrail(access.record, access.login, self.cell, self.name)
        if self.surroundings is not None:
            self.pendants.surround(self.surroundings)
        self.ros = RosFace(self.cell, settings)
        self._ports: dict[int, Port] = {}
        rule = settings.watchdog
        self._ticks = TickWatch(
            round(rule.real_deadline * 1e9), round(rule.emulated_deadline * 1e9)
        )
        self._was_told = False  # the watchdog: that the robot may move before the next tick
        # A second one, so that a stop can be made whatever became of the cell's own.
        self._last_resort = GenericUplink(settings.controller, limits.velocity)

    def _news(self, news: News, now: int) -> list[Outgoing]:
        self._trail.news(news, now)
        if isinstance(news, Begun | Ended):
            self.cell.ended = news.refusal if isinstance(news, Ended) else None
        around = self.surroundings
        answer = None if around is None else around.news(news)
        pendants = self.pendants.news(news, now) if answer is None else answer
        dropped = [] if around is None else around.dropped_by(news)
        return pendants + dropped + self.ros.news(news, now)

    def opened(self, session: int, port: Port, address: str, now: int) -> list[Outgoing]:
        """A client connected."""
        if self.fault is not None:
            return [Close(session, self.fault.sentence)]
        self._ports[session] = port
        if port is Port.PENDANT:
            self.pendants.opened(session, address, now)
            return []
        return self.ros.opened(session, _ROS_PORTS[port], address, now)

    def closed(self, session: int, now: int) -> list[Outgoing]:
        """A client's connection ended, by itself or by us; a second call does nothing."""
        port = self._ports.pop(session, None)
        if port is None:
            return []
        face = self.pendants if port is Port.PENDANT else self.ros
        return face.closed(session, now)

    def stop_first(self, session: int, stop: Message, now: int) -> list[Outgoing] | None:
        """A client's STOP has arrived: it acts before what the client sent in front of it.

        Args:
            session: number of the connection.
            stop: what the STOP says.
            now: monotonic time, ns.

        Returns:
            None where the client may not stop yet: then the STOP waits for its turn.
        """
        match self._ports.get(session):
            case None:
                return None
            case Port.PENDANT:
                if not self.pendants.may_stop(session):
                    return None
                return self._after_a_freeze(now) + self.pendants.stop_first(session, stop, now)
            case _:
                return self._after_a_freeze(now) + self.ros.stop_first(session, now)

    def receive(self, session: int, received: Arrival, now: int) -> list[Outgoing]:
        """A client sent a message."""
        port = self._ports.get(session)
        if port is None:
            return []
        face = self.pendants if port is Port.PENDANT else self.ros
        return self._after_a_freeze(now) + face.receive(session, received, now)

    def skipped(self, session: int) -> None:
        """A client read too slowly for a state message."""
        if self._ports.get(session) is Port.PENDANT:
            self.pendants.skipped(session)

    def planned(self, planned: Planned, now: int) -> list[Outgoing]:
        """A planning process answered."""
        if self.fault is not None:
            return []
        late, around = self._after_a_freeze(now), self.surroundings
        out = self.pendants.programs.planned(planned, now)
        if out is None and around is not None:
            out = around.planned(planned, now)
        if out is not None:
            return late + out
        begun = late + self.cell.motions.planned(planned, now)
        return begun if around is None else begun + around.began(now)

    def errand_done(self, errand_id: int, answer: StoreAnswer, now: int) -> list[Outgoing]:
        """The store answered."""
        if self.fault is not None:
            return []
        late = self._after_a_freeze(now)  # a program that was loaded begins with a motion
        if isinstance(answer, Heading):
            self._trail.saved(answer, now)
        return late + self._errands.done(errand_id, answer, now)

    def password_checked(self, job_id: int, is_right: bool | None, now: int) -> list[Outgoing]:
        """A password was checked; None where it could not be."""
        if self.fault is not None:
            return []
        return self.pendants.access.verified(job_id, is_right, now)

    def account_changed(self, number: int, refusal: Refusal | None, now: int) -> list[Outgoing]:
        """An account was changed, or not."""
        if self.fault is not None:
            return []
        return self.pendants.access.account_changed(number, refusal, now)

    def regranted(self, session: int, now: int) -> list[Outgoing]:
        """A connection may do other things from now on, because its account was changed."""
        if self.fault is not None or self._ports.get(session) is not Port.PENDANT:
            return []
        return self.pendants.regranted(session, now)

    def controller_path(self, path: ControllerPath, up: bool, now: int) -> list[Outgoing]:
        """A connection to the controller came or went."""
        if self.fault is not None:
            return []
        out = self.cell.path_changed(path, up, now)
        if self.surroundings is None or path is not ControllerPath.STATE:
            return out
        return out + self.surroundings.state_link(up, now)

    def on_controller(
        self, path: ControllerPath, received: Received, pending: int, now: int
    ) -> list[Outgoing]:
        """The controller sent a message.

        Args:
            path: on which connection.
            received: the message.
            pending: replies that the connection still owes us.
            now: monotonic time, ns.
        """
        if self.fault is not None:
            return []
        # First of all: its answer must not call forth the set-points of the time that was lost.
        late = [] if now < self._ticks.late_from else self._after_a_freeze(now)
        return late + heard(self.cell, self.surroundings, path, received, pending, now)

    def controller_fault(self, path: ControllerPath, problem: str, now: int) -> list[Outgoing]:
        """The bytes of a connection to the controller make no sense any more."""
        if path is ControllerPath.STOP or self.fault is not None:
            return []
        return self.cell.misanswered(problem, now)

    def tick(self, now: int) -> list[Outgoing]:
        """Advance by one control tick."""
        if self.fault is not None:
            return []
        out = self._after_a_freeze(now)
        self._ticks.tick(now, says_emulated=self.cell.says_emulated)
        if self.surroundings is not None:
            out += self.surroundings.tick(now)
        out += self.cell.tick(now)
        out += self.ros.tick(now)
        out += self.pendants.tick(now)
        self._was_told = self.may_move
        return out

    def watchdog_stopped(self) -> None:
        """The watchdog has sent STOP: the next event latches a stop, as after any freeze."""
        if self.fault is None and self.cell.stop is None:
            self._ticks.stopped()

    def _after_a_freeze(self, now: int) -> list[Outgoing]:
        """Latch a stop after the event loop stood still, where the watchdog has sent one meanwhile.

        To be asked first of all: nothing may begin before it. What began since it was told counts.
        """
        if now < self._ticks.late_from:
            return []
        late = late_refusal(self._ticks.lateness(now))
        may = self._was_told or self.may_move
        return self.cell.protective_stop(late, now) if may else []

    def shut_down(self, now: int) -> list[Outgoing]:
        """The server is going down."""
        if self.fault is not None:
            return []
        out = self.cell.shut_down(now) + self.pendants.programs.desk.shut_down(now)
        return out if self.surroundings is None else out + self.surroundings.shut_down()

    @property
    def may_move(self) -> bool:
        """Whether the robot moves, or will by what was asked already: a freeze stops it then.

        One that stands with nothing queued is let alone, whoever is in control.
        """
        cell = self.cell
        is_asked = cell.program is not None or cell.motion_activity is not Activity.IDLE
        return self.fault is None and (is_asked or cell.is_moving)

    @property
    def is_moving(self) -> bool:
        """Whether the robot moves, as far as anyone knows."""
        return self.fault is None and self.cell.is_moving

    def misheard(self, session: int, incident: str, now: int) -> list[Outgoing]:
        """Stop the robot first and part with a client, because we failed on a message of it.

        Args:
            session: number of the connection.
            incident: under which the log tells more.
            now: monotonic time, ns.
        """
        text = f"a fault of the server, incident {incident} of its log"
        if self.fault is not None:
            return [Close(session, text)]
        stop = Refusal(VerdictCode.PROTECTIVE_STOP, text)
        return [*self.cell.protective_stop(stop, now), Close(session, text)]

    def fail(self, problem: str, now: int) -> list[Outgoing]:
        """Stop the robot and part with everybody, because something in here went wrong.

        Args:
            problem: what went wrong.
            now: monotonic time, ns.

        Returns:
            The stop first; nothing where it failed before.
        """
        if self.fault is not None:
            return []
        text = f"a fault of the server ended cell {self.name!r}: {problem}"
        self.fault = fault = Refusal(VerdictCode.CELL_FAULTED, text)
        stop = LatchedStop(SERVER, fault.sentence, now, is_protective=True)
        told = stop_changed(StopMoved(stop, SERVER))
        out: list[Outgoing] = [ForwardStop(self._last_resort.stop(now, is_sent=False))]
        for session, port in self._ports.items():
            if port is Port.PENDANT:
                out.append(Send(session, told))
            out.append(Close(session, fault.sentence))
        self._ports.clear()
        return out
