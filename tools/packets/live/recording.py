"""Relay of a recording: forwards every byte at once, and records it.

Owns the order and the words of a trace's entries, and that no password gets there. Pure: entries go
to a function, times come in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from openpendant.simplemsg.framing import Mode, Splitter
from openpendant.simplemsg.masking import masked_frame

from ..trace import Entry, Event, Packet, TraceDirection
from .relay import Action, EndStream, ProxyLinkId, ResetBoth, SendBytes, sender


class RecordingRelay:
    """A transparent `Relay` that reports every frame and event.

    Attributes:
        packets: frames and stray pieces seen.
        began: time of the start, t = 0 of the trace [ns].
    """

    def __init__(self, write: Callable[[Entry], None], began: int) -> None:
        """Make a relay.

        Args:
            write: called with every entry, in order of time.
            began: now [ns].
        """
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
