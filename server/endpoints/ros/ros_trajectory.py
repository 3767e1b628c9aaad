"""Trajectory of a ROS-Industrial client: its points, its connection, and what became of it.

Owns the order of sequence numbers, the tolerance for points that come twice, whether a trajectory
says where it ends (one that begins at -1 ends at -3, and nowhere else), and the reading of
velocity, duration and time fields (`Collection`). That part knows nothing of connections,
authority or time. How the real clients fill the fields: `velocity` is the largest joint speed as a
fraction of its limit, 0.1 where the application gave none, always 0 from ABB's; `duration` is the
time of the segment, and 10 s for the first point, as a placeholder.

Owns the newest reason why one was refused, which stands in STATUS; the one log line of each
trajectory that was refused or broken off; and for how long its client is told no joint positions
(`RosOutcomes`). The stock action node looks at no error: it ends a goal only where it arrives, or
where it hears of no position for 1 s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

from openpendant.motion.trajectory.trajectory import MAX_DURATION
from openpendant.simplemsg import (
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    SpecialSequence,
    TrajPoint,
    ValidField,
)
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.joint_slots import JointSlots
from ...events.cell_events import MotionEnded, MotionRefused, MotionRequest
from ...events.effects import Close, Effect, LogLine
from ...planning.jobs import RosPoint
from ...refusal import Refusal
from ..frame_faults import MOST_FAULTS, PeerFaults

DEFAULT_SPEED_FRACTION = 0.1
"""Speed of a segment for which neither time nor speed was given; what the stock client assumes."""

PLACEHOLDER_DURATION = 10.0
"""Duration that the stock client gives a first point for want of a better one [s]."""

_BEGINNINGS = (0, SpecialSequence.START_DOWNLOAD, SpecialSequence.START_STREAMING)

PointMessage = JointTrajPt | JointTrajPtFull | TrajPoint


@dataclass(slots=True)
class Collection:
    """The points of one trajectory so far.

    Attributes:
        last_byte: when its last point came, or earlier [ns].
    """

    slots: JointSlots
    max_points: int
    points: list[RosPoint] = field(default_factory=list)
    complete: bool = False
    last_byte: int = 0
    _announced: bool = False
    _last: PointMessage | None = None
    _sequence: int = -1
    _time: float = 0.0
    _asked: float = 0.0

    @property
    def last(self) -> PointMessage | None:
        """The last point that was taken."""
        return self._last

    @property
    def awaits_end(self) -> bool:
        """Whether it announced that it will say where it ends, and has not said it yet."""
        return self._announced and not self.complete

    def repeats(self, message: PointMessage) -> bool:
        """Return True if a point is the last one again, as after a reconnection."""
        return self._last is not None and same_point(self._last, message)

    def continues(self, message: PointMessage) -> bool:
        """Return True if a point may follow the last one."""
        return message.sequence in (self._sequence + 1, SpecialSequence.END)

    def take(self, message: PointMessage) -> Refusal | None:
        """Take the next point."""
        sequence = message.sequence
        if self._last is not None and self.repeats(message):
            return None
        if self._last is None and not begins(message):
            return Refusal(VerdictCode.SEQUENCE, f"a trajectory cannot begin at {sequence}")
        if self._last is not None and not self.continues(message):
            text = f"sequence {sequence} after {self._last.sequence}"
            return Refusal(VerdictCode.SEQUENCE, text)
        if len(self.points) == self.max_points:
            text = f"more than {self.max_points} points"
            return Refusal(VerdictCode.TOO_MANY_POINTS, text, limit=float(self.max_points))
        point = self._read(message)
        if isinstance(point, Refusal):
            return point
        self._asked += point.min_duration or 0.0
        if not self._asked <= MAX_DURATION:
            text = f"the trajectory would last {self._asked:g} s; accepted: {MAX_DURATION:g}"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=self._asked, limit=MAX_DURATION)
        self.points.append(point)
        if self._last is None:
            self._announced = sequence == SpecialSequence.START_DOWNLOAD
        self._last = message
        # A download counts its first point as -1 and goes on with 1; -3 ends it at any place.
        self._sequence = max(sequence, 0) if sequence != SpecialSequence.END else self._sequence + 1
        self.complete = sequence == SpecialSequence.END
        return None

    def _read(self, message: PointMessage) -> RosPoint | Refusal:
        position = self.slots.position(_joints(message))
        if isinstance(position, Refusal):
            return position
        if isinstance(message, JointTrajPtFull):
            return self._read_full(message, position)
        return self._read_simple(message, position)

    def _read_simple(
        self, message: JointTrajPt | TrajPoint, position: tuple[float, ...]
    ) -> RosPoint | Refusal:
        ratio, duration = message.velocity, message.duration
        if not (math.isfinite(ratio) and math.isfinite(duration)):
            return Refusal(VerdictCode.NOT_FINITE, "velocity or duration is not a finite number")
        if not 0 <= ratio <= 1:
            text = f"velocity {ratio:g}; accepted: 0 to 1"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=ratio, limit=1.0)
        if duration < 0:
            text = f"duration {duration:g} s; accepted: 0 or more"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=duration)
        if duration > 0 and self.points:
            return RosPoint(position, duration, 1.0)
        # On the way to a first point both bind: how far that is only the server knows.
        given = 0 < duration != PLACEHOLDER_DURATION
        return RosPoint(position, duration if given else None, ratio or DEFAULT_SPEED_FRACTION)

    def _read_full(
        self, message: JointTrajPtFull, position: tuple[float, ...]
    ) -> RosPoint | Refusal:
        valid = message.valid_fields
        if message.robot_id != 0:
            text = f"a point for robot {message.robot_id}; accepted: 0"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=float(message.robot_id))
        if not valid & ValidField.POSITION:
            return Refusal(VerdictCode.BAD_ARGUMENT, "a point without a position")
        fault = (
            self.slots.velocity_fault(message.velocities) if valid & ValidField.VELOCITY else None
        )
        if fault is None and valid & ValidField.ACCELERATION:
            fault = self.slots.acceleration_fault(message.accelerations)
        if fault is not None:
            return fault
        if not valid & ValidField.TIME:
            return RosPoint(position, None, DEFAULT_SPEED_FRACTION)
        time = message.time
        if not math.isfinite(time):
            return Refusal(VerdictCode.NOT_FINITE, "the time is not a finite number")
        if (self.points and time <= self._time) or time < 0:
            text = f"time {time:g} s does not follow {self._time:g} s"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=time, limit=self._time)
        duration, self._time = time - self._time, time
        if self.points:
            return RosPoint(position, duration, 1.0)
        # A first point at time 0 only says where the motion starts.
        return RosPoint(position, duration or None, DEFAULT_SPEED_FRACTION)


def begins(message: PointMessage) -> bool:
    """Return True if a point may be the first of a trajectory."""
    return message.sequence in _BEGINNINGS


def _joints(message: PointMessage) -> tuple[float, ...]:
    return message.positions if isinstance(message, JointTrajPtFull) else message.joints


def same_point(one: PointMessage, other: PointMessage) -> bool:
    """Return True if two points are the same one, sent twice."""
    return (
        type(one) is type(other)
        and one.sequence == other.sequence
        and _joints(one) == _joints(other)
    )


def streamed(trajectory: JointTraj) -> list[TrajPoint]:
    """Return the points of a JOINT_TRAJ numbered as a streaming client would, from 0."""
    return [
        TrajPoint(
            sequence=number,
            joints=point.joints,
            velocity=point.velocity,
            duration=point.duration,
        )
        for number, point in enumerate(trajectory.points)
    ]


_MOST_KNOWN = 64
"""Of more addresses those that look on no more are forgotten."""


@dataclass(frozen=True, slots=True)
class Sender:
    """Whose trajectory it is."""

    session: int
    address: str


@dataclass(slots=True)
class HandedOn:
    """A trajectory that is planned or moved.

    Attributes:
        is_unwanted: its own client stopped it, or sent another.
    """

    request: MotionRequest
    sender: Sender
    points: int
    is_unwanted: bool = False


@dataclass(slots=True)
class NewestReason:
    """The reason why the last trajectory was refused or broken off."""

    code: VerdictCode
    _beside: VerdictCode | None = None
    _is_told: bool = field(default=False)

    def beside(self, standing: VerdictCode | None) -> VerdictCode:
        """Return the newer of this reason and of what keeps the robot from moving now.

        Args:
            standing: the condition that is broken now; None for none.
        """
        if not self._is_told or standing is None:
            # What came up in the same turn is a consequence: the latch of the stop that ended it.
            self._is_told, self._beside = True, standing
        return self.code if standing is None or standing is self._beside else standing


class RosOutcomes:
    """The reports about trajectories that did not come to their end.

    Attributes:
        newest: why the last one was refused or broken off; None once the next one is taken.
        handed_on: the trajectory that is planned or moved; None for none.
    """

    def __init__(self, silence: float) -> None:
        """Tell of none.

        Args:
            silence: how long its client is told no joint positions [s].
        """
        self.newest: NewestReason | None = None
        self.handed_on: HandedOn | None = None
        self._silence_ns = round(silence * 1e9)
        self._silent: dict[str, int] = {}
        self._seen: dict[str, int] = {}  # when each address was told positions last

    # What happens.

    def hand_on(self, request: MotionRequest, sender: Sender, points: int) -> None:
        """Take note of a trajectory that goes to the planner."""
        self.handed_on = HandedOn(request, sender, points)

    def begins(self, sender: Sender) -> None:
        """Take note of a new trajectory that may move the robot; its client sees again."""
        self._silent.pop(sender.address, None)
        self.unwanted(sender.session)

    def unwanted(self, session: int) -> None:
        """Take note that a client ends what it has sent before by its own wish."""
        if self.handed_on is not None and self.handed_on.sender.session == session:
            self.handed_on.is_unwanted = True

    def is_of(self, session: int) -> bool:
        """Return True if what is planned or moved is of a connection."""
        return self.handed_on is not None and self.handed_on.sender.session == session

    def ended(self, event: MotionRefused | MotionEnded, now: int) -> list[Effect]:
        """Take note that what was handed on ended, or was refused by the planner."""
        known = self.handed_on
        if known is None or known.request != event.request:
            return []
        self.handed_on = None
        refusal = event.refusal
        if refusal is None or refusal.code is VerdictCode.NO_MOTION:
            # A trajectory that ends where the robot stands is no error.
            self.newest = None
            return []
        done = known.points - event.waypoints_left if isinstance(event, MotionEnded) else 0
        points = (done, known.points)
        return self.tell(known.sender, points, refusal, now, is_wanted=known.is_unwanted)

    def tell(
        self,
        sender: Sender,
        points: tuple[int, int],
        refusal: Refusal,
        now: int,
        *,
        is_wanted: bool = False,
    ) -> list[Effect]:
        """Tell of a trajectory that was refused or broken off; to be called once for each.

        Args:
            points: how many of its points the robot had passed, and how many had come.
            is_wanted: its own client ended it, which is no error.
        """
        if not is_wanted:
            self.newest = NewestReason(refusal.code)
            if self._silence_ns:
                # From when it saw last, so that no row of refusals keeps a client blind.
                seen = self._seen.get(sender.address, now)
                kept = ((who, until) for who, until in self._silent.items() if until > now)
                self._silent = dict(kept) | {sender.address: seen + self._silence_ns}
        done, known = points
        whose = f"ROS-I trajectory of {sender.address} (session {sender.session})"
        what = f"{'broken off' if done else 'refused'}, {done} of {known} points done"
        code = refusal.code
        return [LogLine(f"{whose} {what}: {code.name} ({code:d}): {refusal.sentence}")]

    # What is told.

    def sees(self, address: str, now: int) -> bool:
        """Return True if an address is told joint positions now, which it then is."""
        if self._silent.get(address, now) > now:
            return False
        self._seen[address] = now
        if len(self._seen) > _MOST_KNOWN:
            self._seen = {who: at for who, at in self._seen.items() if now - at < self._silence_ns}
        return True


class RosPort(Enum):
    """The two ports of this endpoint."""

    MOTION = "points and stop"
    STATE = "joint positions and status"


@dataclass(slots=True)
class RosLink:
    """One connection of a ROS-I client.

    Attributes:
        faults: unknown and malformed frames of late.
        gap_ends: when the trajectory counts as finished [ns].
        rejecting: a trajectory was discarded; its further points are refused without a new reason.
        overtaken: points of this connection that a STOP behind them has overtaken, not told of yet.
        finished: last point of the last complete trajectory.
        idle_since: since when the link holds the authority without using it [ns].
    """

    port: RosPort
    session: int
    address: str
    faults: PeerFaults = field(default_factory=PeerFaults)
    collection: Collection | None = None
    gap_ends: int | None = None
    rejecting: bool = False
    overtaken: int = 0
    finished: PointMessage | None = None
    idle_since: int | None = None

    def repeats_finished(self, message: PointMessage) -> bool:
        """Return True if a point ended the last trajectory; one that can begin one is a new one."""
        last = self.finished
        return last is not None and not begins(message) and same_point(last, message)

    @property
    def sender(self) -> Sender:
        """Who sends on it."""
        return Sender(self.session, self.address)

    def drop_points(self) -> None:
        """Forget the points of an unfinished trajectory."""
        self.collection = None
        self.gap_ends = None

    def count_fault(self, now: int) -> list[Effect]:
        """Count an unknown or malformed frame; the connection that sends too many is closed."""
        if not self.faults.add(now):
            return []
        return [Close(self.session, f"{MOST_FAULTS} unknown or malformed requests")]


@dataclass(slots=True)
class OrphanedPoints:
    """Points of a lost connection that wait for it to come back.

    Attributes:
        until: when they are forgotten [ns].
    """

    collection: Collection
    sender: Sender
    until: int


@dataclass(frozen=True, slots=True)
class WaitingTrajectory:
    """A complete trajectory that waits for the robot to stand."""

    sender: Sender
    collection: Collection
