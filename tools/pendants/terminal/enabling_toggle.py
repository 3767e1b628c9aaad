"""Enabling toggle (training): an enabling device for a keyboard without key-up events.

Owns the time after which the toggle releases itself: a few seconds without any key. No safety
device.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

TIMEOUT_NS = 5_000_000_000
"""The toggle lets go so long after the last key of any kind [ns]."""


@dataclass(slots=True)
class EnablingToggle:
    """The enabling device (training) of a terminal."""

    _until: int | None = None

    @property
    def is_on(self) -> bool:
        """True while the enabling device counts as held."""
        return self._until is not None

    def seconds_left(self, now: int) -> int:
        """Return the seconds until it releases itself, rounded up; 0 while it is off."""
        return 0 if self._until is None else max(0, math.ceil((self._until - now) / 1e9))

    def turn_on(self, now: int) -> None:
        """Hold the enabling device from now on [ns]."""
        self._until = now + TIMEOUT_NS

    def key(self, now: int) -> None:
        """Restart the time-out: a key shows that the user is present."""
        if self._until is not None and now < self._until:
            self._until = now + TIMEOUT_NS

    def turn_off(self) -> bool:
        """Release it; return True if it was held."""
        was_on, self._until = self.is_on, None
        return was_on

    def has_run_out(self, now: int) -> bool:
        """Return True if it must be released because no key was struck for too long."""
        return self._until is not None and now >= self._until
