"""Stop keys and enabling toggle (training) of the terminal pendant; neither is a safety device.

A software stop is pending from the key stroke until the server has confirmed it. Owns when a stop
is sent, when it is sent again, and when the screen must say that it is not confirmed. A dead link
can go unnoticed for seconds; therefore a stop counts as not received until its verdict or the event
of a latched stop arrives. The toggle is an enabling device for a keyboard without key-up events: it
releases itself some time after the last key of any kind.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from . import wording
from .cell_view import CellView
from .commands import StopRobot
from .messages import Messages

ANSWER_NS = 300_000_000
"""A stop that is not confirmed so long after its key was struck is called unconfirmed [ns]."""

AGAIN_NS = 1_000_000_000
"""It is sent again so long after it was sent last, on the same connection too [ns]."""

REMEDY = "use the robot's own hardware stop button"


class StopKey:
    """The stop keys of one pendant."""

    def __init__(self, cell: CellView, messages: Messages) -> None:
        self._cell = cell
        self._messages = messages
        self._press = 0
        self._by = ""
        self._since: int | None = None
        self._sent = 0
        self._refusal = ""
        self._is_told = False

    @property
    def is_owed(self) -> bool:
        """True while a stop was pressed and is not confirmed."""
        return self._since is not None

    @property
    def is_awaited(self) -> bool:
        """True while a pending stop was not refused, so that its verdict may still arrive."""
        return self.is_owed and not self._refusal

    def struck(self, by: str, now: int) -> list[StopRobot]:
        """Take a stroke of a key.

        Args:
            by: name of the key, the reason of the stop.

        Returns:
            The stop, to be sent at once, with or without a login; nothing without a link:
            `linked` returns it later.
        """
        self._press += 1
        self._by = by
        self._refusal, self._is_told = "", False
        if self._since is None:
            self._since = now
        self._sent = now
        self._tell(now)
        return [StopRobot(self._by, self._press)] if self._cell.is_greeted else []

    def linked(self) -> list[StopRobot]:
        """Return the pending stop, which must be sent first on a new connection."""
        if not self.is_owed:
            return []
        self._refusal = ""
        return [StopRobot(f"{self._by}, sent again", self._press)]

    def tick(self, now: int) -> list[StopRobot]:
        """Advance the time; a stop that becomes doubtful is reported once.

        Returns:
            The stop, while it is pending; a second one does no harm. A refused stop is not repeated
            on the same connection.
        """
        self._tell(now)
        waits = self.is_awaited and self._cell.is_greeted
        if not waits or now - self._sent < AGAIN_NS:
            return []
        self._sent = now
        return self.linked()

    def _tell(self, now: int) -> None:
        if not self._is_told and (doubt := self.doubt(now)):
            self._is_told = True
            self._messages.add(doubt)

    def confirmed(self, press: int) -> None:
        """Take the verdict that a stroke's stop is latched; ignore that of an earlier stroke."""
        if press == self._press:
            self._settle()

    def latched(self) -> None:
        """Take the event that a stop is latched, requested by any client."""
        self._settle()

    def refused(self, press: int, why: str) -> None:
        """Take the verdict that a stroke's stop was refused."""
        if self.is_owed and press == self._press:
            self._refusal = why

    def _settle(self) -> None:
        if self.is_owed and self._is_told:
            self._messages.add("the stop is confirmed")
        self._since, self._refusal, self._is_told = None, "", False

    def doubt(self, now: int) -> str:
        """Return the warning of an unconfirmed stop, with reason and remedy; empty for none."""
        why = "" if self._since is None else self._why(self._since, now)
        return f"STOP NOT CONFIRMED, {REMEDY}: {why}" if why else ""

    def _why(self, since: int, now: int) -> str:
        if not self._cell.is_greeted:
            return f"no link, it leaves again once linked ({self._cell.absence})"
        if self._refusal:
            return self._refusal
        if not self._cell.is_connected:
            return f"sent, and not answered yet ({self._cell.absence})"
        if self._cell.is_silent(now):
            age = self._cell.message_age(now)
            return "no state came yet" if age is None else f"the server is silent for {age:.1f} s"
        if self._cell.is_stale(now):
            return wording.staleness(self._cell, now)
        waited = now - since
        return f"no answer for {waited / 1e9:.1f} s" if waited >= ANSWER_NS else ""


TIMEOUT_NS = 5_000_000_000
"""The toggle lets go so long after the last key of any kind [ns]."""

EMULATED_TIMEOUT_NS = 30_000_000_000
"""Likewise, where the controller is known to be emulated: nobody can be hurt there [ns]."""

WARNING_NS = 5_000_000_000
"""So long before the longer one is over a warning stands [ns]."""


@dataclass(slots=True)
class EnablingToggle:
    """The enabling device (training) of a terminal.

    Attributes:
        timeout_ns: it lets go so long after the last key.
        why_off: why it was let go last; empty while it is held.
    """

    timeout_ns: int = TIMEOUT_NS
    why_off: str = ""
    _struck: int | None = None

    @property
    def is_on(self) -> bool:
        """True while the enabling device counts as held."""
        return self._struck is not None

    def seconds_left(self, now: int) -> int:
        """Return the seconds until it releases itself, rounded up; 0 while it is off."""
        return math.ceil(self._left(now) / 1e9)

    def _left(self, now: int) -> int:
        return 0 if self._struck is None else max(0, self._struck + self.timeout_ns - now)

    def warning(self, now: int) -> str:
        """Return the warning that it will soon release itself; empty for none."""
        left = self._left(now)
        if self.timeout_ns <= WARNING_NS or not 0 < left <= WARNING_NS:
            return ""
        seconds = self.seconds_left(now)
        return f"enabling (training) lapses in {seconds} s, and what moves stops: any key renews it"

    def turn_on(self, now: int) -> None:
        """Hold the enabling device from now on [ns]."""
        self._struck, self.why_off = now, ""

    def key(self, now: int) -> None:
        """Restart the time-out: a key shows that the user is present."""
        if self.is_on and not self.has_run_out(now):
            self._struck = now

    def turn_off(self, why: str) -> bool:
        """Release it; return True if it was held.

        Args:
            why: what the abort of a motion is explained by.
        """
        was_on = self.is_on
        if was_on:
            self.why_off = why
        self._struck = None
        return was_on

    def has_run_out(self, now: int) -> bool:
        """Return True if it must be released because no key was struck for too long."""
        return self.is_on and self._left(now) == 0
