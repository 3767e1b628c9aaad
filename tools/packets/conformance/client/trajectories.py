"""What a client wants the robot to do: points, trajectories and stops, read from a trace.

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
from .trace import ClientTrace, Frame, Link

STOP_MOTION = 200111
"""MOTION_CTRL command that stops (motoman_driver, `motion_ctrl.h`)."""

SAME_POINT_NS = 100_000_000
"""Sequence 0 again within this time is the same point again, not a new trajectory of one point."""

BEGINNINGS = (0, SpecialSequence.START_DOWNLOAD, SpecialSequence.START_STREAMING)


class Answer(Enum):
    """What the controller said to a point."""

    TAKEN = "taken"
    BUSY = "busy"
    REFUSED = "refused"
    UNREADABLE = "a reply with reply code 0"
    WRONG_TYPE = "a reply of another type"
    NONE = "no answer"


@dataclass(frozen=True, slots=True)
class Part:
    """One group's share of a point.

    Attributes:
        group: robot or group number.
        valid: `valid_fields` as sent; of a type-11 point, position only.
        time: from the start of the trajectory [s]; None in type 11.
        duration: of the segment [s]; None but in type 11.
        ratio: speed ratio; None but in type 11.
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
class Step:
    """A point as it was sent once.

    Attributes:
        frame: the packet.
        sequence: index of the point or a special number.
        parts: one for each group.
        answer: what the controller said.
        reply: its reply.
        repeats: the step before it, where that had the same sequence number.
    """

    frame: Frame
    sequence: int
    parts: tuple[Part, ...]
    answer: Answer
    reply: Frame | None
    repeats: Step | None = None

    @property
    def where(self) -> str:
        """Time and connection in words."""
        return self.frame.where

    @property
    def index(self) -> int:
        """Its number in the trajectory; the marks of a beginning carry the first point."""
        return 0 if self.sequence in BEGINNINGS else self.sequence


@dataclass(slots=True, eq=False)
class Trajectory:
    """Points that belong together, in the order in which they were sent.

    Attributes:
        steps: the points, repetitions included.
        after_stop: the stop before it, where no other trajectory lies between.
        stop: the stop that ended it; None where none did.
    """

    steps: list[Step] = field(default_factory=list)
    after_stop: Frame | None = None
    stop: Frame | None = None

    @property
    def where(self) -> str:
        """Time and connection of its first point in words."""
        return self.steps[0].where

    @property
    def begins(self) -> int:
        """When its first point was sent [ns]."""
        return self.steps[0].frame.time

    @property
    def is_download(self) -> bool:
        """Whether it is sent whole, with marks at both ends."""
        return self.steps[0].sequence == SpecialSequence.START_DOWNLOAD

    @property
    def advancing(self) -> list[Step]:
        """The points without repetitions."""
        return [step for step in self.steps if step.repeats is None]

    @property
    def pairs(self) -> list[tuple[Step, Step]]:
        """Each point with the one after it, without repetitions."""
        return list(pairwise(self.advancing))

    def links(self) -> list[Link]:
        """The connections that carried it, in order."""
        return list({id(step.frame.link): step.frame.link for step in self.steps}.values())


@dataclass(slots=True)
class Motions:
    """All that a client asked the robot to do.

    Attributes:
        trajectories: in order.
        stops: in order.
    """

    trajectories: list[Trajectory] = field(default_factory=list)
    stops: list[Frame] = field(default_factory=list)

    @property
    def steps(self) -> list[Step]:
        """All points of all trajectories."""
        return [step for trajectory in self.trajectories for step in trajectory.steps]


def is_stop(message: Message | None) -> bool:
    """Tell whether a message stops the robot."""
    match message:
        case JointTrajPt() | JointTrajPtFull():
            return message.sequence == SpecialSequence.STOP
        case MotomanMotionCtrl():
            return message.command == STOP_MOTION
    return False


def motions_of(trace: ClientTrace) -> Motions:
    """Read the trajectories and stops of a trace, over all motion connections."""
    found = Motions()
    current: Trajectory | None = None
    stop: Frame | None = None
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
            current = Trajectory(after_stop=stop)
            found.trajectories.append(current)
            stop = None
        elif previous is not None and step.sequence == previous.sequence:
            step.repeats = previous
        current.steps.append(step)
        if step.sequence == SpecialSequence.END:
            current = None
    return found


def _begins(step: Step, previous: Step | None) -> bool:
    """Tell whether a point begins a trajectory; sequence 0 again may be the same point again."""
    if step.sequence not in BEGINNINGS:
        return False
    if previous is None or step.sequence != 0 or previous.sequence != 0:
        return True
    if previous.answer in (Answer.BUSY, Answer.UNREADABLE, Answer.NONE):
        return False
    soon = step.frame.time - previous.frame.time < SAME_POINT_NS
    return not (soon and step.frame.data == previous.frame.data)


def _step(trace: ClientTrace, frame: Frame) -> Step | None:
    parts = parts_of(frame.message)
    if not parts:
        return None
    sequence = getattr(frame.message, "sequence", 0)
    reply = trace.replies.get(frame.number)
    return Step(frame, sequence, parts, _answer(trace, frame, reply), reply)


def parts_of(message: Message | None) -> tuple[Part, ...]:
    """Return what a point says of each group; nothing for any other message."""
    match message:
        case JointTrajPt():
            point = message
            return (
                Part(0, ValidField.POSITION, None, point.duration, point.velocity, point.joints),
            )
        case JointTrajPtFull():
            return (_full_part(message),)
        case MotomanJointTrajPtFullEx():
            return tuple(_full_part(group) for group in message.groups[: message.num_groups])
    return ()


def _full_part(point: JointTrajPtFull | MotomanGroup) -> Part:
    return Part(
        point.robot_id,
        point.valid_fields,
        point.time,
        None,
        None,
        point.positions,
        point.velocities,
        point.accelerations,
    )


def _answer(trace: ClientTrace, request: Frame, reply: Frame | None) -> Answer:
    """Read the controller's answer to a point."""
    if reply is None:
        return Answer.NONE
    if reply.reply_code == ReplyCode.UNUSED:
        return Answer.UNREADABLE
    if trace.setup.dialect is MOTOMAN:
        if reply.msg_type != MotomanMotionReply.PLACE.msg_type:
            return Answer.WRONG_TYPE
        if isinstance(reply.message, MotomanMotionReply):
            return {0: Answer.TAKEN, 1: Answer.BUSY}.get(reply.message.result, Answer.REFUSED)
    elif reply.msg_type not in _reply_types(request.msg_type):
        return Answer.WRONG_TYPE
    return Answer.TAKEN if reply.reply_code == ReplyCode.SUCCESS else Answer.REFUSED


def _reply_types(asked: int) -> set[int]:
    """Return the types that answer a point; Fanuc's server answers type 11 with type 10."""
    return {asked, MsgType.JOINT_POSITION} if asked == MsgType.JOINT_TRAJ_PT else {asked}
