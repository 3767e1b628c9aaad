"""Lanes: frames on their way in one direction of one connection, with their times.

Owns the order, in which nothing overtakes what stands before it unless it was set aside for that;
and, for each connection, who awaits a reply, in which order replies go out, and how many requests
are remembered. Times are in nanoseconds.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from random import Random

from ..live.relay import Action, ProxyLinkId, SendBytes
from ..trace import TraceDirection
from . import fault_script as faults


@dataclass(slots=True)
class _Transit:
    """Bytes that go in pieces from a time on; or, without bytes, one other action."""

    at: int
    data: bytes = b""
    piece: int = 0
    gap: int = 0
    start: int = 0
    action: Action | None = None


@dataclass(slots=True)
class _SetAside:
    """A frame that later ones overtake."""

    data: bytes
    overtakers: int
    until: int


class Lane:
    """One direction of one connection."""

    def __init__(self, link: ProxyLinkId, direction: TraceDirection) -> None:
        self.held = 0
        self._link = link
        self._direction = direction
        self._queue: deque[_Transit] = deque()
        self._free_at = 0
        self._gathered: list[bytes] = []
        self._gather_target = 0
        self._gather_until = 0
        self._aside: list[_SetAside] = []

    def put(
        self, data: bytes, now: int, *, delay: int = 0, piece: int | None = None, gap: int = 0
    ) -> None:
        """Send bytes behind everything that waits."""
        if self._gathered and not delay and piece is None:
            self._gather(data, now)
        else:
            self._flush_gathered(now)
            self._append(data, now + delay, piece or len(data), gap)
        self._overtake(now)

    def _append(self, data: bytes, at: int, piece: int, gap: int) -> None:
        if not data:
            return
        at = max(at, self._free_at)
        self._queue.append(_Transit(at, data, piece, gap))
        self.held += len(data)
        self._free_at = at + gap * ((len(data) - 1) // piece)

    def put_pieces(self, pieces: list[bytes], now: int, gap: int) -> None:
        """Send the pieces of one frame with a pause between them."""
        self._flush_gathered(now)
        for index, piece in enumerate(pieces):
            self._append(piece, max(now, self._free_at) + gap if index else now, len(piece), 0)
        self._overtake(now)

    def put_at_rate(self, data: bytes, now: int, bytes_per_s: float) -> None:
        """Send bytes as a slow line would, in pieces of about ten milliseconds."""
        piece = max(1, round(bytes_per_s / 100))
        gap = round(piece / bytes_per_s * 1e9)
        wait = max(0, self._free_at - now)
        self.put(data, now, delay=wait + gap, piece=piece, gap=gap)

    def put_action(self, action: Action, now: int) -> None:
        """Queue an action behind all bytes that wait."""
        self._flush_gathered(now)
        for waiting in self._aside:
            self.held -= len(waiting.data)
            self._append(waiting.data, now, len(waiting.data), 0)
        self._aside.clear()
        self._queue.append(_Transit(max(now, self._free_at), action=action))

    def gather(self, data: bytes, now: int, count: int, within: int) -> None:
        """Hold a frame until there are `count`, or for `within`; then send all in one piece."""
        if not self._gathered:
            self._gather_target, self._gather_until = count, now + within
        self._gather(data, now)
        self._overtake(now)

    def _gather(self, data: bytes, now: int) -> None:
        self._gathered.append(data)
        self.held += len(data)
        if len(self._gathered) >= self._gather_target:
            self._flush_gathered(now)

    def _flush_gathered(self, now: int) -> None:
        together = b"".join(self._gathered)
        self._gathered.clear()
        self.held -= len(together)
        self._append(together, now, len(together), 0)

    def set_aside(self, data: bytes, now: int, overtakers: int, within: int) -> None:
        """Let `overtakers` later frames pass first, or wait `within`."""
        self._aside.append(_SetAside(data, overtakers, now + within))
        self.held += len(data)

    def _overtake(self, now: int) -> None:
        for waiting in self._aside:
            waiting.overtakers -= 1
        self._return_from_aside(now)

    def _return_from_aside(self, now: int) -> None:
        back = [
            waiting for waiting in self._aside if waiting.overtakers <= 0 or waiting.until <= now
        ]
        for waiting in back:
            self._aside.remove(waiting)
            self.held -= len(waiting.data)
            self._append(waiting.data, now, len(waiting.data), 0)

    def release(self, now: int) -> list[Action]:
        """Return what is to be done by now, in order."""
        if self._gathered and self._gather_until <= now:
            self._flush_gathered(now)
        if self._aside:
            self._return_from_aside(now)
        actions: list[Action] = []
        queue = self._queue
        while queue and queue[0].at <= now:
            transit = queue[0]
            if transit.action is not None:
                actions.append(transit.action)
                queue.popleft()
                continue
            piece = transit.data[transit.start : transit.start + transit.piece]
            actions.append(SendBytes(self._link, self._direction, piece))
            self.held -= len(piece)
            transit.start += len(piece)
            transit.at += transit.gap
            if transit.start == len(transit.data):
                queue.popleft()
        return actions

    def next_due(self) -> int | None:
        """Return when `release` has something next, None for never."""
        times = [waiting.until for waiting in self._aside]
        if self._queue:
            times.append(self._queue[0].at)
        if self._gathered:
            times.append(self._gather_until)
        return min(times, default=None)


MAX_AWAITED = 4096
"""Requests of one direction that are remembered until their reply comes."""

OPPOSITE = {
    TraceDirection.TO_SERVER: TraceDirection.TO_CLIENT,
    TraceDirection.TO_CLIENT: TraceDirection.TO_SERVER,
}


@dataclass(slots=True)
class Prepared:
    """A rule with its place in the script, its chance and its counts."""

    number: int
    rule: faults.Rule
    msg_type: int | None
    chance: Random
    fitted: int = 0
    done: int = 0


@dataclass(slots=True)
class Awaited:
    """A request that the peer owes a reply, and what is to become of that reply."""

    lost_by: Prepared | None = None
    withheld_by: Prepared | None = None
    answer: bytes | None = None


def _ledgers() -> dict[TraceDirection, deque[Awaited]]:
    return {direction: deque(maxlen=MAX_AWAITED) for direction in TraceDirection}


@dataclass(slots=True)
class Traffic:
    """One connection: its lanes, and by direction of the request, who awaits what."""

    opened: int
    lanes: dict[TraceDirection, Lane]
    awaited: dict[TraceDirection, deque[Awaited]] = field(default_factory=_ledgers)


def pay(traffic: Traffic, asked: TraceDirection, now: int) -> None:
    """Send the proxy's own answers whose turn has come: replies keep the order of requests."""
    awaited = traffic.awaited[asked]
    while awaited and (answer := awaited[0].answer) is not None:
        awaited.popleft()
        traffic.lanes[OPPOSITE[asked]].put(answer, now)


def nanoseconds(ms: float) -> int:
    """Return milliseconds as integer nanoseconds."""
    return round(ms * 1e6)
