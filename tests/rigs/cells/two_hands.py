"""Two hands of a pendant to the nanosecond: a key and an enabling device; ticks that may be late.

What arrives until a tick is read before it, as the server's loop does. Owns the two sizes that
tests compare: when the ramp of a jog began, and when a STOP left.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from rigs.cells.robot_cell_situations import enabled
from rigs.cells.server_rig import MS, TICK, ServerRig
from rigs.motion.jog_pad import JogPad

from openpendant.server.events.effects import SendToController
from openpendant.simplemsg import JointTrajPtFull, joint_array
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode as V

HELD, RELEASED = messages.EnablingPosition.HELD, messages.EnablingPosition.RELEASED
PANIC = messages.EnablingPosition.PANIC
PERIOD = 40 * MS

Act = Callable[["TwoHands"], object]
Timeline = Iterable[tuple[int, Act]]
"""What arrives, each with its time from the beginning [ns]."""


def tick_at(time: int) -> int:
    """Return the first tick at or after a time, both from the beginning [ns]."""
    return -(-time // TICK) * TICK


@dataclass(frozen=True, slots=True)
class Seen:
    """What a jog, or a motion, was seen to do, in times from the beginning [ns].

    Attributes:
        ramp: when the first set-point left that is slower than the one before; None for none.
        stops: when a STOP left first; None for none.
        told: why the press ended, as JOG_ENDED tells; None where it has not.
        code: of the outcome; None where there is none.
    """

    ramp: int | None
    stop: int | None
    told: messages.JogEnd | None
    code: V | None


class TwoHands(JogPad):
    """A pad whose messages arrive when a test says so."""

    def __init__(self, rig: ServerRig, version: int, silence: float) -> None:
        super().__init__(rig, version=version, silence=silence)
        self.began = rig.now
        self._ticked = rig.now
        self.rate = 0.0  # of the key that was pressed last, -1 to 1
        self._before = 0.0  # the speed of the last set-point before time began

    # One message each; none waits for its answer.

    def device(self, position: int) -> None:
        self.pendant.send(messages.Enabling(position))

    def key_up(self) -> None:
        self.pendant.send(messages.JogRelease(self._request(), self.press_number))

    def key_down(self, rate: float, deadline: float) -> None:
        """Press a key, with an ENABLING in front of it."""
        self.device(HELD)
        self.rate = rate
        self.press(rate, 0.0, deadline=deadline)

    def key_again(self, deadline: float) -> None:
        """Press the key that was pressed last."""
        self.press(self.rate, 0.0, deadline=deadline)

    def move(self) -> None:
        goal = joint_array((-1.5, 0.0))
        self.pendant.send(messages.JointMove(self._request(), 0.2, 2, goal))

    # Time.

    def jog(self, deadline: float, warm: int = 8) -> None:
        """Press, and hold until the jog is at its speed; time counts from the last of its signs."""
        away = 1.0 if self.rig.controller.position[0] < 0 else -1.0
        self.device(RELEASED)
        self.key_down(away, deadline)
        assert self.is_pressed, self.pendant.verdicts()[-1:]
        for _ in range(warm):
            self.rig.wait(40)
            self.device(HELD)
            self.beat()
        self.begin()

    @property
    def newest_speed(self) -> float:
        """The speed of joint 1 in the last set-point that left [rad/s]."""
        return next((speed for _, speed in reversed([*self.speeds()])), self._before)

    def rest(self) -> None:
        """Let go of both, and wait until the robot stands."""
        self.key_up()
        self.device(RELEASED)
        for _ in range(100):
            self.rig.wait(10)
            if not self.rig.core.cell.is_busy:
                return
        raise AssertionError("the robot does not come to rest")

    def begin(self) -> None:
        """Let time count from now, and forget what was seen."""
        self._before = self.newest_speed
        self.began = self._ticked = self.rig.now
        self.rig.log.clear()
        self.rig.points.clear()
        self.pendant.got[:-1] = []

    def play(
        self,
        timeline: Timeline,
        until: int,
        left_out: Iterable[int] = (),
        tick: Callable[[], object] | None = None,
    ) -> None:
        """Let messages arrive and ticks pass, to a time from the beginning [ns].

        Args:
            left_out: ticks that do not come, as times from the beginning [ns].
            tick: called in the place of the server's tick, which it has to make.
        """
        arriving = sorted(timeline, key=lambda each: each[0])
        missing = {self.began + each for each in left_out}
        while self._ticked < self.began + until:
            self._ticked += TICK
            while arriving and self.began + arriving[0][0] <= self._ticked:
                at, act = arriving.pop(0)
                self.rig.now = self.began + at
                act(self)
            self.rig.now = self._ticked
            if self._ticked not in missing:
                self.rig.report()
                (tick or self.rig.tick)()

    def seen(self) -> Seen:
        told = [each for each in self.pendant.all(messages.JogEnded)]
        codes = [code for _, code in self.pendant.outcomes()]
        return Seen(
            self.ramp(),
            next((time - self.began for time in self.rig.stops), None),
            messages.JogEnd(told[-1].reason) if told else None,
            codes[-1] if codes else None,
        )

    def ramp(self) -> int | None:
        """Return when the first slower set-point left, from the beginning [ns]; None for none."""
        before = self._before
        for time, speed in self.speeds():
            if speed < before - 1e-9:
                return time
            before = speed
        return None

    def speeds(self) -> Iterator[tuple[int, float]]:
        """Yield when each set-point left, from the beginning [ns], and the speed of joint 1."""
        for time, item in self.rig.log:
            if isinstance(item, SendToController) and isinstance(item.message, JointTrajPtFull):
                yield time - self.began, abs(item.message.velocities[0])


def two_hands(
    mode: str = "manual_high", *, version: int = 3, silence: float = 0.25, **settings: Any
) -> TwoHands:
    """Return hands at a robot of two joints in a mode; a jog there is at most 0.25 rad/s fast."""
    rig, pad = enabled(mode, **settings)
    pad.pendant.close()
    rig.wait(10)
    return TwoHands(rig, version, silence)


# Timelines.


def device(position: int) -> Act:
    return lambda hands: hands.device(position)


def beat(hands: TwoHands) -> None:
    hands.beat()


def key_up(hands: TwoHands) -> None:
    hands.key_up()


def beats(since: int, until: int) -> Timeline:
    """Yield the beats of a key that is held."""
    return [(at, beat) for at in range(since, until, PERIOD)]


def signs(since: int, until: int) -> Timeline:
    """Yield the signs of an enabling device that is held."""
    return [(at, device(HELD)) for at in range(since, until, PERIOD)]


def both(since: int, until: int) -> Timeline:
    """Yield the writes of a page: enabling device and key, in this order."""
    return [each for at in range(since, until, PERIOD) for each in ((at, device(HELD)), (at, beat))]
