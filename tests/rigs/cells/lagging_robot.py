"""A robot whose joints lag each by itself, whose reports are noisy and late; and what drives it.

Owns a controller that obeys its points to the letter, on its own clock, and a drive of the server
that is joined with it on a virtual clock. Nothing of what the server accepts is known here: the
reports are made from lags, noise and delays that a test declares.
"""

from bisect import bisect_right
from collections import deque
from collections.abc import Sequence
from random import Random

from promises.promise_table import figure
from rigs.cells.controller_reports import joint_report

from openpendant.motion.description.limits import JointLimits
from openpendant.server.cell.execution.feedback import Feedback
from openpendant.server.cell.execution.motion_watch import ArmPoints
from openpendant.server.cell.execution.trajectory_execution import TrajectoryExecution
from openpendant.server.events.cell_events import CellEvent, MotionEnded
from openpendant.server.events.effects import Effect, SendStop, SendToController
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.simplemsg import (
    JointTrajPtFull,
    Message,
    ReplyCode,
    joint_array,
)

MS = 1_000_000
TICK = 10 * MS
_LONGEST_DELAY = figure(52, "late").ns

Measured = tuple[tuple[float, ...], tuple[float, ...]]
"""(n,) places [rad or m] and (n,) speeds [rad/s or m/s]."""


class LaggingRobot:
    """Follows timed points; joint j is where they put it `lags[j]` seconds ago.

    Attributes:
        waited: for how long it stood because the next point had not come [ns].
    """

    def __init__(
        self, limits: JointLimits, start: Sequence[float], lags: Sequence[float], setting_off: int
    ) -> None:
        """Stand at a place.

        Args:
            start: (n,) where it stands.
            lags: (n,) of its joints [s].
            setting_off: it begins so long after its first point came [ns].
        """
        self._limits = limits
        self._lags = [round(lag * 1e9) for lag in lags]
        self._setting_off = setting_off
        self._times: list[int] = []
        self._points: list[JointTrajPtFull] = []
        self._start = tuple(start)
        self._began = 0
        self.waited = 0
        self._clock: list[tuple[int, int]] = []  # of it, by ours
        self._stopped_at: int | None = None
        self._ramps: list[tuple[float, float]] = []

    def take(self, point: JointTrajPtFull, now: int) -> None:
        if not self._points:
            self._began = now + self._setting_off
        self._points.append(point)
        self._times.append(round(point.time * 1e9))

    def stop(self, now: int) -> None:
        if self._stopped_at is None:
            here = self.position(now)
            before = self.position(now - MS)
            self._ramps = [(a, (a - b) / 1e-3) for a, b in zip(here, before, strict=True)]
            self._stopped_at = now

    def advance(self, now: int) -> None:
        """Let its own clock run, which waits where a moving robot has no next point."""
        if not self._points:
            return
        own = max(now - self._began - self.waited, 0)
        if own > self._times[-1] and any(self._points[-1].velocities):
            self.waited += own - self._times[-1]
            own = self._times[-1]
        self._clock.append((now, own))

    def stock(self, now: int) -> int:
        """Return for how long it can go on with the points that it has [ns]."""
        return self._times[-1] - self._own(now)

    def position(self, now: int) -> tuple[float, ...]:
        if self._stopped_at is not None and now >= self._stopped_at:
            return self._braking((now - self._stopped_at) / 1e9)
        return tuple(self._commanded(j, self._own(now - lag)) for j, lag in enumerate(self._lags))

    def _own(self, now: int) -> int:
        """Return its own clock at a time of ours."""
        after = bisect_right(self._clock, (now, 1 << 62))
        if after == 0:
            return 0
        then, own = self._clock[after - 1]
        if after == len(self._clock):
            return own
        next_then, next_own = self._clock[after]
        return own + (next_own - own) * (now - then) // (next_then - then)

    def _commanded(self, joint: int, own: int) -> float:
        """Return where the points put a joint, by the cubic through two places and speeds."""
        after = bisect_right(self._times, own)
        if after == 0:
            return self._start[joint]
        one = self._points[after - 1]
        if after == len(self._points):
            return one.positions[joint]
        other = self._points[after]
        step = (self._times[after] - self._times[after - 1]) / 1e9
        t = (own - self._times[after - 1]) / 1e9 / step
        a, b = one.positions[joint], other.positions[joint]
        u, v = one.velocities[joint] * step, other.velocities[joint] * step
        way = b - a
        return a + t * (u + t * (3 * way - 2 * u - v + t * (u + v - 2 * way)))

    def _braking(self, time: float) -> tuple[float, ...]:
        """Return where it is in a stop: each joint brakes for itself, as hard as it may."""
        places = []
        for (place, speed), hardest in zip(self._ramps, self._limits.acceleration, strict=True):
            brakes = min(time, abs(speed) / hardest)
            sign = 1.0 if speed > 0 else -1.0
            places.append(place + speed * brakes - sign * hardest * brakes * brakes / 2)
        return tuple(places)


class Delays:
    """How late each report is, 0 to 200 ms; none overtakes one before it."""

    def __init__(self, chance: Random, *, is_prompt: bool = False) -> None:
        self._chance = chance
        kinds = ("none",) if is_prompt else ("none", "steady", "each", "bursts", "growing")
        self._kind = chance.choice(kinds)
        self._most = chance.randint(10 * MS, _LONGEST_DELAY)
        self._hold_until = 0

    def of(self, now: int) -> int:
        """Return the delay of what is measured now [ns]."""
        match self._kind:
            case "none":
                return 0
            case "steady":
                return self._most
            case "each":
                return self._chance.randint(0, self._most)
            case "growing":
                return now // 8 % self._most
        if now >= self._hold_until and self._chance.random() < 0.1:
            self._hold_until = now + self._chance.randint(0, self._most)
        return max(self._hold_until - now, 0)


class TrackedDrive:
    """The server's drive of one robot, and the robot, on one clock.

    Attributes:
        alarms: why a protective stop was asked for.
        ended: why the motions ended; None for one that arrived.
    """

    def __init__(
        self,
        limits: JointLimits,
        link: ControllerLink,
        robot: LaggingRobot,
        points: ArmPoints | None = None,
        cap: float | None = None,
        *,
        chance: Random,
        is_prompt: bool = False,
    ) -> None:
        """Join both.

        Args:
            link: how the server talks to it; says its noise.
            points: whose speed a mode caps.
            cap: of that speed [m/s].
            chance: decides delays and noise.
        """
        self.now = 1_000_000_000
        self.robot = robot
        self.alarms: list[Refusal] = []
        self.ended: list[Refusal | None] = []
        self.feedback = Feedback(limits.dof, link)
        self.driving = TrajectoryExecution(
            link, limits, self.feedback, self._news, self._fault, lambda _: [], cap=lambda: cap
        )
        self.driving.points = points
        self._chance = chance
        self._noise = link.noise
        self._delays = Delays(chance, is_prompt=is_prompt)
        self._under_way: deque[tuple[int, Measured]] = deque()
        self._report(self._measured(), self.now)

    def _news(self, news: CellEvent, now: int) -> list[Effect]:
        if isinstance(news, MotionEnded):
            self.ended.append(news.refusal)
        return []

    def _fault(self, refusal: Refusal, now: int) -> list[Effect]:
        self.alarms.append(refusal)
        return self.driving.halt(refusal, now)

    def perform(self, outgoing: list[Effect]) -> None:
        """Carry out what the drive asks for; each point is answered at once."""
        for item in outgoing:
            match item:
                case SendToController(message=JointTrajPtFull() as point):
                    self.robot.take(point, self.now)
                    self.perform(self.driving.answered(_taken(point), 0, self.now))
                case SendStop():
                    self.robot.stop(self.now)

    def run(self, milliseconds: int) -> None:
        """Let time pass: the robot measures and the drive ticks every 10 ms."""
        for _ in range(0, milliseconds, 10):
            self.now += TICK
            self.robot.advance(self.now)
            arrives = self.now + self._delays.of(self.now)
            if self._under_way:
                arrives = max(arrives, self._under_way[-1][0])
            self._under_way.append((arrives, self._measured()))
            # Those that arrive by now were read in one turn, or in turns close to each other.
            read = self.now
            while self._under_way and self._under_way[0][0] <= self.now:
                self._report(self._under_way.popleft()[1], read)
                read += self._chance.choice((0, 0, 50_000))
            self.perform(self.driving.settle(self.now))
            self.perform(self.driving.advance(max(read, self.now)))
            self.now = max(read, self.now) // TICK * TICK

    def _measured(self) -> Measured:
        """Return places with noise, and speeds that a controller would have filtered."""
        here, before = self.robot.position(self.now), self.robot.position(self.now - MS)
        noise = self._noise
        places = tuple(place + self._chance.uniform(-noise, noise) for place in here)
        return places, tuple((a - b) / 1e-3 for a, b in zip(here, before, strict=True))

    def _report(self, measured: Measured, now: int) -> None:
        self.feedback.take(joint_report(*measured), now)
        self.perform(self.driving.reported(now))


def _taken(point: JointTrajPtFull) -> Message:
    return JointTrajPtFull(
        0, point.sequence, 0, 0.0, *(joint_array(()),) * 3, reply_code=ReplyCode.SUCCESS
    )
