"""Collecting the points of one ROS-Industrial trajectory, and what each of them asks for.

Owns the order of sequence numbers, the tolerance for points that come twice, whether a trajectory
says where it ends (one that begins at -1 ends at -3, and nowhere else), and the reading of
velocity, duration and time fields. It knows nothing of connections, authority or time.

How the real clients fill the fields: `velocity` is the largest joint speed as a fraction of its
limit, 0.1 where the application gave none, always 0 from ABB's; `duration` is the time of the
segment, and 10 s for the first point, as a placeholder.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

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
from ...planning.jobs import RosPoint
from ...refusal import Refusal

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
        slots: reads the joint positions of the robot.
        max_points: most points that are taken.
        points: what they ask for, in order.
        complete: the point that ends the trajectory came.
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
        """Tell whether a point is the last one again, as after a reconnection."""
        return self._last is not None and same_point(self._last, message)

    def continues(self, message: PointMessage) -> bool:
        """Tell whether a point may follow the last one."""
        return message.sequence in (self._sequence + 1, SpecialSequence.END)

    def take(self, message: PointMessage) -> Refusal | None:
        """Take the next point.

        Returns:
            Why the trajectory must be discarded; None where the point was taken.
        """
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
    """Tell whether a point may be the first of a trajectory."""
    return message.sequence in _BEGINNINGS


def _joints(message: PointMessage) -> tuple[float, ...]:
    return message.positions if isinstance(message, JointTrajPtFull) else message.joints


def same_point(one: PointMessage, other: PointMessage) -> bool:
    """Tell whether two points are the same one, sent twice."""
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
