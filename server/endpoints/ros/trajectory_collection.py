"""Trajectories of ROS-Industrial clients: collected point by point, completed, handed on.

Owns when a trajectory is complete, what happens to it when its link is lost or somebody stops, and
who may send one. Whether the robot may move is the cell's rule, what one point means
`ros_trajectory`'s.
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

from ...cell.execution.point_stream import START_TOLERANCE
from ...cell.interlocks import PASSING, check_interlocks
from ...cell.robot_cell import RobotCell
from ...control import Holder, MotionKind
from ...events.cell_events import MotionOwner, MotionRequest
from ...events.effects import Close, Effect, Send
from ...planning.jobs import RosPathJob
from ...refusal import Refusal
from ...settings.cell_settings import RosSettings as RosSettings
from .ros_trajectory import (
    Collection,
    OrphanedPoints,
    PointMessage,
    RosLink,
    RosOutcomes,
    Sender,
    WaitingTrajectory,
    begins,
    streamed,
)

LATEST_BEGINNING_NS = 1_000_000_000
"""So long after its last point a trajectory may begin at the latest, and what planning takes.

Nobody expects a robot to set off later. An announced end is waited for as long.
"""

_LATE_TICK_NS = 100_000_000
"""A tick that comes so long after the last judges no silence: points may wait to be read.

The next one does, however late, or on a machine that is always late nothing would ever end.
"""


class RosTrajectories:
    """All unfinished and waiting trajectories of a cell."""

    def __init__(self, cell: RobotCell, settings: RosSettings, links: dict[int, RosLink]) -> None:
        """Make a place without trajectories."""
        self.outcomes = RosOutcomes(settings.abort_silence)
        self._cell = cell
        self._settings = settings
        self._links = links
        self._orphans: dict[str, OrphanedPoints] = {}
        self._leftovers: dict[
            str, int
        ] = {}  # until when an address sends the rest of a refused one
        self._waiting: WaitingTrajectory | None = None
        self._requests = 0
        self._gap_ns = round(settings.trajectory_gap * 1e9)
        self._resume_ns = round(settings.resume_window * 1e9)
        self._ticked: int | None = None
        self._was_late = False

    def link_lost(self, link: RosLink, now: int) -> list[Effect]:
        """Keep the points of an unfinished trajectory for the client to come back."""
        waiting = self._waiting
        if link.collection is not None:
            orphan = OrphanedPoints(link.collection, link.sender, now + self._resume_ns)
            self._orphans[link.address] = orphan
        if waiting is None or waiting.sender != link.sender:
            return []
        self._waiting = None
        why = Refusal(VerdictCode.TRAJECTORY_INCOMPLETE, "its link was lost before it began")
        return self._drop(waiting.sender, waiting.collection, why, now)

    # Points.

    def point(
        self, session: int, link: RosLink, message: JointTrajPt | JointTrajPtFull, now: int
    ) -> list[Effect]:
        """Take one point of a trajectory, or a stop."""
        if message.comm_type not in (CommType.TOPIC, CommType.REQUEST):
            return []
        if message.sequence == SpecialSequence.STOP:
            return self.stop(link, now) + _answer(session, message, None)
        out: list[Effect] = []
        collection = link.collection
        if collection is None or (begins(message) and not collection.repeats(message)):
            if link.repeats_finished(message):
                return _answer(session, message, None)
            if not begins(message) and self._is_left_over(link, now):
                return _answer(session, message, Refusal(VerdictCode.SEQUENCE))
            if not begins(message) and self._is_under_way(session):
                return self._cut_off(link, message, now)
            started = self._begin(link, message, session, now)
            if isinstance(started, Refusal):
                return self._refuse_at_start(session, link, message, started, now)
            collection, out = started
        refusal = collection.take(message)
        if refusal is not None:
            out += self.discard(link, refusal, now)
            return out + _answer(session, message, refusal)
        out += _answer(session, message, None)
        collection.last_byte = self._arrival(now)
        link.gap_ends = now + (LATEST_BEGINNING_NS if collection.awaits_end else self._gap_ns)
        if collection.complete:
            out += self._finish(link, message, now)
        return out

    def _arrival(self, now: int) -> int:
        """Return the earliest time at which what is read now may have come."""
        return now if self._ticked is None else min(now, self._ticked)

    def whole_trajectory(
        self, session: int, link: RosLink, message: JointTraj, now: int
    ) -> list[Effect]:
        """Take a trajectory that comes in one message."""
        if holds_stop(message):
            return self.stop(link, now) + _answer(session, message, None)
        points = streamed(message)
        started = self._begin(link, points[0], session, now)
        if isinstance(started, Refusal):
            return self._refuse_at_start(session, link, message, started, now)
        collection, out = started
        for point in points:
            refusal = collection.take(point)
            if refusal is not None:
                out += self.discard(link, refusal, now)
                return out + _answer(session, message, refusal)
        collection.last_byte = self._arrival(now)
        out += _answer(session, message, None)
        return out + self._finish(link, points[-1], now)

    def _begin(
        self, link: RosLink, message: PointMessage, session: int, now: int
    ) -> tuple[Collection, list[Effect]] | Refusal:
        """Open a collection for the first point of a trajectory, where this link may move.

        What this client sent before and was not moved yet is replaced; what moves is stopped.
        """
        orphan = self._orphans.pop(link.address, None)
        resumed = None if orphan is None else _resumed(orphan, message, now)
        if resumed is None and not begins(message):
            return Refusal(VerdictCode.SEQUENCE, f"a trajectory cannot begin at {message.sequence}")
        taken = self._take_authority(session, link, now)
        if isinstance(taken, Refusal):
            return taken
        out: list[Effect] = []
        superseded = Refusal(VerdictCode.STOPPED, "a new trajectory replaces this one")
        if resumed is None:
            for sender, replaced in self._unmoved(link, orphan):
                points = (0, len(replaced.points))
                out += self.outcomes.tell(sender, points, superseded, now, is_wanted=True)
        self._waiting = None
        self._leftovers.pop(link.address, None)
        link.rejecting = False
        link.finished = None
        link.idle_since = None
        link.collection = resumed or Collection(self._cell.slots, self._settings.max_points)
        self.outcomes.begins(link.sender)
        return link.collection, taken + out + self._cell.end(superseded, now)

    def _unmoved(
        self, link: RosLink, orphan: OrphanedPoints | None
    ) -> list[tuple[Sender, Collection]]:
        """Return what a client has sent that has not moved the robot yet, and whose it is."""
        unmoved = [] if orphan is None else [(orphan.sender, orphan.collection)]
        if link.collection is not None:
            unmoved.append((link.sender, link.collection))
        if self._waiting is not None:
            unmoved.append((self._waiting.sender, self._waiting.collection))
        return unmoved

    def _is_left_over(self, link: RosLink, now: int) -> bool:
        """Return True if a point belongs to a trajectory that was refused, and told of, before.

        The real client goes on with its points after a failure reply, and on a new link where the
        old one was closed for it; what it is told must stay the first reason.
        """
        if not link.rejecting and self._leftovers.get(link.address, now) > now:
            link.rejecting = True
        if link.rejecting:
            self._leftovers[link.address] = now + self._resume_ns
        return link.rejecting

    def _is_under_way(self, session: int) -> bool:
        """Return True if the last trajectory of a connection waits, is planned or is moved."""
        waiting = self._waiting
        return self.outcomes.is_of(session) or (
            waiting is not None and waiting.sender.session == session
        )

    def _cut_off(
        self, link: RosLink, message: JointTrajPt | JointTrajPtFull, now: int
    ) -> list[Effect]:
        """Break a trajectory off because a point follows that came after it counted as complete.

        Nobody knows where it was to end.
        """
        text = f"point {message.sequence} came after the trajectory had ended"
        if message.sequence >= 0:
            text += f": no point had come for {self._settings.trajectory_gap * 1e3:.0f} ms"
        refusal = Refusal(VerdictCode.SEQUENCE, text)
        out: list[Effect] = []
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            out = self._drop(waiting.sender, waiting.collection, refusal, now)
        else:
            out = self._cell.end(refusal, now)
        self._reject(link, now)
        return out + _answer(link.session, message, refusal)

    def _ineligible(self, link: RosLink) -> Refusal | None:
        """Return why a client may not move the robot, whatever the robot does."""
        if link.address not in self._settings.allow:
            text = f"{link.address} is not among the addresses that may move this robot"
            return Refusal(VerdictCode.ADDRESS_NOT_ALLOWED, text)
        mode = self._cell.feedback.mode
        unknown = mode is ControllerMode.UNKNOWN and self._settings.unknown_mode_is_automatic
        if mode is not ControllerMode.AUTO and not unknown:
            text = f"the controller's mode is {mode.name.lower()}, not automatic"
            return Refusal(VerdictCode.NOT_AUTOMATIC, text)
        return None

    def _take_authority(self, session: int, link: RosLink, now: int) -> list[Effect] | Refusal:
        obstacle = self._cell.obstacle(now)
        if obstacle is not None and obstacle.code in PASSING:
            obstacle = None
        refusal = obstacle or self._ineligible(link)
        if refusal is not None:
            return refusal
        holder = Holder(session, f"ROS-I {link.address}")
        return self._cell.take_authority(holder, now, beats=False)

    def _refuse_at_start(
        self,
        session: int,
        link: RosLink,
        message: PointMessage | JointTraj,
        refusal: Refusal,
        now: int,
    ) -> list[Effect]:
        """Refuse a trajectory at its first point; the link is closed where it may not move.

        The real client takes a failure reply for a success, so closing is the only answer it sees.
        """
        points = len(message.points) if isinstance(message, JointTraj) else 1
        link.drop_points()
        self._reject(link, now)
        out = self.outcomes.tell(link.sender, (0, points), refusal, now)
        out += _answer(session, message, refusal)
        if refusal.code is not VerdictCode.SEQUENCE:
            out.append(Close(session, "its trajectory was refused"))
        return out

    def discard(self, link: RosLink, refusal: Refusal, now: int) -> list[Effect]:
        """Forget the points of a link, and refuse those that belong to the same trajectory."""
        collection = link.collection
        assert collection is not None
        link.drop_points()
        self._reject(link, now)
        return self._drop(link.sender, collection, refusal, now)

    def _reject(self, link: RosLink, now: int) -> None:
        """Refuse what still comes of a trajectory, on a new link of its client too."""
        link.rejecting = True
        self._leftovers[link.address] = now + self._resume_ns

    def _drop(
        self, sender: Sender, collection: Collection, refusal: Refusal, now: int
    ) -> list[Effect]:
        return self.outcomes.tell(sender, (0, len(collection.points)), refusal, now)

    def _forget_unmoved(self, refusal: Refusal, now: int, by: int = 0) -> list[Effect]:
        """Forget every point that does not move the robot yet.

        Args:
            by: number of the connection whose client wants it so; 0 for none.
        """
        dropped = [(orphan.sender, orphan.collection) for orphan in self._orphans.values()]
        if self._waiting is not None:
            dropped.append((self._waiting.sender, self._waiting.collection))
        for link in self._links.values():
            if link.collection is not None:
                dropped.append((link.sender, link.collection))
                link.drop_points()
                self._reject(link, now)
        self._waiting = None
        self._orphans.clear()
        out: list[Effect] = []
        for sender, collection in dropped:
            points, is_wanted = (0, len(collection.points)), sender.session == by
            out += self.outcomes.tell(sender, points, refusal, now, is_wanted=is_wanted)
        return out

    def interrupt(self, refusal: Refusal, now: int) -> list[Effect]:
        """Forget what does not move yet, because the controller or somebody broke off.

        Who waits to move is closed for it.
        """
        sessions = [session for session, link in self._links.items() if link.collection is not None]
        if self._waiting is not None:
            sessions.append(self._waiting.sender.session)
        if sessions:
            # One that turned the mode selector, say: it names what to mend.
            refusal = self._ineligible(self._links[sessions[0]]) or refusal
        out = self._forget_unmoved(refusal, now)
        return out + [Close(session, "its trajectory was broken off") for session in sessions]

    def stop(self, link: RosLink, now: int) -> list[Effect]:
        """Stop the robot at once and forget all points; a fresh trajectory may follow."""
        refusal = Refusal(VerdictCode.STOPPED, f"stop from the ROS-I client at {link.address}")
        self.outcomes.unwanted(link.session)
        told = self._forget_unmoved(refusal, now, by=link.session)
        stopped = self._cell.halt(refusal, now)
        self._leftovers.pop(link.address, None)
        link.rejecting = False
        link.finished = None
        return stopped + told

    def overtaken(
        self, link: RosLink, message: JointTrajPt | JointTrajPtFull | JointTraj
    ) -> list[Effect]:
        """Refuse points that a STOP of the same connection, which has acted, has overtaken."""
        if message.comm_type not in (CommType.TOPIC, CommType.REQUEST):
            return []
        link.overtaken += len(message.points) if isinstance(message, JointTraj) else 1
        return _answer(link.session, message, Refusal(VerdictCode.OVERTAKEN_BY_STOP))

    def passed_stop(self, link: RosLink, now: int) -> list[Effect]:
        """Tell of the points in front of a STOP, whose own place has come, or will never come."""
        if not link.overtaken:
            return []
        points, link.overtaken = (0, link.overtaken), 0
        text = "a STOP that came behind these points has acted before them"
        refusal = Refusal(VerdictCode.OVERTAKEN_BY_STOP, text)
        return self.outcomes.tell(link.sender, points, refusal, now)

    # Complete trajectories.

    def _finish(self, link: RosLink, last: PointMessage | None, now: int) -> list[Effect]:
        """Hand a complete trajectory to the planner, now or when the robot has come to rest."""
        collection = link.collection
        assert collection is not None
        link.drop_points()
        link.finished = last
        self._waiting = WaitingTrajectory(link.sender, collection)
        return self._plan_waiting(now)

    def _plan_waiting(self, now: int) -> list[Effect]:
        if self._waiting is None:
            return []
        sender, collection = self._waiting.sender, self._waiting.collection
        session, cell = sender.session, self._cell
        obstacle = self._ineligible(self._links[session]) or check_interlocks(
            cell, session, now, MotionKind.ROS
        )
        is_passing = obstacle is not None and obstacle.code in PASSING
        begin_by = collection.last_byte + LATEST_BEGINNING_NS
        if now > begin_by and (obstacle is None or is_passing):
            self._waiting = None
            return self._drop(sender, collection, _late(collection, obstacle, now), now)
        if is_passing:
            return []
        self._waiting = None
        if obstacle is not None:
            out = self._drop(sender, collection, obstacle, now)
            return [*out, Close(session, "its trajectory was refused")]
        self._requests += 1
        job = RosPathJob(
            cell.motions.new_job_id(),
            cell.feedback.standing_at,
            tuple(collection.points),
            self._settings.approach_speed,
            START_TOLERANCE,
        )
        request = MotionRequest(session, self._requests, owner=MotionOwner.ROS)
        self.outcomes.hand_on(request, sender, len(collection.points))
        return cell.motions.ask(request, job, MotionKind.ROS, begin_by=begin_by)

    # Time.

    def tick(self, now: int) -> list[Effect]:
        """Plan what waited, end collections, and give idle authority back."""
        before, self._ticked = self._ticked, now
        if self._leftovers:
            self._leftovers = {who: end for who, end in self._leftovers.items() if end > now}
        if not self._links and not self._orphans:
            return []
        out = self._plan_waiting(now)
        was_late, self._was_late = self._was_late, self._is_late(before, now)
        may_wait = self._was_late and not was_late
        for session, link in list(self._links.items()):
            if link.gap_ends is not None and now >= link.gap_ends and not may_wait:
                out += self._fall_silent(link, now)
            out += self._release_idle(session, link, now)
        for address, orphan in list(self._orphans.items()):
            if now > orphan.until:
                del self._orphans[address]
                text = f"its link was lost, and not back within {self._resume_ns / 1e9:g} s"
                refusal = Refusal(VerdictCode.TRAJECTORY_INCOMPLETE, text)
                out += self._drop(orphan.sender, orphan.collection, refusal, now)
        return out

    def _is_late(self, before: int | None, now: int) -> bool:
        return before is not None and now - before > min(self._gap_ns, _LATE_TICK_NS)

    def _fall_silent(self, link: RosLink, now: int) -> list[Effect]:
        """End the collection of a link on which no point came for long enough."""
        collection = link.collection
        assert collection is not None
        if not collection.awaits_end:
            return self._finish(link, collection.last, now)
        text = (
            f"it began at {SpecialSequence.START_DOWNLOAD:d}, and no point came for"
            f" {LATEST_BEGINNING_NS / 1e9:g} s; its end would be {SpecialSequence.END:d}"
        )
        return self.discard(link, Refusal(VerdictCode.TRAJECTORY_INCOMPLETE, text), now)

    def _release_idle(self, session: int, link: RosLink, now: int) -> list[Effect]:
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


def _resumed(orphan: OrphanedPoints, message: PointMessage, now: int) -> Collection | None:
    """Return the points of a client's lost connection if a point goes on with them."""
    known = orphan.collection
    if now > orphan.until:
        return None
    return known if known.repeats(message) or known.continues(message) else None


def _late(collection: Collection, obstacle: Refusal | None, now: int) -> Refusal:
    """Return why a trajectory is dropped that the robot could not begin in time."""
    waited = (now - collection.last_byte) / 1e9
    why = "the server came to it late" if obstacle is None else obstacle.sentence
    text = f"{waited:.3f} s after its last point it had not begun: {why}"
    limit = LATEST_BEGINNING_NS / 1e9
    return Refusal(VerdictCode.TRAJECTORY_LATE, text, value=waited, limit=limit)


def _answer(
    session: int, message: PointMessage | JointTraj, refusal: Refusal | None
) -> list[Effect]:
    if not isinstance(message, Message) or message.comm_type != CommType.REQUEST:
        return []
    return [Send(session, accepted(message) if refusal is None else refused(message))]
