"""Search for STOP: finds every STOP in bytes that have arrived and were not decoded yet.

Owns what a STOP is by its bytes, and the walk that finds it: from frame to frame by their lengths,
never by searching, so that the bytes of a STOP inside another frame are none. A frame of such a
type that is whole is a STOP even where it is too short for its type, too long, or broken further
on, as long as it holds the sequence: when in doubt the robot stands still. A frame that was begun
and did not end is none, and behind a length that cannot be one nothing is looked for, because
nobody knows where a frame begins there.

What follows from a STOP is not decided here.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from .codec import STANDARD, codec_for
from .codes import ByteOrder, CommType, MsgType, SpecialSequence
from .declaration import Message, Text, joint_array
from .errors import MessageFault
from .framing import HEADER_SIZE, LEAST_LENGTH, PREFIX_SIZE
from .pendant import Hello, SoftwareStop
from .standard import JointTraj, JointTrajPt, JointTrajPtFull

_INTEGER = 4

MOST_WALKED = 4_096
"""Frames that one call of `go_on` walks over: bare headers of 64 KiB, in 0.6 ms."""

MOST_FOUND = 128
"""STOPs that one call of `go_on` returns; each is read and answered, which takes a few µs."""

# As plain numbers: an enumeration takes three times as long to compare.
_TOPIC, _REQUEST, _STOP = int(CommType.TOPIC), int(CommType.REQUEST), int(SpecialSequence.STOP)

_REASON = SoftwareStop.FIELDS["reason"]
_REASON_BYTES = _REASON.size if isinstance(_REASON, Text) else 0

_Read = Callable[[bytes, int, ByteOrder], Message | None]
"""Returns what a whole frame of a kind of exchange says as a STOP; None where it is none."""


@dataclass(frozen=True, slots=True)
class StopRule:
    """Rule that names the frames that are a STOP on a port.

    Attributes:
        sequence_at: by message type, where in the frame the sequence stands that has to be STOP's.
            For speed: of a stream of points only those are read that are a STOP.
        reads: by message type, what reads such a frame.
        before_all: messages that are handled in their turn whatever comes behind them.
    """

    sequence_at: Mapping[int, int]
    reads: Mapping[int, _Read]
    before_all: tuple[type[Message], ...] = ()


def _point(frame: bytes, comm_type: int, order: ByteOrder) -> Message:
    return JointTrajPt(_STOP, joint_array([]), 0.0, 0.0, comm_type=comm_type)


def _full_point(frame: bytes, comm_type: int, order: ByteOrder) -> Message:
    nothing = joint_array([])
    return JointTrajPtFull(0, _STOP, 0, 0.0, nothing, nothing, nothing, comm_type=comm_type)


def _whole_trajectory(frame: bytes, comm_type: int, order: ByteOrder) -> Message | None:
    """Read a JOINT_TRAJ: only of a well-formed one is it known where its sequences stand."""
    try:
        message = codec_for(STANDARD, order).decode(frame)
    except MessageFault:
        return None
    return message if isinstance(message, JointTraj) and holds_stop(message) else None


def _software_stop(frame: bytes, comm_type: int, order: ByteOrder) -> Message:
    reason_at = HEADER_SIZE + _INTEGER
    request_id = 0
    if len(frame) >= reason_at:
        (request_id,) = struct.unpack_from(f"{order.value}i", frame, HEADER_SIZE)
    reason = frame[reason_at : reason_at + _REASON_BYTES]
    text = reason.split(b"\0", 1)[0].decode("utf-8", "replace")
    return SoftwareStop(request_id, text, comm_type=comm_type)


ROS_STOPS = StopRule(
    sequence_at={
        MsgType.JOINT_TRAJ_PT: HEADER_SIZE,
        MsgType.JOINT_TRAJ_PT_FULL: HEADER_SIZE + _INTEGER,
    },
    reads={
        MsgType.JOINT_TRAJ_PT: _point,
        MsgType.JOINT_TRAJ_PT_FULL: _full_point,
        MsgType.JOINT_TRAJ: _whole_trajectory,
    },
)
"""On the ports of ROS-Industrial: a point, or a trajectory with one, whose sequence is STOP."""

PENDANT_STOPS = StopRule(
    sequence_at={},
    reads={SoftwareStop.PLACE.msg_type: _software_stop},
    before_all=(Hello,),
)
"""On the pendant port: SOFTWARE_STOP. Who says hello and stops in one breath has said hello."""


def holds_stop(trajectory: JointTraj) -> bool:
    """Return True if a whole trajectory has a point that is a STOP."""
    return any(point.sequence == SpecialSequence.STOP for point in trajectory.points)


@dataclass(slots=True)
class WaitingStop:
    """A STOP that was found before its turn; it also stands in its place among the messages.

    Attributes:
        message: what it says; what a frame too short leaves out is zero.
        place: how many frames were walked before it.
        acted: it has acted before its place.
        is_sound: its frame is one of its type; set when it was decoded.
        answered: it was answered before its place.
    """

    message: Message
    place: int
    acted: bool = field(default=False, compare=False)
    is_sound: bool = field(default=True, compare=False)
    answered: bool = field(default=False, compare=False)

    @property
    def is_request(self) -> bool:
        """True if it is owed an answer."""
        return self.message.comm_type == _REQUEST


class StopWalk:
    """The walk over one conversation, ahead of what decodes it.

    Frames are counted from the first that was walked; a frame that came alone, with nothing waiting
    in front of it, is in nobody's way and needs no walk.

    Of a STOP that waits only its place is kept, and read anew is what it says: a peer may send
    thousands, and as objects the garbage collector would walk over all of them again and again.

    Attributes:
        is_lost: a length was met that cannot be one; nothing behind it is looked at.
        is_behind: the last call of `go_on` stopped at its bound; call it again before more frames
            are decoded.
        taken: how many of the frames were decoded.
    """

    def __init__(self, rule: StopRule, max_frame: int) -> None:
        """Begin before the first frame."""
        self.is_lost = False
        self.is_behind = False
        self.taken = 0
        self.before_all = rule.before_all
        self._rule = rule
        self._max_length = max_frame - PREFIX_SIZE
        self._at = 0
        self._walked = 0
        # Of each STOP its place, and where it begins in all bytes that were ever walked over.
        self._ahead: deque[tuple[int, int]] = deque()
        self._taken_bytes = 0
        self._passing: list[tuple[int, Message]] = []
        self._acted = 0  # every STOP whose place is before this one has acted or gone by
        self._not_acted = 0  # how many of those ahead have not
        self._answered: set[int] = set()
        self._header = struct.Struct("=3i")
        self._integer = struct.Struct("=i")
        self._order: ByteOrder | None = None

    def may_be_stop(self, msg_type: int) -> bool:
        """Return True if a frame of this type has to be read to tell that it is no STOP."""
        return msg_type in self._rule.reads

    def settle(self, order: ByteOrder) -> None:
        """Fix the byte order."""
        self._order = order
        self._header = struct.Struct(f"{order.value}3i")
        self._integer = struct.Struct(f"{order.value}i")

    def go_on(self, buffer: bytes | bytearray) -> list[WaitingStop]:
        """Walk over the frames that have become whole; return the STOPs among them, in order.

        At most `MOST_WALKED` frames, and `MOST_FOUND` STOPs, so that no peer holds up the others.

        Args:
            buffer: all that has arrived and was not decoded, from a frame's first byte on; what was
                walked before stands in it as it did.
        """
        order = self._order
        if order is None or self.is_lost:
            return []
        found: list[WaitingStop] = []
        # Thousands of bare headers are walked over in one call, so all names are local.
        at, walked, size = self._at, self._walked, len(buffer)
        bound = walked + MOST_WALKED
        last, message = b"", None
        ahead, before = self._ahead, self._taken_bytes
        self.is_behind = False
        last_header, most = size - HEADER_SIZE, self._max_length
        header, integer = self._header.unpack_from, self._integer.unpack_from
        reads, sequence_at = self._rule.reads, self._rule.sequence_at
        while at <= last_header:
            length, msg_type, comm_type = header(buffer, at)
            if not LEAST_LENGTH <= length <= most:
                self.is_lost = True
                break
            end = at + PREFIX_SIZE + length
            if end > size:
                break
            if msg_type in reads and (comm_type == _REQUEST or comm_type == _TOPIC):
                offset = sequence_at.get(msg_type)
                if offset is None or (
                    at + offset + _INTEGER <= end and integer(buffer, at + offset)[0] == _STOP
                ):
                    frame = bytes(buffer[at:end])
                    # Of thousands of equal ones the collector would walk over each.
                    if frame != last:
                        last, message = frame, reads[msg_type](frame, comm_type, order)
                    if message is not None:
                        found.append(WaitingStop(message, walked))
                        ahead.append((walked, before + at))
            at = end
            walked += 1
            if walked == bound or len(found) == MOST_FOUND:
                self.is_behind = at <= last_header
                break
        self._at, self._walked = at, walked
        self._not_acted += len(found)
        return found

    def take(self, frames: int, size: int, buffer: bytes | bytearray) -> list[Message]:
        """Note that frames at the front of a buffer were decoded; return the STOPs among them."""
        self.taken += frames
        passing: list[tuple[int, Message]] = []
        while self._ahead and self._ahead[0][0] < self.taken:
            place, begin = self._ahead.popleft()
            self._not_acted -= place >= self._acted
            passing.append((place, self._read(buffer, begin)))
        self._at -= size
        self._taken_bytes += size
        self._passing = passing
        return [message for _, message in passing]

    def _read(self, buffer: bytes | bytearray, begin: int) -> Message:
        """Return what a STOP says that was found."""
        assert self._order is not None
        at = begin - self._taken_bytes
        length, msg_type, comm_type = self._header.unpack_from(buffer, at)
        frame = bytes(buffer[at : at + PREFIX_SIZE + length])
        message = self._rule.reads[msg_type](frame, comm_type, self._order)
        assert message is not None, "the bytes that were walked over are others now"
        return message

    def passing(self) -> dict[int, WaitingStop]:
        """Return by their places the STOPs that were taken last; they act no more before them."""
        stops = {
            place: WaitingStop(
                message, place, place < self._acted, answered=place in self._answered
            )
            for place, message in self._passing
        }
        if stops:
            self._acted = max(self._acted, *(place + 1 for place in stops))
            self._answered -= stops.keys()
        return stops

    def to_act(self, buffer: bytes | bytearray) -> Message | None:
        """Return the first STOP that was found and has neither acted nor gone by.

        Args:
            buffer: all that has arrived and was not decoded.
        """
        for place, message in self._passing:
            if place >= self._acted:
                return message
        if not self._not_acted:
            return None
        _, begin = self._ahead[-self._not_acted]
        return self._read(buffer, begin)

    def have_acted(self, *, is_answered: bool) -> None:
        """Note that all STOPs that were found have acted, and whether the first was answered."""
        if is_answered:
            passing = (place for place, _ in self._passing if place >= self._acted)
            first = next(passing, None)
            self._answered.add(self._ahead[-self._not_acted][0] if first is None else first)
        self._acted = self._walked
        self._not_acted = 0

    @property
    def is_ahead(self) -> bool:
        """True while a STOP stands behind all frames that were taken."""
        return bool(self._ahead)
