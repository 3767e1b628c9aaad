"""Actions of the scripted controller for its shell, immediate and delayed.

Owns the order in which delayed pieces leave. Knows no messages.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from .setup import Purpose


class Act(Enum):
    """Action of the shell other than a write."""

    CLOSE = "close the connection"
    RESET = "reset the connection"
    AWAY = "close all connections and stop listening"
    BACK = "listen again"


@dataclass(frozen=True, slots=True)
class ClientLinkId:
    """A connection to the controller.

    Attributes:
        purpose: motion or state.
        port: our TCP port.
        number: number of the connection on that port, from 1.
    """

    purpose: Purpose
    port: int
    number: int


@dataclass(frozen=True, slots=True)
class Write:
    """Write bytes in one piece."""

    link: ClientLinkId
    data: bytes


@dataclass(frozen=True, slots=True)
class Do:
    """Do something to a connection, or to all where it is None."""

    act: Act
    link: ClientLinkId | None = None


Action = Write | Do


@dataclass(order=True)
class Piece:
    """Bytes that leave later.

    Attributes:
        due: when [ns].
        number: keeps the order among pieces of one time.
        link: where.
        data: the bytes.
        frame: the whole frame that this piece completes; empty where it completes none.
    """

    due: int
    number: int
    link: ClientLinkId = field(compare=False)
    data: bytes = field(compare=False)
    frame: bytes = field(compare=False, default=b"")


class DelayedPieces:
    """Pieces that leave later, those of one connection in the order in which they were put off."""

    def __init__(self) -> None:
        """Make a queue with nothing in it."""
        self._pieces: list[Piece] = []
        self._count = 0

    def add(self, link: ClientLinkId, due: int, data: bytes, frame: bytes = b"") -> None:
        """Put a piece off."""
        self._count += 1
        self._pieces.append(Piece(due, self._count, link, data, frame))

    def after(self, link: ClientLinkId, now: int) -> int:
        """Return when a connection is free again [ns]: now, or behind its last piece."""
        return max((piece.due + 1 for piece in self._pieces if piece.link == link), default=now)

    def take_due(self, now: int) -> list[Piece]:
        """Remove and return what is due, in order."""
        due = sorted(piece for piece in self._pieces if piece.due <= now)
        self._pieces = [piece for piece in self._pieces if piece.due > now]
        return due

    def times(self) -> list[int]:
        """Return when something is due [ns]."""
        return [piece.due for piece in self._pieces]
