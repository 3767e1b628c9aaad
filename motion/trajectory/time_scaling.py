"""Time scaling: speed override and pause of a trajectory, at any time, on its path.

Owns the time scale, its change, and the progress of a run in each phase of constant change. Let τ
be the time of the trajectory and σ = dτ/dt the scale, 0 at rest and 1 as planned. A joint whose
planned velocity and acceleration are v(τ) and a(τ) then has the velocity σ v and, with x = σ², the
acceleration

    x a + ½ (dx/dτ) v,

since dσ/dt = σ dσ/dτ = ½ dx/dτ (the substitution of Bobrow, Dubowsky and Gibson, "Time-Optimal
Control of Robotic Manipulators Along Specified Paths", 1985). The scale changes with constant dσ/dt
within each sample interval. There a is piecewise constant and v and x are linear in τ, so the
acceleration is piecewise linear and obeys its limit between two breaks if it does at both: each
break bounds dx/dτ from both sides. No change at all, dx/dτ = 0, is always within the bounds,
because x ≤ 1 and the trajectory itself obeys its limits. So there is always a way to continue; but
while the trajectory itself brakes as hard as it may, a pause has to wait.

Owns also the motion that a trajectory stands for where only its samples are known: the continuous
motion with the least acceleration through them. On an interval of length h, from (q, v) to
(q₊, v₊), the acceleration of each joint takes the fewest constant values with the least magnitude
p. With m = (v₊ - v) / h the mean acceleration and d = Δq - h (v + v₊) / 2 what the positions gain
over linearly changing velocities:

- If d = 0 the acceleration is m throughout.
- Otherwise it is sign(d) p for a share θ of the interval and -sign(d) p after, from which follow
  m = sign(d) p (2θ - 1) and |d| = (p² - m²) h² / 4p, so p = 2|d|/h² + √(4d²/h⁴ + m²).
- Where that would exceed the joint's velocity limit V, the joint reaches V, stays there and leaves
  it, both with p = (u² + u₊²) / 2D: v and v₊ are u and u₊ below V, and Δq is D below hV.

No motion that meets the samples and obeys V has a smaller greatest acceleration, so this one obeys
every velocity and acceleration limit that the trajectory was planned under.

Time comes in as integer nanoseconds of any one clock and is never read here. The motion follows
from the calls that change the scale alone, never from when or how often its state is read. Joint
vectors are controller-side driven joints in file order [rad or m, s].
"""

from __future__ import annotations

import math
from collections.abc import Iterator
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
        period: time between the samples that are joined [s].
    """

    def __init__(self, trajectory: Trajectory, limits: JointLimits) -> None:
        """Join two samples or more of the robot, or raise `BadArgument` or `WrongJointCount`."""
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


class ScalingPhase(NamedTuple):
    """Phase of constant dσ/dt.

    Attributes:
        begin: its start, from the start of the run [s].
        time: τ at its start [s].
        scale: σ at its start.
        rate: dσ/dt [1/s].
        lasts: its length [s]; infinite if nothing will change.
    """

    begin: float
    time: float
    scale: float
    rate: float
    lasts: float

    def at(self, elapsed: float) -> tuple[float, float]:
        """Return τ and σ after a time in this phase [s]."""
        scale = max(self.scale + self.rate * elapsed, 0.0)
        return self.time + 0.5 * (self.scale + scale) * elapsed, scale


RAMP = 0.1
"""Least time for the scale to go from 0 to 1, even where the joints would allow less [s]."""

_FELT = 1e-290
"""Factors below this bound nothing, and a limit divided by one may be infinite."""

_SOUND = 1.0 + 2e-3
"""Factor by which a trajectory may exceed its acceleration limits, as its certificate allows."""

_NS = 1_000_000_000


class ScaledRun:
    """Run of a trajectory whose scale may be changed at any time.

    Calls carry the time `now` [ns]. It must not go back beyond the last change, nor beyond an
    earlier call by more than the phase of constant dσ/dt that it fell in, or raises `BadArgument`.
    """

    def __init__(
        self,
        trajectory: Trajectory,
        limits: JointLimits,
        *,
        started: int,
        scale: float = 1.0,
        ramp: float = RAMP,
    ) -> None:
        """Start a run.

        Args:
            trajectory: two samples or more.
            started: time of its start [ns].
            scale: scale at the start, 0 to 1.
            ramp: least time for the scale to go from 0 to 1 [s].

        Raises:
            BadArgument: the scale or the ramp, or a trajectory that breaks the limits.
            WrongJointCount: the trajectory is of another robot.
        """
        if not 1e-3 <= ramp <= 10.0:
            raise BadArgument("ramp", ramp, "0.001 to 10 s")
        self._motion = IntersampleCheck(trajectory, limits)
        _check_soundness(trajectory, limits)
        self._limit = np.array(limits.acceleration)
        self._steepest = 2.0 / ramp
        self._end = trajectory.duration
        self._started = started
        self._wanted = _checked(scale)
        self._paused = False
        # A trajectory that starts with a velocity starts at scale 1, whatever scale is wanted.
        self._phase = self._following(0.0, 0.0, 1.0)

    @property
    def scale_wanted(self) -> float:
        """Scale that the run approaches: 0 while paused, else the one last set."""
        return 0.0 if self._paused else self._wanted

    def set_scale(self, now: int, scale: float) -> None:
        """Approach another scale from now on; while paused, after the pause.

        Raises:
            BadArgument: the scale is not 0 to 1 (faster than planned needs a new plan), or `now`
                lies before what has happened.
        """
        wanted = _checked(scale)
        self._advance(now)
        self._wanted = wanted
        self._turn(now)

    def pause(self, now: int) -> None:
        """Come to rest on the path as soon as the limits allow, and stay there."""
        self._advance(now)
        self._paused = True
        self._turn(now)

    def resume(self, now: int) -> None:
        """Continue after a pause, at the scale last set."""
        self._advance(now)
        self._paused = False
        self._turn(now)

    def state(self, now: int) -> JointState:
        """Return position, velocity and acceleration of the joints, in real time."""
        time, scale, rate = self._now(now)
        position, velocity, _ = self._motion.state(time)
        acceleration = self._motion.even_acceleration(time)
        if time >= self._end:
            final = self._motion.trajectory
            return JointState(final.position[-1], final.velocity[-1], final.acceleration[-1])
        felt = scale**2 * acceleration + rate * velocity
        # Where the acceleration jumps, its even value lies between the two for which the change of
        # scale was chosen. All joints are lowered by one factor: a controller that interpolates
        # stays on a straight line only if the accelerations are in proportion.
        felt /= max(float((np.abs(felt) / self._limit).max()), 1.0)
        # No limit is passed by rounding either.
        return JointState(position, scale * velocity, np.clip(felt, -self._limit, self._limit))

    def time(self, now: int) -> float:
        """Return τ, the time of the trajectory that the run has reached [s]."""
        return self._now(now)[0]

    def scale(self, now: int) -> float:
        """Return σ, the speed of the run as a share of the planned one, 0 to 1."""
        return self._now(now)[1]

    def finished(self, now: int) -> bool:
        """Return True if the run has reached the trajectory's end."""
        return self._now(now)[0] >= self._end

    def remaining(self, now: int) -> float:
        """Return the time left if nothing is changed any more [s], else infinity."""
        self._advance(now)
        *_, last = self._ahead()
        if last.time < self._end:
            return math.inf
        return max(last.begin - self._elapsed(now), 0.0)

    def _now(self, now: int) -> tuple[float, float, float]:
        """Return τ, σ and dσ/dt."""
        self._advance(now)
        elapsed = self._elapsed(now) - self._phase.begin
        time, scale = self._phase.at(elapsed)
        return min(time, self._end), scale, self._phase.rate

    def _elapsed(self, now: int) -> float:
        return (now - self._started) / _NS

    def _advance(self, now: int) -> None:
        """Advance to the phase that a time lies in."""
        elapsed = self._elapsed(now)
        if elapsed < self._phase.begin:
            earliest = self._started + math.ceil(self._phase.begin * _NS)
            raise BadArgument("now", now, f"{earliest} ns or later")
        for phase in self._ahead():
            self._phase = phase
            if elapsed < phase.begin + phase.lasts:
                return

    def _turn(self, now: int) -> None:
        """Start a phase now, because the scale wanted may have changed."""
        elapsed = self._elapsed(now)
        time, scale = self._phase.at(elapsed - self._phase.begin)
        self._phase = self._following(elapsed, min(time, self._end), scale)

    def _ahead(self) -> Iterator[ScalingPhase]:
        """Yield this phase and those that follow if nothing is changed, up to rest."""
        phase = self._phase
        while True:
            yield phase
            if math.isinf(phase.lasts):
                return
            time, scale = phase.at(phase.lasts)
            wanted = self.scale_wanted
            # A phase reaches the scale that it aims at, whatever the rounding.
            if phase.rate and (scale - wanted) * phase.rate >= -1e-12 * abs(phase.rate):
                scale = wanted
            phase = self._following(phase.begin + phase.lasts, self._snapped(time), scale)

    def _snapped(self, time: float) -> float:
        """Return a time, or the end of the interval if it reaches that but for rounding."""
        nearest = round(time / self._motion.period) * self._motion.period
        if abs(nearest - time) <= 1e-12 * max(self._end, 1.0):
            time = nearest
        return self._end if time >= self._end - 1e-12 * max(self._end, 1.0) else time

    def _following(self, begin: float, time: float, scale: float) -> ScalingPhase:
        """Return the phase that begins at τ and σ."""
        wanted = self.scale_wanted
        if time >= self._end:
            return ScalingPhase(begin, self._end, 0.0, 0.0, math.inf)
        if not self._motion.state(time).velocity.any():
            # At rest every scale is possible at once: σ times a velocity of 0 does not jump.
            scale = wanted
        if scale == wanted:
            lasts = (self._end - time) / scale if scale else math.inf
            return ScalingPhase(begin, time, scale, 0.0, lasts)
        place, into = self._motion.interval(time)
        least, greatest = self._slopes(place, into, scale**2)
        left = self._motion.period - into
        rate = 0.5 * (greatest if wanted > scale else least)
        if rate == 0.0:
            # The trajectory itself needs all of an acceleration here, so σ stays to the interval's
            # end.
            return ScalingPhase(begin, time, scale, 0.0, left / scale)
        # By σ² = scale² + 2 rate τ: up to the interval's end, or to the scale wanted if that is
        # reached before.
        reached = (wanted**2 - scale**2) / (2.0 * rate)
        final = wanted if reached <= left else math.sqrt(scale**2 + 2.0 * rate * left)
        return ScalingPhase(begin, time, scale, rate, (final - scale) / rate)

    def _slopes(self, place: int, into: float, x: float) -> tuple[float, float]:
        """Return the least and the greatest dx/dτ on the rest of an interval."""
        breaks, speeds, gain = self._motion.on(place)
        begins = np.maximum(breaks[:, :-1], into)
        ends = breaks[:, 1:]
        velocity = speeds[:, :-1] + gain * (begins - breaks[:, :-1])
        ahead = (ends > into) & (ends > begins)
        # The limits, or what is planned here if that is greater by the certificate's tolerance.
        kept = np.maximum(np.abs(gain).max(axis=1), self._limit)
        bound = np.broadcast_to(kept[:, np.newaxis], ends.shape)
        least, greatest = -self._steepest, self._steepest
        for at, speed in ((begins, velocity), (ends, velocity + gain * (ends - begins))):
            # |gain · x + factor · dx/dτ| <= bound
            factor = gain * (at - into) + 0.5 * speed
            felt = ahead & (np.abs(factor) > _FELT)
            size = np.abs(factor[felt])
            centre = -np.sign(factor[felt]) * gain[felt] * x
            least = max(least, float(((centre - bound[felt]) / size).max(initial=-math.inf)))
            greatest = min(greatest, float(((centre + bound[felt]) / size).min(initial=math.inf)))
        # No change is always allowed; a bound beyond 0 is rounding.
        return min(least, 0.0), max(greatest, 0.0)


def _checked(scale: float) -> float:
    if not 0.0 <= scale <= 1.0:
        raise BadArgument("scale", scale, "0 to 1; to go faster, plan the motion anew")
    return float(scale)


def _check_soundness(trajectory: Trajectory, limits: JointLimits) -> None:
    planned = np.abs(trajectory.acceleration).max(axis=0)
    for joint, (value, limit) in enumerate(zip(planned.tolist(), limits.acceleration, strict=True)):
        if not value <= limit * _SOUND:
            name = f"acceleration of {limits.names[joint]} in the trajectory"
            raise BadArgument(name, value, f"{limit:g} {limits.unit(joint)}/s² at most")
