"""What a proxy may do with the bytes of its connections, and who decides it.

Owns the contract between the proxy's shell, which has the sockets, and a relay, which is pure: it
is told what happened and when, and returns what to do.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from ..trace import Direction


class LinkId(NamedTuple):
    """One client's connection through the proxy.

    Attributes:
        pair: number of the listen and target pair, from 1.
        port: TCP port of the server behind the proxy.
        number: number of the connection on that port, from 1.
    """

    pair: int
    port: int
    number: int


@dataclass(frozen=True, slots=True)
class Send:
    """Write bytes to the receiver of a direction, in one piece."""

    link: LinkId
    direction: Direction
    data: bytes


@dataclass(frozen=True, slots=True)
class End:
    """Tell the receiver of a direction that nothing follows (FIN)."""

    link: LinkId
    direction: Direction


@dataclass(frozen=True, slots=True)
class Close:
    """Close both sides in order (FIN), after what was sent."""

    link: LinkId


@dataclass(frozen=True, slots=True)
class Reset:
    """Break both sides off (RST)."""

    link: LinkId


@dataclass(frozen=True, slots=True)
class Freeze:
    """Read and forward nothing any more, but keep both sockets: a half-open connection."""

    link: LinkId


Action = Send | End | Close | Reset | Freeze


class Relay(Protocol):
    """Decides about all connections of a proxy; times are in nanoseconds."""

    def opened(self, link: LinkId, now: int) -> None:
        """A client is connected, the server not yet."""

    def refused(self, link: LinkId, reason: str, now: int) -> None:
        """The server could not be reached; the client is closed."""

    def received(
        self, link: LinkId, direction: Direction, data: bytes, now: int
    ) -> Iterable[Action]:
        """Bytes came from the sender of a direction; each action is done as it is given."""

    def ended(self, link: LinkId, direction: Direction, now: int) -> list[Action]:
        """The sender of a direction will send nothing more (FIN)."""

    def reset(self, link: LinkId, direction: Direction, now: int) -> list[Action]:
        """The connection to the sender of a direction broke (RST)."""

    def closed(self, link: LinkId, now: int) -> None:
        """Both sides are gone."""

    def due(self, now: int) -> list[Action]:
        """Return what was put off until now."""

    def next_due(self) -> int | None:
        """Return when `due` has something to say next, None for never."""

    def held(self, link: LinkId, direction: Direction) -> int:
        """Return the bytes of a direction that are kept back; reading pauses when they are many."""


def sender(direction: Direction) -> str:
    """Return who sends in a direction: "client" or "server"."""
    return "client" if direction is Direction.TO_SERVER else "server"
