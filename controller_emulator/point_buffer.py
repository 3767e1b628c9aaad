"""The controller's buffer of legs that are not finished yet.

Owns its depth and the state at its far end. Knows no time.
"""

from __future__ import annotations

from collections import deque
from itertools import islice

from .legs import Leg


class PointBuffer:
    """First in, first out, of a fixed depth; the leg being moved along counts.

    Attributes:
        depth: most legs that it holds.
    """

    def __init__(self, depth: int) -> None:
        self.depth = depth
        self._legs: deque[Leg] = deque()

    def __len__(self) -> int:
        return len(self._legs)

    @property
    def room(self) -> int:
        """How many more legs fit."""
        return self.depth - len(self._legs)

    @property
    def span(self) -> int:
        """Motion in the buffer, from the start of its first leg [ns]."""
        return sum(leg.duration for leg in self._legs)

    @property
    def first(self) -> Leg | None:
        """The leg that is moved along, or will be first."""
        return self._legs[0] if self._legs else None

    @property
    def last(self) -> Leg | None:
        """The leg at the far end."""
        return self._legs[-1] if self._legs else None

    def ahead(self, count: int) -> list[Leg]:
        """Return the legs behind the first one, in order, `count` of them at most."""
        return list(islice(self._legs, 1, count + 1))

    def append(self, leg: Leg) -> None:
        """Add a leg; the caller has looked at `room`."""
        self._legs.append(leg)

    def drop_first(self) -> None:
        """Forget the leg that is finished."""
        self._legs.popleft()

    def close(self) -> None:
        """Let the motion end at rest at the last point, where its velocity is still open."""
        last = self.last
        if last is not None and last.end.velocity is None:
            last.end = last.end.with_velocity((0.0,) * len(last.end.position))

    def clear(self) -> int:
        """Forget everything and return how many legs that were."""
        count = len(self._legs)
        self._legs.clear()
        return count
