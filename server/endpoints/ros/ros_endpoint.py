"""ROS-Industrial endpoint: to an unmodified ROS-I client the server looks like a controller.

Owns the answers to each message, and what STATUS shows of a trajectory. What becomes of points is
the business of `trajectory_collection`. The rules are those of the architecture page, "The public
protocol"; what the real clients do is in `docs/ros-i.md`.

Owns the state port: joint positions and status at a fixed rate, and who is due when. What the
messages say is the business of `state_report`; from whom positions are withheld, that of
`RosOutcomes`.
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
    Unasked,
    WaitingStop,
    accepted,
    refused,
)
from openpendant.simplemsg.pendant import AuthorityReason
from openpendant.simplemsg.stop_walk import holds_stop
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.robot_cell import RobotCell
from ...cell.state_report import joint_position_message, status_message
from ...events.cell_events import CellEvent, Interruption, MotionEnded, MotionRefused, MotionStarted
from ...events.effects import Broadcast, Effect, Send
from ...refusal import Refusal
from ...settings.cell_settings import CellSettings
from .ros_trajectory import RosLink, RosOutcomes, RosPort
from .trajectory_collection import RosTrajectories


class RosStatePort:
    """All state connections of a cell."""

    def __init__(self, cell: RobotCell, outcomes: RosOutcomes, period_ns: int) -> None:
        """Make a port nobody listens to; each listener is told once in `period_ns`."""
        self._cell = cell
        self._outcomes = outcomes
        self._period_ns = period_ns
        self._due: dict[int, int] = {}
        self._addresses: dict[int, str] = {}

    def opened(self, session: int, address: str, now: int) -> list[Effect]:
        """Take note of a new connection and tell it the state at once."""
        self._due[session] = now + self._period_ns
        self._addresses[session] = address
        return self._state((session,), now)

    def closed(self, session: int) -> None:
        """Forget a connection."""
        self._due.pop(session, None)
        self._addresses.pop(session, None)

    def tick(self, now: int) -> list[Effect]:
        """Tell the state to whoever is due."""
        sessions = tuple(session for session, due in self._due.items() if now >= due)
        for session in sessions:
            self._due[session] = max(self._due[session] + self._period_ns, now)
        return self._state(sessions, now) if sessions else []

    def _state(self, sessions: tuple[int, ...], now: int) -> list[Effect]:
        """Joint positions first, then status: the order the real clients expect."""
        out: list[Effect] = []
        joints = joint_position_message(self._cell, now)
        if joints is not None:
            sees, addresses = self._outcomes.sees, self._addresses
            seeing = tuple(each for each in sessions if sees(addresses[each], now))
            out.append(Broadcast(seeing, joints))
        out.append(Broadcast(sessions, status_message(self._cell, self._outcomes.newest, now)))
        return out


SERVER_VERSION = (0, 1, 0)
"""Answer to GET_VERSION."""


class RosEndpoint:
    """All ROS-I connections of a cell."""

    def __init__(self, cell: RobotCell, settings: CellSettings) -> None:
        """Make an endpoint that nobody is connected to."""
        self._cell = cell
        self._links: dict[int, RosLink] = {}
        self._trajectories = RosTrajectories(cell, settings.ros_i, self._links)
        period_ns = round(1e9 / settings.ros_i.state_rate)
        self._state = RosStatePort(cell, self._trajectories.outcomes, period_ns)

    @property
    def refused(self) -> VerdictCode | None:
        """Why the last trajectory did not come to its end; in STATUS until the next is taken."""
        newest = self._trajectories.outcomes.newest
        return None if newest is None else newest.code

    # Connections.

    def opened(self, session: int, port: RosPort, address: str, now: int) -> list[Effect]:
        """Take note of a new connection; a state connection is told the state at once."""
        self._links[session] = RosLink(port, session, address)
        return self._state.opened(session, address, now) if port is RosPort.STATE else []

    def closed(self, session: int, now: int) -> list[Effect]:
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

    @staticmethod
    def may_stop(session: int) -> bool:
        """Return True: whoever may connect here may stop the robot."""
        return True

    def stop_first(self, session: int, stop: Message, now: int) -> list[Effect]:
        """Obey a STOP before what came in front of it; it is answered in its place."""
        return self._trajectories.stop(self._links[session], now)

    def receive(self, session: int, received: Arrival, now: int) -> list[Effect]:
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
            case WaitingStop(message=stop):
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

    def _overtaken(self, link: RosLink, received: Received, now: int) -> list[Effect]:
        """Refuse the points that a STOP has overtaken; take anything else as usual."""
        if isinstance(received, JointTrajPt | JointTrajPtFull | JointTraj):
            return self._trajectories.overtaken(link, received)
        return self.receive(link.session, received, now)

    def _status_reply(self, session: int, now: int) -> Send:
        status = status_message(self._cell, self._trajectories.outcomes.newest, now)
        status.comm_type, status.reply_code = CommType.REPLY, ReplyCode.SUCCESS
        return Send(session, status)

    def _malformed(
        self, session: int, link: RosLink, received: Malformed, now: int
    ) -> list[Effect]:
        out: list[Effect] = []
        if received.comm_type == CommType.REQUEST and received.msg_type != 0:
            reply = HeaderOnly(received.msg_type, reply_code=ReplyCode.FAILURE)
            out.append(Send(session, reply))
        if link.collection is not None:
            refusal = Refusal(VerdictCode.MALFORMED, str(received.error))
            out += self._trajectories.discard(link, refusal, now)
        return out + link.count_fault(now)

    def on_cell_event(self, event: CellEvent, now: int) -> list[Effect]:
        """Take note of what became of a trajectory; the client learns it from STATUS."""
        outcomes = self._trajectories.outcomes
        match event:
            case MotionStarted(request=request) if outcomes.is_of(request.session):
                outcomes.newest = None
            case MotionRefused() | MotionEnded():
                return outcomes.ended(event, now)
            case Interruption(refusal=refusal):
                return self._trajectories.interrupt(refusal, now)
        return []

    # Time.

    def tick(self, now: int) -> list[Effect]:
        """Let trajectories go on, and send state to whoever is due."""
        out = self._trajectories.tick(now)
        return out + self._state.tick(now) if self._links else out
