"""Breaks off what the tester does when the robot goes too far, or when the user has had enough.

Owns the fence around the robot's start and the one way in which a check is cut short: STOP leaves
first, then the check is cancelled. Knows no sockets; how STOP is sent is the target's business.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from typing import Any, TypeVar

from .watch import distance

_Result = TypeVar("_Result")

INTERRUPTED = "interrupted"
"""What is said of a check that was cut short by a signal, or not begun because of it."""


class BrokenOff(Exception):
    """What was being done was cut short; the text says why."""


class Guard:
    """One run's fence and its way to be cut short.

    Attributes:
        is_interrupted: the user wants no more.
        fence: so far from `home` the robot may be [rad or m]; None while nobody looks.
        breaches: how often it was farther.
    """

    def __init__(self, stop: Callable[[], None]) -> None:
        """Take the way to send STOP at once, on whatever connection is open."""
        self._stop = stop
        self._home: tuple[float, ...] = ()
        self._work: asyncio.Task[Any] | None = None
        self._reason = ""
        self.fence: float | None = None
        self.is_interrupted = False
        self.breaches = 0

    def put_up(self, home: tuple[float, ...], reach: float) -> None:
        """Put the fence around a position.

        Args:
            home: all ten slots [rad or m].
            reach: how far any joint may be from there [rad or m].
        """
        self._home, self.fence = home, reach

    def look(self, position: Sequence[float]) -> None:
        """Look at a reported position; break off where it is beyond the fence."""
        if self.fence is None or self._work is None or self._reason:
            return
        away = distance(position, self._home)
        if away > self.fence:
            self.breaches += 1
            self.break_off(
                f"the robot was {away:.4g} rad or m from where it stood at first, allowed are"
                f" {self.fence:.4g}; it was sent STOP"
            )

    def interrupt(self) -> None:
        """Cut the run short; what is under way ends, and nothing more is begun."""
        self.is_interrupted = True
        self.break_off(INTERRUPTED)

    def break_off(self, reason: str) -> None:
        """Send STOP and cancel what is under way, where anything is."""
        if self._work is None or self._reason:
            return
        self._reason = reason
        self._stop()
        self._work.cancel()

    async def over(self, work: Coroutine[Any, Any, _Result]) -> _Result:
        """Do something that may be cut short.

        Raises:
            BrokenOff: it was.
        """
        self._reason = ""
        task: asyncio.Task[_Result] = asyncio.create_task(work)
        self._work = task
        try:
            return await task
        except asyncio.CancelledError:
            if self._reason:
                raise BrokenOff(self._reason) from None
            raise
        finally:
            self._work = None
