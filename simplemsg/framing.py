"""Frames: the length prefix, the raw header, the byte order, and the cutting of a stream.

Owns the bounds of a frame, the rules of its header, and what an onlooker makes of bytes in which no
frame can be found. `Connection` keeps an inner loop of its own, which is measured, and takes names
and rules from here. Knows no messages, sockets or time.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from enum import Enum
from functools import cache

from .codes import ByteOrder, CommType, ReplyCode

PREFIX_SIZE = 4
"""Bytes of the length field, which does not count itself."""

HEADER_SIZE = 16
"""Bytes before the body: length, message type, communication type, reply code."""

LEAST_LENGTH = HEADER_SIZE - PREFIX_SIZE
"""Length field of a frame without a body."""

MAX_DETECTABLE_LENGTH = 65_535
"""Largest length field that reads differently in both byte orders."""

MAX_FRAME = MAX_DETECTABLE_LENGTH + PREFIX_SIZE
"""Largest frame whose byte order its length tells, bytes."""

_LITTLE = struct.Struct(f"{ByteOrder.LITTLE.value}i").unpack_from
_BIG = struct.Struct(f"{ByteOrder.BIG.value}i").unpack_from

Bytes = bytes | bytearray | memoryview
"""Types that may be decoded; memory views are of single bytes."""


def detect_byte_order(frame: Bytes) -> ByteOrder | None:
    """Return the byte order that a frame's length tells: only one reading lies in 12 to 65,535."""
    prefix = frame[:PREFIX_SIZE]
    if len(prefix) < PREFIX_SIZE:
        return None
    if LEAST_LENGTH <= int.from_bytes(prefix, "little") <= MAX_DETECTABLE_LENGTH:
        return ByteOrder.LITTLE
    if LEAST_LENGTH <= int.from_bytes(prefix, "big") <= MAX_DETECTABLE_LENGTH:
        return ByteOrder.BIG
    return None


def broken_header_rule(msg_type: int, comm_type: int, reply_code: int) -> str | None:
    """Return the rule that a header breaks, as the C++ library's `validateMessage` does."""
    if msg_type == 0:
        return "message type 0 is reserved"
    if comm_type == CommType.INVALID:
        return "communication type 0 is invalid"
    if (comm_type == CommType.REPLY) == (reply_code == ReplyCode.UNUSED):
        return (
            f"reply code {reply_code} does not go with communication type {comm_type};"
            " only a reply has one, and it is not 0"
        )
    return None


class Frame:
    """Raw bytes read as a frame, whatever they say.

    Attributes:
        data: the bytes, prefix included.
        byte_order: as given, else as the length tells, else little.
    """

    __slots__ = ("byte_order", "data")

    def __init__(self, data: bytes, byte_order: ByteOrder | None = None) -> None:
        self.data = data
        self.byte_order = byte_order or detect_byte_order(data) or ByteOrder.LITTLE

    def integer_at(self, offset: int) -> int | None:
        """Return the 32-bit integer at an offset from the first byte, None behind the last one."""
        if len(self.data) < offset + 4:
            return None
        unpack = _LITTLE if self.byte_order is ByteOrder.LITTLE else _BIG
        (value,) = unpack(self.data, offset)
        return int(value)

    @property
    def has_header(self) -> bool:
        """True if there are enough bytes for a header."""
        return len(self.data) >= HEADER_SIZE

    @property
    def length(self) -> int:
        """Length field of the header; like all of them 0 where the header is cut short."""
        return self.integer_at(0) or 0

    @property
    def msg_type(self) -> int:
        """Message type of the header."""
        return self.integer_at(4) or 0

    @property
    def comm_type(self) -> int:
        """Communication type of the header."""
        return self.integer_at(8) or 0

    @property
    def reply_code(self) -> int:
        """Reply code of the header."""
        return self.integer_at(12) or 0

    @property
    def body(self) -> bytes:
        """The bytes behind the header."""
        return self.data[HEADER_SIZE:]


@dataclass(frozen=True, slots=True)
class Cut:
    """Part of a stream, in order.

    Attributes:
        data: one whole frame, prefix included, or stray bytes.
        is_frame: False for bytes in which no frame can be found.
    """

    data: bytes
    is_frame: bool


class Mode(Enum):
    """Action of a splitter behind an impossible length: the protocol has no mark of a frame."""

    STRICT = "gives what it holds as stray bytes and drops all that follows"
    ONLOOKER = "hands on all that follows as stray bytes: nothing is lost or changed"
    SEARCHING = "looks for a header that looks like one, and goes on there"


class Splitter:
    """Cuts one direction of a connection into frames.

    A searching splitter takes the byte order from each frame's own prefix. The others settle on
    that of the first.

    Attributes:
        byte_order: None until the first length prefix came.
        in_step: False while the position in the stream is lost; for good unless it searches.
    """

    def __init__(
        self,
        mode: Mode,
        byte_order: ByteOrder | None = None,
        *,
        least_length: int = LEAST_LENGTH,
        in_step: bool = True,
    ) -> None:
        """Make a splitter to which nothing was fed.

        Args:
            least_length: least length field that is taken for one, where the order is known.
        """
        self.byte_order = byte_order
        self.in_step = in_step
        self._mode = mode
        self._is_searching = mode is Mode.SEARCHING
        self._least_length = least_length
        self._pending = bytearray()

    @property
    def pending(self) -> bytes:
        """Bytes of a frame that is not complete; never more than `MAX_FRAME`."""
        return bytes(self._pending)

    def feed(self, data: bytes) -> list[Cut]:
        """Take bytes in any portions and return the frames they complete, and stray bytes."""
        if not self.in_step and not self._is_searching:
            return self._strays(data) if self._mode is Mode.ONLOOKER else []
        buffer = self._pending
        buffer += data
        cuts: list[Cut] = []
        at = 0
        while True:
            if not self.in_step:
                found, until = self._search(at)
                cuts += self._strays(bytes(buffer[at:until]))
                at = until
                if not found:
                    break
                self.in_step = True
            size = self._size_at(at)
            if size == 0:
                self.in_step = False
                if self._is_searching:
                    continue
                cuts += self._strays(bytes(buffer[at:]))
                at = len(buffer)
                break
            if size is None or at + size > len(buffer):
                break
            cuts.append(Cut(bytes(buffer[at : at + size]), is_frame=True))
            at += size
        del buffer[:at]
        return cuts

    def finish(self) -> list[Cut]:
        """End the stream, or mark missing bytes in it; return the unfinished part."""
        rest = bytes(self._pending)
        self._pending.clear()
        if self._is_searching:
            self.in_step = False
        return self._strays(rest)

    def _size_at(self, at: int) -> int | None:
        """Return the size of the frame that starts here: 0 for none, None if bytes are missing."""
        prefix = self._pending[at : at + PREFIX_SIZE]
        if len(prefix) < PREFIX_SIZE:
            return None
        order = self.byte_order
        if order is None or self._is_searching:
            order = detect_byte_order(prefix)
            if order is None:
                return 0
            if order is not (self.byte_order or order):
                # In the other order than so far: rather bytes out of step, unless all of it fits.
                header = bytes(self._pending[at : at + HEADER_SIZE])
                if len(header) < HEADER_SIZE:
                    return None
                if not _is_header(header):
                    return 0
            self.byte_order = self.byte_order or order
        length = int.from_bytes(prefix, "little" if order is ByteOrder.LITTLE else "big")
        if not self._least_length <= length <= MAX_DETECTABLE_LENGTH:
            return 0
        return PREFIX_SIZE + length

    def _search(self, at: int) -> tuple[bool, int]:
        """Search for a header; return True with its start, else False with the unknown part's."""
        for match in _header_pattern().finditer(self._pending, at):
            start = match.start()
            if _is_header(bytes(self._pending[start : start + HEADER_SIZE])):
                return True, start
        return False, max(at, len(self._pending) - HEADER_SIZE + 1)

    def _strays(self, data: bytes) -> list[Cut]:
        """Return stray bytes; an onlooker's in pieces that each fit a line of a trace."""
        size = MAX_FRAME if self._mode is Mode.ONLOOKER else len(data)
        return [
            Cut(data[start : start + size], is_frame=False)
            for start in range(0, len(data), size or 1)
        ]


@cache
def _header_pattern() -> re.Pattern[bytes]:
    """Return what finds lengths and types below 65,536, communication types 1 to 3, codes 0 to 2.

    In either byte order. Compiled for who searches: starting is to stay cheap.
    """
    return re.compile(
        rb"(?=(?s:..\0\0..\0\0[\1-\3]\0\0\0[\0-\2]\0\0\0|\0\0..\0\0..\0\0\0[\1-\3]\0\0\0[\0-\2]))"
    )


def _is_header(raw: bytes) -> bool:
    """Return True if 16 bytes look like the header of a frame of a known kind."""
    if detect_byte_order(raw) is None or not _header_pattern().match(raw):
        return False
    frame = Frame(raw)
    return broken_header_rule(frame.msg_type, frame.comm_type, frame.reply_code) is None
