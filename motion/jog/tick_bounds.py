"""What joint limits leave to one tick of a tool jog.

Owns the bounds between two set-points: |Δv| ≤ a dt, |v| ≤ v_max, and a way that differs from that
of the mean velocity by a dt²/4 at most, as it does for a joint that keeps to its acceleration at
every moment. They are what the last look before a set-point leaves asks for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

from ..limits import JointLimits

State: TypeAlias = tuple[Sequence[float], Sequence[float]]
"""(n,) position and (n,) velocity of a set-point."""

SPEED_RESERVE = 0.9995
"""Of a joint's speed at a set-point: within a tick it may be faster than at both ends."""

_STANDS = 1e-12  # by σ: a joint that does not move along the way
_SLACK = 1.0 - 1e-7


def speed_bounds(
    limits: JointLimits, rate: Sequence[float], before: Sequence[float], dt: float
) -> tuple[float, float]:
    """Return the least and the greatest dσ/dt; the least is greater where there is none.

    Args:
        limits: of the joints.
        rate: (n,) by σ where the tick ends.
        before: (n,) velocity where it begins.
        dt: its length [s].
    """
    least, most = 0.0, math.inf
    joints = zip(rate, before, limits.acceleration, limits.velocity, strict=True)
    for each, velocity, acceleration, top in joints:
        gain, fastest = acceleration * dt, SPEED_RESERVE * top
        lower, upper = velocity - gain, velocity + gain
        if lower < -fastest:
            lower = -fastest
        if upper > fastest:
            upper = fastest
        if each > _STANDS:
            lower, upper = lower / each, upper / each
        elif each < -_STANDS:
            lower, upper = upper / each, lower / each
        elif lower > 0.0 or upper < 0.0:
            return math.inf, 0.0
        else:
            continue
        if lower > least:
            least = lower
        if upper < most:
            most = upper
    return least, most


def is_even(limits: JointLimits, before: State, after: State, dt: float) -> bool:
    """Return whether joints that keep to their accelerations can go from one state to another."""
    most, half = 0.25 * _SLACK * dt * dt, 0.5 * dt
    joints = zip(*before, *after, limits.acceleration, strict=True)
    for start, speed, end, speed_after, limit in joints:
        way = end - start - half * (speed + speed_after)
        allowed = most * limit
        if way > allowed or way < -allowed:
            return False
    return True
