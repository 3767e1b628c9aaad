"""The way to one point: what the buffer holds and the interpolator runs.

Owns the state handed from one point to the next. Plain data; the rules that make a leg from a point
are `admission`'s.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from .float32 import NANOSECONDS
from .joint_motion import Bounds, End, ends
from .segment import Segment


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
    _ends: list[End] | None = field(default=None, init=False, repr=False, compare=False)

    @classmethod
    def at_rest(cls, position: tuple[float, ...]) -> Knot:
        """Return the state of a robot that stands."""
        zeros = (0.0,) * len(position)
        return cls(position, zeros, None, zeros, 0.0)

    def with_velocity(self, velocity: tuple[float, ...]) -> Knot:
        """Return the state with a velocity in place of its own."""
        return Knot(self.position, velocity, self.acceleration, self.mean_velocity, self.span)

    def ends(self) -> list[End]:
        """Return the state of each joint; the velocity must be known.

        Two legs ask for it: what ends one begins the next.
        """
        if self._ends is None:
            assert self.velocity is not None
            self._ends = ends(self.position, self.velocity, self.acceleration)
        return self._ends


@dataclass(slots=True)
class Leg:
    """One buffered point and the way to it.

    Attributes:
        sequence: number of the point, for the referee.
        duration: [ns]; 0 where the point is where the robot stands already.
        end: state to be reached.
        bounds: bounds of each joint on the way.
        segment: the motion, None while it depends on a velocity that is open.
    """

    sequence: int
    duration: int
    end: Knot
    bounds: tuple[Bounds, ...]
    segment: Segment | None

    @property
    def seconds(self) -> float:
        """Duration in seconds."""
        return self.duration / NANOSECONDS
