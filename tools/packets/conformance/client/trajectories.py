"""Motions that a client commands: points, trajectories and stops, read from a trace.

Owns where one trajectory ends and the next begins, which point is a repetition, and what an answer
of the controller means. Knows the three point messages (11, 14, 2016); judges nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise

from openpendant.simplemsg import (
    MOTOMAN,
    CommType,
    JointTrajPt,
    JointTrajPtFull,
    Message,
    MsgType,
    ReplyCode,
    SpecialSequence,
    ValidField,
)
from openpendant.simplemsg.motoman import (
    MotomanGroup,
    MotomanJointTrajPtFullEx,
    MotomanMotionCtrl,
    MotomanMotionReply,
)

from .setup import Purpose
from .trace import ClientTrace, TracedFrame

STOP_MOTION = 200111
"""MOTION_CTRL command that stops (motoman_driver, `motion_ctrl.h`)."""

SAME_POINT_NS = 100_000_000
"""Sequence 0 again within this time is the same point again, not a new trajectory of one point."""

BEGINNINGS = (0, SpecialSequence.START_DOWNLOAD, SpecialSequence.START_STREAMING)


class PointAnswer(Enum):
    """Answer of the controller to a point."""

    TAKEN = "taken"
    BUSY = "busy"
    REFUSED = "refused"
    UNREADABLE = "a reply with reply code 0"
    WRONG_TYPE = "a reply of another type"
    NONE = "no answer"


@dataclass(frozen=True, slots=True)
class GroupPoint:
    """One group's share of a point.

    Attributes:
        valid: `valid_fields` as sent; of a type-11 point, position only.
        time: from the start of the trajectory [s]; None in type 11.
        duration: of the segment [s]; None but in type 11.
        positions: (10,) [rad or m].
        velocities: (10,) [rad/s or m/s]; empty in type 11.
        accelerations: (10,) [rad/s² or m/s²]; empty in type 11.
    """

    group: int
    valid: int
    time: float | None
    duration: float | None
    ratio: float | None
    positions: tuple[float, ...]
    velocities: tuple[float, ...] = ()
    accelerations: tuple[float, ...] = ()


@dataclass(slots=True, eq=False)
class SentPoint:
    """A point as it was sent once.

    Attributes:
        sequence: index of the point or a special number.
        repeats: the step before it, where that had the same sequence number.
    """

    frame: TracedFrame
    sequence: int
    parts: tuple[GroupPoint, ...]
    answer: PointAnswer
    reply: TracedFrame | None
    repeats: SentPoint | None = None

    @property
    def where(self) -> str:
        """Time and connection in words."""
        return self.frame.where

    @property
    def index(self) -> int:
        """Its number in the trajectory; the marks of a beginning carry the first point."""
        return 0 if self.sequence in BEGINNINGS else self.sequence

    @property
    def is_full(self) -> bool:
        """True if it is of type 14 or 2016, with times and velocities of its own."""
        return self.frame.msg_type != MsgType.JOINT_TRAJ_PT


@dataclass(slots=True, eq=False)
class SentTrajectory:
    """Points that belong together, in the order in which they were sent.

    Attributes:
        after_stop: the stop before it, where no other trajectory lies between.
        stop: the stop that ended it; None where none did.
    """

    steps: list[SentPoint] = field(default_factory=list)
    after_stop: TracedFrame | None = None
    stop: TracedFrame | None = None

    @property
    def where(self) -> str:
        """Time and connection of its first point in words."""
        return self.steps[0].where

    @property
    def begins(self) -> int:
        """Time at which its first point was sent [ns]."""
        return self.steps[0].frame.time

    @property
    def is_download(self) -> bool:
        """True if it is sent whole, with marks at both ends."""
        return self.steps[0].sequence == SpecialSequence.START_DOWNLOAD

    @property
    def advancing(self) -> list[SentPoint]:
        """The points without repetitions."""
        return [step for step in self.steps if step.repeats is None]

    @property
    def pairs(self) -> list[tuple[SentPoint, SentPoint]]:
        """Each point with the one after it, without repetitions."""
        return list(pairwise(self.advancing))

    @property
    def followed(self) -> list[tuple[SentPoint, SentPoint | None]]:
        """Each point with the one sent after it, repetitions included; None behind the last."""
        return list(zip(self.steps, [*self.steps[1:], None], strict=True))


@dataclass(slots=True)
class Motions:
    """All that a client asked the robot to do, in order."""

    trajectories: list[SentTrajectory] = field(default_factory=list)
    stops: list[TracedFrame] = field(default_factory=list)

    @property
    def steps(self) -> list[SentPoint]:
        """All points of all trajectories."""
        return [step for trajectory in self.trajectories for step in trajectory.steps]


def is_stop(message: Message | None) -> bool:
    """Return True if a message stops the robot."""
    match message:
        case JointTrajPt() | JointTrajPtFull():
            return message.sequence == SpecialSequence.STOP
        case MotomanMotionCtrl():
            return message.command == STOP_MOTION
    return False


def motions_of(trace: ClientTrace) -> Motions:
    """Read the trajectories and stops of a trace, over all motion connections."""
    found = Motions()
    current: SentTrajectory | None = None
    stop: TracedFrame | None = None
    for frame in trace.on(Purpose.MOTION):
        if frame.comm_type == CommType.REPLY:
            continue
        if is_stop(frame.message):
            found.stops.append(frame)
            if current is not None:
                current.stop = frame
            current, stop = None, frame
            continue
        step = _step(trace, frame)
        if step is None:
            continue
        previous = current.steps[-1] if current else None
        if current is None or _begins(step, previous):
            current = SentTrajectory(after_stop=stop)
            found.trajectories.append(current)
            stop = None
        elif previous is not None and step.sequence == previous.sequence:
            step.repeats = previous
        current.steps.append(step)
        if step.sequence == SpecialSequence.END:
            current = None
    return found


def _begins(step: SentPoint, previous: SentPoint | None) -> bool:
    """Return True if a point starts a trajectory; sequence 0 again may be the same point again."""
    if step.sequence not in BEGINNINGS:
        return False
    if previous is None or step.sequence != 0 or previous.sequence != 0:
        return True
    if previous.answer in (PointAnswer.BUSY, PointAnswer.UNREADABLE, PointAnswer.NONE):
        return False
    soon = step.frame.time - previous.frame.time < SAME_POINT_NS
    return not (soon and step.frame.data == previous.frame.data)


def _step(trace: ClientTrace, frame: TracedFrame) -> SentPoint | None:
    parts = parts_of(frame.message)
    if not parts:
        return None
    sequence = getattr(frame.message, "sequence", 0)
    reply = trace.replies.get(frame.number)
    return SentPoint(frame, sequence, parts, _answer(trace, frame, reply), reply)


def parts_of(message: Message | None) -> tuple[GroupPoint, ...]:
    """Return what a point says of each group; nothing for any other message."""
    match message:
        case JointTrajPt():
            point = message
            return (
                GroupPoint(
                    0, ValidField.POSITION, None, point.duration, point.velocity, point.joints
                ),
            )
        case JointTrajPtFull():
            return (_full_part(message),)
        case MotomanJointTrajPtFullEx():
            return tuple(_full_part(group) for group in message.groups[: message.num_groups])
    return ()


def _full_part(point: JointTrajPtFull | MotomanGroup) -> GroupPoint:
    return GroupPoint(
        point.robot_id,
        point.valid_fields,
        point.time,
        None,
        None,
        point.positions,
        point.velocities,
        point.accelerations,
    )


def _answer(trace: ClientTrace, request: TracedFrame, reply: TracedFrame | None) -> PointAnswer:
    """Read the controller's answer to a point."""
    if reply is None:
        return PointAnswer.NONE
    if reply.reply_code == ReplyCode.UNUSED:
        return PointAnswer.UNREADABLE
    if trace.setup.dialect is MOTOMAN:
        if reply.msg_type != MotomanMotionReply.PLACE.msg_type:
            return PointAnswer.WRONG_TYPE
        if isinstance(reply.message, MotomanMotionReply):
            return {0: PointAnswer.TAKEN, 1: PointAnswer.BUSY}.get(
                reply.message.result, PointAnswer.REFUSED
            )
    elif reply.msg_type not in _reply_types(request.msg_type):
        return PointAnswer.WRONG_TYPE
    return PointAnswer.TAKEN if reply.reply_code == ReplyCode.SUCCESS else PointAnswer.REFUSED


def _reply_types(asked: int) -> set[int]:
    """Return the types that answer a point; Fanuc's server answers type 11 with type 10."""
    return {asked, MsgType.JOINT_POSITION} if asked == MsgType.JOINT_TRAJ_PT else {asked}
