"""The motion between the samples of a trajectory: the gentlest that meets them.

Owns the continuous motion that a trajectory stands for where nothing but its samples is known. On
an interval of length h, from (q, v) to (q₊, v₊), the acceleration of each joint takes the fewest
constant values with the least magnitude p. With m = (v₊ - v) / h the mean acceleration and
d = Δq - h (v + v₊) / 2 what the positions gain over evenly changing velocities:

- If d = 0 the acceleration is m throughout.
- Else it is sign(d) p for a share θ of the interval and -sign(d) p after, from which follow
  m = sign(d) p (2θ - 1) and |d| = (p² - m²) h² / 4p, so p = 2|d|/h² + √(4d²/h⁴ + m²).
- Where that would exceed the joint's velocity limit V, it reaches V, stays there and leaves it,
  both with p = (u² + u₊²) / 2D: v and v₊ are u and u₊ below V, and Δq is D below hV.

No motion that meets the samples and keeps V has a smaller greatest acceleration, so this one keeps
every velocity and acceleration limit that the trajectory was planned under. Knows no timing and no
path. Joint vectors are controller-side driven joints in file order [rad or m, s].
"""

from __future__ import annotations

import numpy as np

from .errors import BadArgument, WrongJointCount
from .limits import JointLimits
from .trajectory import Array, JointState, Trajectory

_PIECES = 3
_ROUNDING = 1e-9  # of an interval
_NEGLIGIBLE = 1e-12  # of the way at the velocity limit: a gain in position that is rounding


class BetweenSamples:
    """The motion through a trajectory's samples, for m samples of n joints.

    Attributes:
        trajectory: the samples.
        period: time between samples [s].
        breaks: (m - 1, n, 4) when each piece of each interval begins and the last one ends, from
            the start of the interval [s].
        velocity: (m - 1, n, 4) joint velocity at the breaks.
        acceleration: (m - 1, n, 3) joint acceleration on each piece.
    """

    def __init__(self, trajectory: Trajectory, limits: JointLimits) -> None:
        """Join the samples.

        Args:
            trajectory: two samples or more.
            limits: what the trajectory was planned under.

        Raises:
            WrongJointCount: the trajectory is of another robot.
            BadArgument: the trajectory has fewer than two samples.
        """
        if trajectory.dof != limits.dof:
            raise WrongJointCount(trajectory.dof, limits.dof)
        if len(trajectory) < 2:
            raise BadArgument("trajectory", len(trajectory), "two samples or more")
        self.trajectory = trajectory
        self.period = float(trajectory.times[1])
        top = np.maximum(limits.velocity, np.abs(trajectory.velocity).max(axis=0))
        self.breaks, self.acceleration = _pieces(trajectory, self.period, top)
        gains = self.acceleration * np.diff(self.breaks, axis=2)
        self.velocity = np.cumsum(
            np.concatenate((trajectory.velocity[:-1, :, np.newaxis], gains), axis=2), axis=2
        )

    @property
    def greatest_acceleration(self) -> Array:
        """(n,) the greatest acceleration of each joint [rad/s² or m/s²]."""
        greatest: Array = np.abs(self.acceleration).max(axis=(0, 2))
        return greatest

    def interval(self, time: float) -> tuple[int, float]:
        """Return the place of the interval that a time lies in, and how far into it [s]."""
        last = len(self.trajectory) - 2
        # A time on a sample belongs to the interval after it, whatever the rounding.
        place = min(max(int(time / self.period + _ROUNDING), 0), last)
        return place, min(max(time - place * self.period, 0.0), self.period)

    def state(self, time: float) -> JointState:
        """Return the motion at a time from its start [s]; outside it the ends hold."""
        place, into = self.interval(time)
        # How long each piece has lasted by then.
        lasted = np.clip(into - self.breaks[place, :, :-1], 0.0, np.diff(self.breaks[place]))
        gain = self.acceleration[place]
        moved = ((self.velocity[place, :, :-1] + 0.5 * gain * lasted) * lasted).sum(axis=1)
        piece = np.minimum((self.breaks[place, :, 1:] <= into).sum(axis=1), _PIECES - 1)
        joints = np.arange(len(piece))
        return JointState(
            self.trajectory.position[place] + moved,
            self.trajectory.velocity[place] + (gain * lasted).sum(axis=1),
            gain[joints, piece],
        )


def _pieces(trajectory: Trajectory, h: float, top: Array) -> tuple[Array, Array]:
    """Return breaks (m - 1, n, 4) and accelerations (m - 1, n, 3), as of `BetweenSamples`."""
    before, after = trajectory.velocity[:-1], trajectory.velocity[1:]
    mean = (after - before) / h
    gained = np.diff(trajectory.position, axis=0) - 0.5 * h * (before + after)
    gained[np.abs(gained) <= _NEGLIGIBLE * h * top] = 0.0
    side = np.where(gained < 0.0, -1.0, 1.0)
    half = 2.0 * np.abs(gained) / h**2
    peak = half + np.hypot(half, mean)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(gained == 0.0, 1.0, 0.5 + 0.5 * side * mean / peak)
    first = np.where(gained == 0.0, mean, side * peak)
    second = np.where(gained == 0.0, mean, -side * peak)
    middle = np.clip(share, 0.0, 1.0) * h
    breaks = np.stack((np.zeros_like(middle), middle, middle, np.full_like(middle, h)), axis=2)
    pieces = np.stack((first, np.zeros_like(first), second), axis=2)

    lack, lack_after = top - side * before, top - side * after
    capped = (side * before + peak * middle > top) & (gained != 0.0)
    short = h * top - side * np.diff(trajectory.position, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        slower = (lack**2 + lack_after**2) / (2.0 * short)
        reach, leave = lack / slower, h - lack_after / slower
    capped &= np.isfinite(reach) & (reach <= leave)
    breaks[capped, 1], breaks[capped, 2] = reach[capped], leave[capped]
    pieces[capped, 0], pieces[capped, 2] = (side * slower)[capped], -(side * slower)[capped]
    return breaks, pieces
