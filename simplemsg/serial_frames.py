"""Frames on a serial line: COBS between zero bytes, kind, sequence, length and CRC.

Owns the kinds of frames of a keypad, declared once with the layout of each payload, the bytes of a
frame, and a reader that is back in step at the next zero byte after any rubbish. A line loses and
invents bytes, so nothing here raises on what was received: rubbish is a count. Knows no port, no
robot and no time.

    00 | COBS( kind u8 | sequence u8 | length u16 | payload | crc u16 ) | 00      little endian
"""

from __future__ import annotations

import binascii
import struct
from collections.abc import Mapping
from dataclasses import astuple, dataclass, field
from enum import Enum, IntEnum, IntFlag
from typing import ClassVar, TypeAlias

PROTOCOL = 1
"""Version of the protocol between keypad and bridge."""

LONGEST_PIECE = 96
"""Bytes between two zero bytes on the line of a keypad, at most; longer pieces are dropped."""

LONGEST_UPLINK_PIECE = 1_100
"""Likewise on a line that carries whole simple messages."""

NO_KEY = 0xFF
"""In the place of a key: none, or all of them."""

COLUMNS, ROWS = 20, 4
"""Size of the display."""

_HEAD = struct.Struct("<BBH")
_CRC = struct.Struct("<H")


class LineWay(Enum):
    """Direction of a frame."""

    TO_HOST = "from the keypad"
    TO_DEVICE = "to the keypad"


class FrameKind(IntEnum):
    """Kinds of frames."""

    HELLO = 0x01
    KEY_DOWN = 0x02
    KEY_UP = 0x03
    BEAT = 0x04
    ACK = 0x05
    MESSAGE = 0x40
    WELCOME = 0x81
    LCD_ROW = 0x82
    LCD_PAGE = 0x83
    HOST_BEAT = 0x84
    ASK_HELLO = 0x85


class KeyFlag(IntFlag):
    """Flags of a key frame."""

    TOO_MANY_KEYS = 1
    ENABLING_HELD = 2
    RUBBISH_RECEIVED = 4
    PAGE_INCOMPLETE = 8


class KeypadFeature(IntFlag):
    """What a keypad is fitted with."""

    ENABLING_BUTTON = 1
    CHARACTERS_JUMPER = 2


class WelcomeFlag(IntFlag):
    """Flags of a welcome."""

    BACK_LIGHT = 1


class HostFlag(IntFlag):
    """Flags of the bridge's beat."""

    IN_CONTROL = 1
    MOVING = 2
    STOP_LATCHED = 4


class AckResult(IntEnum):
    """What a keypad made of a frame."""

    DONE = 0
    WRONG_KIND = 1
    WRONG_LENGTH = 2
    WRONG_PLACE = 3
    BUSY = 4
    WRONG_VERSION = 5


@dataclass(frozen=True, slots=True)
class KeypadHello:
    """What a keypad says of itself after its start, and when it is asked.

    Attributes:
        reset_cause: MCUSR of the AVR.
        mask: bit k is set while key k is down.
        time: clock of the keypad [ms], modulo 65,536.
    """

    KIND: ClassVar[FrameKind] = FrameKind.HELLO
    LAYOUT: ClassVar[str] = "7BxHH"
    protocol: int
    major: int
    minor: int
    reset_cause: int
    columns: int
    rows: int
    features: int
    mask: int
    time: int


@dataclass(frozen=True, slots=True)
class _KeyFrame:
    """A key frame: which keys are down.

    Attributes:
        key: its number from 0, 4 × row + column; `NO_KEY` for none, or for all.
        flags: of `KeyFlag`.
        mask: bit k is set while key k is down, after the event.
        time: clock of the keypad [ms], modulo 65,536.
    """

    LAYOUT: ClassVar[str] = "BBHH"
    key: int
    flags: int
    mask: int
    time: int


@dataclass(frozen=True, slots=True)
class KeyDown(_KeyFrame):
    """A key went down."""

    KIND: ClassVar[FrameKind] = FrameKind.KEY_DOWN


@dataclass(frozen=True, slots=True)
class KeyUp(_KeyFrame):
    """A key came up; with `NO_KEY` and no key down: all keys are up after a start or a welcome."""

    KIND: ClassVar[FrameKind] = FrameKind.KEY_UP


@dataclass(frozen=True, slots=True)
class KeypadBeat(_KeyFrame):
    """The keypad lives; sent all the time, with and without keys."""

    KIND: ClassVar[FrameKind] = FrameKind.BEAT


@dataclass(frozen=True, slots=True)
class Ack:
    """The keypad's answer to a welcome, a row or a page.

    Attributes:
        sequence: of the frame that it answers.
        result: of `AckResult`.
    """

    KIND: ClassVar[FrameKind] = FrameKind.ACK
    LAYOUT: ClassVar[str] = "BB"
    sequence: int
    result: int


@dataclass(frozen=True, slots=True)
class CarriedMessage:
    """Exactly one frame of simple message: one that is lost shifts no stream."""

    KIND: ClassVar[FrameKind] = FrameKind.MESSAGE
    LAYOUT: ClassVar[str] = "1027s"
    LEAST: ClassVar[int] = 16
    frame: bytes


@dataclass(frozen=True, slots=True)
class KeypadWelcome:
    """The bridge's answer to a hello.

    Attributes:
        beat: time between two beats of the keypad [ms].
        debounce: a key counts as down once it was so for so long [ms].
        flags: of `WelcomeFlag`.
    """

    KIND: ClassVar[FrameKind] = FrameKind.WELCOME
    LAYOUT: ClassVar[str] = "4B"
    protocol: int
    beat: int
    debounce: int
    flags: int


@dataclass(frozen=True, slots=True)
class LcdRow:
    """One row of the display: twenty characters of printable ASCII."""

    KIND: ClassVar[FrameKind] = FrameKind.LCD_ROW
    LAYOUT: ClassVar[str] = f"Bx{COLUMNS}s"
    row: int
    text: bytes


@dataclass(frozen=True, slots=True)
class LcdPage:
    """All of the display, row by row."""

    KIND: ClassVar[FrameKind] = FrameKind.LCD_PAGE
    LAYOUT: ClassVar[str] = f"{COLUMNS * ROWS}s"
    text: bytes


@dataclass(frozen=True, slots=True)
class HostBeat:
    """The bridge lives; `flags` of `HostFlag`."""

    KIND: ClassVar[FrameKind] = FrameKind.HOST_BEAT
    LAYOUT: ClassVar[str] = "Bx"
    flags: int


@dataclass(frozen=True, slots=True)
class AskHello:
    """The bridge wants a hello."""

    KIND: ClassVar[FrameKind] = FrameKind.ASK_HELLO
    LAYOUT: ClassVar[str] = ""


KeyFrame: TypeAlias = KeyDown | KeyUp | KeypadBeat
FromKeypad: TypeAlias = KeypadHello | KeyFrame | Ack
ToKeypad: TypeAlias = KeypadWelcome | LcdRow | LcdPage | HostBeat | AskHello
SerialFrame: TypeAlias = FromKeypad | ToKeypad | CarriedMessage

FRAMES: Mapping[int, tuple[type[SerialFrame], frozenset[LineWay]]] = {
    **{
        each.KIND: (each, frozenset({LineWay.TO_HOST}))
        for each in (KeypadHello, KeyDown, KeyUp, KeypadBeat, Ack)
    },
    CarriedMessage.KIND: (CarriedMessage, frozenset(LineWay)),
    **{
        each.KIND: (each, frozenset({LineWay.TO_DEVICE}))
        for each in (KeypadWelcome, LcdRow, LcdPage, HostBeat, AskHello)
    },
}
"""The declaration of each kind, and the directions that it goes."""

ACKNOWLEDGED = frozenset({FrameKind.WELCOME, FrameKind.LCD_ROW, FrameKind.LCD_PAGE})
"""Kinds that a keypad answers."""


_LAYOUTS: Mapping[int, struct.Struct] = {
    kind: struct.Struct(f"<{frame.LAYOUT}") for kind, (frame, _) in FRAMES.items()
}


def payload_of(frame: SerialFrame) -> bytes:
    """Return the payload of a frame.

    Raises:
        struct.error: a value does not fit its field.
        ValueError: a text or a message has another length than its field.
    """
    if isinstance(frame, CarriedMessage):
        if not frame.LEAST <= len(frame.frame) <= _LAYOUTS[FrameKind.MESSAGE].size:
            raise ValueError(f"a message of {len(frame.frame)} bytes; accepted: 16 to 1,027")
        return frame.frame
    if isinstance(frame, LcdRow | LcdPage):
        wanted = COLUMNS if isinstance(frame, LcdRow) else COLUMNS * ROWS
        if len(frame.text) != wanted:
            raise ValueError(f"{len(frame.text)} characters; accepted: {wanted}")
    return _LAYOUTS[frame.KIND].pack(*astuple(frame))


def bytes_of(frame: SerialFrame, sequence: int) -> bytes:
    """Return a frame as it goes on the line, with its zero bytes.

    Args:
        sequence: number of the frame in its direction, modulo 256.
    """
    payload = payload_of(frame)
    data = _HEAD.pack(frame.KIND, sequence % 256, len(payload)) + payload
    return b"\0" + stuffed(data + _CRC.pack(checksum(data))) + b"\0"


def checksum(data: bytes) -> int:
    """Return the CRC-16/CCITT, not reflected, from FFFFh."""
    return binascii.crc_hqx(data, 0xFFFF)


_BLOCK = 254
"""Bytes other than zero that one count of COBS covers."""


def stuffed(data: bytes) -> bytes:
    """Return data by COBS, so that it has no zero byte."""
    out = bytearray()
    *blocks, last = data.split(b"\0")
    for block in blocks:
        out += _counted(block)
    # Behind a last block that is full no zero is implied, so it needs no empty one to end it.
    out += _counted(last) if not last or len(last) % _BLOCK else _counted(last)[:-1]
    return bytes(out)


def _counted(block: bytes) -> bytes:
    out = bytearray()
    while len(block) >= _BLOCK:
        out.append(_BLOCK + 1)
        out += block[:_BLOCK]
        block = block[_BLOCK:]
    out.append(len(block) + 1)
    return bytes(out + block)


def unstuffed(piece: bytes) -> bytes | None:
    """Return the data of a piece without zero bytes by COBS; None where it is none."""
    out = bytearray()
    at, size = 0, len(piece)
    while at < size:
        count = piece[at]
        if count == 0 or at + count > size:
            return None
        out += piece[at + 1 : at + count]
        at += count
        if count <= _BLOCK and at < size:
            out.append(0)
    return bytes(out)


@dataclass(slots=True)
class LineCounts:
    """What came on a line so far.

    Attributes:
        bad: pieces that are no frame.
        repeated: frames with the sequence of the one before, which were ignored.
        missing: frames that never came, by the gaps in their sequence.
    """

    received: int = 0
    frames: int = 0
    bad: int = 0
    repeated: int = 0
    missing: int = 0


@dataclass(slots=True)
class FrameReader:
    """Reads one direction of a line, in whatever portions the bytes come.

    Attributes:
        way: the direction; a kind that does not go it is rubbish.
        longest: bytes of the longest piece that can be a frame.
    """

    way: LineWay
    longest: int = LONGEST_PIECE
    counts: LineCounts = field(default_factory=LineCounts)
    _piece: bytearray = field(default_factory=bytearray)
    _is_too_long: bool = False
    _last: int | None = None

    def receive(self, data: bytes) -> list[tuple[int, SerialFrame]]:
        """Take bytes and return the frames that they complete, each behind its sequence."""
        self.counts.received += len(data)
        *ended, open_piece = data.split(b"\0")
        found: list[tuple[int, SerialFrame]] = []
        for part in ended:
            self._grow(part)
            frame = self._end_piece()
            if frame is not None:
                found.append(frame)
        self._grow(open_piece)
        return found

    def _grow(self, part: bytes) -> None:
        """Add to the open piece; one that is too long is dropped up to the next zero byte."""
        if len(self._piece) + len(part) > self.longest:
            self._is_too_long = True
            self._piece.clear()
        else:
            self._piece += part

    def _end_piece(self) -> tuple[int, SerialFrame] | None:
        piece, was_too_long = bytes(self._piece), self._is_too_long
        self._piece.clear()
        self._is_too_long = False
        if not piece and not was_too_long:
            return None
        read = None if was_too_long else frame_of(piece, self.way)
        if read is None:
            self.counts.bad += 1
            return None
        sequence = read[0]
        if sequence == self._last:
            self.counts.repeated += 1
            return None
        if self._last is not None:
            self.counts.missing += (sequence - self._last - 1) % 256
        self._last = sequence
        self.counts.frames += 1
        return read


def frame_of(piece: bytes, way: LineWay) -> tuple[int, SerialFrame] | None:
    """Return the sequence and the frame of a piece between zero bytes; None where it is none.

    Args:
        way: the direction in which it came.
    """
    data = unstuffed(piece)
    if data is None or len(data) < _HEAD.size + _CRC.size:
        return None
    kind, sequence, length = _HEAD.unpack_from(data)
    end = len(data) - _CRC.size
    if length != end - _HEAD.size or (checksum(data[:end]),) != _CRC.unpack_from(data, end):
        return None
    frame, ways = FRAMES.get(kind, (None, frozenset()))
    if frame is None or way not in ways:
        return None
    payload = data[_HEAD.size : end]
    if frame is CarriedMessage:
        fits = CarriedMessage.LEAST <= length <= _LAYOUTS[FrameKind.MESSAGE].size
        return (sequence, CarriedMessage(payload)) if fits else None
    layout = _LAYOUTS[kind]
    return (sequence, frame(*layout.unpack(payload))) if length == layout.size else None


@dataclass(slots=True)
class FrameWriter:
    """Numbers the frames of one direction of a line."""

    _next: int = 0

    def write(self, frame: SerialFrame) -> tuple[int, bytes]:
        """Return the sequence of a frame that is sent now, and its bytes."""
        sequence = self._next
        self._next = (sequence + 1) % 256
        return sequence, bytes_of(frame, sequence)
