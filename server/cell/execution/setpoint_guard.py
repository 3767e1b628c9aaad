"""Set-point guard: an independent check of each sample just before it is sent.

A trajectory was certified as a whole; this checks every single sample once more, against the limits
and against the sample that left before it, with its own few lines of arithmetic. What fails here is
a fault of ours (a mixed-up trajectory, a skipped sample), and the motion is aborted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.trajectory.trajectory import Row
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal

VELOCITY_SLACK = 1.0 + 1e-6
ACCELERATION_SLACK = 1.0 + 1e-3

_TIME_ROUNDING = 1e-9
_SURELY = 1.0 - 1e-9  # what rounding may do to a distance, many times over


class SetpointGuard:
    """Checks the set-points of one motion in the order in which they leave."""

    def __init__(self, limits: JointLimits, start: Sequence[float] | None = None) -> None:
        """Make a check that has seen no sample yet; the first one must be at rest.

        Args:
            start: (n,) where a jog begins [rad or m]. A joint that is beyond its limit there may
                come back and never go farther; None where all joints must be inside.
        """
        self._limits = limits
        self._fastest = [speed * VELOCITY_SLACK for speed in limits.velocity]
        self._hardest = [gain * ACCELERATION_SLACK for gain in limits.acceleration]
        self._last: Row | None = None
        self._slowest = min(self._fastest) * _SURELY
        self._least_gain = min(self._hardest) * _SURELY
        self._seen_at = self._rest = [0.0] * len(limits.velocity)
        self._room = -1.0
        self._lower, self._upper = list(limits.lower), list(limits.upper)
        self._begins_outside = False
        if start is not None:
            self._lower = [min(pair) for pair in zip(limits.lower, start, strict=True)]
            self._upper = [max(pair) for pair in zip(limits.upper, start, strict=True)]
            bounds = (*self._lower, *self._upper)
            self._begins_outside = bounds != (*limits.lower, *limits.upper)

    def check(self, row: Row) -> Refusal | None:
        """Check the next sample."""
        last = self._last
        if last is None:
            # The first one is compared with rest at its own place.
            last = Row(row.time, row.position, self._rest, [])
            step = 0.0
        else:
            step = row.time - last.time
            if not step > _TIME_ROUNDING:
                return _refusal("does not advance in time", -1, row.time, last.time)
        if not self._is_surely_sound(row, last, step):
            refusal = self._fault(row, last, step)
            if refusal is not None:
                return refusal
            if math.dist(row.position, self._seen_at) > self._room:
                self._look_around(row)
        self._last = row
        return None

    def _is_surely_sound(self, row: Row, last: Row, step: float) -> bool:
        """Return True if a sample breaks nothing that `_fault` looks at, as far as a glance tells.

        A glance takes half the time, and nearly every sample passes it. No joint differs by more
        than the plain distance of all of them, so that none breaks its own limit where that
        distance is within the least limit of all. None leaves its range that has gone no farther,
        since all were looked at one by one, than the one next to its end was away from it then.
        """
        gain = self._least_gain * step
        position, velocity = row.position, row.velocity
        if not (
            math.dist(velocity, last.velocity) <= gain
            and math.hypot(*velocity) <= self._slowest
            and math.dist(position, self._seen_at) <= self._room
        ):
            return False
        half = 0.5 * step
        joints = zip(last.position, velocity, last.velocity, strict=True)
        planned = [place + half * (velocity + speed) for place, velocity, speed in joints]
        return math.dist(position, planned) <= 0.25 * gain * step

    def _fault(self, row: Row, last: Row, step: float) -> Refusal | None:
        """Return what the first joint that breaks something breaks; None where none does."""
        joints = zip(
            row.position,
            row.velocity,
            last.position,
            last.velocity,
            self._lower,
            self._upper,
            self._fastest,
            self._hardest,
            strict=True,
        )
        for joint, row_of_joint in enumerate(joints):
            position, velocity, place, speed, lower, upper, fastest, hardest = row_of_joint
            # Each comparison is written so that a value that is not a number fails.
            if not lower <= position <= upper:
                bound = lower if position < lower else upper
                return _refusal("is out of range", joint, position, bound)
            if not -fastest <= velocity <= fastest:
                limit = self._limits.velocity[joint]
                return _refusal("is too fast", joint, velocity, limit)
            gain = hardest * step
            change = velocity - speed
            if not -gain <= change <= gain:
                return _refusal("changes its velocity too fast", joint, change, gain)
            # Between two samples the acceleration stays within its limit, so the way differs from
            # that of the mean velocity by a quarter of what the limit allows at most.
            way = position - place - 0.5 * (velocity + speed) * step
            most = 0.25 * gain * step + _TIME_ROUNDING
            if not -most <= way <= most:
                return _refusal("jumps", joint, position, place)
        return None

    def _look_around(self, row: Row) -> None:
        """Note how far the joints may go from here, each in its range."""
        if self._begins_outside:
            self._close_in(row)
            return
        joints = zip(row.position, self._lower, self._upper, strict=True)
        self._room = min(min(at - lower, upper - at) for at, lower, upper in joints) * _SURELY
        self._seen_at = row.position

    def _close_in(self, row: Row) -> None:
        """Let a joint that came back towards its range not leave again."""
        limits = self._limits
        for joint, position in enumerate(row.position):
            self._lower[joint] = min(limits.lower[joint], max(self._lower[joint], position))
            self._upper[joint] = max(limits.upper[joint], min(self._upper[joint], position))


def _refusal(what: str, joint: int, value: float, limit: float) -> Refusal:
    where = "the set-point" if joint < 0 else f"joint {joint + 1}"
    text = f"{where} {what}: {value:g} against {limit:g}; it was not sent"
    return Refusal(VerdictCode.CERTIFICATE_REFUSED, text, joint, value, limit)
