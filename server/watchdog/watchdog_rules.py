"""Watchdog rules: the decision to stop the robots of a silent server, without a process.

Owns the watchdog's part of promise 26: how long beats may be missing, and which robots are stopped
then. `loop_monitor` owns what the server does when it returns. Knows no socket, process or clock
(`watchdog_process` is the shell) and imports nothing, so that the child starts fast.
"""

from __future__ import annotations

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
        self._heard = now
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
        silence = now - self._heard
        was_stopped = bool(self._stopped)
        self._heard, self._stopped = now, 0
        self.news(moving, emulated)
        return silence if was_stopped else None

    def news(self, moving: int, emulated: int) -> None:
        """Take which cells may move from now on; the silence still counts from the last beat."""
        self._moving, self._emulated = moving, emulated

    def overdue(self, now: int) -> int:
        """Return the cells to stop because no beat came in time, each once per silence."""
        silence = now - self._heard
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
        return max(self._heard + deadline - now, 0) / 1e9


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

    def tick(self, now: int, *, was_heard: bool) -> bool:
        """Return True if the process has been silent for too long.

        Time in which the loop did not run must not count as silence of the process: each gap
        between two ticks counts as two periods at most.

        Args:
            was_heard: whether it said anything since the last tick.
        """
        self._silent += min(now - self._ticked, self._most_ns)
        self._ticked = now
        if was_heard:
            self._silent, self._allowed = 0, _SILENT_NS
        return self._silent >= self._allowed
