"""When a server that fell silent is stopped for: the rules of the watchdog, without a process.

Owns the watchdog's end of promise 26: for how long beats may stay away, who is stopped then, and
which late ticks are logged. What the server does when it comes back is `tick_watch`'s. No socket,
process or clock in here (`process` is the shell), and no import, so the child is up fast.
"""

from __future__ import annotations

LOGGED_LATENESS_NS = 30_000_000
"""A tick that is later than this is worth a line in the log."""

ALIVE_NS = 100_000_000
"""The watchdog process says so often that it is alive."""

_SILENT_NS = 500_000_000
_STARTING_NS = 3_000_000_000

MOST_CELLS = 64
"""Cells that one watchdog can tell apart; a beat carries one bit for each."""


class BeatWatch:
    """The watchdog's judgement: beats come in, robots that must be stopped come out.

    A set of cells is an integer with one bit for each, the first cell's the lowest.
    """

    def __init__(self, deadline_ns: int, now: int) -> None:
        """Begin to wait; nothing moves before the first beat."""
        self._deadline_ns = deadline_ns
        self._heard = now
        self._moving = 0
        self._is_answered = True

    def beat(self, moving: int, now: int) -> int | None:
        """Take a beat of the server.

        Args:
            moving: the cells whose robots may move until the next beat.
            now: monotonic time, ns.

        Returns:
            How long the server had been silent [ns] where it was stopped for, else None.
        """
        silence = now - self._heard
        was_stopped = not self._is_answered
        self._heard = now
        self._moving = moving
        self._is_answered = True
        return silence if was_stopped else None

    def news(self, moving: int) -> None:
        """Take note of which robots may move from now on; the silence is that since the beat."""
        self._moving = moving

    def overdue(self, now: int) -> int:
        """Return, once for each silence, the cells to be stopped because no beat came in time."""
        if now - self._heard < self._deadline_ns:
            return 0
        return self.lost()

    def lost(self) -> int:
        """Return, once, the cells to be stopped because no beat can come any more."""
        if not self._is_answered or not self._moving:
            return 0
        self._is_answered = False
        return self._moving

    def remaining(self, now: int) -> float | None:
        """Return for how long there is nothing to decide [s]; None for until the next beat."""
        if not self._is_answered or not self._moving:
            return None
        return max(self._heard + self._deadline_ns - now, 0) / 1e9


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


class LagLog:
    """Which late ticks are worth a line: those above 30 ms, one line a second."""

    def __init__(self, period_ns: int) -> None:
        """Make a log for a loop that ticks every `period_ns`."""
        self._period_ns = period_ns
        self._ticked: int | None = None
        self._told = 0
        self._worst = 0
        self._count = 0

    def tick(self, now: int) -> str:
        """Take note of a tick; return the line to log, empty for none."""
        before, self._ticked = self._ticked, now
        late = 0 if before is None else now - before - self._period_ns
        if late > LOGGED_LATENESS_NS:
            self._count += 1
            self._worst = max(self._worst, late)
        if not self._count or (self._told and now - self._told < 1_000_000_000):
            return ""
        text = (
            f"the control loop was late {self._count} times, by {self._worst / 1e6:.0f} ms at most"
        )
        self._told, self._worst, self._count = now, 0, 0
        return text
