"""How fast each joint may get in a tick so that it still comes to rest inside its range.

Owns that rule. From speed v a joint comes to rest within B(v) = v²/2a + v T/2, T being the longest
tick: braking by a·dt a tick, B falls at each tick by at least the way that is gone, as
B(v) - B(w) - (v + w) dt/2 = a dt T/2 for w = v - a dt. So while the rest of the range is at least
B, it stays so, and the position, a trapezoid from tick to tick, never passes the end. A joint slows
within its margin by the same rule with the lesser deceleration that spreads the stop from its jog
speed over the margin.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

from .model import JogModel
from .point_speeds import stop_time
from .targets import LONGEST_STEP

Bound: TypeAlias = tuple[float, float, float]
"""The least and greatest velocity of a joint at the end of a tick, and its greatest change."""

ROUNDING = 1.0 + 1e-6
"""Of what an acceleration gives, so a stop ends in its last tick."""

_EVEN = 0.95  # of the acceleration, that an even stop takes
_STILL = 1e-4  # of the jog speed: slower is creeping towards the end of a range


class RangeEnds:
    """The ends of the ranges, for joints that are asked for certain speeds at most."""

    def __init__(self, model: JogModel, speeds: Sequence[float]) -> None:
        """Work out where the ends begin to matter.

        Args:
            model: the robot.
            speeds: (n,) greatest that is asked of each joint [rad/s or m/s].
        """
        self._model = model
        self._speeds = speeds
        joints = zip(speeds, model.limits.acceleration, model.margin, strict=True)
        self._clear = [_clear(speed, _EVEN * limit, margin) for speed, limit, margin in joints]
        self._low = [end + way for end, way in zip(model.lower, self._clear, strict=True)]
        self._high = [end - way for end, way in zip(model.upper, self._clear, strict=True)]
        self._dt = 0.0
        self._free: list[Bound] = []

    def bounds(
        self, dt: float, position: Sequence[float], velocity: Sequence[float]
    ) -> list[Bound]:
        """Return the velocities after a tick from which each joint still rests inside its range.

        Args:
            dt: length of the tick [s].
            position: (n,) where it begins [rad or m].
            velocity: (n,) there [rad/s or m/s].
        """
        model = self._model
        if dt != self._dt:
            gains = [limit * ROUNDING * dt for limit in model.limits.acceleration]
            self._dt, self._free = dt, [(-math.inf, math.inf, gain) for gain in gains]
        bounds = self._free
        joints = zip(position, velocity, self._speeds, self._low, self._high, strict=True)
        for joint, (place, now, speed, low, high) in enumerate(joints):
            if low < place < high and -speed <= now <= speed:
                continue
            if bounds is self._free:
                bounds = self._free.copy()
            bounds[joint] = self._bound(joint, place, now)
        return bounds

    def free_way(self, position: Sequence[float], velocity: Sequence[float]) -> float:
        """Return for how long joints can go on at a velocity and none be bound by an end.

        Nor be within the margin of the end that it goes to, nor get there in a stop, but for what a
        joint moves in two ticks: whatever share of the velocity they have, as long as they have
        gone no farther than that. 0 where one is beyond a limit, or too slow to tell.

        Args:
            position: (n,) where they are [rad or m].
            velocity: (n,) within the speeds asked for [rad/s or m/s].
        """
        model, way = self._model, math.inf
        stop = stop_time(model, velocity)
        for joint, (place, each) in enumerate(zip(position, velocity, strict=True)):
            if not model.limits.lower[joint] <= place <= model.limits.upper[joint]:
                return 0.0
            if each == 0.0:
                continue
            speed = abs(each)
            even = self._even(joint)
            if not even:
                return 0.0
            bound = speed * (0.5 * speed / even + 1.5 * LONGEST_STEP)
            needed = max(min(self._clear[joint], bound), model.margin[joint] + speed * stop)
            left = model.upper[joint] - place if each > 0.0 else place - model.lower[joint]
            way = min(way, (left - needed) / speed)
        return way

    def _bound(self, joint: int, place: float, now: float) -> Bound:
        """Return the bound of one joint that is near an end, or faster than is asked."""
        model, speed = self._model, self._speeds[joint]
        up, down = model.upper[joint] - place, place - model.lower[joint]
        margin, even = model.margin[joint], _EVEN * model.limits.acceleration[joint]
        clear = _clear(max(speed, now, -now), even, margin)
        least, most, gain = self._free[joint]
        if up <= clear or down <= clear:
            even = self._even(joint)
            still = _STILL * speed
            if up <= clear:
                most = _stoppable(up, now, even, self._dt)
                most = 0.0 if most < still else most
            if down <= clear:
                least = -_stoppable(down, -now, even, self._dt)
                least = 0.0 if least > -still else least
        return least, most, gain

    def _even(self, joint: int) -> float:
        """Return the deceleration at which a joint slows before the end of its range."""
        model, speed = self._model, self._speeds[joint]
        spread = speed * speed / (2.0 * model.margin[joint])
        return min(_EVEN * model.limits.acceleration[joint], spread)


def _clear(speed: float, even: float, margin: float) -> float:
    """Return how far from its ends a joint may do all that it is asked for.

    What an even stop from the greatest speed takes leaves no more to be asked.
    """
    fastest = speed + even * 2.0 * LONGEST_STEP
    return max(margin, fastest * fastest / (2.0 * even))


def _stoppable(left: float, speed: float, deceleration: float, dt: float) -> float:
    """Return the greatest speed after a tick from which a joint can rest within a way.

    The positive root of w²/2a + w (T + dt)/2 + v dt/2 - left, see the module's text.
    """
    linear = 0.5 * deceleration * (LONGEST_STEP + dt)
    root = linear * linear + 2.0 * deceleration * (left - 0.5 * speed * dt)
    return math.sqrt(root) - linear if root > linear * linear else 0.0
