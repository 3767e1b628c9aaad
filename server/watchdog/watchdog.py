"""When a server that fell silent is stopped for: the rules of the watchdog, without a process.

Owns the watchdog's end of promise 26: for how long beats may stay away, and who is stopped then.
What the server does when it comes back is `tick_watch`'s. No socket, process or clock in here
(`process` is the shell), and no import, so the child is up fast.
"""

from __future__ import annotations

ALIVE_NS = 100_000_000
"""The watchdog process says so often that it is alive."""

_SILENT_NS = 500_000_000
_STARTING_NS = 3_000_000_000

MOST_CELLS = 64
"""Cells that one watchdog can tell apart; a beat carries one bit for each."""


class BeatWatch:
    """The watchdog's judgement: beats come in, robots that must be stopped come out.

    A set of cells is an integer with one bit for each, the first cell's the lowest. Each cell has
    one of two deadlines: a controller that says it is emulated is given more time.
    """

    def __init__(self, real_ns: int, emulated_ns: int, now: int) -> None:
        """Begin to wait; nothing moves before the first beat.

        Args:
            real_ns: how long a beat is waited for where a controller may be a real one.
            emulated_ns: the same where it says that it is emulated; no less.
            now: monotonic time, ns.
        """
        self._real_ns = real_ns
        self._emulated_ns = emulated_ns
        self._heard = now
        self._moving = 0
        self._emulated = 0
        self._stopped = 0  # of those that move, since the last beat

    def beat(self, moving: int, emulated: int, now: int) -> int | None:
        """Take a beat of the server.

        Args:
            moving: the cells whose robots may move until the next beat.
            emulated: the cells whose controllers say that they are emulated.
            now: monotonic time, ns.

        Returns:
            How long the server had been silent [ns] where it was stopped for, else None.
        """
        silence = now - self._heard
        was_stopped = bool(self._stopped)
        self._heard, self._stopped = now, 0
        self.news(moving, emulated)
        return silence if was_stopped else None

    def news(self, moving: int, emulated: int) -> None:
        """Take note of what is so from now on; the silence is that since the beat."""
        self._moving, self._emulated = moving, emulated

    def overdue(self, now: int) -> int:
        """Return the cells to be stopped because no beat came in time, each once a silence."""
        silence = now - self._heard
        if silence < self._real_ns:
            return 0
        return self._stop(self._moving if silence >= self._emulated_ns else self._impatient)

    def lost(self) -> int:
        """Return, once, the cells to be stopped because no beat can come any more."""
        return self._stop(self._moving)

    def _stop(self, cells: int) -> int:
        new = cells & ~self._stopped
        self._stopped |= new
        return new

    @property
    def _impatient(self) -> int:
        return self._moving & ~self._emulated

    def remaining(self, now: int) -> float | None:
        """Return for how long there is nothing to decide [s]; None for until the next beat."""
        if not self._moving & ~self._stopped:
            return None
        deadline = self._real_ns if self._impatient & ~self._stopped else self._emulated_ns
        return max(self._heard + deadline - now, 0) / 1e9


class AnswerWatch:
    """The server's judgement of its watchdog: is it alive, as far as the loop could have heard?"""

    def __init__(self, period_ns: int) -> None:
        """Make a watch for a loop that ticks every `period_ns`."""
        self._most_ns = 2 * period_ns
        self._silent = 0
        self._allowed = _STARTING_NS
        self._ticked = 0

    def begin(self, now: int) -> None:
        """Take note that another process starts."""
        self._silent, self._allowed, self._ticked = 0, _STARTING_NS, now

    def tick(self, now: int, *, was_heard: bool) -> bool:
        """Tell whether the process has been silent for too long.

        Time in which the loop did not run is not the process's: of each gap between two ticks two
        periods count at most.

        Args:
            now: monotonic time, ns.
            was_heard: whether it said anything since the last tick.
        """
        self._silent += min(now - self._ticked, self._most_ns)
        self._ticked = now
        if was_heard:
            self._silent, self._allowed = 0, _SILENT_NS
        return self._silent >= self._allowed
