"""Motion legs, each leading to one point, and the buffer of legs that are not finished yet.

Owns the state handed from one point to the next, the depth of the buffer and the state at its far
end. The rules that make a leg from a point are `admission`'s. Knows no time.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from itertools import islice

from ..float32 import NANOSECONDS
from .polynomials import Bounds, SegmentEnd, ends
from .segment import MotionSegment


@dataclass(slots=True)
class Knot:
    """State at a point; never changed, so that legs may share it.

    Not frozen, as that takes four times as long to make, for every point that comes in.

    Attributes:
        position: (n,) [rad or m].
        velocity: (n,) […/s]; None while it is open, to be chosen when the leg begins.
        acceleration: (n,) […/s²], None where the sender left it open.
        mean_velocity: (n,) over the leg that led here […/s].
        span: duration of that leg [s], 0 after a rest.
    """

    position: tuple[float, ...]
    velocity: tuple[float, ...] | None
    acceleration: tuple[float, ...] | None
    mean_velocity: tuple[float, ...]
    span: float
    _ends: list[SegmentEnd] | None = field(default=None, init=False, repr=False, compare=False)

    @classmethod
    def at_rest(cls, position: tuple[float, ...]) -> Knot:
        """Return the state of a robot that stands."""
        zeros = (0.0,) * len(position)
        return cls(position, zeros, None, zeros, 0.0)

    def with_velocity(self, velocity: tuple[float, ...]) -> Knot:
        """Return the state with a velocity in place of its own."""
        return Knot(self.position, velocity, self.acceleration, self.mean_velocity, self.span)

    def ends(self) -> list[SegmentEnd]:
        """Return the state of each joint; the velocity must be known.

        Two legs ask for it: what ends one begins the next.
        """
        if self._ends is None:
            assert self.velocity is not None
            self._ends = ends(self.position, self.velocity, self.acceleration)
        return self._ends


@dataclass(slots=True)
class MotionLeg:
    """One buffered point and the way to it.

    Attributes:
        duration: [ns]; 0 where the point is where the robot stands already.
        segment: the motion, None while it depends on a velocity that is open.
    """

    sequence: int
    duration: int
    end: Knot
    bounds: tuple[Bounds, ...]
    segment: MotionSegment | None

    @property
    def seconds(self) -> float:
        """Duration in seconds."""
        return self.duration / NANOSECONDS


class PointBuffer:
    """First in, first out, of a fixed depth; the leg being moved along counts."""

    def __init__(self, depth: int) -> None:
        self.depth = depth
        self._legs: deque[MotionLeg] = deque()

    def __len__(self) -> int:
        return len(self._legs)

    @property
    def room(self) -> int:
        """Number of legs that still fit."""
        return self.depth - len(self._legs)

    @property
    def span(self) -> int:
        """Motion in the buffer, from the start of its first leg [ns]."""
        return sum(leg.duration for leg in self._legs)

    @property
    def first(self) -> MotionLeg | None:
        """The leg that is moved along, or will be first."""
        return self._legs[0] if self._legs else None

    @property
    def last(self) -> MotionLeg | None:
        """The leg at the far end."""
        return self._legs[-1] if self._legs else None

    def ahead(self, count: int) -> list[MotionLeg]:
        """Return the legs behind the first one, in order, `count` of them at most."""
        return list(islice(self._legs, 1, count + 1))

    def append(self, leg: MotionLeg) -> None:
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
