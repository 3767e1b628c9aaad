"""Straight line in joint space that a joint jog follows while nothing bends it.

Owns what can be proven there for many ticks at once. All joints change their velocities by the same
share, so from rest, and soon after a change of keys, they follow q(σ) = q₀ + σ a, where a is the
velocity that is asked for and dσ/dt the share of it that limits leave. A stop follows the same
line. Along it

- no end of a range matters up to a σ that is computed at the start, where the line ends
  (`JointLimitBraking.free_distance`);
- bodies that a check finds beyond `SLOW` stay so for a length that their sweep bounds
  (`CollisionGuard.clear_distance`). As without a line, the place checked is where a stop would end;
  where it lies beyond that length, it is checked again;
- the speeds of tool and elbow at a few places bound them in between (`line_speed_bounds`).

All three hold at every share, so one check stands for several ticks, and each tick is still judged.
Keys, override and caps are no part of the line: a change of them ends it in the same tick.
"""

from __future__ import annotations

from collections.abc import Sequence

from .jog_commands import LONGEST_STEP, JogCause, JogSlowdown
from .jog_model import JogModel
from .joint_braking import RESERVE, ROUNDING, JointLimitBraking, stop_time
from .line_speed_bounds import LineSpeeds

_REASONS = (JogSlowdown.TOOL_SPEED, JogSlowdown.ELBOW_SPEED)
_STRAIGHT = 1e-9  # of the asked speed: a lesser deviation from the line is rounding
_WORTH = 10  # ticks: shorter lines save nothing


class JogLine:
    """A straight line in joint space, and the place of the motion on it.

    Attributes:
        sigma: how far along the line the motion is [s].
        share: dσ/dt, share of the asked velocity, 0 to 1.
        rise: greatest change of the share [1/s].
    """

    def __init__(
        self,
        model: JogModel,
        line: tuple[Sequence[float], Sequence[float]],
        shares: tuple[float, float],
        free: float,
        limit: float,
    ) -> None:
        """Start at σ = 0; `line_from` has checked that there is a line.

        Args:
            model: the robot, serial.
            line: (n,) position now and (n,) velocity that is asked for.
            shares: share of that velocity, now and at most.
            free: σ up to which no end of a range matters.
        """
        assert model.line_points is not None
        self.sigma = 0.0
        self.share, self._most = shares
        self._free, self._limit = free, limit
        self._time = stop_time(model, line[1])
        self.rise = ROUNDING / self._time
        self.allowed = RESERVE * limit
        until = free + self._stop_way(self._most, LONGEST_STEP)
        # Bounds reach as far as a stop that begins at the line's end.
        self._speeds = LineSpeeds(model.line_points, line, until, self.allowed)
        self._guard = model.guard
        self._closing = None if model.guard is None else model.guard.closing(line[1])
        self._clear = 0.0, -1.0  # σ of the last check of bodies, and how far around it is clear

    def goes_on(self, dt: float) -> bool:
        """Return True if a tick stays on the line, whatever share of the asked velocity it has."""
        most = self._most
        return self.sigma + most * dt < self._free and (
            most == 1.0 or self.share + self.rise * dt <= most
        )

    def released(self, dt: float) -> float:
        """Return the share after one tick of a stop."""
        return 0.0 if self.share <= self.rise * dt else self.share - dt / self._time

    def too_fast(self, share: float, dt: float) -> JogCause | None:
        """Return the point that may exceed its speed limit after a tick to a share.

        From the end of the tick until rest. None if both points are proven to stay below it.
        """
        end = self.sigma + 0.5 * (self.share + share) * dt
        way = self._stop_way(share, dt)
        speed, which = self._speeds.greatest(end, share, way, self.allowed)
        return None if speed <= self.allowed else JogCause(_REASONS[which], speed, self._limit)

    def is_clear(self, share: float, dt: float) -> bool:
        """Return True if all bodies are proven clear where a stop after a tick to a share ends."""
        if self._guard is None:
            return True
        seen_at, around = self._clear
        return abs(self._stop_end(share, dt) - seen_at) <= around

    def note_clear(self, share: float, dt: float) -> None:
        """Record that bodies were checked where a stop ends, and all that count were clear."""
        if self._guard is not None and self._closing is not None:
            self._clear = self._stop_end(share, dt), self._guard.clear_distance(self._closing)

    def advance(self, share: float, dt: float) -> float:
        """Advance by a tick to a share, and return the distance by σ."""
        way = 0.5 * (self.share + share) * dt
        self.sigma += way
        self.share = share
        return way

    def _stop_end(self, share: float, dt: float) -> float:
        """Return the σ where a stop after a tick to a share ends."""
        return self.sigma + 0.5 * (self.share + share) * dt + self._stop_way(share, dt)

    def _stop_way(self, share: float, dt: float) -> float:
        """Return the length of a stop from a share by σ, computed as in `JointJogMotion`."""
        time = share * self._time
        return 0.5 * share * ((time if time > LONGEST_STEP else LONGEST_STEP) + dt)


def line_from(
    model: JogModel,
    ends: JointLimitBraking,
    state: tuple[Sequence[float], Sequence[float]],
    asked: Sequence[float],
    limit: float,
) -> JogLine | None:
    """Return the line from a place; None if the joints do not follow one, or only a short one.

    Args:
        ends: ends of the ranges, at the speeds of the press.
        state: (n,) position and (n,) velocity.
    """
    position, velocity = state
    if model.line_points is None:
        return None
    share = _share_along(velocity, asked)
    if share is None:
        return None
    # An end may matter at the full speed and not at the lower one that limits leave: try both.
    room = 2.0 * LONGEST_STEP / stop_time(model, asked)
    for most in (1.0, min(1.0, 2.0 * share + room)):
        free = most * ends.free_distance(position, [most * rate for rate in asked])
        if free > _WORTH * LONGEST_STEP * most:
            return JogLine(model, (position, asked), (share, most), free, limit)
    return None


def _share_along(velocity: Sequence[float], asked: Sequence[float]) -> float | None:
    """Return the share of the asked velocity that a velocity is; None if it is not along it."""
    pairs = list(zip(velocity, asked, strict=True))
    square = sum([rate * rate for rate in asked])
    if square == 0.0:
        return None
    share = sum([now * rate for now, rate in pairs]) / square
    if not 0.0 <= share <= 1.0 + _STRAIGHT:
        return None
    for now, rate in pairs:
        # Written with `not`, so that a NaN counts as off the line.
        if not abs(now - share * rate) <= _STRAIGHT * abs(rate):
            return None
    return min(share, 1.0)
