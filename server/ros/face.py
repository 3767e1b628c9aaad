"""The ROS-Industrial face: to an unmodified ROS-I client the server looks like a controller.

Owns when a trajectory is complete, what happens to it when its link is lost, and who may send one.
The rules are those of the architecture page, "The public protocol"; what the real clients do is in
`docs/ros-i.md`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from openpendant.simplemsg import (
    CommType,
    ControllerMode,
    GetVersion,
    GetVersionReply,
    HeaderOnly,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    Malformed,
    Message,
    MsgType,
    Ping,
    Received,
    ReplyCode,
    SpecialSequence,
    Status,
    Unasked,
    accepted,
    refused,
)
from openpendant.simplemsg.pendant import Activity, AuthorityReason
from openpendant.simplemsg.verdicts import VerdictCode

from ..authority import Holder
from ..driving.execution import START_TOLERANCE
from ..news import Begun, Ended, News, Refused, Request, StopMoved
from ..operating_mode import MotionKind
from ..outgoing import Close, Outgoing, Send
from ..peer_faults import MOST_FAULTS, PeerFaults
from ..pendant.state_report import status_message
from ..planning.jobs import RosPathJob
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..settings import CellSettings
from .state import RosStatePort
from .trajectory import Collection, PointMessage, begins, same_point, streamed

SERVER_VERSION = (0, 1, 0)
"""Answer to GET_VERSION."""

_BUSY = (VerdictCode.MOVING, VerdictCode.PLANNING)


class RosPort(Enum):
    """The two ports of this face."""

    MOTION = "points and stop"
    STATE = "joint positions and status"


@dataclass(slots=True)
class _Link:
    """One connection of a ROS-I client.

    Attributes:
        port: what it was accepted for.
        address: the client's address.
        faults: unknown and malformed frames of late.
        collection: points of an unfinished trajectory.
        gap_ends: when the trajectory counts as finished [ns].
        rejecting: a trajectory was discarded; its further points are refused without a new reason.
        finished: last point of the last complete trajectory.
        idle_since: since when the link holds the authority without using it [ns].
    """

    port: RosPort
    address: str
    faults: PeerFaults = field(default_factory=PeerFaults)
    collection: Collection | None = None
    gap_ends: int | None = None
    rejecting: bool = False
    finished: PointMessage | None = None
    idle_since: int | None = None


@dataclass(slots=True)
class _Orphan:
    """Points of a lost connection that wait for it to come back."""

    collection: Collection
    until: int


class RosFace:
    """All ROS-I connections of a cell.

    Attributes:
        refused: why the last trajectory was refused; shown in STATUS until the next is taken.
    """

    def __init__(self, cell: RobotCell, settings: CellSettings) -> None:
        """Make a face nobody is connected to."""
        self._cell = cell
        self._settings = settings.ros_i
        self._links: dict[int, _Link] = {}
        self._orphans: dict[str, _Orphan] = {}
        self._waiting: tuple[int, Collection] | None = None
        self._requests = 0
        self._gap_ns = round(settings.ros_i.trajectory_gap * 1e9)
        self._state = RosStatePort(cell, round(1e9 / settings.ros_i.state_rate))
        self.refused: VerdictCode | None = None

    # Connections.

    def opened(self, session: int, port: RosPort, address: str, now: int) -> list[Outgoing]:
        """Take note of a new connection; a state connection is told the state at once."""
        self._links[session] = _Link(port, address)
        return self._state.opened(session, self.refused, now) if port is RosPort.STATE else []

    def closed(self, session: int, now: int) -> list[Outgoing]:
        """Take note that a connection ended.

        Points of an unfinished trajectory wait for the client to come back; a motion under way is
        stopped, and the authority ends with the link.
        """
        link = self._links.pop(session)
        self._state.closed(session)
        if link.collection is not None:
            until = now + round(self._settings.resume_window * 1e9)
            self._orphans[link.address] = _Orphan(link.collection, until)
        if self._waiting is not None and self._waiting[0] == session:
            self._waiting = None
        change = self._cell.authority.release(session, AuthorityReason.CONNECTION_LOST)
        return self._cell.authority_gone(change, now)

    # Messages.

    def receive(self, session: int, received: Received, now: int) -> list[Outgoing]:
        """Take one message of a ROS-I client; requests are always answered, topics never."""
        link = self._links[session]
        match received:
            case JointTrajPt() | JointTrajPtFull() if link.port is RosPort.MOTION:
                return self._point(session, link, received, now)
            case Unasked():
                return []
            case Malformed(msg_type=MsgType.STATUS, comm_type=CommType.REQUEST):
                # The question carries nothing, so that its body is mostly empty.
                return [self._status_reply(session, now)]
            case Malformed():
                return self._malformed(session, link, received, now)
            case JointTraj() if link.port is RosPort.MOTION:
                return self._whole_trajectory(session, link, received, now)
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
        return [Send(session, refused(received)), *self._count_fault(session, link, now)]

    def _status_reply(self, session: int, now: int) -> Send:
        status = status_message(self._cell, self.refused, now)
        status.comm_type, status.reply_code = CommType.REPLY, ReplyCode.SUCCESS
        return Send(session, status)

    def _malformed(
        self, session: int, link: _Link, received: Malformed, now: int
    ) -> list[Outgoing]:
        out: list[Outgoing] = []
        if received.comm_type == CommType.REQUEST and received.msg_type != 0:
            reply = HeaderOnly(received.msg_type, reply_code=ReplyCode.FAILURE)
            out.append(Send(session, reply))
        if link.collection is not None:
            self._discard(link, VerdictCode.MALFORMED)
        return out + self._count_fault(session, link, now)

    @staticmethod
    def _count_fault(session: int, link: _Link, now: int) -> list[Outgoing]:
        if not link.faults.add(now):
            return []
        return [Close(session, f"{MOST_FAULTS} unknown or malformed requests")]

    @staticmethod
    def _answer(
        session: int, message: PointMessage | JointTraj, refusal: Refusal | None
    ) -> list[Outgoing]:
        if not isinstance(message, Message) or message.comm_type != CommType.REQUEST:
            return []
        return [Send(session, accepted(message) if refusal is None else refused(message))]

    # Points.

    def _point(
        self, session: int, link: _Link, message: JointTrajPt | JointTrajPtFull, now: int
    ) -> list[Outgoing]:
        if message.comm_type not in (CommType.TOPIC, CommType.REQUEST):
            return []
        if message.sequence == SpecialSequence.STOP:
            return self._stop(session, link, message, now)
        out: list[Outgoing] = []
        collection = link.collection
        if collection is None or (begins(message) and not collection.repeats(message)):
            if _repeats_finished(link, message):
                return self._answer(session, message, None)
            if link.rejecting and not begins(message):
                # Left over from a trajectory that was discarded; it ends with the next beginning.
                return self._answer(session, message, Refusal(VerdictCode.SEQUENCE))
            begun = self._begin(link, message, session, now)
            if isinstance(begun, Refusal):
                return self._turn_away(session, link, message, begun)
            collection, out = begun
        refusal = collection.take(message)
        if refusal is not None:
            self._discard(link, refusal.code)
            return out + self._answer(session, message, refusal)
        out += self._answer(session, message, None)
        link.gap_ends = now + self._gap_ns
        if collection.complete:
            out += self._finish(session, link, message, now)
        return out

    def _whole_trajectory(
        self, session: int, link: _Link, message: JointTraj, now: int
    ) -> list[Outgoing]:
        if any(point.sequence == SpecialSequence.STOP for point in message.points):
            return self._stop(session, link, message, now)
        points = streamed(message)
        begun = self._begin(link, points[0], session, now)
        if isinstance(begun, Refusal):
            return self._turn_away(session, link, message, begun)
        collection, out = begun
        for point in points:
            refusal = collection.take(point)
            if refusal is not None:
                self._discard(link, refusal.code)
                return out + self._answer(session, message, refusal)
        out += self._answer(session, message, None)
        return out + self._finish(session, link, points[-1], now)

    def _begin(
        self, link: _Link, message: PointMessage, session: int, now: int
    ) -> tuple[Collection, list[Outgoing]] | Refusal:
        """Open a collection for the first point of a trajectory, where this link may move.

        What this client sent before and was not moved yet is replaced; what moves is stopped.
        """
        resumed = self._adopt(link, message, now)
        if resumed is None and not begins(message):
            return Refusal(VerdictCode.SEQUENCE, f"a trajectory cannot begin at {message.sequence}")
        taken = self._take_authority(session, link, now)
        if isinstance(taken, Refusal):
            return taken
        self._waiting = None
        link.rejecting = False
        link.finished = None
        link.idle_since = None
        link.collection = resumed or Collection(self._cell.slots, self._settings.max_points)
        superseded = Refusal(VerdictCode.STOPPED, "a new trajectory replaces this one")
        return link.collection, taken + self._cell.end(superseded, now)

    def _adopt(self, link: _Link, message: PointMessage, now: int) -> Collection | None:
        """Return the points of this client's lost connection if a point goes on with them."""
        orphan = self._orphans.pop(link.address, None)
        if orphan is None or now > orphan.until:
            return None
        known = orphan.collection
        return known if known.repeats(message) or known.continues(message) else None

    def _ineligible(self, link: _Link) -> Refusal | None:
        """Return why a client may not move the robot, whatever the robot does."""
        if link.address not in self._settings.allow:
            text = f"{link.address} is not among the addresses that may move this robot"
            return Refusal(VerdictCode.ADDRESS_NOT_ALLOWED, text)
        mode = self._cell.mode
        unknown = mode is ControllerMode.UNKNOWN and self._settings.unknown_mode_is_automatic
        if mode is not ControllerMode.AUTO and not unknown:
            text = f"the controller's mode is {mode.name.lower()}, not automatic"
            return Refusal(VerdictCode.NOT_AUTOMATIC, text)
        return None

    def _take_authority(self, session: int, link: _Link, now: int) -> list[Outgoing] | Refusal:
        obstacle = self._cell.obstacle(now)
        if obstacle is not None and obstacle.code in _BUSY:
            obstacle = None
        refusal = obstacle or self._ineligible(link)
        if refusal is not None:
            return refusal
        holder = Holder(session, f"ROS-I {link.address}")
        return self._cell.take_authority(holder, now, beats=False)

    def _turn_away(
        self, session: int, link: _Link, message: PointMessage | JointTraj, refusal: Refusal
    ) -> list[Outgoing]:
        """Refuse a trajectory at its first point; the link is closed where it may not move.

        The real client takes a failure reply for a success, so closing is the only answer it sees.
        """
        self._discard(link, refusal.code)
        out = self._answer(session, message, refusal)
        if refusal.code is not VerdictCode.SEQUENCE:
            out.append(Close(session, refusal.sentence))
        return out

    def _discard(self, link: _Link, code: VerdictCode) -> None:
        link.collection = None
        link.gap_ends = None
        link.rejecting = True
        self.refused = code

    def _discard_all(self, code: VerdictCode) -> None:
        """Forget every point that does not move the robot yet, because somebody stopped it."""
        self._waiting = None
        self._orphans.clear()
        for link in self._links.values():
            if link.collection is not None:
                self._discard(link, code)

    def _stop(
        self,
        session: int,
        link: _Link,
        message: JointTrajPt | JointTrajPtFull | JointTraj,
        now: int,
    ) -> list[Outgoing]:
        """Stop the robot at once and forget all points; a fresh trajectory may follow."""
        link.collection = None
        link.gap_ends = None
        link.rejecting = False
        link.finished = None
        self._discard_all(VerdictCode.STOPPED)
        stopped = self._cell.halt(
            Refusal(VerdictCode.STOPPED, f"stop from the ROS-I client at {link.address}"), now
        )
        return stopped + self._answer(session, message, None)

    # Complete trajectories.

    def _finish(
        self, session: int, link: _Link, last: PointMessage | None, now: int
    ) -> list[Outgoing]:
        """Hand a complete trajectory to the planner, now or when the robot has come to rest."""
        collection = link.collection
        assert collection is not None
        link.collection = None
        link.gap_ends = None
        link.finished = last
        self._waiting = (session, collection)
        return self._plan_waiting(now)

    def _plan_waiting(self, now: int) -> list[Outgoing]:
        if self._waiting is None:
            return []
        session, collection = self._waiting
        cell = self._cell
        obstacle = self._ineligible(self._links[session]) or cell.check(
            session, now, MotionKind.ROS
        )
        if obstacle is not None and obstacle.code in _BUSY:
            return []
        self._waiting = None
        if obstacle is not None:
            self.refused = obstacle.code
            return [Close(session, obstacle.sentence)]
        self._requests += 1
        job = RosPathJob(
            cell.new_job_id(),
            cell.standing_at,
            tuple(collection.points),
            self._settings.approach_speed,
            START_TOLERANCE,
        )
        return cell.ask(Request(session, self._requests), job, MotionKind.ROS)

    def news(self, news: News, now: int) -> list[Outgoing]:
        """Take note of what became of a trajectory; the client learns it from STATUS."""
        match news:
            case Begun(request=request) if request.session in self._links:
                self.refused = None
            case Refused(request=request) if request.session in self._links:
                # A trajectory that ends where the robot stands is no error.
                self.refused = None
                if news.refusal.code is not VerdictCode.NO_MOTION:
                    self._show(news.refusal)
            case Ended(request=request) if request.session in self._links:
                self._show(news.refusal)
            case StopMoved(stop=stop) if stop is not None:
                self._discard_all(VerdictCode.STOP_LATCHED)
        return []

    def _show(self, refusal: Refusal | None) -> None:
        """Show in STATUS why a trajectory ended; a stop that was asked for is no error."""
        if refusal is not None and refusal.code is not VerdictCode.STOPPED:
            self.refused = refusal.code

    # Time.

    def tick(self, now: int) -> list[Outgoing]:
        """End collections, give idle authority back, and send state to whoever is due."""
        out = self._plan_waiting(now)
        for session, link in list(self._links.items()):
            if link.collection is not None and link.gap_ends is not None and now >= link.gap_ends:
                out += self._finish(session, link, link.collection.last, now)
            out += self._release_idle(session, link, now)
        for address in [key for key, orphan in self._orphans.items() if now > orphan.until]:
            del self._orphans[address]
        return out + self._state.tick(self.refused, now)

    def _release_idle(self, session: int, link: _Link, now: int) -> list[Outgoing]:
        cell = self._cell
        if not cell.authority.is_held_by(session):
            link.idle_since = None
            return []
        if (
            cell.activity is not Activity.IDLE
            or link.collection is not None
            or self._waiting is not None
        ):
            link.idle_since = None
            return []
        if link.idle_since is None:
            link.idle_since = now
        if now - link.idle_since < round(self._settings.idle_release * 1e9):
            return []
        link.idle_since = None
        return cell.authority_gone(cell.authority.release(session, AuthorityReason.RELEASED), now)


def _repeats_finished(link: _Link, message: PointMessage) -> bool:
    """Tell whether a point ended the last trajectory; a point that can begin one is a new one."""
    return link.finished is not None and not begins(message) and same_point(link.finished, message)
