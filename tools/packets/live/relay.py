"""Contract between a proxy and its relay: events in, actions on the connections out.

The proxy's shell has the sockets; a relay is pure: it gets each event with its time and returns
actions.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from ..trace import TraceDirection


class ProxyLinkId(NamedTuple):
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
class SendBytes:
    """Write bytes to the receiver of a direction, in one piece."""

    link: ProxyLinkId
    direction: TraceDirection
    data: bytes


@dataclass(frozen=True, slots=True)
class EndStream:
    """Tell the receiver of a direction that nothing follows (FIN)."""

    link: ProxyLinkId
    direction: TraceDirection


@dataclass(frozen=True, slots=True)
class CloseBoth:
    """Close both sides in order (FIN), after what was sent."""

    link: ProxyLinkId


@dataclass(frozen=True, slots=True)
class ResetBoth:
    """Break both sides off (RST)."""

    link: ProxyLinkId


@dataclass(frozen=True, slots=True)
class Freeze:
    """Read and forward nothing any more, but keep both sockets: a half-open connection."""

    link: ProxyLinkId


Action = SendBytes | EndStream | CloseBoth | ResetBoth | Freeze


class Relay(Protocol):
    """Policy for all connections of a proxy; times are in nanoseconds."""

    def opened(self, link: ProxyLinkId, now: int) -> None:
        """A client is connected, the server not yet."""

    def refused(self, link: ProxyLinkId, reason: str, now: int) -> None:
        """The server could not be reached; the client is closed."""

    def received(
        self, link: ProxyLinkId, direction: TraceDirection, data: bytes, now: int
    ) -> Iterable[Action]:
        """Bytes came from the sender of a direction; each action is done as it is given."""

    def ended(self, link: ProxyLinkId, direction: TraceDirection, now: int) -> list[Action]:
        """The sender of a direction will send nothing more (FIN)."""

    def reset(self, link: ProxyLinkId, direction: TraceDirection, now: int) -> list[Action]:
        """The connection to the sender of a direction broke (RST)."""

    def closed(self, link: ProxyLinkId, now: int) -> None:
        """Both sides are gone."""

    def due(self, now: int) -> list[Action]:
        """Return what was put off until now."""

    def next_due(self) -> int | None:
        """Return when `due` has something to say next, None for never."""

    def held(self, link: ProxyLinkId, direction: TraceDirection) -> int:
        """Return the bytes of a direction that are kept back; reading pauses when they are many."""


def sender(direction: TraceDirection) -> str:
    """Return who sends in a direction: "client" or "server"."""
    return "client" if direction is TraceDirection.TO_SERVER else "server"
