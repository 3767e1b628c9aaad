"""Velocity profile of a path: its rate over the path, measured against limits and sampled in time.

Owns the profile whose path acceleration is constant between grid points. Does not know how a
profile is found. Joint vectors are controller-side driven joints in file order [rad or m, s]; s is
the path parameter of `joint_curves`, q' and q'' the path's derivatives by it.

On a step of length Δs with the path acceleration u, from the path velocity v to v₊:

    v₊² = v² + 2 u Δs        Δt = 2 Δs / (v + v₊)        s(t) = s + v t + u t²/2
    dq/dt = q' v             d²q/dt² = q' u + q'' v²

the discretisation of TOPP-RA (Pham and Pham, "A New Approach to Time-Optimal Path Parameterization
Based on Reachability Analysis", IEEE T-RO 34(3), 2018). The square of the velocity is linear in s,
so both ratios to limits are smooth on a step but not linear: they are measured in between.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..description.limits import JointLimits
from ..pose import Array
from ..trajectory.joint_curves import Indices, Path
from ..trajectory.trajectory import FINER, MOST_FINE, FineSamples, Trajectory

_MEASURED = 32  # places measured between two knots of the path, about
_LEAST_MEASURED = 4  # least number of places between two grid points


@dataclass(frozen=True, slots=True, eq=False)
class VelocityProfile:
    """Profile of a run along a path from rest to rest; its squared rate is linear on each step.

    Attributes:
        grid: (g,) path positions s from 0 to the path's length, with every knot among them.
        rate: (g,) path velocity v there [unit of s per s], 0 at both ends.
        gain: (g - 1,) path acceleration u on the step that follows [unit of s per s²].
        times: (g,) time at each position, from 0 [s].
    """

    grid: Array
    rate: Array
    gain: Array
    times: Array

    @classmethod
    def through(cls, grid: Array, rate: Array) -> VelocityProfile:
        """Return the profile with given rates at the grid points.

        Args:
            grid: (g,) path positions, increasing.
            rate: (g,) path velocities, 0 or more, no two successive ones 0 [unit of s per s].
        """
        steps = np.diff(grid)
        both = rate[1:] + rate[:-1]
        gain = np.diff(rate) * both / (2.0 * steps)
        return cls(grid, rate, gain, np.concatenate(([0.0], np.cumsum(2.0 * steps / both))))

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""
        return float(self.times[-1])

    def excess(
        self, path: Path, velocity: Array, acceleration: Array, tool: Array | None = None
    ) -> tuple[Array, Array]:
        """Return the greatest ratios of the run to its limits between the grid points.

        Args:
            path: the path, n joints.
            velocity: (g - 1, n) velocity limits on each step [rad/s or m/s].
            acceleration: (n,) acceleration limits [rad/s² or m/s²].
            tool: (g - 1, places, k) at the `measured_places`, for each of k points of the arm the
                ratio of its speed to its limit at path velocity 1, as of `speed_ratios`.

        Returns:
            For each step (g - 1,) the greatest ratio of a joint velocity or tool speed, and of a
            joint acceleration, to its limit; 1 is at the limit. Both are upper bounds where a curve
            is a parabola between places, see `_crests`.
        """
        s = measured_places(path, self.grid)
        steps, places = s.shape
        ahead = s - self.grid[:-1, np.newaxis]
        square = self.rate[:-1, np.newaxis] ** 2 + 2.0 * self.gain[:, np.newaxis] * ahead
        square = np.maximum(square, 0.0)[:, :, np.newaxis]
        slope, bend = (
            path.evaluate(s.ravel(), order).reshape(steps, places, path.dof) for order in (1, 2)
        )
        speeds = np.square(slope / velocity[:, np.newaxis]) * square
        gains = (slope * self.gain[:, np.newaxis, np.newaxis] + bend * square) / acceleration
        fastest = _crests(speeds)
        if tool is not None:
            fastest = np.maximum(fastest, _crests(np.square(tool) * square))
        return np.sqrt(fastest), _crests(gains)

    def sampled(
        self, path: Path, limits: JointLimits, waypoints: Indices, samples: int, period: float
    ) -> Trajectory:
        """Return the samples of the run, slowed down as a whole to last a number of sample periods.

        Slower by the factor c, the run passes each place at c times its time: its path velocity is
        divided by c, its path acceleration by c².

        Args:
            path: the path, n joints.
            limits: limits whose ranges the path obeys but for rounding.
            waypoints: (w,) indices of the path's waypoints in the grid.
            samples: number m of sample periods; m times the period is the duration or more.
            period: their length [s].

        Returns:
            m + 1 samples of n joints, and finer ones between them unless there are too many.
        """
        slower = samples * period / self.duration
        finer = FINER if samples <= MOST_FINE else 1
        elapsed = np.arange(finer * samples) * (period / finer / slower)
        step = np.searchsorted(self.times[1:-1], elapsed, side="right")
        since = elapsed - self.times[step]
        gain, before = self.gain[step], self.rate[step]
        s = self.grid[step] + (before + 0.5 * gain * since) * since
        s = np.append(np.minimum(s, self.grid[step + 1]), path.length)
        rate = np.append(np.maximum(before + gain * since, 0.0), 0.0)[:, np.newaxis] / slower
        gain = np.append(gain, 0.0)[:, np.newaxis] / slower**2
        slope = path.evaluate(s, 1)
        # A curve that just touches a limit may exceed it by rounding.
        position = np.clip(path.evaluate(s), limits.lower, limits.upper)
        velocity = slope * rate
        # The samples sent to the controller are every `FINER`th of them.
        sent = slice(None, None, finer)
        bend = path.evaluate(s[sent], 2)
        return Trajectory(
            times=np.asarray(np.arange(samples + 1) * period, dtype=np.float64),
            position=np.asfortranarray(position[sent]),
            velocity=np.asfortranarray(velocity[sent]),
            acceleration=np.asfortranarray(slope[sent] * gain[sent] + bend * rate[sent] ** 2),
            waypoint_times=self.times[waypoints] * slower,
            fine=FineSamples(position, velocity) if finer > 1 else None,
        )


def measured_places(path: Path, grid: Array) -> Array:
    """Return the (g - 1, places) path positions where a run is measured, ends of steps included.

    Args:
        path: the path; its knots set the density.
        grid: (g,) path positions of the profile.
    """
    steps = len(grid) - 1
    count = max(_MEASURED * len(path.knots) // steps, _LEAST_MEASURED)
    ahead = np.diff(grid)[:, np.newaxis] * (np.arange(count + 1) / count)
    places: Array = np.minimum(grid[:-1, np.newaxis] + ahead, grid[1:, np.newaxis])
    return places


def _crests(values: Array) -> Array:
    """Return the (steps,) greatest magnitude on each step of curves given at (steps, places, n).

    Between neighbouring places at a distance h a parabola rises above their chord by at most
    h² |f''| / 8 (the remainder of linear interpolation), and h² f'' is its second difference.
    """
    rise = np.abs(np.diff(values, 2, axis=1)).max(axis=(1, 2)) / 8.0
    greatest: Array = np.abs(values).max(axis=(1, 2)) + rise
    return greatest
