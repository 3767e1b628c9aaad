"""Captured frames of a pcap file (libpcap's own format), one at a time.

Owns the file and record headers and their bounds. Knows nothing of what the frames carry.
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
"""The four bytes that a pcap file may begin with."""

_SECOND = 1_000_000_000


class CaptureFault(Exception):
    """A capture file cannot be read on from here.

    Attributes:
        offset: where in the file, bytes.
    """

    def __init__(self, offset: int, reason: str) -> None:
        super().__init__(reason)
        self.offset = offset


@dataclass(frozen=True, slots=True)
class Frame:
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
    """Reads exactly, and knows where it is.

    Attributes:
        offset: bytes read so far.
    """

    def __init__(self, stream: BinaryIO, offset: int = 0) -> None:
        self._stream = stream
        self.offset = offset

    def take(self, size: int, what: str) -> bytes:
        """Return so many bytes.

        Raises:
            CaptureFault: the file ends before; the text says inside what.
        """
        data = self._stream.read(size)
        if len(data) < size:
            raise CaptureFault(
                self.offset + len(data),
                f"the file ends inside {what}: {len(data)} of {size} bytes",
            )
        self.offset += size
        return data

    def begins(self, size: int, what: str) -> bytes:
        """Return so many bytes, or none at all where the file has ended.

        Raises:
            CaptureFault: it ends inside them.
        """
        first = self._stream.read(1)
        if not first:
            return b""
        self.offset += 1
        return first + self.take(size - 1, what)


def read_pcap(stream: BinaryIO, magic: bytes) -> Iterator[Frame]:
    """Give the frames of a pcap file, each as soon as it was read.

    Args:
        stream: the file behind its first four bytes.
        magic: those four bytes.

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
        yield Frame(seconds * _SECOND + fraction * unit, link_type, data, offset)
