"""Captured packets of a pcap or pcapng file, one at a time.

Owns the file and record headers of libpcap's own format, the blocks of pcapng
(draft-ietf-opsawg-pcapng) with sections, interfaces and the three kinds of packet blocks, and the
bounds of all these. Other blocks are skipped. Knows nothing of what the packets carry.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

MAX_RECORD = 262_144
"""Longest captured frame, bytes; libpcap's own `MAXIMUM_SNAPLEN`."""

_MICROSECOND, _NANOSECOND = 1_000, 1

_FORMS = {
    b"\xa1\xb2\xc3\xd4": (">", _MICROSECOND),
    b"\xd4\xc3\xb2\xa1": ("<", _MICROSECOND),
    b"\xa1\xb2\x3c\x4d": (">", _NANOSECOND),
    b"\x4d\x3c\xb2\xa1": ("<", _NANOSECOND),
}

MAGICS = tuple(_FORMS)
"""The four bytes with which a pcap file may start."""

_SECOND = 1_000_000_000


class CaptureFault(Exception):
    """A capture file cannot be read on from here."""

    def __init__(self, offset: int, reason: str) -> None:
        super().__init__(reason)
        self.offset = offset


@dataclass(frozen=True, slots=True)
class CapturedPacket:
    """One captured frame of the link layer.

    Attributes:
        time: as the file gives it, since its own epoch [ns].
        link_type: number of the link type (tcpdump.org/linktypes.html).
        data: the captured bytes, perhaps fewer than there were.
        offset: where its record stands in the file, bytes.
    """

    time: int
    link_type: int
    data: bytes
    offset: int


class Cursor:
    """Reader of exact sizes that counts its offset."""

    def __init__(self, stream: BinaryIO, offset: int = 0) -> None:
        self._stream = stream
        self.offset = offset

    def take(self, size: int, what: str) -> bytes:
        """Return so many bytes; CaptureFault, saying inside what, where the file ends before."""
        data = self._stream.read(size)
        if len(data) < size:
            raise CaptureFault(
                self.offset + len(data), f"the file ends inside {what}: {len(data)} of {size} bytes"
            )
        self.offset += size
        return data

    def begins(self, size: int, what: str) -> bytes:
        """Return so many bytes, none at the file's end; CaptureFault where it ends inside them."""
        first = self._stream.read(1)
        if not first:
            return b""
        self.offset += 1
        return first + self.take(size - 1, what)


def read_pcap(stream: BinaryIO, magic: bytes) -> Iterator[CapturedPacket]:
    """Yield the frames of a pcap file, each as soon as it was read.

    Raises:
        CaptureFault: this is no pcap file, or it ends inside a record.
    """
    if magic not in _FORMS:
        raise CaptureFault(0, f"first bytes {magic.hex() or 'none'}: neither pcap nor pcapng")
    order, unit = _FORMS[magic]
    cursor = Cursor(stream, len(magic))
    header = struct.unpack(f"{order}HHiIII", cursor.take(20, "the file header"))
    major, minor, link_type = header[0], header[1], header[5] & 0xFFFF
    if major != 2:
        raise CaptureFault(4, f"pcap version {major}.{minor}, not 2.4")
    record = struct.Struct(f"{order}IIII")
    while True:
        offset = cursor.offset
        raw = cursor.begins(record.size, "a record header")
        if not raw:
            return
        seconds, fraction, captured, _ = record.unpack(raw)
        if captured > MAX_RECORD:
            raise CaptureFault(offset, f"a record of {captured} bytes, more than {MAX_RECORD}")
        data = cursor.take(captured, "a record")
        yield CapturedPacket(seconds * _SECOND + fraction * unit, link_type, data, offset)


MAGIC = b"\x0a\x0d\x0d\x0a"
"""Type of a section header block: the first four bytes of every pcapng file."""

MAX_INTERFACES = 4_096
"""Most interfaces of one section."""

_SECTION, _INTERFACE, _SIMPLE, _OLD_PACKET, _PACKET = 0x0A0D0D0A, 1, 3, 2, 6
_ORDERS = {b"\x1a\x2b\x3c\x4d": ">", b"\x4d\x3c\x2b\x1a": "<"}
_FRAME_BLOCK_OVERHEAD = 65_536
_END_OF_OPTIONS, _TIME_RESOLUTION, _TIME_OFFSET = 0, 9, 14
_SKIPPED_AT_ONCE = 65_536


@dataclass(frozen=True, slots=True)
class _Interface:
    """Interface of a capture: link type, captured length, and the unit of its time stamps."""

    link_type: int
    snap_length: int
    per_second: int = 1_000_000
    offset: int = 0

    def time(self, high: int, low: int) -> int:
        """Return a time stamp in nanoseconds."""
        return (high << 32 | low) * _SECOND // self.per_second + self.offset * _SECOND


def read_pcapng(stream: BinaryIO) -> Iterator[CapturedPacket]:
    """Yield the frames of a pcapng file, each as soon as it was read.

    A frame of a simple packet block has no time; it gets that of the frame before it.

    Raises:
        CaptureFault: a block is none, or the file ends inside one.
    """
    cursor = Cursor(stream, len(MAGIC))
    blocks = _Blocks(cursor)
    interfaces: list[_Interface] = []
    time = 0
    for offset, kind, body in blocks.read():
        try:
            if kind == _SECTION:
                interfaces.clear()
            elif kind == _INTERFACE:
                if len(interfaces) == MAX_INTERFACES:
                    raise CaptureFault(offset, f"more than {MAX_INTERFACES} interfaces")
                interfaces.append(_interface(body, blocks.order))
            else:
                frame = _frame(kind, body, blocks.order, interfaces, time, offset)
                time = frame.time
                yield frame
        except (struct.error, IndexError) as error:
            raise CaptureFault(offset, f"a block of type {kind} that is none: {error}") from None


class _Blocks:
    """The blocks that are read; attribute `order` is the byte order of the present section."""

    def __init__(self, cursor: Cursor) -> None:
        self._cursor = cursor
        self.order = "<"

    def read(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield offset, type and body of each block."""
        offset, raw = 0, MAGIC
        while raw:
            if raw == MAGIC:
                kind, length = _SECTION, self._begin_section(offset)
                left = length - 16
            else:
                (kind,) = struct.unpack(f"{self.order}I", raw)
                (length,) = struct.unpack(f"{self.order}I", self._cursor.take(4, "a block"))
                left = length - 12
            if length % 4 or left < 0:
                raise CaptureFault(offset, f"a block of type {kind} with {length} bytes")
            if kind in (_INTERFACE, _SIMPLE, _OLD_PACKET, _PACKET):
                if left > MAX_RECORD + _FRAME_BLOCK_OVERHEAD:
                    raise CaptureFault(offset, f"a block of type {kind} with {length} bytes")
                yield offset, kind, self._finish(self._cursor.take(left, "a block"), length)
            else:
                self._skip(left)
                body = self._finish(b"", length)
                if kind == _SECTION:
                    yield offset, kind, body
            offset = self._cursor.offset
            raw = self._cursor.begins(4, "a block")

    def _begin_section(self, offset: int) -> int:
        raw = self._cursor.take(8, "a section header")
        if raw[4:] not in _ORDERS:
            raise CaptureFault(offset, f"byte-order magic {raw[4:].hex()} is none of pcapng")
        self.order = _ORDERS[raw[4:]]
        (length,) = struct.unpack(f"{self.order}I", raw[:4])
        return int(length)

    def _skip(self, size: int) -> None:
        while size:
            size -= len(self._cursor.take(min(size, _SKIPPED_AT_ONCE), "a block"))

    def _finish(self, body: bytes, length: int) -> bytes:
        offset = self._cursor.offset
        (again,) = struct.unpack(f"{self.order}I", self._cursor.take(4, "a block"))
        if again != length:
            raise CaptureFault(offset, f"a block of {length} bytes ends as one of {again}")
        return body


def _interface(body: bytes, order: str) -> _Interface:
    link_type, _, snap_length = struct.unpack_from(f"{order}HHI", body)
    per_second, offset = 1_000_000, 0
    for code, value in _options(body[8:], order):
        if code == _TIME_RESOLUTION and value:
            power = value[0] & 0x7F
            per_second = 2**power if value[0] & 0x80 else 10**power
        elif code == _TIME_OFFSET and len(value) == 8:
            (offset,) = struct.unpack(f"{order}q", value)
    return _Interface(link_type, snap_length, per_second, offset)


def _options(raw: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at + 4 <= len(raw):
        code, size = struct.unpack_from(f"{order}HH", raw, at)
        if code == _END_OF_OPTIONS:
            return
        yield code, raw[at + 4 : at + 4 + size]
        at += 4 + (size + 3) // 4 * 4


def _frame(
    kind: int, body: bytes, order: str, interfaces: list[_Interface], before: int, offset: int
) -> CapturedPacket:
    """Return the frame of a packet block.

    Raises:
        struct.error: the block is shorter than its header.
        IndexError: its interface was not described.
        CaptureFault: its frame is longer than the block, or than the bound.
    """
    if kind == _SIMPLE:
        (wire,) = struct.unpack_from(f"{order}I", body)
        interface, start, time = interfaces[0], 4, before
        captured = min(wire, interface.snap_length or wire, len(body) - start)
    else:
        which = f"{order}I" if kind == _PACKET else f"{order}H2x"
        (number,) = struct.unpack_from(which, body)
        high, low, captured, _ = struct.unpack_from(f"{order}IIII", body, 4)
        interface, start = interfaces[number], 20
        time = interface.time(high, low)
    if captured > min(len(body) - start, MAX_RECORD):
        raise CaptureFault(offset, f"a frame of {captured} bytes in a block of {len(body) + 12}")
    return CapturedPacket(time, interface.link_type, body[start : start + captured], offset)
