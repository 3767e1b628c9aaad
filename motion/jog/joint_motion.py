"""A joint jog as set-points: each joint by itself, and all together under the speed of the tool.

Owns two rules; those of the speed of tool and elbow are `point_speeds`'.

The end of a range. From speed v a joint comes to rest within B(v) = v²/2a + v T/2, T being the
longest tick: braking by a·dt a tick, B falls at each tick by at least the way that is gone, as
B(v) - B(w) - (v + w) dt/2 = a dt T/2 for w = v - a dt. So while the rest of the range is at least
B, it stays so, and the position, a trapezoid from tick to tick, never passes the end. A joint slows
within its margin by the same rule with the lesser deceleration that spreads the stop from its jog
speed over the margin.

The stop. A release scales the velocity to zero in the least time that all joints can; a joint that
would run out of its range so brakes by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

from ..errors import NoAssembly
from .collision_guard import SLOW
from .model import JogModel
from .nearness import SLOW_POSTURE
from .point_speeds import point_excess, stop_time
from .reasons import JogCause, JogReason
from .targets import LONGEST_STEP, JogCaps

Bounds: TypeAlias = list[tuple[float, float, float]]
"""For each joint the least and greatest velocity at the end of a tick, and its greatest change."""

_SCALINGS = 4
_NEAR = 2e-4  # rad or m
_STILL = 1e-4  # of the jog speed: slower is creeping towards the end of a range
_AT_END = 0.01  # of the margin: near enough to be told as held
_RECOVERY, _LEAST_RECOVERY = 1.02, 0.01  # of the share of the last tick, in each tick
_BELOW = 0.9995  # of the speed that the last trial says is allowed
_ROUNDING = 1.0 + 1e-6  # of what an acceleration gives, so a stop ends in its last tick


class JointMotion:
    """Moving joints.

    Attributes:
        position: (n,) the last set-point [rad or m].
        velocity: (n,) of it.
        scale: what limits leave of the asked speed, of the joint that they leave least.
        cause: what takes the rest.
    """

    def __init__(
        self, model: JogModel, position: Sequence[float], velocity: Sequence[float] | None = None
    ) -> None:
        self._model = model
        self.position = list(position)
        self.velocity = [0.0] * model.dof if velocity is None else list(velocity)
        self.scale = 1.0
        self.cause: JogCause | None = None
        self._share = 1.0  # of the asked velocity, that points left at the last tick
        self._clear = False  # whether all bodies were, where a stop at the last tick would end

    @property
    def at_rest(self) -> bool:
        """Whether the robot stands."""
        return not any(self.velocity)

    def release(self, dt: float) -> None:
        """Move on by one tick of the stop."""
        self.scale, self.cause = 1.0, None
        self._move(self._released(dt), dt)

    def step(self, dt: float, rates: Sequence[float], caps: JogCaps) -> None:
        """Move on by one tick towards a velocity.

        Args:
            dt: since the last set-point [s].
            rates: (n,) shares of the jog speeds.
            caps: that say what these are.
        """
        gain = caps.override * caps.joint_fraction
        speeds = [gain * limit for limit in self._model.limits.velocity]
        asked = [rate * speed for rate, speed in zip(rates, speeds, strict=True)]
        self.scale, self.cause = 1.0, None
        velocity = self._scaled(dt, asked, speeds, caps)
        self._move(velocity, dt)
        self._judge(asked, speeds)

    def _scaled(
        self, dt: float, asked: list[float], speeds: list[float], caps: JogCaps
    ) -> list[float]:
        """Return the next velocity, scaled until the tool and what is near allow it."""
        # What the last tick left is tried first, with a little more, so one trial mostly does.
        share = min(1.0, self._share * _RECOVERY + _LEAST_RECOVERY)
        self._share = 1.0
        bounds = self._bounds(dt, speeds)
        target = asked if share == 1.0 else [share * each for each in asked]
        blocked = self._blocked(dt, asked, bounds) if any(asked) else None
        if blocked is not None:
            left, self.cause, wanted = blocked
            if left <= 0.0:
                self.scale = 0.0
                return self._released(dt)
            target = [left * each for each in wanted]
            self.scale = min(1.0, _along(target, asked))
        for _ in range(_SCALINGS):
            velocity = self._next(target, bounds)
            excess, cause = self._point_excess(dt, velocity, caps.point_speed)
            if excess <= 1.0:
                return velocity
            target = [_BELOW * each / excess for each in velocity]
            self._share = max(_along(target, asked), 0.0)
            if self._share < self.scale:
                self.scale, self.cause = self._share, cause
            if self._is_near(target, velocity, dt) and self._next(target, bounds) == target:
                # So near, the speeds of points scale as the velocity does.
                return target
        return self._released(dt)

    def _is_near(self, target: Sequence[float], velocity: Sequence[float], dt: float) -> bool:
        near = _NEAR / (0.5 * dt)
        return all(abs(one - other) < near for one, other in zip(target, velocity, strict=True))

    def _next(self, asked: Sequence[float], bounds: Bounds) -> list[float]:
        """Return the velocity nearest to the asked one that accelerations and ranges allow.

        All joints change alike, so from rest they start in the asked direction; but for one that
        has to brake before the end of its range.

        Args:
            asked: (n,) velocity.
            bounds: of `_bounds`.
        """
        targets, share = [], 1.0
        for wanted, now, (least, most, gain) in zip(asked, self.velocity, bounds, strict=True):
            target = most if wanted > most else least if wanted < least else wanted
            change = target - now if target > now else now - target
            if change * share > gain:
                share = gain / change
            targets.append(target)
        if share == 1.0:
            return targets
        velocity = []
        for target, now, (least, most, gain) in zip(targets, self.velocity, bounds, strict=True):
            after = now + share * (target - now)
            after = most if after > most else least if after < least else after
            velocity.append(min(max(after, now - gain), now + gain))
        return velocity

    def _bounds(self, dt: float, speeds: Sequence[float]) -> Bounds:
        """Return the velocities after a tick from which each joint still rests inside its range.

        Args:
            dt: length of the tick [s].
            speeds: (n,) greatest that is asked of each joint [rad/s or m/s].
        """
        model = self._model
        bounds = []
        joints = zip(
            self.position,
            self.velocity,
            speeds,
            model.lower,
            model.upper,
            model.margin,
            model.limits.acceleration,
            strict=True,
        )
        for place, now, speed, lower, upper, margin, acceleration in joints:
            even = 0.95 * acceleration
            fastest = max(speed, now, -now) + even * 2.0 * LONGEST_STEP
            # What an even stop from the greatest speed takes leaves no more to be asked.
            clear = max(margin, fastest * fastest / (2.0 * even))
            up, down = upper - place, place - lower
            least, most = -math.inf, math.inf
            if up <= clear or down <= clear:
                even = min(even, speed * speed / (2.0 * margin))
                still = _STILL * speed
                if up <= clear:
                    most = _stoppable(up, now, even, dt)
                    most = 0.0 if most < still else most
                if down <= clear:
                    least = -_stoppable(down, -now, even, dt)
                    least = 0.0 if least > -still else least
            bounds.append((least, most, acceleration * _ROUNDING * dt))
        return bounds

    def _released(self, dt: float) -> list[float]:
        """Return the next velocity of the stop."""
        time = stop_time(self._model, self.velocity)
        share = 0.0 if time <= dt * _ROUNDING else 1.0 - dt / time
        scaled = [share * velocity for velocity in self.velocity]
        return self._next(scaled, self._bounds(dt, self._model.limits.velocity))

    def _move(self, velocity: list[float], dt: float) -> None:
        half = 0.5 * dt
        state = zip(self.position, self.velocity, velocity, strict=True)
        self.position = [place + half * (before + after) for place, before, after in state]
        self.velocity = velocity

    def _judge(self, asked: list[float], speeds: list[float]) -> None:
        """Note the joint that the end of its range slows most, if nothing slows more."""
        model = self._model
        for joint, wanted in enumerate(asked):
            if wanted == 0.0:
                continue
            place = self.position[joint]
            up = wanted > 0.0
            left = model.upper[joint] - place if up else place - model.lower[joint]
            if left >= model.margin[joint]:
                continue
            speed = abs(self.velocity[joint]) if self.velocity[joint] * wanted > 0.0 else 0.0
            share = max(left, 0.0) / model.margin[joint]
            held = speed == 0.0 and share <= _AT_END
            scale = 0.0 if held else math.sqrt(share) * speeds[joint] / abs(wanted)
            if scale < min(1.0, self.scale):
                bound = model.limits.upper[joint] if up else model.limits.lower[joint]
                self.scale = scale
                self.cause = JogCause(JogReason.JOINT_LIMIT, place, bound, joint)

    def _stop_at(
        self, velocity: Sequence[float], dt: float
    ) -> tuple[list[float], list[float], float]:
        """Return where a tick to a velocity ends, where a stop from there does, and its time."""
        half, time = 0.5 * dt, stop_time(self._model, velocity)
        stop = 0.5 * (max(LONGEST_STEP, time) + dt)
        state = zip(self.position, self.velocity, velocity, strict=True)
        here = [place + half * (before + after) for place, before, after in state]
        return here, [p + stop * each for p, each in zip(here, velocity, strict=True)], time

    def _point_excess(
        self, dt: float, velocity: list[float], limit: float
    ) -> tuple[float, JogCause | None]:
        here, there, time = self._stop_at(velocity, dt)
        return point_excess(self._model, here, there, velocity, limit, time)

    def _blocked(
        self, dt: float, asked: list[float], bounds: Bounds
    ) -> tuple[float, JogCause, list[float]] | None:
        """Return what the neighbourhood of the place where a stop would end leaves of a velocity.

        Returns:
            The share, why, and the velocity that it is of; None if it leaves all.
        """
        model, guard = self._model, self._model.guard
        if guard is None and not model.watches_posture:
            return None
        wanted = self._next(asked, bounds)
        here, there, stop = self._stop_at(wanted, dt)
        found: list[tuple[float, JogCause, list[float]]] = []
        after = None if guard is None else guard.look(there)
        was_clear, self._clear = self._clear, after is None or min(after.values()) >= SLOW
        # What can rest beyond `SLOW` after this tick and could after the last is not near here.
        if guard is not None and after is not None and not (was_clear and self._clear):
            before = guard.look(self.position)
            way = self.position, asked
            time = 0.5 * max(LONGEST_STEP, stop) + dt
            near = guard.nearing(before, after, way, time)
            if guard.in_contact(before):
                self._clear = False
            if near is None and guard.in_contact(before):
                # What parts in the end might first come nearer, or part more and come back.
                meanwhile = guard.look(here)
                near = guard.nearing(before, meanwhile, way, dt)
                near = near or guard.nearing(meanwhile, after, way, time)
            if near is not None:
                found.append((*near, wanted))
        if model.watches_posture:
            use = _posture_left(model, self.position, there)
            if use is not None:
                found.append((*use, asked))
        return min(found, key=lambda each: each[0] * max(map(abs, each[2])), default=None)


def _along(velocity: Sequence[float], asked: Sequence[float]) -> float:
    """Return which share of the asked velocity another one has along it."""
    along = sum(each * wanted for each, wanted in zip(velocity, asked, strict=True))
    return along / (sum(each * each for each in asked) or 1.0)


def _stoppable(left: float, speed: float, deceleration: float, dt: float) -> float:
    """Return the greatest speed after a tick from which a joint can rest within a way.

    The positive root of w²/2a + w (T + dt)/2 + v dt/2 - left, see the module's text.
    """
    linear = 0.5 * deceleration * (LONGEST_STEP + dt)
    root = linear * linear + 2.0 * deceleration * (left - 0.5 * speed * dt)
    return math.sqrt(root) - linear if root > linear * linear else 0.0


def _posture_left(
    model: JogModel, here: Sequence[float], there: Sequence[float]
) -> tuple[float, JogCause] | None:
    before = model.arm.posture(here)
    try:
        after = model.arm.posture(there)
    except NoAssembly:
        return None if before is None else (0.0, before.cause)
    if after is None or after.use <= SLOW_POSTURE:
        return None
    if before is not None and after.use <= before.use:
        return None
    return math.sqrt(max(0.0, (1.0 - after.use) / (1.0 - SLOW_POSTURE))), after.cause
