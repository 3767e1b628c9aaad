"""The relay of the fault proxy: bytes to frames, frames to the engine, faults to the log."""

from __future__ import annotations

from typing import Any

from openpendant.simplemsg.framing import Mode, Splitter

from ..live.relay import Action, ProxyLinkId, ResetBoth
from ..trace import TraceDirection
from .fault_engine import FaultDone, FaultEngine


class FaultRelay:
    """A `Relay` that lets an engine decide about every frame.

    Bytes in which no frame can be found are forwarded as they are. A frame is forwarded when it is
    complete; what there is of one when its sender ends is forwarded, too.

    Attributes:
        frames: frames seen.
    """

    def __init__(self, engine: FaultEngine) -> None:
        self.frames = 0
        self._engine = engine
        self._splitters: dict[ProxyLinkId, dict[TraceDirection, Splitter]] = {}

    def opened(self, link: ProxyLinkId, now: int) -> None:
        """Add a new connection."""
        self._splitters[link] = {direction: Splitter(Mode.ONLOOKER) for direction in TraceDirection}
        self._engine.opened(link, now)

    def refused(self, link: ProxyLinkId, reason: str, now: int) -> None:
        """Do nothing: the client is closed, and `closed` follows."""

    def received(
        self, link: ProxyLinkId, direction: TraceDirection, data: bytes, now: int
    ) -> list[Action]:
        """Cut bytes into frames and ask the engine about each."""
        actions: list[Action] = []
        for piece in self._splitters[link][direction].feed(data):
            if piece.is_frame:
                self.frames += 1
                actions += self._engine.take(direction, link, piece.data, now)
            else:
                actions += self._engine.pass_on(direction, link, piece.data, now)
        return actions

    def ended(self, link: ProxyLinkId, direction: TraceDirection, now: int) -> list[Action]:
        """Pass a FIN on behind what waits."""
        actions: list[Action] = []
        for piece in self._splitters[link][direction].finish():
            actions += self._engine.pass_on(direction, link, piece.data, now)
        return actions + self._engine.end(direction, link, now)

    def reset(self, link: ProxyLinkId, direction: TraceDirection, now: int) -> list[Action]:
        """Pass a RST on at once; what waits is lost."""
        self._engine.forget(link)
        return [ResetBoth(link)]

    def closed(self, link: ProxyLinkId, now: int) -> None:
        """Forget a connection."""
        self._engine.forget(link)
        del self._splitters[link]

    def due(self, now: int) -> list[Action]:
        """Return what was put off until now."""
        return self._engine.due(now)

    def next_due(self) -> int | None:
        """Return when `due` has something to say next."""
        return self._engine.next_due()

    def held(self, link: ProxyLinkId, direction: TraceDirection) -> int:
        """Return the bytes that are kept back."""
        return self._engine.held(link, direction)


def fault_to_json(done: FaultDone, began: int) -> dict[str, Any]:
    """Return a line of the log.

    Args:
        done: the fault.
        began: time of the start [ns].
    """
    return {
        "t": (done.time - began) / 1e9,
        "rule": done.rule,
        "fault": done.fault,
        "detail": done.detail,
        "dir": done.direction.value,
        "port": done.link.port,
        "conn": done.link.number,
        "hex": done.frame.hex(),
    }
