"""Joint jog: set-points of joints that move each by itself, all below the speed limit of the tool.

Owns how the joints change their velocities together, what slows them and in which order, and which
places are checked for that. The rules for the ends of their ranges and for the speed of tool and
elbow are `joint_braking`'s.

In most ticks the joints of an arm go along a straight line, for which `joint_line` has proven many
ticks ahead what is otherwise checked in every tick. Every tick is checked while a press begins off
the line, bends or approaches the end of a range, and always with a platform.

A release scales the velocity to zero in the least time that all joints can; a joint that would
leave its range in that time brakes harder by itself.

Bodies and posture limits are checked where a stop would end, the next place where the robot could
stand still, so everything before it was checked already. Where bodies are near that place, they are
also checked where the robot is, because only what comes nearer counts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from ..errors import NoAssembly
from .collision_guard import SLOW
from .jog_commands import LONGEST_STEP, JogCaps, JogCause, JogSlowdown
from .jog_model import JogModel
from .joint_braking import ROUNDING, Bound, JointLimitBraking, StopOutlook, point_excess, stop_time
from .joint_line import JogLine, line_from
from .path_node import SLOW_POSTURE


class StopSurroundings:
    """Collision and posture check of the place where a stop would end, for one jog.

    Attributes:
        stay_clear: True if all bodies are beyond `SLOW` at the ends of the last two stops asked
            about; the last of them was the last place checked.
    """

    def __init__(self, model: JogModel) -> None:
        self._model = model
        self._clear = False  # True if bodies are clear where the last stop ends
        self.stay_clear = False

    def left(
        self, dt: float, position: Sequence[float], asked: list[float], stop: StopOutlook
    ) -> tuple[float, JogCause, list[float]] | None:
        """Return what bodies and posture limits at the end of a stop leave of a velocity.

        Args:
            asked: (n,) velocity, which sets the direction.
            stop: the stop after the tick towards it.

        Returns:
            The share, the cause, and the velocity that the share is of; None if they leave all of
            it.
        """
        found: list[tuple[float, JogCause, list[float]]] = []
        near = self._bodies(dt, position, asked, stop)
        if near is not None:
            found.append((*near, stop.velocity))
        if self._model.watches_posture:
            use = _posture_left(self._model, position, stop.there)
            if use is not None:
                found.append((*use, asked))
        if not found:
            return None
        # The two shares are of different velocities, so the velocities that remain are compared.
        return min(found, key=lambda each: each[0] * max(map(abs, each[2])))

    def _bodies(
        self, dt: float, position: Sequence[float], asked: list[float], stop: StopOutlook
    ) -> tuple[float, JogCause] | None:
        guard = self._model.guard
        if guard is None:
            return None
        after = guard.look(stop.there)
        was_clear, self._clear = self._clear, after is None or min(after.values()) >= SLOW
        self.stay_clear = was_clear and self._clear
        # Both this stop and the last end beyond `SLOW`, so nothing between them is near.
        if after is None or self.stay_clear:
            return None
        before = guard.look(position)
        way = position, asked
        # The full velocity would cover the tick and the stop in this time.
        time = 0.5 * max(LONGEST_STEP, stop.time) + dt
        near = guard.nearing(before, after, way, time)
        if guard.in_contact(before):
            self._clear = False
        if near is None and guard.in_contact(before):
            # Bodies that are farther apart at the end may come nearer first, or part and come back.
            meanwhile = guard.look(stop.here)
            near = guard.nearing(before, meanwhile, way, dt)
            near = near or guard.nearing(meanwhile, after, way, time)
        return near


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


_SCALINGS = 4
_NEAR = 2e-4  # rad or m: how far a tick may end from the one that was checked
_AT_END = 0.01  # of the margin: so near, a joint is reported as held
_RECOVERY, _LEAST_RECOVERY = 1.02, 0.01  # a tick: how the share of the asked speed grows again
_BELOW = 0.9995  # of the speed that the last trial says is allowed


class _Press(NamedTuple):
    """Data that stay the same as long as a press and its caps do.

    Attributes:
        rates: (n,) shares of the jog speeds.
        asked: (n,) velocity that is asked for [rad/s or m/s].
        square: square of the length of that velocity; 1 where it is 0.
        ends: ends of the ranges, for joints at these speeds.
    """

    rates: tuple[float, ...]
    caps: JogCaps
    speeds: list[float]
    asked: list[float]
    square: float
    ends: JointLimitBraking

    def share(self, velocity: Sequence[float]) -> float:
        """Return the component of a velocity along the asked one, as a share of it."""
        pairs = zip(velocity, self.asked, strict=True)
        return sum([each * wanted for each, wanted in pairs]) / self.square


class JointJogMotion:
    """Joints in a joint jog, moving or at rest.

    Attributes:
        scale: share of the asked speed that limits leave, of the joint that they leave least.
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
        self._share = 1.0  # of the asked velocity, left by points in the last tick
        self._surroundings = StopSurroundings(model)
        self._press: _Press | None = None
        self._stop_ends: JointLimitBraking | None = None
        self._line: JogLine | None = None  # along which this press goes now

    @property
    def at_rest(self) -> bool:
        """True while the robot stands still."""
        return not any(self.velocity)

    def release(self, dt: float) -> None:
        """Advance by one tick of the stop."""
        self.scale, self.cause, self._line = 1.0, None, None
        self._move(self._released(dt), dt)

    def step(self, dt: float, rates: tuple[float, ...], caps: JogCaps) -> None:
        """Advance by one tick towards a velocity."""
        press = self._press
        # By identity, which is cheap: neither is changed in place, and a new press brings new ones.
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
        return _Press(rates, caps, speeds, asked, square, JointLimitBraking(self._model, speeds))

    def _recovered(self) -> float:
        """Return the share of the asked velocity to try first.

        The share of the last tick and a little more, so that one trial is usually enough.
        """
        share = min(1.0, self._share * _RECOVERY + _LEAST_RECOVERY)
        self._share = 1.0
        return share

    def _advance_along(self, line: JogLine, dt: float, press: _Press) -> None:
        """Advance as `_advance` does, by shares of the asked velocity along a line."""
        target = self._recovered()
        gain = line.rise * dt
        least, most = line.share - gain, line.share + gain
        fastest = min(1.0, most)
        # Checked for the greatest share: a stop from a lesser one ends earlier on the same line.
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
        # No trial was slow enough. A tick of the stop is: the tick before was judged with its stop.
        self._go_along(line, line.released(dt), dt, press)

    def _go_along(self, line: JogLine, share: float, dt: float, press: _Press) -> None:
        """Advance by a tick to a share of the asked velocity."""
        way, asked = line.advance(share, dt), press.asked
        self.position = [at + way * each for at, each in zip(self.position, asked, strict=True)]
        self.velocity = asked if share == 1.0 else [share * each for each in asked]

    def _advance(self, dt: float, press: _Press) -> None:
        """Advance to the next velocity, scaled until points and surroundings allow it."""
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
            # Judged with the whole stop after the tick: a stretching arm gets faster while its
            # joints brake.
            excess, cause = point_excess(self._model, stop, limit)
            if excess <= 1.0:
                self.position, self.velocity = stop.here, velocity
                return
            target = [_BELOW * each / excess for each in velocity]
            self._share = max(press.share(target), 0.0)
            if self._share < self.scale:
                self.scale, self.cause = self._share, cause
            if self._is_near(target, velocity, dt) and self._next(target, bounds) == target:
                # At such a small change the speeds of points scale with the velocity: no further
                # trial.
                self._move(target, dt)
                return
        self._move(self._released(dt), dt)

    def _is_near(self, target: Sequence[float], velocity: Sequence[float], dt: float) -> bool:
        near = _NEAR / (0.5 * dt)
        return max([abs(one - other) for one, other in zip(target, velocity, strict=True)]) < near

    def _next(self, asked: Sequence[float], bounds: Sequence[Bound]) -> list[float]:
        """Return the velocity nearest to the asked one that accelerations and ranges allow.

        All joints change by the same share, so from rest they start in the asked direction; except
        a joint that has to brake before the end of its range.
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
            self._stop_ends = JointLimitBraking(self._model, self._model.limits.velocity)
        return self._next(scaled, self._stop_ends.bounds(dt, self.position, self.velocity))

    def _move(self, velocity: list[float], dt: float) -> None:
        self.position, self.velocity = self._place_after(velocity, dt), velocity

    def _place_after(self, velocity: Sequence[float], dt: float) -> list[float]:
        """Return the position at the end of a tick that ends at a velocity."""
        half = 0.5 * dt
        state = zip(self.position, self.velocity, velocity, strict=True)
        return [place + half * (before + after) for place, before, after in state]

    def _judge(self, press: _Press) -> None:
        """Set the cause to the joint that the end of its range slows most, if that is the worst."""
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
                self.cause = JogCause(JogSlowdown.JOINT_LIMIT, place, bound, joint)

    def _stop_after(self, velocity: list[float], dt: float) -> StopOutlook:
        """Return the stop that follows a tick to a velocity."""
        time = stop_time(self._model, velocity)
        # Ticks are whole: a stop goes up to half a tick farther than a continuous one, and a stop
        # that is shorter than a tick may take a longest one.
        stop = 0.5 * (max(LONGEST_STEP, time) + dt)
        here = self._place_after(velocity, dt)
        there = [place + stop * each for place, each in zip(here, velocity, strict=True)]
        return StopOutlook(velocity, here, there, time)
