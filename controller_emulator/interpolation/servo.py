"""Servo: the motion along the buffered legs by the clock, and its stop.

Owns where the robot is at any instant, when a buffered motion starts, and what happens at the end
of the buffer: hold at a point of rest, stop ramp on an under-run. All transitions take place at
their exact times, however late `advance` is called. Knows no messages, no links and no operators.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from ..error_codes import ErrorCode, PointRefusal
from ..float32 import NANOSECONDS
from .legs import Knot, MotionLeg, PointBuffer
from .lookahead import LOOKAHEAD, begin, can_rest
from .segment import MotionSegment, State
from .stop_ramp import AxisLimits, Ramp

_TO_TAKE_POINTS = 20_000_000
"""Points that waited while nobody took any are taken, and answered, within this time [ns]."""


class ServoPhase(Enum):
    """Phase of the servo's motion."""

    RESTING = "nothing to do"
    COLLECTING = "points are buffered, their clock has not started"
    MOVING = "running buffered legs"
    STOPPING = "on a stop ramp"


class StartRule(NamedTuple):
    """Rule for the start of a streamed motion.

    Attributes:
        points: at least this many points are buffered …
        lead: … and at least this much motion [ns];
        wait: or this long after the last point, if no more come [ns];
        patience: or this long, if that point is to be passed at speed, so that more must come [ns].
    """

    points: int
    lead: int
    wait: int
    patience: int


class Servo:
    """The axes of one robot.

    Attributes:
        sequence: number of the point that it moves to, or moved to last.
    """

    def __init__(
        self, axes: AxisLimits, start: tuple[float, ...], depth: int, rule: StartRule
    ) -> None:
        """Put the robot at rest.

        Args:
            start: (n,) where the robot stands [rad or m].
        """
        self.phase = ServoPhase.RESTING
        self.buffer = PointBuffer(depth)
        self.sequence = 0
        self._axes = axes
        self._rule = rule
        self._zeros = (0.0,) * len(start)
        self._since = 0
        self._until: int | None = None  # the end of the phase or leg; None: nothing is due
        self._segment: MotionSegment | Ramp | None = None
        self._state: State = (start, self._zeros, self._zeros)
        self._end_velocity = self._zeros

    @property
    def at_rest(self) -> bool:
        """True unless the axes move or are about to."""
        return self.phase is ServoPhase.RESTING

    @property
    def in_motion(self) -> bool:
        """True while a motion runs, dwells included, and from when its start is certain.

        A streamed point that waits for others will be moved to, though the axes rest until then.
        """
        return self._until is not None

    def tail(self) -> Knot:
        """Return the state in which the buffered motion ends; the present one if there is none."""
        last = self.buffer.last
        if last is None:
            return Knot.at_rest(self._state[0])
        if self.phase is ServoPhase.MOVING and last is self.buffer.first:
            # The stated velocity may be open, or closed since: the leg keeps its end velocity.
            velocity = self._end_velocity
            return last.end if last.end.velocity is velocity else last.end.with_velocity(velocity)
        return last.end

    def sample(self, now: int) -> State:
        """Return position, velocity and acceleration; call `advance` with the same time first."""
        if self._segment is None:
            return self._state
        until = self._until
        assert until is not None
        time = now if now < until else until
        return self._segment.sample((time - self._since) / NANOSECONDS)

    def append(self, leg: MotionLeg, now: int, *, streamed: bool) -> None:
        """Buffer a leg; `advance` afterwards may start it.

        Args:
            leg: an admitted leg; the caller has looked at `buffer.room`.
            streamed: the start rule applies; else `go` starts the motion.
        """
        self.buffer.append(leg)
        if self.phase is ServoPhase.RESTING:
            self.phase = ServoPhase.COLLECTING
            self._until = None
        if self.phase is ServoPhase.COLLECTING and streamed:
            self._until = now + self._start_delay(leg)

    def _start_delay(self, last: MotionLeg) -> int:
        rule = self._rule
        if len(self.buffer) >= rule.points and self.buffer.span >= rule.lead:
            return 0
        return rule.wait if self._may_rest_at(last) else rule.patience

    def _may_rest_at(self, last: MotionLeg) -> bool:
        """Return True if the buffered motion, started at rest, may end with its last leg."""
        if last.end.velocity is not None:
            return self._axes.is_rest(last.end.velocity)
        first = self.buffer.first
        assert first is not None
        # With more legs than the lookahead, the interpolator decides about rest on the way.
        return len(self.buffer) > LOOKAHEAD or can_rest([first, *self.buffer.ahead(LOOKAHEAD)])

    def go(self, now: int) -> None:
        """Close the buffered motion at its last point, and start it if it has not started."""
        self.buffer.close()
        if self.phase is ServoPhase.COLLECTING:
            self._until = now

    def stop(self, now: int) -> int:
        """Flush the buffer and ramp down from wherever the axes are; return what was flushed."""
        flushed = self.buffer.clear()
        if self.phase is ServoPhase.COLLECTING:
            self._rest(self._state[0])
        elif self.phase is ServoPhase.MOVING:
            self._ramp(self.sample(now), now)
        return flushed

    def excuse(self, since: int, until: int) -> None:
        """Prevent an under-run that only a freeze of this process would cause.

        Where what is buffered would end at speed before the end of that time, and a while behind
        it, they are as much later as it takes. They never go back. To be called before `advance`
        with a time behind `since`.

        Args:
            since: when points were last taken [ns].
            until: when they are taken again [ns].
        """
        away = until - since
        if self.phase is ServoPhase.COLLECTING and self._until is not None:
            self._until += away
        elif self.phase is ServoPhase.MOVING:
            dry = self._runs_dry()
            if dry is not None and dry < until + _TO_TAKE_POINTS:
                later = min(until + _TO_TAKE_POINTS - dry, away)
                assert self._until is not None
                self._since += later
                self._until += later

    def _runs_dry(self) -> int | None:
        """Return when the buffered legs end at speed [ns]; None where they end at rest."""
        last = self.buffer.last
        assert last is not None
        end = self._since + self.buffer.span
        velocity = self._end_velocity if last is self.buffer.first else last.end.velocity
        if velocity is None:
            # The end velocity is chosen at the start of a leg; by then the next must be buffered.
            return end - last.duration
        return None if self._axes.is_rest(velocity) else end

    def advance(self, now: int) -> PointRefusal | None:
        """Advance to a time, through every transition before it; return why the motion broke off.

        None where it did not; else a ramp began at that time.
        """
        while self._until is not None and now >= self._until:
            at = self._until
            problem = self._begin(at) if self.phase is ServoPhase.COLLECTING else self._finish(at)
            if problem is not None:
                self.buffer.clear()
                self._ramp(self._state, at)
                return problem
        return None

    def _begin(self, at: int) -> PointRefusal | None:
        """Start the first leg at a time, from the present state."""
        leg = self.buffer.first
        assert leg is not None
        position, velocity, _ = self._state
        self.phase = ServoPhase.MOVING
        self.sequence = leg.sequence
        self._since, self._until = at, at + leg.duration
        if leg.duration == 0:
            self._segment, self._end_velocity = None, self._zeros
            return None
        if leg.segment is not None:
            assert leg.end.velocity is not None
            self._segment, self._end_velocity = leg.segment, leg.end.velocity
            return None
        ahead = self.buffer.ahead(LOOKAHEAD)
        begun = begin(leg, position, velocity, ahead)
        if isinstance(begun, PointRefusal):
            ran_dry = not ahead and not self._axes.is_rest(velocity)
            return PointRefusal(ErrorCode.BUFFER_UNDERRUN) if ran_dry else begun
        self._segment, self._end_velocity = begun
        return None

    def _finish(self, at: int) -> PointRefusal | None:
        """End the present leg or ramp at a time and start what follows."""
        if isinstance(self._segment, Ramp):
            self._rest(self._segment.final)
            return None
        leg = self.buffer.first
        assert leg is not None
        self.buffer.drop_first()
        self._segment = None
        self._state = (leg.end.position, self._end_velocity, self._zeros)
        following = self.buffer.first
        if following is not None:
            is_open = following is self.buffer.last and following.end.velocity is None
            if (
                is_open
                and self._axes.is_rest(self._end_velocity)
                and not self._may_rest_at(following)
            ):
                # The stream fell behind; by its start rule it continues once enough is buffered.
                self._rest(leg.end.position)
                self.phase, self._until = ServoPhase.COLLECTING, at + self._rule.patience
                return None
            return self._begin(at)
        if self._axes.is_rest(self._end_velocity):
            self._rest(leg.end.position)
            return None
        return PointRefusal(ErrorCode.BUFFER_UNDERRUN)

    def _ramp(self, state: State, at: int) -> None:
        position, velocity, _ = state
        ramp = Ramp(position, velocity, self._axes)
        if not ramp.duration:
            self._rest(position)
            return
        self.phase = ServoPhase.STOPPING
        self._segment = ramp
        self._since, self._until = at, at + round(ramp.duration * NANOSECONDS)

    def _rest(self, position: tuple[float, ...]) -> None:
        self.phase = ServoPhase.RESTING
        self._until = None
        self._segment = None
        self._state = (position, self._zeros, self._zeros)
