"""The straight line of the joints that a joint jog goes along while nothing bends it.

Owns what can be known there for many ticks. Joints change their velocities alike, so from rest, and
soon after a change of keys, they go along q(σ) = q₀ + σ a with a the velocity that is asked for, at
the share dσ/dt of it that limits leave, and so does a stop. Along that line

- no end of a range matters up to a σ that is worked out at its start (`RangeEnds.free_way`); the
  line ends there;
- bodies that a look finds beyond `SLOW` stay so for a way that their sweep bounds
  (`CollisionGuard.clear_way`). As without a line it is asked about the place where a stop would
  end; where it lies beyond that way, it is looked again;
- looks at the speeds of tool and elbow bound them in between (`line_speeds`).

All three hold at whatever share, so a look stands for several ticks and each tick is still judged.
Keys, override and caps are no part of it: a change of them ends the line in the same tick.
"""

from __future__ import annotations

from collections.abc import Sequence

from .line_speeds import LineSpeeds
from .model import JogModel
from .point_speeds import RESERVE, stop_time
from .range_ends import ROUNDING, RangeEnds
from .reasons import JogCause, JogReason
from .targets import LONGEST_STEP

_REASONS = (JogReason.TOOL_SPEED, JogReason.ELBOW_SPEED)
_STRAIGHT = 1e-9  # of the asked speed: a velocity is along it up to rounding
_WORTH = 10  # ticks: shorter lines save nothing


class JointLine:
    """A line, and the place on it.

    Attributes:
        sigma: how far along it is [s].
        share: dσ/dt, of the asked velocity, 0 to 1.
        rise: how much the share can change in a second.
        allowed: the speed of points that it keeps to [m/s].
    """

    def __init__(
        self,
        model: JogModel,
        line: tuple[Sequence[float], Sequence[float]],
        shares: tuple[float, float],
        free: float,
        limit: float,
    ) -> None:
        """Begin at σ = 0; `line_from` finds out before whether there is a line.

        Args:
            model: the robot, serial.
            line: (n,) place now and (n,) velocity that is asked for.
            shares: of that velocity, now and at most.
            free: up to which σ no end of a range matters.
            limit: greatest speed of points [m/s].
        """
        assert model.line_points is not None
        self.sigma = 0.0
        self.share, self._most = shares
        self._free, self._limit = free, limit
        self._time = stop_time(model, line[1])
        self.rise = ROUNDING / self._time
        self.allowed = RESERVE * limit
        until = free + self._stop_way(self._most, LONGEST_STEP)
        self._speeds = LineSpeeds(model.line_points, line, until, self.allowed)
        self._guard = model.guard
        self._closing = None if model.guard is None else model.guard.closing(line[1])
        self._clear = 0.0, -1.0  # where bodies were looked at, and how far around they are clear

    def goes_on(self, dt: float) -> bool:
        """Return whether a tick stays on it, whatever is left of the asked velocity."""
        most = self._most
        return self.sigma + most * dt < self._free and (
            most == 1.0 or self.share + self.rise * dt <= most
        )

    def released(self, dt: float) -> float:
        """Return the share after a tick of a stop."""
        return 0.0 if self.share <= self.rise * dt else self.share - dt / self._time

    def too_fast(self, share: float, dt: float) -> JogCause | None:
        """Return the point that gets faster than allowed after a tick to a share, or may get so.

        From the end of the tick to rest. None where it is proven that both keep to what is allowed.
        """
        end = self.sigma + 0.5 * (self.share + share) * dt
        way = self._stop_way(share, dt)
        speed, which = self._speeds.greatest(end, share, way, self.allowed)
        return None if speed <= self.allowed else JogCause(_REASONS[which], speed, self._limit)

    def is_clear(self, share: float, dt: float) -> bool:
        """Return whether it is known of all bodies where a stop ends after a tick to a share."""
        if self._guard is None:
            return True
        seen_at, around = self._clear
        return abs(self._stop_end(share, dt) - seen_at) <= around

    def note_clear(self, share: float, dt: float) -> None:
        """Note that it was looked where a stop ends, and all bodies that count were clear."""
        if self._guard is not None and self._closing is not None:
            self._clear = self._stop_end(share, dt), self._guard.clear_way(self._closing)

    def advance(self, share: float, dt: float) -> float:
        """Go on by a tick to a share, and return how far that is, by σ."""
        way = 0.5 * (self.share + share) * dt
        self.sigma += way
        self.share = share
        return way

    def _stop_end(self, share: float, dt: float) -> float:
        """Return where a stop after a tick to a share ends."""
        return self.sigma + 0.5 * (self.share + share) * dt + self._stop_way(share, dt)

    def _stop_way(self, share: float, dt: float) -> float:
        """Return the way of a stop from a share, by σ, as `JointMotion` has it."""
        time = share * self._time
        return 0.5 * share * ((time if time > LONGEST_STEP else LONGEST_STEP) + dt)


def line_from(
    model: JogModel,
    ends: RangeEnds,
    state: tuple[Sequence[float], Sequence[float]],
    asked: Sequence[float],
    limit: float,
) -> JointLine | None:
    """Return the line from a place; None where joints do not go along one, or not far.

    Args:
        model: the robot.
        ends: of the ranges, at the speeds of the press.
        state: (n,) place and (n,) velocity.
        asked: (n,) velocity that is asked for.
        limit: greatest speed of points [m/s].
    """
    position, velocity = state
    if model.line_points is None:
        return None
    share = _share_along(velocity, asked)
    if share is None:
        return None
    # At their full speed joints may be near an end where what limits leave of it is not.
    room = 2.0 * LONGEST_STEP / stop_time(model, asked)
    for most in (1.0, min(1.0, 2.0 * share + room)):
        free = most * ends.free_way(position, [most * rate for rate in asked])
        if free > _WORTH * LONGEST_STEP * most:
            return JointLine(model, (position, asked), (share, most), free, limit)
    return None


def _share_along(velocity: Sequence[float], asked: Sequence[float]) -> float | None:
    """Return which share of the asked velocity another one is; None if it is no share of it."""
    pairs = list(zip(velocity, asked, strict=True))
    square = sum([rate * rate for rate in asked])
    if square == 0.0:
        return None
    share = sum([now * rate for now, rate in pairs]) / square
    if not 0.0 <= share <= 1.0 + _STRAIGHT:
        return None
    for now, rate in pairs:
        if not abs(now - share * rate) <= _STRAIGHT * abs(rate):
            return None
    return min(share, 1.0)
