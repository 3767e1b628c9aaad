"""Enabling (training) by a toggle, for a device whose keys cannot be held.

Owns when the toggle lets go by itself: a few seconds without any key. No safety device.
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
        """Whether it counts as held."""
        return self._until is not None

    def seconds_left(self, now: int) -> int:
        """Return the seconds until it lets go by itself, rounded up; 0 while it is off."""
        return 0 if self._until is None else max(0, math.ceil((self._until - now) / 1e9))

    def turn_on(self, now: int) -> None:
        """Hold it from now on."""
        self._until = now + TIMEOUT_NS

    def key(self, now: int) -> None:
        """Take note of a key: somebody is there."""
        if self._until is not None and now < self._until:
            self._until = now + TIMEOUT_NS

    def turn_off(self) -> bool:
        """Let it go; return whether it was held."""
        was_on, self._until = self.is_on, None
        return was_on

    def has_run_out(self, now: int) -> bool:
        """Tell whether it must be let go, because nobody has touched a key for too long."""
        return self._until is not None and now >= self._until
