"""Trajectory: a motion as samples of position, velocity and acceleration, usually every 10 ms.

Owns the layout of a timed motion and the accepted values of a request for one (speed fraction,
sample period, longest duration). Knows no robot, and not how the samples were found. All vectors
are controller-side driven joints in file order [rad or m, s].
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..errors import BadArgument
from ..pose import Array

SAMPLE_PERIOD = 0.01
"""Time between samples [s]."""

FINER = 8
"""Number of parts that the fine samples of a curved motion divide a sample period into."""

MOST_FINE = 30_000
"""Greatest number of samples of a motion with fine samples: five minutes of 10 ms."""

MAX_DURATION = 3600.0
"""Longest motion that is sampled [s]; a longer one is refused, as it would fill the memory."""


class JointState(NamedTuple):
    """State of a motion at one time; each array is (n,)."""

    position: Array
    velocity: Array
    acceleration: Array


class Row(NamedTuple):
    """One sample of a motion as plain numbers; each list has n values."""

    time: float
    position: list[float]
    velocity: list[float]
    acceleration: list[float]


@dataclass(frozen=True, slots=True, eq=False)
class FineSamples:
    """Samples of a motion at `FINER` times as many places, for a run that is slower than planned.

    Between two samples the motion is known approximately only: on a curved path the error is about
    1e-5 rad where the acceleration changes. Between fine samples it is 500 times less. The arrays
    are read-only; every `FINER`th row is that of a sample.

    Attributes:
        position: (FINER (m - 1) + 1, n) [rad or m].
        velocity: likewise [rad/s or m/s].
    """

    position: Array
    velocity: Array

    def __post_init__(self) -> None:
        if self.velocity.shape != self.position.shape:
            raise BadArgument("fine velocity", self.velocity.shape, "the shape of fine position")
        self.position.flags.writeable = False
        self.velocity.flags.writeable = False

    def __reduce__(self) -> tuple[Callable[..., FineSamples], tuple[Array, ...]]:
        # Through the constructor: numpy forgets on the way that an array was read-only.
        return FineSamples, (_by_rows(self.position), _by_rows(self.velocity))


def _by_rows(array: Array) -> Array:
    """Return an array whose rows lie one behind the other, so that whoever gets it copies none."""
    return np.ascontiguousarray(array)


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Motion that ends at rest; the arrays are read-only and hold m samples of n joints.

    Every sample lies exactly on one continuous motion. An acceleration may jump at a sample: the
    value is the one that holds from the sample on, and 0 at the last, after which the robot stands
    still.

    Attributes:
        times: (m,) from 0 [s], evenly spaced.
        position: (m, n) [rad or m].
        velocity: (m, n) [rad/s or m/s]; 0 at the last sample, and at the first unless it was
            planned from a moving state.
        acceleration: (m, n) [rad/s² or m/s²].
        waypoint_times: (w,) when the motion passes each waypoint it was planned through [s].
        fine: fine samples of the same motion; None where the samples define it fully, or where
            nothing more is known.
    """

    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    waypoint_times: Array
    fine: FineSamples | None = None

    def __post_init__(self) -> None:
        shape = self.position.shape
        if len(shape) != 2 or not shape[0] or self.times.shape != shape[:1]:
            raise BadArgument("position", shape, "one row of joints for each time")
        if self.velocity.shape != shape or self.acceleration.shape != shape:
            raise BadArgument("velocity and acceleration", shape, "the shape of position")
        if self.fine is not None and len(self.fine.position) != FINER * (shape[0] - 1) + 1:
            found = len(self.fine.position)
            raise BadArgument("fine samples", found, f"{FINER} to each sample period")
        for array in (
            self.times,
            self.position,
            self.velocity,
            self.acceleration,
            self.waypoint_times,
        ):
            array.flags.writeable = False

    def __reduce__(
        self,
    ) -> tuple[Callable[..., Trajectory], tuple[Array | FineSamples | None, ...]]:
        # Through the constructor: numpy forgets on the way that an array was read-only.
        return Trajectory, (
            self.times,
            _by_rows(self.position),
            _by_rows(self.velocity),
            _by_rows(self.acceleration),
            self.waypoint_times,
            self.fine,
        )

    @property
    def dof(self) -> int:
        """Number of joints."""
        return int(self.position.shape[1])

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.times[-1])

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.times)

    @property
    def final(self) -> tuple[float, ...]:
        """Last position, (n,) [rad or m]."""
        return tuple(self.position[-1].tolist())

    def row(self, index: int) -> Row:
        """Return one sample as plain numbers."""
        return Row(
            float(self.times[index]),
            self.position[index].tolist(),
            self.velocity[index].tolist(),
            self.acceleration[index].tolist(),
        )

    def trajectory(self) -> Trajectory:
        """Return itself: all samples as arrays."""
        return self

    def sample(self, time: float) -> JointState:
        """Return the motion at a time; before the start and after the end it is at rest.

        The position between two samples is the cubic that meets both positions and velocities.
        Velocity and acceleration are interpolated linearly, so they never exceed what the samples
        themselves keep to.

        Args:
            time: from the start of the motion [s].

        Raises:
            BadArgument: the time is not a number.
        """
        if math.isnan(time):
            raise BadArgument("time", time, "a number of seconds")
        if time >= self.duration:
            return JointState(self.position[-1], self.velocity[-1], self.acceleration[-1])
        left = max(int(np.searchsorted(self.times, time, side="right")) - 1, 0)
        step = float(self.times[left + 1] - self.times[left])
        u = max(time - float(self.times[left]), 0.0) / step
        w = 1.0 - u
        position, velocity, acceleration = (
            field[left : left + 2] for field in (self.position, self.velocity, self.acceleration)
        )
        return JointState(
            w * w * ((1.0 + 2.0 * u) * position[0] + u * step * velocity[0])
            + u * u * ((1.0 + 2.0 * w) * position[1] - w * step * velocity[1]),
            w * velocity[0] + u * velocity[1],
            w * acceleration[0] + u * acceleration[1],
        )


def join(legs: Sequence[Trajectory]) -> Trajectory:
    """Return one trajectory that runs several in sequence, at rest where they meet.

    Args:
        legs: at least one, each starting where the one before ends, with one sample period.

    Raises:
        BadArgument: no legs, or a leg that starts elsewhere or has another sample period.
    """
    if not legs:
        raise BadArgument("legs", 0, "at least one trajectory")
    period = legs[0].times[1]
    for number, (before, after) in enumerate(pairwise(legs), start=1):
        if not np.array_equal(before.position[-1], after.position[0]):
            raise BadArgument("legs", f"leg {number} starts elsewhere", "legs that meet exactly")
        if after.times[1] != period:
            raise BadArgument("legs", float(after.times[1]), f"a sample period of {period:g} s")
    # A leg's last sample is the next one's first and is left out: accelerations hold from a sample
    # on.
    parts = [slice(0, -1)] * (len(legs) - 1) + [slice(None)]
    starts = np.cumsum([0] + [len(leg.times) - 1 for leg in legs])
    return Trajectory(
        times=np.arange(starts[-1] + 1) * period,
        position=np.concatenate([leg.position[p] for leg, p in zip(legs, parts, strict=True)]),
        velocity=np.concatenate([leg.velocity[p] for leg, p in zip(legs, parts, strict=True)]),
        acceleration=np.concatenate(
            [leg.acceleration[p] for leg, p in zip(legs, parts, strict=True)]
        ),
        waypoint_times=np.concatenate(
            [
                leg.waypoint_times[p] + start * period
                for leg, p, start in zip(legs, parts, starts[:-1], strict=True)
            ]
        ),
        fine=_joined_fine([leg.fine for leg in legs], parts),
    )


def _joined_fine(fine: Sequence[FineSamples | None], parts: Sequence[slice]) -> FineSamples | None:
    """Return the fine samples of legs that follow one another; None where one has none."""
    known = [each for each in fine if each is not None]
    rows = sum(len(each.position) for each in known)
    if len(known) < len(fine) or rows > FINER * MOST_FINE:
        return None
    return FineSamples(
        np.concatenate([each.position[p] for each, p in zip(known, parts, strict=True)]),
        np.concatenate([each.velocity[p] for each, p in zip(known, parts, strict=True)]),
    )


def check_rates(speed: float, sample_period: float) -> None:
    """Check the speed fraction and sample period of a request.

    Args:
        speed: fraction of the velocity limits, above 0 and at most 1.
        sample_period: time between samples [s], 0.1 ms to 1 s.

    Raises:
        BadArgument: one of them is outside.
    """
    if not 0.0 < speed <= 1.0:
        raise BadArgument("speed", speed, "more than 0 and at most 1")
    if not 1e-4 <= sample_period <= 1.0:
        raise BadArgument("sample_period", sample_period, "0.0001 to 1 s")
