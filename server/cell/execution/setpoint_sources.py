"""Sources of a motion's set-points: a certified trajectory, slowed down on its path, or a jog.

Owns the making of each set-point as late as it is needed, so that pause, override and the end of a
press act on everything that has not left yet. When a set-point leaves is `point_stream`'s
business.

Owns the press of a jog key: hold-to-run, judged by the server's clock (promise 1). A press that
ended is dead for ever, because numbers only count up on a connection; a beat that comes twice or
in the wrong order counts for nothing.

Owns the joining of a press with the mathematics of `motion.jog`: what a jog message aims at, the
ramp that begins when the press ends, and the account of the stop.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.pose import Array
from openpendant.motion.trajectory.ptp import StraightMove
from openpendant.motion.trajectory.time_scaling import ScaledRun
from openpendant.motion.trajectory.trajectory import Row, Trajectory
from openpendant.simplemsg.pendant import JogEnd
from openpendant.simplemsg.verdicts import VerdictCode

from ...events.cell_events import StopAccount
from ...refusal import Refusal

if TYPE_CHECKING:
    from openpendant.motion.jog import JogCaps, Jogger, JogSetpoint, JogTarget


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


SHORTEST_DEADLINE = 0.05
LONGEST_DEADLINE = 0.25
"""Bounds of the deadline that a press may declare [s]."""


@dataclass(slots=True)
class Press:
    """A key that is held.

    Attributes:
        deadline_ns: the press ends so long after its last beat.
        heard: when the last beat came [ns].
        ended_at: when [ns].
        awaits_release: it ended because its enabling device was let go; a STOP follows shortly,
            unless the key is released as well.
    """

    session: int
    number: int
    deadline_ns: int
    heard: int
    beat: int = 0
    ended: JogEnd | None = None
    ended_at: int = 0
    awaits_release: bool = False

    def take_beat(self, session: int, number: int, beat: int, now: int) -> None:
        """Prolong the press; a beat of another press, or a late, old or repeated one, does not."""
        if self.ended is None and (session, number) == (self.session, self.number):
            if beat > self.beat and not self.is_overdue(now):
                self.beat = beat
                self.heard = now

    def is_overdue(self, now: int) -> bool:
        """Return True if the deadline has passed without a beat."""
        return now - self.heard >= self.deadline_ns

    def end(self, why: JogEnd, now: int) -> None:
        """End the press; the first reason counts, but for a release that was awaited."""
        if self.ended is None:
            self.ended = why
            self.ended_at = now
        elif self.awaits_release and why is JogEnd.RELEASED:
            self.ended, self.awaits_release = why, False

    def cut_short(self, now: int) -> None:
        """Take note that a STOP ends it, or its ramp; that is what is told of it."""
        self.end(JogEnd.STOPPED, now)
        self.ended, self.awaits_release = JogEnd.STOPPED, False


class PressCounter:
    """The highest press number of each connection; none is taken twice."""

    def __init__(self) -> None:
        self._highest: dict[int, int] = {}

    def begin(self, session: int, number: int, deadline: float, now: int) -> Press | Refusal:
        """Begin a press.

        Args:
            deadline: declared, s.

        Returns:
            The press, or why it is refused. A number that was refused for another reason later is
            used up all the same.
        """
        if not SHORTEST_DEADLINE <= deadline <= LONGEST_DEADLINE:
            text = f"deadline {deadline:g} s; accepted: {SHORTEST_DEADLINE:g} to"
            return Refusal(
                VerdictCode.BAD_ARGUMENT,
                f"{text} {LONGEST_DEADLINE:g} s",
                value=deadline,
                limit=LONGEST_DEADLINE,
            )
        highest = self._highest.get(session, 0)
        if number <= highest:
            text = f"press {number}; the next number of this connection is {highest + 1} or higher"
            return Refusal(VerdictCode.PRESS_DEAD, text)
        self._highest[session] = number
        return Press(session, number, round(deadline * 1e9), now)

    def forget(self, session: int) -> None:
        """Forget a connection that ended; its number is never given to another."""
        self._highest.pop(session, None)


JOG_PERIOD = 0.01
"""Time between two set-points of a jog [s]."""


class JogRows:
    """The set-points of a jog, made one by one.

    Attributes:
        step: the last step of the mathematics, with scale and reason; None before the first.
        start: (n,) where it began [rad or m].
        is_urgent: the press has ended since the last set-point, so that the next one slows down.
        ramp_began: the tick from which on it slows down because the press ended [ns]; None before.
    """

    def __init__(
        self, jogger: Jogger, start: Sequence[float], target: JogTarget, press: Press
    ) -> None:
        """Begin at rest where the robot stands."""
        rest = [0.0] * len(start)
        self.last = Row(0.0, list(start), rest, rest)
        self.press = press
        self.step: JogSetpoint | None = None
        self.start = tuple(start)
        self.is_urgent = False
        self.ramp_began: int | None = None
        self._jogger = jogger
        self._taken = 0
        self._released_at: Row | None = None
        jogger.aim(target)

    @property
    def next_time(self) -> float | None:
        """Time of the next set-point [s]; None once the press has ended and it stands."""
        if self._released_at is not None and self._taken and not any(self.last.velocity):
            return None
        return self._taken * JOG_PERIOD

    def take(self) -> Row:
        """Make and return the next set-point."""
        time = self._taken * JOG_PERIOD
        self._taken += 1
        self.is_urgent = False
        if time == 0.0:
            return self.last
        step = self._jogger.step(JOG_PERIOD)
        self.step = step
        self.last = Row(time, step.position, step.velocity, step.acceleration)
        return self.last

    def way_back(self) -> tuple[tuple[float, ...], ...]:
        """Return the waypoints from where it is now back to where it began, the start last."""
        here, *back = self._jogger.way.way_back()
        return tuple(back) or (here,)

    def aim(self, target: JogTarget, press: Press) -> None:
        """Let a new press take over, smoothly; the old one is dead."""
        self.press = press
        self.is_urgent = False
        self.ramp_began = None
        self._released_at = None
        self._jogger.aim(target)

    def limit(self, caps: JogCaps) -> None:
        """Let other caps rule from the next set-point on."""
        self._jogger.limit(caps)

    def release(self, why: JogEnd, now: int) -> None:
        """End the press: from the next set-point on the robot ramps to rest."""
        self.press.end(why, now)
        if self._released_at is None:
            self._released_at = self.last
            self.is_urgent = True
            self._jogger.aim(None)

    def lose_enabling(self, now: int) -> None:
        """End the press because its enabling device was let go while the key was held."""
        self.release(JogEnd.STOPPED, now)
        self.press.awaits_release = True

    def account(self) -> StopAccount:
        """Return how it came to rest; of a jog that stands, or was stopped by the controller."""
        began = self._released_at or self.last
        gaps = [abs(a - b) for a, b in zip(began.position, self.last.position, strict=True)]
        return StopAccount(
            self.press.number,
            self.press.ended or JogEnd.STOPPED,
            self.last.time - began.time,
            max(gaps, default=math.nan),
            tuple(began.position),
            tuple(self.last.position),
        )
