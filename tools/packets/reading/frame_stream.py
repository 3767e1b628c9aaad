"""Frames in the bytes of one direction, also where the stream is broken.

A connection has to give up when it is out of step (`simplemsg.connection`); whoever reads a capture
wants to see what comes after. So frames are looked for again, by a header that looks like one.
"""

from __future__ import annotations

import re
import struct

from openpendant.simplemsg import ByteOrder
from openpendant.simplemsg.connection import MAX_DETECTABLE_LENGTH, detect_byte_order
from openpendant.simplemsg.layout import HEADER_SIZE, PREFIX_SIZE, broken_header_rule

from ..frames import Cut

# Length and type below 65,536, communication type 1 to 3, reply code 0 to 2, in either order.
_HEADER = re.compile(
    rb"(?=(?s:..\0\0..\0\0[\1-\3]\0\0\0[\0-\2]\0\0\0|\0\0..\0\0..\0\0\0[\1-\3]\0\0\0[\0-\2]))"
)


class FrameStream:
    """Cuts a stream into frames.

    Each frame's own prefix tells its byte order, since only one reading of a length is in bounds.

    Attributes:
        found_frames: false until the first frame came; before it nothing says that this is simple
            message at all, and bytes that are no frame are not returned.
        ignored: the first of those bytes, at most 16.
    """

    def __init__(self, starts_with_frame: bool) -> None:
        """Make a stream.

        Args:
            starts_with_frame: true where the first byte is the first of the connection.
        """
        self.found_frames = False
        self.ignored = b""
        self._in_step = starts_with_frame
        self._order: ByteOrder | None = None
        self._pending = bytearray()

    def feed(self, data: bytes) -> list[Cut]:
        """Take bytes in order; return the frames that they complete, and what is none."""
        self._pending += data
        cuts: list[Cut] = []
        at = 0
        while True:
            if not self._in_step:
                found, until = self._search(at)
                cuts += self._no_frame(self._pending[at:until])
                at = until
                if not found:
                    break
                self._in_step = True
            end = self._end_of_frame(at)
            if end is None:
                break
            if end == at:
                self._in_step = False
                continue
            self.found_frames = True
            cuts.append(Cut(bytes(self._pending[at:end]), is_frame=True))
            at = end
        del self._pending[:at]
        return cuts

    def interrupt(self) -> list[Cut]:
        """Say that bytes are missing here, or that the stream ends; return what was unfinished."""
        cuts = self._no_frame(self._pending)
        self._pending.clear()
        self._in_step = False
        return cuts

    def _no_frame(self, data: bytearray) -> list[Cut]:
        if not data:
            return []
        if self.found_frames:
            return [Cut(bytes(data), is_frame=False)]
        self.ignored = self.ignored or bytes(data[:HEADER_SIZE])
        return []

    def _end_of_frame(self, at: int) -> int | None:
        """Return where the frame ends that begins here.

        Returns:
            None where more bytes are needed, `at` where there is no frame.
        """
        prefix = self._pending[at : at + PREFIX_SIZE]
        if len(prefix) < PREFIX_SIZE:
            return None
        order = detect_byte_order(bytes(prefix))
        if order is None:
            return at
        if self._order not in (None, order):
            # In the other byte order than so far: rather bytes out of step, unless all of it fits.
            header = bytes(self._pending[at : at + HEADER_SIZE])
            if len(header) < HEADER_SIZE:
                return None
            if not _is_header(header):
                return at
        self._order = self._order or order
        end = at + PREFIX_SIZE + struct.unpack(f"{order.value}i", prefix)[0]
        return end if end <= len(self._pending) else None

    def _search(self, at: int) -> tuple[bool, int]:
        """Look for a header; return whether there is one, and where it or the unknown begins."""
        for match in _HEADER.finditer(self._pending, at):
            start = match.start()
            if _is_header(bytes(self._pending[start : start + HEADER_SIZE])):
                return True, start
        return False, max(at, len(self._pending) - HEADER_SIZE + 1)


def _is_header(raw: bytes) -> bool:
    """Say whether 16 bytes look like the header of a frame of a known kind."""
    order = detect_byte_order(raw)
    if order is None or not _HEADER.match(raw):
        return False
    length, msg_type, comm_type, reply_code = struct.unpack(f"{order.value}4i", raw)
    if length > MAX_DETECTABLE_LENGTH:
        return False
    return broken_header_rule(msg_type, comm_type, reply_code) is None
