"""The trajectories of ROS-Industrial clients: collected point by point, completed, handed on.

Owns when a trajectory is complete, what happens to it when its link is lost or somebody stops, and
who may send one. Whether the robot may move is the cell's rule, what one point means
`trajectory`'s.
"""

from __future__ import annotations

from openpendant.simplemsg import (
    CommType,
    ControllerMode,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    Message,
    SpecialSequence,
    accepted,
    refused,
)
from openpendant.simplemsg.pendant import Activity, AuthorityReason
from openpendant.simplemsg.stop_walk import holds_stop
from openpendant.simplemsg.verdicts import VerdictCode

from ..authority import Holder
from ..driving.execution import START_TOLERANCE
from ..news import Request
from ..operating_mode import MotionKind
from ..outgoing import Close, Outgoing, Send
from ..planning.jobs import RosPathJob
from ..readiness import PASSING
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..settings import RosFace as RosSettings
from .link import Link, Orphan
from .trajectory import Collection, PointMessage, begins, streamed


class RosTrajectories:
    """All unfinished and waiting trajectories of a cell.

    Attributes:
        refused: why the last trajectory was refused; None once the next is taken.
    """

    def __init__(self, cell: RobotCell, settings: RosSettings, links: dict[int, Link]) -> None:
        """Make a place without trajectories.

        Args:
            cell: the cell.
            settings: of this face.
            links: the connections by their numbers, as they come and go.
        """
        self.refused: VerdictCode | None = None
        self._cell = cell
        self._settings = settings
        self._links = links
        self._orphans: dict[str, Orphan] = {}
        self._waiting: tuple[int, Collection] | None = None
        self._requests = 0
        self._gap_ns = round(settings.trajectory_gap * 1e9)

    def link_lost(self, link: Link, now: int) -> None:
        """Keep the points of an unfinished trajectory for the client to come back."""
        if link.collection is not None:
            until = now + round(self._settings.resume_window * 1e9)
            self._orphans[link.address] = Orphan(link.collection, until)
        if self._waiting is not None and self._waiting[0] == link.session:
            self._waiting = None

    # Points.

    def point(
        self, session: int, link: Link, message: JointTrajPt | JointTrajPtFull, now: int
    ) -> list[Outgoing]:
        """Take one point of a trajectory, or a stop."""
        if message.comm_type not in (CommType.TOPIC, CommType.REQUEST):
            return []
        if message.sequence == SpecialSequence.STOP:
            return self.stop(link, now) + _answer(session, message, None)
        out: list[Outgoing] = []
        collection = link.collection
        if collection is None or (begins(message) and not collection.repeats(message)):
            if link.repeats_finished(message):
                return _answer(session, message, None)
            if link.rejecting and not begins(message):
                # Left over from a trajectory that was discarded; it ends with the next beginning.
                return _answer(session, message, Refusal(VerdictCode.SEQUENCE))
            begun = self._begin(link, message, session, now)
            if isinstance(begun, Refusal):
                return self._turn_away(session, link, message, begun)
            collection, out = begun
        refusal = collection.take(message)
        if refusal is not None:
            self.discard(link, refusal.code)
            return out + _answer(session, message, refusal)
        out += _answer(session, message, None)
        link.gap_ends = now + self._gap_ns
        if collection.complete:
            out += self._finish(session, link, message, now)
        return out

    def whole_trajectory(
        self, session: int, link: Link, message: JointTraj, now: int
    ) -> list[Outgoing]:
        """Take a trajectory that comes in one message."""
        if holds_stop(message):
            return self.stop(link, now) + _answer(session, message, None)
        points = streamed(message)
        begun = self._begin(link, points[0], session, now)
        if isinstance(begun, Refusal):
            return self._turn_away(session, link, message, begun)
        collection, out = begun
        for point in points:
            refusal = collection.take(point)
            if refusal is not None:
                self.discard(link, refusal.code)
                return out + _answer(session, message, refusal)
        out += _answer(session, message, None)
        return out + self._finish(session, link, points[-1], now)

    def _begin(
        self, link: Link, message: PointMessage, session: int, now: int
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

    def _adopt(self, link: Link, message: PointMessage, now: int) -> Collection | None:
        """Return the points of this client's lost connection if a point goes on with them."""
        orphan = self._orphans.pop(link.address, None)
        if orphan is None or now > orphan.until:
            return None
        known = orphan.collection
        return known if known.repeats(message) or known.continues(message) else None

    def _ineligible(self, link: Link) -> Refusal | None:
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

    def _take_authority(self, session: int, link: Link, now: int) -> list[Outgoing] | Refusal:
        obstacle = self._cell.obstacle(now)
        if obstacle is not None and obstacle.code in PASSING:
            obstacle = None
        refusal = obstacle or self._ineligible(link)
        if refusal is not None:
            return refusal
        holder = Holder(session, f"ROS-I {link.address}")
        return self._cell.take_authority(holder, now, beats=False)

    def _turn_away(
        self, session: int, link: Link, message: PointMessage | JointTraj, refusal: Refusal
    ) -> list[Outgoing]:
        """Refuse a trajectory at its first point; the link is closed where it may not move.

        The real client takes a failure reply for a success, so closing is the only answer it sees.
        """
        self.discard(link, refusal.code)
        out = _answer(session, message, refusal)
        if refusal.code is not VerdictCode.SEQUENCE:
            out.append(Close(session, refusal.sentence))
        return out

    def discard(self, link: Link, code: VerdictCode) -> None:
        """Forget the points of a link, and refuse those that belong to the same trajectory."""
        link.drop_points()
        link.rejecting = True
        self.refused = code

    def discard_all(self, code: VerdictCode) -> None:
        """Forget every point that does not move the robot yet, because somebody stopped it."""
        self._waiting = None
        self._orphans.clear()
        for link in self._links.values():
            if link.collection is not None:
                self.discard(link, code)

    def interrupt(self, refusal: Refusal) -> list[Outgoing]:
        """Forget the same because the controller broke off; who waits to move is closed for it."""
        sessions = [session for session, link in self._links.items() if link.collection is not None]
        if self._waiting is not None:
            sessions.append(self._waiting[0])
        self.discard_all(refusal.code)
        out: list[Outgoing] = []
        for session in sessions:
            why = self._ineligible(self._links[session]) or refusal  # it names what to mend
            self.refused = why.code
            out.append(Close(session, why.sentence))
        return out

    def stop(self, link: Link, now: int) -> list[Outgoing]:
        """Stop the robot at once and forget all points; a fresh trajectory may follow."""
        link.drop_points()
        link.rejecting = False
        link.finished = None
        self.discard_all(VerdictCode.STOPPED)
        return self._cell.halt(
            Refusal(VerdictCode.STOPPED, f"stop from the ROS-I client at {link.address}"), now
        )

    # Complete trajectories.

    def _finish(
        self, session: int, link: Link, last: PointMessage | None, now: int
    ) -> list[Outgoing]:
        """Hand a complete trajectory to the planner, now or when the robot has come to rest."""
        collection = link.collection
        assert collection is not None
        link.drop_points()
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
        if obstacle is not None and obstacle.code in PASSING:
            return []
        self._waiting = None
        if obstacle is not None:
            self.refused = obstacle.code
            return [Close(session, obstacle.sentence)]
        self._requests += 1
        job = RosPathJob(
            cell.motions.new_job_id(),
            cell.standing_at,
            tuple(collection.points),
            self._settings.approach_speed,
            START_TOLERANCE,
        )
        return cell.motions.ask(Request(session, self._requests), job, MotionKind.ROS)

    # Time.

    def tick(self, now: int) -> list[Outgoing]:
        """Plan what waited, end collections, and give idle authority back."""
        if not self._links and not self._orphans:
            return []
        out = self._plan_waiting(now)
        for session, link in list(self._links.items()):
            if link.collection is not None and link.gap_ends is not None and now >= link.gap_ends:
                out += self._finish(session, link, link.collection.last, now)
            out += self._release_idle(session, link, now)
        for address in [key for key, orphan in self._orphans.items() if now > orphan.until]:
            del self._orphans[address]
        return out

    def _release_idle(self, session: int, link: Link, now: int) -> list[Outgoing]:
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


def _answer(
    session: int, message: PointMessage | JointTraj, refusal: Refusal | None
) -> list[Outgoing]:
    if not isinstance(message, Message) or message.comm_type != CommType.REQUEST:
        return []
    return [Send(session, accepted(message) if refusal is None else refused(message))]
