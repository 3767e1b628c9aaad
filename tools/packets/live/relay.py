"""Relays: what decides about the bytes of a proxy, and the one that forwards and records them all.

The proxy's shell has the sockets; a relay is pure: it gets each event with its time and returns
actions. Owns the order and the words of a recorded trace's entries, and that no password is in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from openpendant.simplemsg.framing import Mode, Splitter
from openpendant.simplemsg.masking import masked_frame

from ..trace import Entry, Event, Packet, TraceDirection


class ProxyLinkId(NamedTuple):
    """One client's connection through the proxy.

    Attributes:
        pair: number of the listen and target pair, from 1.
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


class RecordingRelay:
    """A transparent `Relay` that reports every frame and event.

    Attributes:
        packets: frames and stray pieces seen.
        began: time of the start, t = 0 of the trace [ns].
    """

    def __init__(self, write: Callable[[Entry], None], began: int) -> None:
        """Make a relay that writes every entry, in order of time, from its beginning on [ns]."""
        self.packets = 0
        self.began = began
        self._write = write
        self._splitters: dict[ProxyLinkId, dict[TraceDirection, Splitter]] = {}

    def opened(self, link: ProxyLinkId, now: int) -> None:
        """Note a new client."""
        self._splitters[link] = {direction: Splitter(Mode.ONLOOKER) for direction in TraceDirection}
        self._note("client-connected", link, now)

    def refused(self, link: ProxyLinkId, reason: str, now: int) -> None:
        """Note a server that cannot be reached."""
        self._note(f"refused {reason}", link, now)

    def received(
        self, link: ProxyLinkId, direction: TraceDirection, data: bytes, now: int
    ) -> Iterator[Action]:
        """Forward bytes as they came; only then note what they complete."""
        yield SendBytes(link, direction, data)
        splitter = self._splitters[link][direction]
        was_in_step = splitter.in_step
        for piece in splitter.feed(data):
            if was_in_step and not piece.is_frame:
                self._note(f"out-of-step {sender(direction)}", link, now)
                was_in_step = False
            self._packet(link, direction, piece.data, now, is_frame=piece.is_frame)

    def ended(self, link: ProxyLinkId, direction: TraceDirection, now: int) -> list[Action]:
        """Pass a FIN on."""
        self._finish(link, direction, now)
        self._note(f"{sender(direction)}-closed-connection", link, now)
        return [EndStream(link, direction)]

    def reset(self, link: ProxyLinkId, direction: TraceDirection, now: int) -> list[Action]:
        """Pass a RST on."""
        for each in TraceDirection:
            self._finish(link, each, now)
        self._note(f"reset {sender(direction)}", link, now)
        return [ResetBoth(link)]

    def closed(self, link: ProxyLinkId, now: int) -> None:
        """Forget a connection."""
        for direction in TraceDirection:
            self._finish(link, direction, now)
        del self._splitters[link]

    def due(self, now: int) -> list[Action]:
        """Return nothing: nothing is ever put off."""
        return []

    def next_due(self) -> int | None:
        """Return None: nothing is ever put off."""
        return None

    def held(self, link: ProxyLinkId, direction: TraceDirection) -> int:
        """Return 0: what a splitter keeps of a frame has been forwarded already."""
        return 0

    def finish(self, now: int) -> None:
        """Note the unfinished frames of all connections: the recording ends."""
        for link in list(self._splitters):
            self.closed(link, now)

    def _finish(self, link: ProxyLinkId, direction: TraceDirection, now: int) -> None:
        for piece in self._splitters[link][direction].finish():
            self._packet(link, direction, piece.data, now, is_frame=False)

    def _packet(
        self, link: ProxyLinkId, direction: TraceDirection, data: bytes, now: int, *, is_frame: bool
    ) -> None:
        self.packets += 1
        time = now - self.began
        data = masked_frame(data)
        self._write(Packet(time, direction, data, link.port, link.number, is_frame=is_frame))

    def _note(self, text: str, link: ProxyLinkId, now: int) -> None:
        self._write(Event(now - self.began, text, link.port, link.number))
