"""The ROS-Industrial face: to an unmodified ROS-I client the server looks like a controller.

Owns the answers to each message, and what STATUS shows of a trajectory. What becomes of points is
`trajectories`' business. The rules are those of the architecture page, "The public protocol"; what
the real clients do is in `docs/ros-i.md`.
"""

from __future__ import annotations

from openpendant.simplemsg import (
    Arrival,
    CommType,
    GetVersion,
    GetVersionReply,
    HeaderOnly,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    Malformed,
    Message,
    MsgType,
    Overtaken,
    Ping,
    Received,
    ReplyCode,
    SpecialSequence,
    Status,
    StopAhead,
    Unasked,
    accepted,
    refused,
)
from openpendant.simplemsg.pendant import AuthorityReason
from openpendant.simplemsg.stop_walk import holds_stop
from openpendant.simplemsg.verdicts import VerdictCode

from ..news import Begun, Ended, Interrupted, News, Refused
from ..outgoing import Outgoing, Send
from ..pendant.state_report import status_message
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..settings import CellSettings
from .link import Link, RosPort
from .state import RosStatePort
from .trajectories import RosTrajectories

SERVER_VERSION = (0, 1, 0)
"""Answer to GET_VERSION."""


class RosFace:
    """All ROS-I connections of a cell."""

    def __init__(self, cell: RobotCell, settings: CellSettings) -> None:
        """Make a face nobody is connected to."""
        self._cell = cell
        self._links: dict[int, Link] = {}
        self._trajectories = RosTrajectories(cell, settings.ros_i, self._links)
        period_ns = round(1e9 / settings.ros_i.state_rate)
        self._state = RosStatePort(cell, self._trajectories.outcomes, period_ns)

    @property
    def refused(self) -> VerdictCode | None:
        """Why the last trajectory did not come to its end; in STATUS until the next is taken."""
        newest = self._trajectories.outcomes.newest
        return None if newest is None else newest.code

    # Connections.

    def opened(self, session: int, port: RosPort, address: str, now: int) -> list[Outgoing]:
        """Take note of a new connection; a state connection is told the state at once."""
        self._links[session] = Link(port, session, address)
        return self._state.opened(session, address, now) if port is RosPort.STATE else []

    def closed(self, session: int, now: int) -> list[Outgoing]:
        """Take note that a connection ended.

        Points of an unfinished trajectory wait for the client to come back; a motion under way is
        stopped, and the authority ends with the link.
        """
        link = self._links.pop(session)
        self._state.closed(session)
        lost = self._trajectories.passed_stop(link, now)
        lost += self._trajectories.link_lost(link, now)
        change = self._cell.authority.release(session, AuthorityReason.CONNECTION_LOST)
        return self._cell.authority_gone(change, now) + lost

    # Messages.

    def stop_first(self, session: int, now: int) -> list[Outgoing]:
        """Obey a STOP before what came in front of it; it is answered in its place."""
        return self._trajectories.stop(self._links[session], now)

    def receive(self, session: int, received: Arrival, now: int) -> list[Outgoing]:
        """Take one message of a ROS-I client; requests are always answered, topics never."""
        link = self._links[session]
        match received:
            case JointTrajPt() | JointTrajPtFull() if (
                link.port is RosPort.MOTION or received.sequence == SpecialSequence.STOP
            ):
                return self._trajectories.point(session, link, received, now)
            case Unasked():
                return []
            case Malformed(msg_type=MsgType.STATUS, comm_type=CommType.REQUEST):
                # The question carries nothing, so that its body is mostly empty.
                return [self._status_reply(session, now)]
            case Malformed():
                return self._malformed(session, link, received, now)
            case JointTraj() if link.port is RosPort.MOTION or holds_stop(received):
                return self._trajectories.whole_trajectory(session, link, received, now)
            case Overtaken(received=overtaken):
                return self._overtaken(link, overtaken, now)
            case StopAhead(message=stop):
                out = self._trajectories.passed_stop(link, now)
                if received.is_request:
                    # A frame that is not one of its type is refused, though it has stopped.
                    answer = accepted(stop) if received.is_sound else refused(stop)
                    out.append(Send(session, answer))
                return out
        if received.comm_type != CommType.REQUEST:
            return []
        match received:
            case Ping():
                reply: Message = Ping(comm_type=CommType.REPLY, reply_code=ReplyCode.SUCCESS)
                return [Send(session, reply)]
            case GetVersion():
                major, minor, patch = SERVER_VERSION
                return [Send(session, GetVersionReply(major=major, minor=minor, patch=patch))]
            case Status():
                return [self._status_reply(session, now)]
        return [Send(session, refused(received)), *link.count_fault(now)]

    def _overtaken(self, link: Link, received: Received, now: int) -> list[Outgoing]:
        """Refuse the points that a STOP has overtaken; take anything else as usual."""
        if isinstance(received, JointTrajPt | JointTrajPtFull | JointTraj):
            return self._trajectories.overtaken(link, received)
        return self.receive(link.session, received, now)

    def _status_reply(self, session: int, now: int) -> Send:
        status = status_message(self._cell, self._trajectories.outcomes.newest, now)
        status.comm_type, status.reply_code = CommType.REPLY, ReplyCode.SUCCESS
        return Send(session, status)

    def _malformed(self, session: int, link: Link, received: Malformed, now: int) -> list[Outgoing]:
        out: list[Outgoing] = []
        if received.comm_type == CommType.REQUEST and received.msg_type != 0:
            reply = HeaderOnly(received.msg_type, reply_code=ReplyCode.FAILURE)
            out.append(Send(session, reply))
        if link.collection is not None:
            refusal = Refusal(VerdictCode.MALFORMED, str(received.error))
            out += self._trajectories.discard(link, refusal, now)
        return out + link.count_fault(now)

    def news(self, news: News, now: int) -> list[Outgoing]:
        """Take note of what became of a trajectory; the client learns it from STATUS."""
        outcomes = self._trajectories.outcomes
        match news:
            case Begun(request=request) if outcomes.is_of(request.session):
                outcomes.newest = None
            case Refused() | Ended():
                return outcomes.ended(news, now)
            case Interrupted(refusal=refusal):
                return self._trajectories.interrupt(refusal, now)
        return []

    # Time.

    def tick(self, now: int) -> list[Outgoing]:
        """Let trajectories go on, and send state to whoever is due."""
        out = self._trajectories.tick(now)
        return out + self._state.tick(now) if self._links else out
