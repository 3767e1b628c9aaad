"""The backlog of a browser: frames of a server that wait until they can be written.

Owns what becomes of a browser that reads too slowly. Once so many bytes wait, states are left out:
a newer one comes soon, and an old one is worth nothing. Every other frame is kept up to a bound;
beyond it the connection is given up, because a frame that is missing would be a lie.

Pure: what waits in the socket is an argument.
"""

from __future__ import annotations

from openpendant.simplemsg import ByteOrder
from openpendant.simplemsg.pendant import State

STATES_WAIT_BELOW = 65_536
"""Bytes that may wait before a state is left out."""

MOST_WAITING = 1_048_576
"""Bytes that may wait in all; with more the browser is given up."""

_STATE = State.PLACE.msg_type


class TooSlow(Exception):
    """A browser that has left more bytes unread than may wait."""


class Backlog:
    """What waits for one browser.

    Attributes:
        skipped: states that were left out.
    """

    def __init__(self) -> None:
        self.skipped = 0
        self._frames: list[bytes] = []
        self._size = 0

    def __bool__(self) -> bool:
        """True while something waits."""
        return bool(self._frames)

    def add(self, frame: bytes, order: ByteOrder, in_socket: int) -> None:
        """Take a whole frame.

        Args:
            in_socket: bytes that wait in the socket already.

        Raises:
            TooSlow: more wait than may.
        """
        waiting = in_socket + self._size
        if waiting > STATES_WAIT_BELOW and _msg_type(frame, order) == _STATE:
            self.skipped += 1
            return
        if waiting + len(frame) > MOST_WAITING:
            raise TooSlow(f"{waiting} bytes wait for a browser that does not read them")
        self._frames.append(frame)
        self._size += len(frame)

    def take(self) -> bytes:
        """Return all that waits, to be written as one message."""
        frames = self._frames
        data = frames[0] if len(frames) == 1 else b"".join(frames)
        self._frames, self._size = [], 0
        return data


def _msg_type(frame: bytes, order: ByteOrder) -> int:
    return int.from_bytes(frame[4:8], "little" if order is ByteOrder.LITTLE else "big")
