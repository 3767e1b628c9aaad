"""Where the set-points of a motion come from, and how a certified trajectory is slowed down.

Owns the making of each set-point as late as it is needed, so that pause and override act on
everything that has not left yet. When a set-point leaves is `point_stream`'s business.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Protocol

import numpy as np

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.pose import Array
from openpendant.motion.trajectory.ptp import StraightMove
from openpendant.motion.trajectory.time_scaling import ScaledRun
from openpendant.motion.trajectory.trajectory import Row, Trajectory

_LAST_STEP = 1.5
"""Longest way to the last set-point, in sample periods; the shortest is one less."""

_MOST_REMEMBERED = 1024
"""Set-points whose places on the trajectory are known: many more than are under way."""

_SAME_TIME = 1e-6
"""Times no farther apart are one [s]: a set-point's is kept in whole nanoseconds."""

_END_STEP = 1e-4
"""To what the end of a run that was slowed down is rounded up, so that 4-byte reals hold it [s]."""


class SetpointSource(Protocol):
    """Set-points in the order of their times.

    Attributes:
        last: the set-point that was taken last; the first one before any was taken.
        is_urgent: the next set-point begins a ramp, and leaves in its turn before it is due.
    """

    last: Row
    is_urgent: bool

    @property
    def next_time(self) -> float | None:
        """Time of the next set-point from the motion's start [s]; None where none will come."""

    def take(self) -> Row:
        """Return the next set-point; only where `next_time` is not None."""


class StoredRows:
    """The samples of a certified trajectory, slowed down on their path where that is asked for.

    It may be kept at rest on its path for two reasons, and goes on when there is none left.

    Attributes:
        pause_wanted: somebody paused it, and nobody has resumed it since.
        is_held: nobody knows yet whether the way ahead is free.
    """

    is_urgent = False

    def __init__(self, samples: Trajectory | StraightMove, limits: JointLimits) -> None:
        """Begin at the first sample."""
        self.last = samples.row(0)
        self._samples = samples
        self._limits = limits
        self._next = 0
        self._due: Row | None = self.last
        self._period = samples.row(1).time if len(samples) > 1 else 0.0
        self._run: ScaledRun | None = None
        # Of the set-points of such a run that the robot may not have reached yet: time, path time.
        self._course: deque[tuple[float, float]] = deque(maxlen=_MOST_REMEMBERED)
        self._has_ended = False
        self._rests_from = 0.0
        self.pause_wanted = False
        self.is_held = False

    @property
    def next_time(self) -> float | None:
        """Time of the next set-point [s]; None after the last."""
        if self._run is not None and self._next > 0:
            return None if self._has_ended else self._scaled_time(self._run)
        return None if self._due is None else self._due.time

    def _scaled_time(self, run: ScaledRun) -> float:
        """Return the time of the next set-point of a run that was slowed down [s].

        Such a run ends between two periods. Its last set-point has the time of that end: at the
        next whole period instead, whoever interpolates would overshoot the goal and come back.
        """
        last, period = self.last.time, self._period
        # A run is never faster than planned, so that most often this tells without looking ahead.
        if self.duration - self.path_time > _LAST_STEP * period:
            return last + period
        left = run.remaining(self._clock)
        if left > _LAST_STEP * period:
            return last + period
        return last + math.ceil(left / _END_STEP) * _END_STEP

    def take(self) -> Row:
        """Return the next set-point."""
        # The first set-point is where the robot stands, at rest, at whatever scale.
        if self._run is not None and self._next > 0:
            return self._take_scaled(self._run)
        assert self._due is not None
        self.last = self._due
        self._next += 1
        more = self._next < len(self._samples)
        self._due = self._samples.row(self._next) if more else None
        self._has_ended = not more
        return self.last

    def _take_scaled(self, run: ScaledRun) -> Row:
        time = self._scaled_time(run)
        at = round(time * 1e9)
        state = run.state(at)
        if not self.is_at_rest:
            self._rests_from = time
        self.last = Row(
            time, state.position.tolist(), state.velocity.tolist(), state.acceleration.tolist()
        )
        self._course.append((time, run.time(at)))
        self._has_ended = run.finished(at)
        return self.last

    def waypoints_passed(self, reached: float) -> int:
        """Return how many waypoints after the start the robot has passed.

        Set-points leave long before it does: where it ends meanwhile, it has not been there.

        Args:
            reached: time of the set-point where the robot is [s]; never before an earlier one.
        """
        passed = (
            self._samples.trajectory().waypoint_times <= self._path_time_at(reached) + _SAME_TIME
        )
        return max(int(passed.sum()) - 1, 0)

    def _path_time_at(self, time: float) -> float:
        """Return where on the trajectory the set-point of a time was, as a time of it [s]."""
        course = self._course
        while len(course) > 1 and course[1][0] <= time:
            course.popleft()
        if not course:
            return time
        # Those before the first that was slowed down went as they were planned.
        return course[0][1] if course[0][0] <= time else min(time, course[0][1])

    @property
    def waypoints(self) -> int:
        """How many waypoints it has after its start."""
        return len(self._samples.trajectory().waypoint_times) - 1

    @property
    def path_time(self) -> float:
        """Where the set-points are on the trajectory, as a time of it [s]."""
        run = self._run
        return self.last.time if run is None else run.time(self._clock)

    @property
    def duration(self) -> float:
        """Of the trajectory [s]."""
        return self._samples.duration

    def ahead(self, begins: float, ends: float = math.inf) -> Array:
        """Return the (m, n) samples between two times of the trajectory [s], one or more."""
        whole = self._samples.trajectory()
        first = max(int(np.searchsorted(whole.times, begins, side="right")) - 1, 0)
        last = int(np.searchsorted(whole.times, ends, side="right"))
        return whole.position[first : max(last, first + 1)]

    @property
    def is_paused(self) -> bool:
        """Whether it is kept at rest for any reason, the ramp to it included."""
        return self._run is not None and self._run.scale_wanted == 0.0

    @property
    def is_at_rest(self) -> bool:
        """Whether the set-point that was taken last stands still."""
        return not any(self.last.velocity)

    @property
    def rest_time(self) -> float:
        """How long the set-points have stood still in a pause [s]; 0 while they move."""
        return self.last.time - self._rests_from if self.is_at_rest else 0.0

    @property
    def _clock(self) -> int:
        return round(self.last.time * 1e9)

    def _scaled(self) -> ScaledRun | None:
        """Return the run that can be slowed down; None where nothing is left to slow down."""
        if self._has_ended:
            return None
        if self._run is None:
            whole = self._samples.trajectory()
            self._run = ScaledRun(whole, self._limits, started=0)
        return self._run

    def pause(self) -> bool:
        """Come to rest on the path as soon as the limits allow; False where all has left."""
        self.pause_wanted = self._come_to_rest()
        return self.pause_wanted

    def hold(self) -> bool:
        """Come to rest as for a pause, until `let_go`; False where all has left."""
        self.is_held = self._come_to_rest()
        return self.is_held

    def _come_to_rest(self) -> bool:
        run = self._scaled()
        if run is not None:
            run.pause(self._clock)
        return run is not None

    def resume(self) -> None:
        """End the pause; go on along the path, unless it is held."""
        self.pause_wanted = False
        self._go_on()

    def let_go(self) -> None:
        """Hold it no longer; go on along the path, unless it is paused."""
        self.is_held = False
        self._go_on()

    def _go_on(self) -> None:
        if self._run is not None and not self.pause_wanted and not self.is_held:
            self._run.resume(self._clock)

    def scale(self, override: float) -> None:
        """Tend to a fraction of the planned speed, 0 to 1."""
        if override == 1.0 and self._run is None:
            return
        run = self._scaled()
        if run is not None:
            run.set_scale(self._clock, override)
