"""One TCP or serial conversation as a pure object: bytes in, messages out.

Owns reassembly, the bounds of a frame, detection of the byte order, who owes whom a reply, and
which messages a STOP behind them has overtaken (what a STOP is, `stop_walk` knows). It knows no
sockets and no time; deadlines belong to the shell, which sees `partial`.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import Enum
from functools import cache

from .codec import STANDARD, Codec, Dialect, codec_for
from .codes import ByteOrder, CommType
from .declaration import Message
from .errors import (
    FramingFault,
    LengthOutOfBounds,
    LocalProtocolError,
    MessageFault,
    OrderUndetectable,
)
from .framing import HEADER_SIZE, LEAST_LENGTH, MAX_FRAME, PREFIX_SIZE, Bytes, detect_byte_order
from .layout import Decode
from .standard import message_type
from .stop_walk import StopRule, StopWalk, WaitingStop

MAX_REFERENCE_FRAME = 1023
"""Largest frame that the reference C++ library sends or can receive safely, bytes."""

FRAMES_PER_CALL = 64
"""Most frames decoded per call, so that one talkative peer cannot hold up the others."""

_WINDOW = 16 * 1024
"""Bytes that are looked at in one call, or one frame, where more than that waits: a backlog that is
handled in parts is not copied once for each of them."""

_HEADER = slice(0, HEADER_SIZE)
_BEHIND_LENGTH = slice(PREFIX_SIZE, HEADER_SIZE)

_Known = tuple[int, Decode]
"""Size of a frame, and what decodes it."""

# Looked up for every frame; finding a member of an enumeration takes three times as long.
_TOPIC, _REQUEST, _REPLY = CommType.TOPIC, CommType.REQUEST, CommType.REPLY


class Role(Enum):
    """Our end of the conversation."""

    CLIENT = "opens the connection and knows the byte order"
    SERVER = "accepts the connection and may learn the byte order from the first frame"


@dataclass(frozen=True, slots=True)
class Malformed:
    """A frame in bounds whose header or body is wrong; the conversation continues.

    Attributes:
        comm_type: from the header; a request is still owed a reply.
        request_id: of a request that begins with one, so that its refusal can name it; else 0.
    """

    msg_type: int
    comm_type: int
    error: MessageFault
    request_id: int = 0


@dataclass(frozen=True, slots=True)
class Unasked:
    """A reply that answers no request of ours; REP-I0006 says to ignore it."""

    message: Message


Received = Message | Malformed | Unasked


@dataclass(frozen=True, slots=True)
class Overtaken:
    """Message in front of a STOP that has arrived: it must not undo the STOP."""

    received: Received


Arrival = Received | Overtaken | WaitingStop
"""Items of a conversation in which a STOP goes first; the STOP itself stands in its place."""


class Connection:
    """The state of one conversation.

    Attributes:
        byte_order: None on a server until the first frame came.
        fault: set for good once the position in the stream is lost; then close the link.
        unanswered: requests of the peer, malformed ones too, that may still be answered.
        awaited: requests of ours that the peer still owes a reply.
        more: the last call of `receive` stopped at its limit: call `receive(b"")` a turn later.
        stops: what was found ahead of its turn, until the caller empties it; for all that has not
            acted yet, ask `stop_to_act`.
        overtaking: a STOP is behind, or among, what was returned last: call `marked`.
    """

    def __init__(
        self,
        role: Role,
        dialect: Dialect = STANDARD,
        byte_order: ByteOrder | None = None,
        real_size: int = 4,
        max_frame: int = MAX_REFERENCE_FRAME,
        frames_per_call: int = FRAMES_PER_CALL,
        stop_rule: StopRule | None = None,
    ) -> None:
        """Make a conversation that has not started.

        Args:
            byte_order: order of the wire; a server may leave it out and learn it.
            real_size: bytes of a real, 4 or 8.
            max_frame: largest frame to send or accept, prefix included.
            frames_per_call: most frames that a call of `receive` returns, 1 or more.
            stop_rule: what a STOP is, where one goes first; None where nothing does.

        Raises:
            ValueError: a client without byte order, or a bound that leaves no room.
        """
        if role is Role.CLIENT and byte_order is None:
            raise ValueError("a client must know the byte order: the controller's wins")
        if not HEADER_SIZE <= max_frame <= MAX_FRAME:
            raise ValueError(f"max_frame must be {HEADER_SIZE} to 65539, not {max_frame}")
        self.role = role
        self.byte_order: ByteOrder | None = None
        self.fault: FramingFault | None = None
        self.unanswered = 0
        self.awaited = 0
        self._dialect = dialect
        self._real_size = real_size
        self._max_frame = max_frame
        self._frames_per_call = frames_per_call
        self._max_length = max_frame - PREFIX_SIZE
        self._pending = bytearray()
        self._needed = PREFIX_SIZE
        self._window = 0
        self.more = False
        self.stops: list[WaitingStop] = []
        self.overtaking = False
        self._walk = None if stop_rule is None else StopWalk(stop_rule, max_frame)
        self._usual: dict[bytes, _Known] = {}
        self._of_any_size: dict[bytes, Decode] = {}
        if byte_order is not None:
            self.settle_byte_order(byte_order)

    def settle_byte_order(self, byte_order: ByteOrder) -> None:
        """Fix the byte order, as learned from the first frame or from this peer's other link."""
        self.byte_order = byte_order
        self._prefix = struct.Struct(f"{byte_order.value}i")
        self._codec = codec_for(self._dialect, byte_order, self._real_size)
        self._usual = _frames_up_to(self._max_frame, self._codec)
        self._of_any_size = self._codec.of_any_size
        if self._walk is not None:
            self._walk.settle(byte_order)
            self._of_any_size = {
                header: decode
                for header, decode in self._codec.of_any_size.items()
                if not self._walk.may_be_stop(self._prefix.unpack_from(header)[0])
            }

    @property
    def partial(self) -> bool:
        """True while the buffer holds the beginning of a frame but not its end."""
        return bool(self._pending) and not self.more

    @property
    def is_searching(self) -> bool:
        """True while a STOP may be among what waits and was not walked over yet."""
        return self._walk is not None and self._walk.is_behind

    @property
    def waiting(self) -> int:
        """Bytes that arrived and were not decoded yet."""
        return len(self._pending)

    def receive(self, data: Bytes) -> list[Received]:
        """Take bytes and return what they complete, at most `frames_per_call`.

        After a framing fault `fault` is set, nothing more is decoded and further bytes are
        dropped; what was complete before the fault is still returned. No more than one unfinished
        frame is kept, unless `more` is true: then `read_ahead` takes what the peer says meanwhile,
        and how much of it may wait is for the caller to bound.
        """
        if self.fault is not None:
            return []
        if not isinstance(data, bytes):
            data = bytes(memoryview(data))
        if self._pending:
            return self._go_on(data)
        # Nearly all bytes of controllers and pendants come as one whole frame, alone.
        known = self._usual.get(data[_HEADER])
        if known is None and (decode := self._of_any_size.get(data[_BEHIND_LENGTH])) is not None:
            size = PREFIX_SIZE + self._prefix.unpack_from(data)[0]
            known = (size, decode) if HEADER_SIZE <= size <= self._max_frame else None
        if known is not None and known[0] == len(data):
            received = [self._take(data, known[1])]
            if self._walk is not None and type(received[0]) is Malformed:
                # Its header is usual and its body broken: even so it may be a STOP.
                self._look_for_stops(data)
                self._account_for(received, len(data), PREFIX_SIZE, data)
            return received
        if self._walk is not None:
            self._look_for_stops(data)
            if self._walk.is_behind:
                self._pending += data
                return self._later()
        received, start, needed = self._split(data, known)
        self._window = len(data) - start
        if self.fault is None and start < len(data):
            self._pending += data[start:]
        self._account_for(received, start, needed, data)
        return received

    def receive_next(self) -> list[Received]:
        """Return the next frame of the bytes that the last call of `receive` looked at.

        So a caller that may stop after each frame, with one frame a call, takes in one turn no more
        than `receive` would have returned at once, or less where the turn has cost enough. None is
        returned where these bytes hold no other whole frame; `more` says whether others do.
        """
        pending = self._pending
        size = min(self._window, len(pending))
        if size >= PREFIX_SIZE:
            (length,) = self._prefix.unpack_from(pending)
            if LEAST_LENGTH <= length <= self._max_length:
                size = min(size, PREFIX_SIZE + length)
        frame = bytes(pending[:size])
        received, start, needed = self._split(frame, self._usual.get(frame[_HEADER]))
        del pending[:start]
        self._window -= start
        self._account_for(received, start, needed, frame)
        return received

    def read_ahead(self, data: Bytes) -> None:
        """Take bytes that wait until `receive` is called; only their STOPs are found at once."""
        if self.fault is None:
            self._pending += data
            self._look_for_stops(self._pending)
            self.more = len(self._pending) >= self._needed

    def marked(self, received: list[Received]) -> list[Arrival]:
        """Return what `receive` has just returned, with what a STOP has overtaken marked."""
        walk = self._walk
        assert walk is not None, "without a stop rule nothing is overtaken"
        self.overtaking = False
        place = walk.taken - len(received)
        stops = walk.passing()
        last = walk.taken if walk.is_ahead else max(stops)
        marked: list[Arrival] = []
        for at, each in enumerate(received, place):
            stop = stops.get(at)
            if stop is not None:
                stop.is_sound = not isinstance(each, Malformed)
                marked.append(stop)
            elif at < last and not isinstance(each, walk.before_all):
                marked.append(Overtaken(each))
            else:
                marked.append(each)
        return marked

    def stop_to_act(self) -> Message | None:
        """Return the first STOP that has arrived and has neither acted nor been handed on."""
        return None if self._walk is None else self._walk.to_act(self._pending)

    def stops_have_acted(self, *, is_answered: bool) -> None:
        """Note that all STOPs that have arrived have acted, and whether the first was answered."""
        assert self._walk is not None, "without a stop rule none is found"
        self._walk.have_acted(is_answered=is_answered)

    def _go_on(self, data: bytes) -> list[Received]:
        """Take bytes behind those that wait, and return the next messages."""
        pending = self._pending
        pending += data
        if len(pending) < self._needed:
            return []  # nothing behind the incomplete frame has come either
        if self._walk is not None and (data or self._walk.is_behind):
            self._look_for_stops(pending)
            if self._walk.is_behind:
                return self._later()
        # At least the one frame that is known to be whole; all frames, if they are not many bytes.
        window = bytes(pending[: max(self._needed, _WINDOW)])
        received, start, needed = self._split(window, self._usual.get(window[_HEADER]))
        del pending[:start]
        self._window = len(window) - start
        self._account_for(received, start, needed, window)
        return received

    def _later(self) -> list[Received]:
        """Return nothing yet: no frame is decoded before all that has arrived was walked over."""
        self._needed = PREFIX_SIZE
        self.more = True
        self.overtaking = False
        self._window = 0
        return []

    def _account_for(self, received: list[Received], size: int, needed: int, buffer: bytes) -> None:
        """Note that frames of a buffer were taken, and how many bytes the next one needs."""
        if self.fault is not None:
            self._pending.clear()
        self._needed = needed
        self.more = len(self._pending) >= needed
        if self._walk is not None:
            passing = self._walk.take(len(received), size, buffer)
            self.overtaking = bool(passing) or self._walk.is_ahead
            for stop in passing:
                # Its answer was owed since it was found.
                self.unanswered -= stop.comm_type == _REQUEST

    def _look_for_stops(self, buffer: bytes | bytearray) -> None:
        """Walk over what has become whole; a STOP may be answered from now on."""
        walk = self._walk
        if walk is None:
            return
        if self.byte_order is None:
            byte_order = detect_byte_order(buffer)
            if byte_order is None:
                return
            self.settle_byte_order(byte_order)
        for stop in walk.go_on(buffer):
            self.stops.append(stop)
            self.unanswered += stop.is_request

    def _split(self, buffer: bytes, known: _Known | None) -> tuple[list[Received], int, int]:
        """Take the whole frames at the front, the first of which may be known.

        Returns:
            The messages, the start of the rest, and the number of bytes that the rest needs.
        """
        received: list[Received] = []
        start, size, needed = 0, len(buffer), PREFIX_SIZE
        # A stream of points is taken apart here at almost half the pace of bare `struct`: one
        # look-up of a header settles length, layout and accounts, and all names are local.
        usual, take = self._usual, self._take
        last_prefix = size - PREFIX_SIZE
        while start <= last_prefix:
            if known is None:
                known = self._measure(buffer, start)
                if known is None:
                    break
            frame_size, decode = known
            end = start + frame_size
            if end > size:
                needed = frame_size
                break
            received.append(take(buffer[start:end], decode))
            start = end
            if len(received) == self._frames_per_call:
                break
            known = usual.get(buffer[start : start + HEADER_SIZE])
        return received, start, needed

    def _measure(self, buffer: bytes, start: int) -> _Known | None:
        """Return size and decoder of a frame with an unusual header; None where it is a fault."""
        if self.byte_order is None and not self._learn_byte_order(buffer):
            return None
        (length,) = self._prefix.unpack_from(buffer, start)
        if not LEAST_LENGTH <= length <= self._max_length:
            self.fault = LengthOutOfBounds(length, LEAST_LENGTH, self._max_length)
            return None
        return PREFIX_SIZE + int(length), self._codec.decode

    def _take(self, frame: bytes, decode: Decode) -> Received:
        """Decode a whole frame, and note what it owes or pays."""
        try:
            message = decode(frame)
        except UnicodeDecodeError:
            return self._judge(frame)
        except MessageFault as error:
            return self._malformed(error, frame)
        comm_type = message.comm_type
        if comm_type is _REQUEST:
            self.unanswered += 1
        elif comm_type is not _TOPIC and not self._settle_accounts(comm_type):
            return Unasked(message)
        return message

    def _judge(self, frame: bytes) -> Received:
        """Decode a frame with a usual header whose text is none: of a reply that is no fault."""
        try:
            message = self._codec.decode(frame)
        except MessageFault as error:
            return self._malformed(error, frame)
        return message if self._settle_accounts(message.comm_type) else Unasked(message)

    def _malformed(self, error: MessageFault, frame: bytes) -> Malformed:
        self._settle_accounts(error.comm_type)
        # As a value it needs no traceback, which with the frames that hold what was received is a
        # cycle: of thousands of broken frames the garbage collector would have to free each.
        error.__traceback__ = error.__context__ = None
        request_id = self._codec.request_id(frame, error.msg_type, error.comm_type)
        return Malformed(error.msg_type, error.comm_type, error, request_id)

    def _learn_byte_order(self, buffer: bytes) -> bool:
        prefix = buffer[:PREFIX_SIZE]
        byte_order = detect_byte_order(prefix)
        if byte_order is None:
            self.fault = OrderUndetectable(prefix)
            return False
        self.settle_byte_order(byte_order)
        return True

    def _settle_accounts(self, comm_type: int) -> bool:
        """Note what a frame of the peer owes or pays; return False for a reply nobody asked for.

        A reply settles a request whatever is wrong with it: no second one will come.
        """
        if comm_type == _REQUEST:
            self.unanswered += 1
        elif comm_type == _REPLY:
            if not self.awaited:
                return False
            self.awaited -= 1
        return True

    def send(self, message: Message) -> bytes:
        """Return the bytes of a message, to be written at once and in one piece.

        Raises:
            LocalProtocolError: the message cannot be encoded, is too large for this
                conversation, is a reply that nobody asked for, or the byte order is not known yet.
        """
        if self.byte_order is None:
            raise LocalProtocolError("the byte order is not known before the peer's first frame")
        comm_type = message.comm_type
        is_reply = comm_type == _REPLY
        if is_reply and not self.unanswered:
            raise LocalProtocolError(
                f"a reply of type {message_type(message)} answers no request: topics are never"
                " answered, requests once"
            )
        frame = self._codec.encoders[type(message)](message)
        if len(frame) > self._max_frame:
            raise LocalProtocolError(
                f"a frame of {len(frame)} bytes exceeds the {self._max_frame} of this conversation"
            )
        if is_reply:
            self.unanswered -= 1
        elif comm_type == _REQUEST:
            self.awaited += 1
        return frame


@cache
def _frames_up_to(max_frame: int, codec: Codec) -> dict[bytes, _Known]:
    return {header: known for header, known in codec.usual.items() if known[0] <= max_frame}
