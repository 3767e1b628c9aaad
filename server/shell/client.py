"""Client of a server: what its parts know of one accepted connection."""

from __future__ import annotations

from typing import Protocol

from openpendant.simplemsg import Connection, Message

from ..access.connection_loads import ConnectionLoad
from ..events.events import Port


class Client(Protocol):
    """One accepted connection; a `ClientConnection` is one.

    Attributes:
        cell: number of the cell whose port that is; None for the pendant port of all.
        load: what it took of the loop since it was opened.
    """

    session: int
    port: Port
    cell: int | None
    address: str
    wire: Connection
    load: ConnectionLoad

    @property
    def unread(self) -> int:
        """How many bytes wait for it to read them."""

    def send(self, message: Message) -> None:
        """Write a message."""

    def write(self, frame: bytes) -> None:
        """Write a frame that was encoded for this conversation."""

    def failed(self, error: Exception) -> None:
        """Take note of what went wrong with a message to it, for `check_deadlines`."""

    def is_clogged(self) -> bool:
        """Return True if the client reads too slowly for another state message."""

    def check_deadlines(self, now: int) -> None:
        """Cut off a client whose frame never ends or who never reads.

        Raises:
            Exception: what went wrong with a message to it.
        """

    def hold(self) -> None:
        """Let wait what it sends, but for what stops or keeps alive."""

    def release(self) -> None:
        """Go on with what waits."""

    def close(self, reason: str) -> None:
        """Close after what was written has left."""

    def abort(self, reason: str) -> None:
        """Close at once; what was not written is lost."""
