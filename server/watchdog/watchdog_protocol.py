"""Watchdog protocol: orders, beats and answers between server and process, and their deadlines.

Owns the formats of the orders, sent once, of the beat that follows each tick, and of the process's
reports. Owns the watchdog's part of promise 26: how long beats may be missing, and which robots are
stopped then. `LoopMonitor` owns what the server does when it returns. Knows no socket, process or
clock (`watchdog_process` is the shell) and imports the standard library only, so that the child
starts fast.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Literal, NamedTuple

BEAT = struct.Struct("<QQB")
"""One bit for each cell whose robot may move, one for each whose controller says that it is
emulated, and which kind of beat it is."""

IS_BEAT, IS_FAREWELL, IS_UPDATE = 0, 1, 2
"""Kinds of a frame: start of a tick; end of the server in order; cells that may move, no beat."""

ANSWER = struct.Struct("<Q")
"""Report of the process through its own pipe: one bit for each cell whose robot it has just
stopped. It is repeated, mostly with no bit set, as the sign that the process is alive."""


class Deadlines(NamedTuple):
    """Longest times without a beat of the server before a robot is stopped [s].

    Attributes:
        real: for any controller.
        emulated: for a controller that reports to be emulated; at least `real`.
    """

    real: float
    emulated: float


@dataclass(frozen=True, slots=True)
class StopTarget:
    """Address and STOP bytes of one cell's controller.

    Attributes:
        stop: the bytes of its STOP, hexadecimal.
        is_kept: keep a connection up; else one is made when it is needed, because the controller
            takes only one at a time.
        answer: first bytes, behind its length, of a frame that answers STOP, hexadecimal.
        order: byte order of the length of a frame.
    """

    cell: str
    host: str
    port: int
    stop: str
    is_kept: bool
    answer: str
    order: Literal["little", "big"]


def orders(deadlines: Deadlines, targets: Sequence[StopTarget]) -> bytes:
    """Return the line that the server writes first.

    Args:
        targets: one for each cell, in their order.
    """
    content = {"deadlines": deadlines, "targets": [asdict(target) for target in targets]}
    return json.dumps(content).encode() + b"\n"


def read_orders(line: bytes) -> tuple[Deadlines, list[StopTarget]]:
    """Return the contents of a line that `orders` made."""
    content = json.loads(line)
    return Deadlines(*content["deadlines"]), [StopTarget(**target) for target in content["targets"]]


ALIVE_NS = 100_000_000
"""Period at which the watchdog process reports that it is alive."""

_SILENT_NS = 500_000_000
_STARTING_NS = 3_000_000_000

MOST_CELLS = 64
"""Cells that one watchdog can tell apart; a beat carries one bit for each."""


class BeatWatch:
    """The watchdog's decision: beats in, cells whose robots must be stopped out.

    A set of cells is an integer with one bit for each, the first cell's the lowest. Each cell has
    one of two deadlines: a controller that reports to be emulated gets the longer one.
    """

    def __init__(self, real_ns: int, emulated_ns: int, now: int) -> None:
        """Start waiting; nothing moves before the first beat.

        Args:
            real_ns: deadline of a beat where a controller may be a real one [ns].
            emulated_ns: deadline where it reports to be emulated [ns]; at least `real_ns`.
        """
        self._real_ns = real_ns
        self._emulated_ns = emulated_ns
        self._last_beat = now
        self._moving = 0
        self._emulated = 0
        self._stopped = 0  # of those that move, since the last beat

    def beat(self, moving: int, emulated: int, now: int) -> int | None:
        """Take a beat of the server.

        Args:
            moving: the cells whose robots may move until the next beat.
            emulated: the cells whose controllers say that they are emulated.

        Returns:
            The server's silence [ns] if a robot was stopped because of it, else None.
        """
        silence = now - self._last_beat
        was_stopped = bool(self._stopped)
        self._last_beat, self._stopped = now, 0
        self.update(moving, emulated)
        return silence if was_stopped else None

    def update(self, moving: int, emulated: int) -> None:
        """Take which cells may move from now on; the silence still counts from the last beat."""
        self._moving, self._emulated = moving, emulated

    def overdue(self, now: int) -> int:
        """Return the cells to stop because no beat came in time, each once per silence."""
        silence = now - self._last_beat
        if silence < self._real_ns:
            return 0
        return self._stop(self._moving if silence >= self._emulated_ns else self._impatient)

    def lost(self) -> int:
        """Return, once, the cells to stop because no beat can come any more."""
        return self._stop(self._moving)

    def _stop(self, cells: int) -> int:
        new = cells & ~self._stopped
        self._stopped |= new
        return new

    @property
    def _impatient(self) -> int:
        return self._moving & ~self._emulated

    def remaining(self, now: int) -> float | None:
        """Return the time to the next deadline [s]; None if there is none before the next beat."""
        if not self._moving & ~self._stopped:
            return None
        deadline = self._real_ns if self._impatient & ~self._stopped else self._emulated_ns
        return max(self._last_beat + deadline - now, 0) / 1e9


class AnswerWatch:
    """The server's check that its watchdog process is alive."""

    def __init__(self, period_ns: int) -> None:
        self._most_ns = 2 * period_ns
        self._silent = 0
        self._allowed = _STARTING_NS
        self._ticked = 0

    def begin(self, now: int) -> None:
        """Start the check of a new process, which gets more time for its first report."""
        self._silent, self._allowed, self._ticked = 0, _STARTING_NS, now

    def tick(self, now: int, *, has_reported: bool) -> bool:
        """Return True if the process has been silent for too long.

        Time in which the loop did not run must not count as silence of the process: each gap
        between two ticks counts as two periods at most.
        """
        self._silent += min(now - self._ticked, self._most_ns)
        self._ticked = now
        if has_reported:
            self._silent, self._allowed = 0, _SILENT_NS
        return self._silent >= self._allowed
