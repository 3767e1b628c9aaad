"""A motion between two states whose accelerations step once, at one time for all joints.

Owns what takes the quintic's place where the sender changes its acceleration along a bent path
between two points: the quintic smooths the step, and swings beyond the bounds on either side of it.
Knows nothing of what is done where this is out of bounds too.
"""

from __future__ import annotations

from typing import NamedTuple

from .joint_motion import Bounds, End, Pieces
from .polynomials import cubic

_EARLIEST = 0.02
"""Share of the duration; a step nearer than this to either end is not told from rounding."""

_TRIED = 4
"""Places tried for a step on either side of the best one known."""

_CLOSER = 3
"""How often they are tried, each time between the neighbours of the best."""


def stepped(
    h: float, starts: list[End], ends: list[End], bounds: tuple[Bounds, ...]
) -> tuple[Pieces, ...] | None:
    """Return accelerations that change evenly but for one step, at one time for all joints.

    They begin and end as stated. That is what a sender does which between two points of a bent path
    changes the acceleration along it: its joints' accelerations step at that time, and change
    slowly before and after, because the path bends. The time is that of the least acceleration,
    where that is none beyond those stated, of the least change besides the step. None where
    accelerations are open, and out of bounds.
    """
    gains = []
    for start, end, bound in zip(starts, ends, bounds, strict=True):
        gain = _gain(h, start, end, bound.acceleration)
        if gain is None:
            return None
        gains.append(gain)
    switch = h * _gentlest_share(h, gains)
    joints = []
    for start, end, bound in zip(starts, ends, bounds, strict=True):
        middle = _at_step(h, start, end, switch)
        first = cubic(switch, start, middle, bound)
        second = cubic(h - switch, middle, end, bound)
        if first is None or second is None:
            return None
        joints.append(((0.0, first), (switch, second)))
    return tuple(joints)


class _Gain(NamedTuple):
    """What one joint gains over a segment, in units of its acceleration limit.

    Attributes:
        before: acceleration stated at the start.
        after: acceleration stated at the end.
        velocity: gained over that at the start [s].
        way: gained over an even motion with that velocity [s²].
    """

    before: float
    after: float
    velocity: float
    way: float


def _gain(h: float, start: End, end: End, limit: float) -> _Gain | None:
    if start.acceleration is None or end.acceleration is None:
        return None
    return _Gain(
        start.acceleration / limit,
        end.acceleration / limit,
        (end.velocity - start.velocity) / limit,
        (end.position - start.position - start.velocity * h) / limit,
    )


def _gentlest_share(h: float, gains: list[_Gain]) -> float:
    """Return the share of the duration after which a step needs the least acceleration."""
    share, apart = 0.5, (0.5 - _EARLIEST) / _TRIED
    for _ in range(_CLOSER):
        tried = [share + place * apart for place in range(-_TRIED, _TRIED + 1)]
        near = [x for x in tried if _EARLIEST <= x <= 1 - _EARLIEST]
        share = min(near, key=lambda share: _sharpness(h, share * h, gains))
        apart /= _TRIED
    return share


def _sharpness(h: float, switch: float, gains: list[_Gain]) -> tuple[float, float]:
    """Return the greatest acceleration, and the greatest change of one besides the step.

    Accelerations that stay as stated for t before the step, and for u after it, lack a velocity r
    and a way w. They make up for both if they change by (6 w - 4 u r) / t h before it and by
    (6 w - (2 t + 6 u) r) / u h after it.
    """
    t, u = switch, h - switch
    early, late = t * (t / 2 + u), u * u / 2
    to_step, from_step = 1 / (t * h), 1 / (u * h)
    most = change = 0.0
    for before, after, velocity, way in gains:
        r = velocity - before * t - after * u
        w = 6 * (way - before * early - after * late)
        first, second = (w - 4 * u * r) * to_step, (w - (2 * t + 6 * u) * r) * from_step
        most = max(most, abs(before), abs(after), abs(before + first), abs(after - second))
        change = max(change, abs(first), abs(second))
    return most, change


def _at_step(h: float, start: End, end: End, switch: float) -> End:
    """Return where a joint is at the step, and how fast."""
    gain = _gain(h, start, end, 1.0)
    assert gain is not None
    t, u = switch, h - switch
    r = gain.velocity - gain.before * t - gain.after * u
    w = gain.way - gain.before * t * (t / 2 + u) - gain.after * u * u / 2
    rate = (6 * w - 4 * u * r) / (t * t * h)
    way = start.velocity * t + t * t * (gain.before / 2 + rate * t / 6)
    return End(start.position + way, start.velocity + t * (gain.before + rate * t / 2))
