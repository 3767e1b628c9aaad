"""A client's connection, as the parts of the shell that admit, close and write to it know it."""

from __future__ import annotations

from typing import Protocol

from openpendant.simplemsg import Connection, Message

from ..events.events import Port


class Client(Protocol):
    """One accepted connection; a `ClientConnection` is one.

    Attributes:
        session: its number.
        port: what it was accepted for.
        cell: number of the cell whose port that is; None for the pendant port of all.
        address: the peer's address.
        wire: the conversation.
    """

    session: int
    port: Port
    cell: int | None
    address: str
    wire: Connection

    def send(self, message: Message) -> None:
        """Write a message."""

    def write(self, frame: bytes) -> None:
        """Write a frame that was encoded for this conversation."""

    def is_clogged(self) -> bool:
        """Return True if the client reads too slowly for another state message."""

    def check_deadlines(self, now: int) -> None:
        """Cut off a client whose frame never ends or who never reads.

        Raises:
            Exception: what went wrong with a message to it.
        """

    def close(self, reason: str) -> None:
        """Close after what was written has left."""

    def abort(self, reason: str) -> None:
        """Close at once; what was not written is lost."""
