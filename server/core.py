"""The pendant server as one pure core: both faces and the cell behind them.

Every event comes in as a call with its time and goes out as a list of `Outgoing`, so a packet's way
from the transport to the controller is one call stack. No socket, clock, file or thread in here.
"""

from __future__ import annotations

from enum import Enum

from openpendant.motion.limits import JointLimits
from openpendant.simplemsg import CommType, Malformed, Ping, Received, Unasked, accepted, refused

from .controller_path import ControllerPath
from .jobs import Planned
from .news import News
from .outgoing import Answer, Outgoing
from .pendant_face import Identity, PendantFace
from .robot_cell import RobotCell
from .ros_face import RosFace, RosPort
from .settings import CellSettings
from .state_report import ToolView


class Port(Enum):
    """What a connection was accepted for."""

    PENDANT = "pendant protocol"
    ROS_MOTION = "ROS-Industrial motion"
    ROS_STATE = "ROS-Industrial state"


_ROS_PORTS = {Port.ROS_MOTION: RosPort.MOTION, Port.ROS_STATE: RosPort.STATE}


class ServerCore:
    """All connections of one cell, and the cell.

    Attributes:
        cell: the robot cell.
        pendants: the pendant face.
        ros: the ROS-Industrial face.
    """

    def __init__(
        self, settings: CellSettings, limits: JointLimits, identity: Identity, tool: ToolView
    ) -> None:
        """Make a server nobody is connected to.

        Args:
            settings: the cell's configuration.
            limits: the robot's joint limits, controller side.
            identity: what hello says.
            tool: where the tool is.
        """
        self.cell = RobotCell(settings, limits, self._news)
        self.pendants = PendantFace(self.cell, settings, identity, tool)
        self.ros = RosFace(self.cell, settings)
        self._ports: dict[int, Port] = {}

    def _news(self, news: News, now: int) -> list[Outgoing]:
        return self.pendants.news(news, now) + self.ros.news(news, now)

    def opened(self, session: int, port: Port, address: str, now: int) -> list[Outgoing]:
        """A client connected."""
        self._ports[session] = port
        if port is Port.PENDANT:
            self.pendants.opened(session, now)
            return []
        return self.ros.opened(session, _ROS_PORTS[port], address, now)

    def closed(self, session: int, now: int) -> list[Outgoing]:
        """A client's connection ended, by itself or by us; a second call does nothing."""
        port = self._ports.pop(session, None)
        if port is None:
            return []
        if port is Port.PENDANT:
            return self.pendants.closed(session, now)
        return self.ros.closed(session, now)

    def receive(self, session: int, received: Received, now: int) -> list[Outgoing]:
        """A client sent a message."""
        port = self._ports.get(session)
        if port is None:
            return []
        if port is Port.PENDANT:
            return self.pendants.receive(session, received, now)
        return self.ros.receive(session, received, now)

    def skipped(self, session: int) -> None:
        """A client read too slowly for a state message."""
        if self._ports.get(session) is Port.PENDANT:
            self.pendants.skipped(session)

    def planned(self, planned: Planned, now: int) -> list[Outgoing]:
        """The planning process answered."""
        return self.cell.planned(planned, now)

    def controller_path(self, path: ControllerPath, up: bool, now: int) -> list[Outgoing]:
        """A connection to the controller came or went."""
        return self.cell.path_changed(path, up, now)

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
        is_motion = path is ControllerPath.MOTION
        match received:
            case Unasked():
                problem = "the controller answered although nothing was asked"
                return self.cell.misanswered(problem, now) if is_motion else []
            case Malformed():
                is_answer = is_motion and received.comm_type == CommType.REPLY
                return self.cell.misanswered(str(received.error), now) if is_answer else []
        if received.comm_type == CommType.REPLY:
            return self.cell.answered(received, pending, now) if is_motion else []
        if received.comm_type == CommType.REQUEST:
            # But for a ping a controller has nothing to ask of us; an answer is still owed.
            is_ping = isinstance(received, Ping)
            return [Answer(path, accepted(received) if is_ping else refused(received))]
        return self.cell.reported(received, now) if path is ControllerPath.STATE else []

    def controller_fault(self, path: ControllerPath, problem: str, now: int) -> list[Outgoing]:
        """The bytes of a connection to the controller make no sense any more."""
        if path is ControllerPath.STOP:
            return []
        return self.cell.misanswered(problem, now)

    def tick(self, now: int) -> list[Outgoing]:
        """Advance by one control tick."""
        return self.cell.tick(now) + self.ros.tick(now) + self.pendants.tick(now)

    def shut_down(self, now: int) -> list[Outgoing]:
        """The server is going down."""
        return self.cell.shut_down(now)
