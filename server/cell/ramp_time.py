"""Time that a robot may need to come to rest once nothing moves it on."""

from __future__ import annotations

from fractions import Fraction
from math import ceil

from openpendant.motion.description.limits import JointLimits

LONGEST = 1.0
"""Whatever the joints, a robot that still moves after this is stopped [s]."""


def ramp_time(limits: JointLimits, tick: float) -> float:
    """Return R: how long a robot may ramp before that becomes a stop [s].

    A tool jog that is released at full speed brakes along its path for up to 1.3 times as long as
    its slowest joint alone would need, so 1.5 times is allowed, up to whole ticks, and two more for
    the way of the release.

    Args:
        tick: control tick [s].
    """
    slowest = max(v / a for v, a in zip(limits.velocity, limits.acceleration, strict=True))
    # Rounded first: 0.15 / 0.01 is a hair more than 15 ticks.
    ticks = ceil(round(1.5 * slowest / tick, 9)) + 2
    return min(LONGEST, float(ticks * Fraction(tick).limit_denominator(1_000)))
