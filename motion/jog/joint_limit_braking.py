"""Joint limit braking: the greatest speed of each joint from which it still rests inside its range.

Owns that rule. From speed v a joint comes to rest within B(v) = v²/2a + v T/2, where T is the
longest tick. Braking by a·dt a tick, B falls in each tick by at least the distance covered, as
B(v) - B(w) - (v + w) dt/2 = a dt T/2 for w = v - a dt. So while the rest of the range is at least
B, it stays so, and the position, a trapezoid from tick to tick, never passes the end. Within its
margin a joint slows by the same rule, with the lesser deceleration that spreads the stop from its
jog speed over the margin.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

from .jog_commands import LONGEST_STEP
from .jog_model import JogModel
from .point_speed_bounds import stop_time

Bound: TypeAlias = tuple[float, float, float]
"""The least and greatest velocity of a joint at the end of a tick, and its greatest change."""

ROUNDING = 1.0 + 1e-6
"""Factor on what an acceleration gives, so that rounding adds no further tick to a stop."""

_EVEN = 0.95  # of the acceleration limit: what a stop before the end of a range takes
_STILL = 1e-4  # of the jog speed: slower is creeping towards the end of a range


class JointLimitBraking:
    """Ends of the joint ranges, for joints that are asked for certain speeds at most."""

    def __init__(self, model: JogModel, speeds: Sequence[float]) -> None:
        """Compute where the ends begin to matter.

        Args:
            model: the robot.
            speeds: (n,) greatest speed that is asked of each joint [rad/s or m/s].
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
            position: (n,) where the tick begins [rad or m].
            velocity: (n,) there [rad/s or m/s].
        """
        model = self._model
        if dt != self._dt:
            gains = [limit * ROUNDING * dt for limit in model.limits.acceleration]
            self._dt, self._free = dt, [(-math.inf, math.inf, gain) for gain in gains]
        bounds = self._free
        joints = zip(position, velocity, self._speeds, self._low, self._high, strict=True)
        for joint, (place, now, speed, low, high) in enumerate(joints):
            # The usual case costs four comparisons a joint: nothing is computed away from the ends.
            if low < place < high and -speed <= now <= speed:
                continue
            if bounds is self._free:
                bounds = self._free.copy()
            bounds[joint] = self._bound(joint, place, now)
        return bounds

    def free_distance(self, position: Sequence[float], velocity: Sequence[float]) -> float:
        """Return how long joints can keep a velocity and none is bound by an end [s].

        In that time no joint enters the margin of the end that it approaches, nor would it in a
        stop, except for what it moves in two ticks. This holds for every share of the velocity, as
        long as the joints have gone no farther. 0 where a joint is beyond a limit, or too slow to
        tell.

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
        """Return the bound of one joint that is near an end, or faster than asked."""
        model, speed = self._model, self._speeds[joint]
        up, down = model.upper[joint] - place, place - model.lower[joint]
        margin, even = model.margin[joint], _EVEN * model.limits.acceleration[joint]
        clear = _clear(max(speed, now, -now), even, margin)
        least, most, gain = self._free[joint]
        if up <= clear or down <= clear:
            even = self._even(joint)
            # Near the end v T/2 dominates the stop, so each tick covers a share of the distance
            # left and none reaches the end: a joint slower than this stops where it is.
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
        # From the jog speed to rest within the margin, so that slow jogs brake gently.
        spread = speed * speed / (2.0 * model.margin[joint])
        return min(_EVEN * model.limits.acceleration[joint], spread)


def _clear(speed: float, even: float, margin: float) -> float:
    """Return how far from its ends a joint may do all that it is asked for.

    The path of an even stop from the greatest speed and two longest ticks more.
    """
    fastest = speed + even * 2.0 * LONGEST_STEP
    return max(margin, fastest * fastest / (2.0 * even))


def _stoppable(left: float, speed: float, deceleration: float, dt: float) -> float:
    """Return the greatest speed after a tick from which a joint can rest within a distance.

    The positive root of w²/2a + w (T + dt)/2 + v dt/2 - left, see the module docstring.
    """
    linear = 0.5 * deceleration * (LONGEST_STEP + dt)
    root = linear * linear + 2.0 * deceleration * (left - 0.5 * speed * dt)
    # Also 0 where `left` is NaN or used up by the tick: at its end a joint gets no speed towards
    # it.
    return math.sqrt(root) - linear if root > linear * linear else 0.0
