"""Jog keys of a device that tells when a key goes down, and never when it comes up.

Owns how long a key counts as held, and which keys count as struck together. No axis is ever asked
to move longer than `PULSE_NS` after its own last key stroke: each stroke makes a pulse that ends by
itself, and the auto-repeat of a held key makes the next one in time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from .keyboard import AxisKey

PULSE_NS = 250_000_000
"""A key counts as held for so long after its last stroke; the server's longest deadline."""

_SHORTEST_NS = 50_000_000
"""The server's shortest deadline: a key with less left takes no part in a pulse."""

CHORD_NS = 80_000_000
"""Keys struck within this time of the first make one step together."""

Axes = tuple[tuple[int, int], ...]


class JogKind(Enum):
    """What a jog key does."""

    STEP = "step"
    HOLD = "hold"


@dataclass(slots=True)
class JogKeys:
    """The jog keys that count as held, or that wait to make one step."""

    _struck: dict[int, tuple[int, int]] = field(default_factory=dict)
    _gathered: dict[int, int] = field(default_factory=dict)
    _since: int = 0

    def pulse(self, key: AxisKey, now: int) -> tuple[Axes, float]:
        """Take a stroke of a held key.

        Args:
            key: the key.
            now: monotonic time [ns].

        Returns:
            Which axes to move, and for how long [s]: until the first of their keys runs out.
        """
        self._struck[key.axis] = (key.sign, now)
        left = {axis: PULSE_NS - (now - at) for axis, (_, at) in self._struck.items()}
        for axis in [axis for axis, rest in left.items() if rest < _SHORTEST_NS]:
            del self._struck[axis], left[axis]
        axes = tuple((axis, sign) for axis, (sign, _) in sorted(self._struck.items()))
        return axes, min(left.values()) / 1e9

    def gather(self, key: AxisKey, now: int) -> None:
        """Take a stroke that shall make a step; the other direction of an axis replaces the first.

        Args:
            key: the key.
            now: monotonic time [ns].
        """
        if not self._gathered:
            self._since = now
        self._gathered[key.axis] = key.sign

    def gathered(self, now: int) -> Axes:
        """Return the axes of a step once no other key can join it; empty before."""
        if not self._gathered or now - self._since < CHORD_NS:
            return ()
        axes, self._gathered = tuple(sorted(self._gathered.items())), {}
        return axes

    def let_go(self) -> None:
        """Forget every key."""
        self._struck.clear()
        self._gathered.clear()
