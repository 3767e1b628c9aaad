"""Intersample motion: the continuous motion with the least acceleration through the samples.

Owns the motion that a trajectory stands for where only its samples are known. On an interval of
length h, from (q, v) to (q₊, v₊), the acceleration of each joint takes the fewest constant values
with the least magnitude p. With m = (v₊ - v) / h the mean acceleration and
d = Δq - h (v + v₊) / 2 what the positions gain over linearly changing velocities:

- If d = 0 the acceleration is m throughout.
- Otherwise it is sign(d) p for a share θ of the interval and -sign(d) p after, from which follow
  m = sign(d) p (2θ - 1) and |d| = (p² - m²) h² / 4p, so p = 2|d|/h² + √(4d²/h⁴ + m²).
- Where that would exceed the joint's velocity limit V, the joint reaches V, stays there and leaves
  it, both with p = (u² + u₊²) / 2D: v and v₊ are u and u₊ below V, and Δq is D below hV.

No motion that meets the samples and obeys V has a smaller greatest acceleration, so this one obeys
every velocity and acceleration limit that the trajectory was planned under. Knows no timing and no
path. Joint vectors are controller-side driven joints in file order [rad or m, s].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..description.limits import JointLimits
from ..errors import BadArgument, WrongJointCount
from ..pose import Array
from .trajectory import FINER, JointState, Trajectory

_PIECES = 3
_BLOCK = 256  # intervals computed at once, so that an hour of motion takes no time at the start
_ROUNDING = 1e-9  # of an interval
_NEGLIGIBLE = 1e-12  # of the distance at the velocity limit: a lesser gain in position is rounding


class Pieces(NamedTuple):
    """Motion on each of k intervals, for n joints.

    Attributes:
        breaks: (k, n, 4) when each piece begins and the last one ends, from the start of the
            interval [s].
        velocity: (k, n, 4) joint velocity at the breaks.
        acceleration: (k, n, 3) joint acceleration on each piece.
    """

    breaks: Array
    velocity: Array
    acceleration: Array


class IntersampleCheck:
    """Continuous motion through a trajectory's samples, fine ones where it has them: m of n joints.

    Attributes:
        trajectory: the samples.
        period: time between the samples that are joined [s].
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
        fine = trajectory.fine
        self.period = float(trajectory.times[1]) / (1 if fine is None else FINER)
        self._position = (trajectory if fine is None else fine).position
        self._velocity = (trajectory if fine is None else fine).velocity
        # A sample may exceed a limit by the certificate's tolerance; the motion must still meet it.
        self._top = np.maximum(limits.velocity, np.abs(trajectory.velocity).max(axis=0))
        self._block = -1
        self._pieces = self._joined(slice(0, 1))

    def __len__(self) -> int:
        """Return the number of intervals."""
        return len(self._position) - 1

    def pieces(self) -> Pieces:
        """Return the motion on all intervals; for a long motion this takes a while."""
        return self._joined(slice(None))

    def on(self, place: int) -> Pieces:
        """Return the motion on one interval; its arrays are (n, 4) and (n, 3)."""
        block, row = divmod(place, _BLOCK)
        if block != self._block:
            self._pieces = self._joined(slice(block * _BLOCK, (block + 1) * _BLOCK))
            self._block = block
        return Pieces(*(field[row] for field in self._pieces))

    def _joined(self, places: slice) -> Pieces:
        ends = slice(places.start, None if places.stop is None else places.stop + 1)
        position, velocity = self._position[ends], self._velocity[ends]
        breaks, acceleration = _pieces(position, velocity, self.period, self._top)
        gains = acceleration * np.diff(breaks, axis=2)
        begins = velocity[:-1, :, np.newaxis]
        return Pieces(
            breaks, np.cumsum(np.concatenate((begins, gains), axis=2), axis=2), acceleration
        )

    def interval(self, time: float) -> tuple[int, float]:
        """Return the index of the interval that a time lies in, and the time since its start."""
        last = len(self) - 1
        # A time on a sample belongs to the interval after it, whatever the rounding.
        place = min(max(int(time / self.period + _ROUNDING), 0), last)
        return place, min(max(time - place * self.period, 0.0), self.period)

    def state(self, time: float) -> JointState:
        """Return the motion at a time from its start [s]; outside it, the first or last state."""
        place, into = self.interval(time)
        breaks, velocity, gain = self.on(place)
        # The time that each piece has lasted so far, 0 for those still ahead.
        lasted = np.clip(into - breaks[:, :-1], 0.0, np.diff(breaks))
        moved = ((velocity[:, :-1] + 0.5 * gain * lasted) * lasted).sum(axis=1)
        piece = np.minimum((breaks[:, 1:] <= into).sum(axis=1), _PIECES - 1)
        return JointState(
            self._position[place] + moved,
            self._velocity[place] + (gain * lasted).sum(axis=1),
            gain[np.arange(len(piece)), piece],
        )

    def even_acceleration(self, time: float) -> Array:
        """Return the (n,) acceleration at a time without the pieces' oscillation [rad/s² or m/s²].

        On a curved path the pieces oscillate about the acceleration of the path by as much as it
        changes over an interval. This value is linear between the means of the intervals. Where
        only the samples of a motion are known, it is that of the piece.
        """
        place, into = self.interval(time)
        if self.trajectory.fine is None:
            return self.state(time).acceleration
        share = into / self.period - 0.5
        other = min(max(place + (1 if share > 0.0 else -1), 0), len(self) - 1)
        mean: Array = self._mean(place) * (1.0 - abs(share)) + self._mean(other) * abs(share)
        return mean

    def _mean(self, place: int) -> Array:
        mean: Array = (self._velocity[place + 1] - self._velocity[place]) / self.period
        return mean


def _pieces(position: Array, velocity: Array, h: float, top: Array) -> tuple[Array, Array]:
    """Return breaks (k, n, 4) and accelerations (k, n, 3) between k + 1 samples, as of `Pieces`."""
    before, after = velocity[:-1], velocity[1:]
    mean = (after - before) / h
    gained = np.diff(position, axis=0) - 0.5 * h * (before + after)
    # Rounding of a constant acceleration would otherwise become two pieces that differ by noise.
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
    short = h * top - side * np.diff(position, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        slower = (lack**2 + lack_after**2) / (2.0 * short)
        reach, leave = lack / slower, h - lack_after / slower
    # Where V is reached after it is left, the samples do not obey V; the two pieces then stay.
    capped &= np.isfinite(reach) & (reach <= leave)
    breaks[capped, 1], breaks[capped, 2] = reach[capped], leave[capped]
    pieces[capped, 0], pieces[capped, 2] = (side * slower)[capped], -(side * slower)[capped]
    return breaks, pieces
