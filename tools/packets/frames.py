"""Cuts a byte stream into frames for an onlooker that must lose nothing.

Owns the rule of what is a frame to a recorder or proxy. Unlike `simplemsg.Connection` it gives up
no conversation: bytes in which no frame can be found are handed on as they are. Knows nothing of
messages, sockets or time.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg import ByteOrder
from openpendant.simplemsg.connection import MAX_DETECTABLE_LENGTH, detect_byte_order
from openpendant.simplemsg.layout import HEADER_SIZE, PREFIX_SIZE

MAX_FRAME = MAX_DETECTABLE_LENGTH + PREFIX_SIZE
"""Largest frame that is recognised, bytes; its length reads differently in both byte orders."""

_LEAST_LENGTH = HEADER_SIZE - PREFIX_SIZE
_ORDER_NAMES = {ByteOrder.LITTLE: "little", ByteOrder.BIG: "big"}


@dataclass(frozen=True, slots=True)
class Cut:
    """Part of a stream, in order; all pieces together are the stream.

    Attributes:
        data: one whole frame, prefix included, or stray bytes.
        is_frame: False for bytes in which no frame can be found.
    """

    data: bytes
    is_frame: bool


def length_in(data: bytes | bytearray, order: ByteOrder, start: int = 0) -> int | None:
    """Return the length field at `start`, None where it is no length of a frame."""
    prefix = data[start : start + PREFIX_SIZE]
    length = int.from_bytes(prefix, "little" if order is ByteOrder.LITTLE else "big")
    return length if _LEAST_LENGTH <= length <= MAX_DETECTABLE_LENGTH else None


def order_name(order: ByteOrder) -> str:
    """Return "little" or "big"."""
    return _ORDER_NAMES[order]


class FrameSplitter:
    """Splits one direction of a connection into frames.

    A length that no frame has puts the stream out of step for good: there is no mark to find the
    next frame by.

    Attributes:
        byte_order: None until the first length prefix came.
        in_step: False once the position in the stream is lost.
    """

    def __init__(self, byte_order: ByteOrder | None = None) -> None:
        self.byte_order = byte_order
        self.in_step = True
        self._pending = bytearray()

    @property
    def pending(self) -> int:
        """Bytes kept of a frame that is not complete; never more than `MAX_FRAME`."""
        return len(self._pending)

    def feed(self, data: bytes) -> list[Cut]:
        """Take bytes in any portions and return the frames they complete, and stray bytes."""
        if not self.in_step:
            return _strays(data)
        buffer = self._pending
        buffer += data
        pieces: list[Cut] = []
        start = 0
        while len(buffer) - start >= PREFIX_SIZE:
            length = self._length_at(start)
            if length is None:
                self.in_step = False
                pieces += _strays(bytes(buffer[start:]))
                start = len(buffer)
                break
            end = start + PREFIX_SIZE + length
            if end > len(buffer):
                break
            pieces.append(Cut(bytes(buffer[start:end]), is_frame=True))
            start = end
        del buffer[:start]
        return pieces

    def _length_at(self, start: int) -> int | None:
        if self.byte_order is None:
            self.byte_order = detect_byte_order(self._pending)
            if self.byte_order is None:
                return None
        return length_in(self._pending, self.byte_order, start)

    def finish(self) -> list[Cut]:
        """Return the beginning of a frame that will never be complete: the stream has ended."""
        rest = bytes(self._pending)
        self._pending.clear()
        return _strays(rest)


def _strays(data: bytes) -> list[Cut]:
    """Return stray bytes in pieces no larger than a frame, so that each fits a line of a trace."""
    return [
        Cut(data[start : start + MAX_FRAME], is_frame=False)
        for start in range(0, len(data), MAX_FRAME)
    ]
