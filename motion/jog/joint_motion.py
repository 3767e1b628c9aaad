"""A joint jog as set-points: each joint by itself, and all together under the speed of the tool.

Owns how the joints change their velocities together, and what slows them in which order; the rule
of the ends of their ranges is `range_ends`', that of the speed of tool and elbow `point_speeds`'.
Mostly the joints of an arm go along a straight line, of which `joint_line` knows for many ticks
ahead what else is looked at at every tick: while a press begins off it, bends or nears the end of a
range, and with a platform.

A release scales the velocity to zero in the least time that all joints can; a joint that would run
out of its range so brakes by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from .joint_line import JointLine, line_from
from .model import JogModel
from .point_speeds import StopAhead, point_excess, stop_time
from .range_ends import ROUNDING, Bound, RangeEnds
from .reasons import JogCause, JogReason
from .stop_surroundings import StopSurroundings
from .targets import LONGEST_STEP, JogCaps

_SCALINGS = 4
_NEAR = 2e-4  # rad or m
_AT_END = 0.01  # of the margin: near enough to be told as held
_RECOVERY, _LEAST_RECOVERY = 1.02, 0.01  # of the share of the last tick, in each tick
_BELOW = 0.9995  # of the speed that the last trial says is allowed


class _Press(NamedTuple):
    """What is asked for as long as a press and its caps stay.

    Attributes:
        rates: (n,) shares of the jog speeds.
        caps: that say what these are.
        speeds: (n,) the jog speeds [rad/s or m/s].
        asked: (n,) velocity [rad/s or m/s].
        square: of the length of that velocity; 1 where it is 0.
        ends: of the ranges, for joints at these speeds.
    """

    rates: tuple[float, ...]
    caps: JogCaps
    speeds: list[float]
    asked: list[float]
    square: float
    ends: RangeEnds

    def share(self, velocity: Sequence[float]) -> float:
        """Return which share of the asked velocity another one has along it."""
        pairs = zip(velocity, self.asked, strict=True)
        return sum([each * wanted for each, wanted in pairs]) / self.square


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
        self._surroundings = StopSurroundings(model)
        self._press: _Press | None = None
        self._stop_ends: RangeEnds | None = None
        self._line: JointLine | None = None  # that this press goes along now

    @property
    def at_rest(self) -> bool:
        """Whether the robot stands."""
        return not any(self.velocity)

    def release(self, dt: float) -> None:
        """Move on by one tick of the stop."""
        self.scale, self.cause, self._line = 1.0, None, None
        self._move(self._released(dt), dt)

    def step(self, dt: float, rates: tuple[float, ...], caps: JogCaps) -> None:
        """Move on by one tick towards a velocity.

        Args:
            dt: since the last set-point [s].
            rates: (n,) shares of the jog speeds.
            caps: that say what these are.
        """
        press = self._press
        # By identity: neither is changed in place, and a new press brings new ones.
        if press is None or press.rates is not rates or press.caps is not caps:
            press, self._line = self._pressed(rates, caps), None
            self._press = press
        self.scale, self.cause = 1.0, None
        if self._line is not None and self._line.goes_on(dt):
            self._advance_along(self._line, dt, press)
            return
        self._advance(dt, press)
        self._judge(press)
        state = self.position, self.velocity
        self._line = line_from(self._model, press.ends, state, press.asked, caps.point_speed)

    def _pressed(self, rates: tuple[float, ...], caps: JogCaps) -> _Press:
        gain = caps.override * caps.joint_fraction
        speeds = [gain * limit for limit in self._model.limits.velocity]
        asked = [rate * speed for rate, speed in zip(rates, speeds, strict=True)]
        square = sum([each * each for each in asked]) or 1.0
        return _Press(rates, caps, speeds, asked, square, RangeEnds(self._model, speeds))

    def _recovered(self) -> float:
        """Return the share of the asked velocity to try first.

        What the last tick left, with a little more, so one trial mostly does.
        """
        share = min(1.0, self._share * _RECOVERY + _LEAST_RECOVERY)
        self._share = 1.0
        return share

    def _advance_along(self, line: JointLine, dt: float, press: _Press) -> None:
        """Move on as `_advance` does, by shares of the asked velocity and what a line tells."""
        target = self._recovered()
        gain = line.rise * dt
        least, most = line.share - gain, line.share + gain
        fastest = min(1.0, most)
        if not line.is_clear(fastest, dt):
            stop = self._stop_after([fastest * each for each in press.asked], dt)
            blocked = self._surroundings.left(dt, self.position, press.asked, stop)
            if blocked is not None:
                left, self.cause, _ = blocked
                if left <= 0.0:
                    self.scale = 0.0
                    self._go_along(line, line.released(dt), dt, press)
                    return
                self.scale = target = left * fastest
            elif self._surroundings.stay_clear:
                line.note_clear(fastest, dt)
        for _ in range(_SCALINGS):
            share = least if target < least else most if target > most else target
            cause = line.too_fast(share, dt)
            if cause is None:
                self._go_along(line, share, dt, press)
                return
            target = self._share = _BELOW * share * line.allowed / cause.value
            if target < self.scale:
                self.scale, self.cause = target, cause
        self._go_along(line, line.released(dt), dt, press)

    def _go_along(self, line: JointLine, share: float, dt: float, press: _Press) -> None:
        """Move on by a tick to a share of the asked velocity."""
        way, asked = line.advance(share, dt), press.asked
        self.position = [at + way * each for at, each in zip(self.position, asked, strict=True)]
        self.velocity = asked if share == 1.0 else [share * each for each in asked]

    def _advance(self, dt: float, press: _Press) -> None:
        """Move on to the next velocity, scaled until the tool and what is near allow it."""
        share = self._recovered()
        asked, limit = press.asked, press.caps.point_speed
        bounds = press.ends.bounds(dt, self.position, self.velocity)
        stop = self._stop_after(self._next(asked, bounds), dt)
        target = asked if share == 1.0 else [share * each for each in asked]
        blocked = None
        if any(asked):
            blocked = self._surroundings.left(dt, self.position, asked, stop)
        if blocked is not None:
            left, self.cause, wanted = blocked
            if left <= 0.0:
                self.scale = 0.0
                self._move(self._released(dt), dt)
                return
            target = [left * each for each in wanted]
            self.scale = min(1.0, press.share(target))
        for _ in range(_SCALINGS):
            if target is not asked:
                stop = self._stop_after(self._next(target, bounds), dt)
            velocity = stop.velocity
            excess, cause = point_excess(self._model, stop, limit)
            if excess <= 1.0:
                self.position, self.velocity = stop.here, velocity
                return
            target = [_BELOW * each / excess for each in velocity]
            self._share = max(press.share(target), 0.0)
            if self._share < self.scale:
                self.scale, self.cause = self._share, cause
            if self._is_near(target, velocity, dt) and self._next(target, bounds) == target:
                # So near, the speeds of points scale as the velocity does.
                self._move(target, dt)
                return
        self._move(self._released(dt), dt)

    def _is_near(self, target: Sequence[float], velocity: Sequence[float], dt: float) -> bool:
        near = _NEAR / (0.5 * dt)
        return max([abs(one - other) for one, other in zip(target, velocity, strict=True)]) < near

    def _next(self, asked: Sequence[float], bounds: Sequence[Bound]) -> list[float]:
        """Return the velocity nearest to the asked one that accelerations and ranges allow.

        All joints change alike, so from rest they start in the asked direction; but for one that
        has to brake before the end of its range.

        Args:
            asked: (n,) velocity.
            bounds: (n,) of `RangeEnds.bounds`.
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
            low, high = now - gain, now + gain
            velocity.append(low if after < low else high if after > high else after)
        return velocity

    def _released(self, dt: float) -> list[float]:
        """Return the next velocity of the stop."""
        time = stop_time(self._model, self.velocity)
        share = 0.0 if time <= dt * ROUNDING else 1.0 - dt / time
        scaled = [share * velocity for velocity in self.velocity]
        if self._stop_ends is None:
            self._stop_ends = RangeEnds(self._model, self._model.limits.velocity)
        return self._next(scaled, self._stop_ends.bounds(dt, self.position, self.velocity))

    def _move(self, velocity: list[float], dt: float) -> None:
        self.position, self.velocity = self._place_after(velocity, dt), velocity

    def _place_after(self, velocity: Sequence[float], dt: float) -> list[float]:
        """Return where a tick to a velocity ends."""
        half = 0.5 * dt
        state = zip(self.position, self.velocity, velocity, strict=True)
        return [place + half * (before + after) for place, before, after in state]

    def _judge(self, press: _Press) -> None:
        """Note the joint that the end of its range slows most, if nothing slows more."""
        model, limits = self._model, self._model.limits
        joints = zip(
            press.asked, self.position, model.lower, model.upper, model.margin, strict=True
        )
        for joint, (wanted, place, lower, upper, margin) in enumerate(joints):
            up = wanted > 0.0
            left = upper - place if up else place - lower
            if left >= margin or wanted == 0.0:
                continue
            speed = abs(self.velocity[joint]) if self.velocity[joint] * wanted > 0.0 else 0.0
            share = max(left, 0.0) / margin
            held = speed == 0.0 and share <= _AT_END
            scale = 0.0 if held else math.sqrt(share) * press.speeds[joint] / abs(wanted)
            if scale < min(1.0, self.scale):
                bound = limits.upper[joint] if up else limits.lower[joint]
                self.scale = scale
                self.cause = JogCause(JogReason.JOINT_LIMIT, place, bound, joint)

    def _stop_after(self, velocity: list[float], dt: float) -> StopAhead:
        """Return the stop after a tick to a velocity."""
        time = stop_time(self._model, velocity)
        stop = 0.5 * (max(LONGEST_STEP, time) + dt)
        here = self._place_after(velocity, dt)
        there = [place + stop * each for place, each in zip(here, velocity, strict=True)]
        return StopAhead(velocity, here, there, time)
