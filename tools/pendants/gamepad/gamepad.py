"""Core of the gamepad, without input or output: device events, news and time in, commands out.

Owns what a button and a stick do in each state, and that nothing moves before sticks and enabling
button were seen let go: at opening, after lost events, after a stop, another mode, a refusal, a
lost connection or a lost device. While the enabling button is held enabling (training) is held, and
the sticks that are off centre make one press. The server decides if the robot may move. Knows no
device, socket or clock: `now` is monotonic time in ns.
"""

from __future__ import annotations

from collections.abc import Iterable

from openpendant.simplemsg.verdicts import VerdictCode

from ..panel import commands as do
from ..panel.commands import JOINTS, Command
from ..panel.jog_pad import speed_asked
from ..panel.keyboard import Intent
from ..panel.panel import Panel
from .commands import AimSticks, GamepadCommand, PressSticks
from .device_events import ButtonTurned, DeviceEvent, EventCut, EventsLost, StickMoved
from .settings import GamepadSettings

BEAT_NS = 40_000_000
"""Time between two signs of what is held [ns]."""

AIM_NS = 40_000_000
"""Shortest time between two aims of a press [ns]."""

_LEAST_CHANGE = 0.02
"""A smaller change of all axes is no other aim."""

_PRESS_ANEW = "Let the enabling button go, then press it again."

_REMEDIES = {
    VerdictCode.NOT_ENABLED: _PRESS_ANEW,
    VerdictCode.ENABLING_LOST: _PRESS_ANEW,
    VerdictCode.PRESS_DEAD: _PRESS_ANEW,
    VerdictCode.PRESS_STALE: _PRESS_ANEW,
}


class Gamepad(Panel):
    """One gamepad or SpaceMouse as a pendant.

    Attributes:
        is_held: the enabling button counts as held.
    """

    remedies = _REMEDIES
    gives_control = "end this program to give it up"

    def __init__(self, settings: GamepadSettings) -> None:
        """Make a pendant without a device and without a connection."""
        super().__init__()
        self.jog.frame = "base"
        self.is_held = False
        self._settings = settings
        self._sticks: dict[int, float] = {}
        self._down: set[int] = set()
        self._must_let_go = False
        self._aimed: tuple[float, ...] | None = None
        self._aimed_at = self._beaten_at = self._heard = 0

    # The device.

    def plugged(self) -> None:
        """Take that a device is open; how it stands is not known yet."""
        self._forget()
        self._must_let_go = False

    def unplugged(self, why: str) -> list[Command]:
        """Take that the device is gone; release everything that is held."""
        self.messages.add(why)
        return self._let_go(why)

    def _forget(self) -> None:
        self._sticks.clear()
        self._down.clear()

    def take(
        self, events: Iterable[DeviceEvent], now: int, *, is_sign: bool = True
    ) -> list[GamepadCommand]:
        """Take events of the device.

        Args:
            is_sign: they show that the device lives.
        """
        asked: list[GamepadCommand] = []
        for event in events:
            if is_sign:
                self._heard = now
            self._look_for_rest()
            asked += self._event(event, now)
        self._look_for_rest()
        return [*asked, *self._follow(now)]

    def _event(self, event: DeviceEvent, now: int) -> list[Command]:
        match event:
            case StickMoved(number=number, value=value):
                self._sticks[number] = value
                return self._let_go("as it was opened") if event.is_at_opening else []
            case ButtonTurned():
                return self._button(event, now)
            case EventsLost():
                self._forget()
                self.messages.add("events of the device were lost: let go, then press again")
                return self._let_go("events were lost")
            case EventCut():
                return []  # whoever read it closes the device

    def _button(self, button: ButtonTurned, now: int) -> list[Command]:
        buttons, was_down = self._settings.buttons, button.number in self._down
        (self._down.add if button.is_down else self._down.discard)(button.number)
        is_struck = button.is_down and not was_down
        if is_struck and button.number == buttons.stop:
            return self._stop("gamepad", now)
        if button.is_at_opening:
            return self._let_go("as it was opened")
        if button.number == buttons.enabling:
            return self._hold(now) if button.is_down else self._release()
        return self._other_button(button.number) if is_struck else []

    def _other_button(self, number: int) -> list[Command]:
        buttons, state = self._settings.buttons, self.cell.state
        if number == buttons.mode:
            self._next_frame()
        elif number in (buttons.slower, buttons.faster):
            intent = Intent.FASTER if number == buttons.faster else Intent.SLOWER
            if self.cell.is_connected and state is not None:
                return [speed_asked(intent, state)]
            self.messages.add(f"no link: {self.cell.absence}")
        return []

    def _next_frame(self) -> None:
        if self.is_held:
            self.messages.add("the frame stays while the enabling button is held")
            return
        self.jog.turn_frame(1)
        self.messages.add(f"frame: {self.jog.frame or 'joints'}")

    # What is held.

    def _look_for_rest(self) -> None:
        """Let the enabling button count again once it and the sticks are let go."""
        is_down = self._settings.buttons.enabling in self._down
        if not is_down and self._settings.are_centred(self._sticks):
            self._must_let_go = False

    def _hold(self, now: int) -> list[Command]:
        """Take that the enabling button went down."""
        if self.is_held:
            return []
        if self._must_let_go:
            self.messages.add("let sticks and enabling button go, then press again")
            return []
        self._must_let_go = True
        if not self.jog.is_fresh(now):
            return []
        if not self.cell.in_control:
            self.messages.add("not in control: asked for it; let go, then press again")
            return [do.TakeControl()]
        self._must_let_go = False
        self.is_held = True
        self._beaten_at = now
        return [do.Enable(True)]

    def _release(self) -> list[Command]:
        """Release everything that is held."""
        was_held, self.is_held, self._aimed = self.is_held, False, None
        return [do.Enable(False)] if was_held else []

    def _let_go(self, why: str) -> list[Command]:
        """Release everything that is held; what is still pressed counts once it was let go."""
        self._must_let_go = True
        return self._release()

    def jog_ended(self) -> list[Command]:
        """Take that the press was refused, or ended by something else than this gamepad."""
        return self._let_go("the jog ended")

    def lost(self, reason: str) -> None:
        """Take the end of the connection; release everything that is held."""
        super().lost(reason)
        self._let_go("no link")

    # The sticks.

    def _follow(self, now: int) -> list[GamepadCommand]:
        """Return what the sticks ask for, where it is something else than before."""
        if not self.is_held:
            return []
        values, before = self._values(), self._aimed
        if not any(values):
            self._aimed = None
            return [] if before is None else [do.ReleaseJog()]
        if before is None:
            return self._press(values, now)
        if now - self._aimed_at < AIM_NS or not _differ(values, before):
            return []
        self._aimed, self._aimed_at = values, now
        return [AimSticks(self.jog.frame, values)]

    def _press(self, values: tuple[float, ...], now: int) -> list[GamepadCommand]:
        if not self.jog.is_fresh(now):
            return [*self._let_go("the values are old")]
        self._aimed, self._aimed_at, self._beaten_at = values, now, now
        return [PressSticks(self.jog.frame, values)]

    def _values(self) -> tuple[float, ...]:
        is_shifted = self._settings.buttons.shift in self._down
        aim = self._settings.aim(self._sticks, is_shifted=is_shifted)
        if self.jog.frame != JOINTS:
            return aim
        return (*aim, *[0.0] * self.cell.dof)[: self.cell.dof]

    def advance(self, now: int) -> list[GamepadCommand]:
        """Advance the time: signs of what is held, an aim that waited, a stop that is owed."""
        asked: list[GamepadCommand] = [*self.tick(now)]
        still = self._settings.longest_still
        if self.is_held and now - self._heard >= still * 1e9:
            self.messages.add(f"let go: no event of the device for {still:g} s; press again")
            return [*asked, *self._let_go("no event")]
        asked += self._follow(now)
        if self.is_held and now - self._beaten_at >= BEAT_NS:
            self._beaten_at = now
            asked.append(do.FeedBeat())
        return asked


def _differ(values: tuple[float, ...], before: tuple[float, ...]) -> bool:
    """Return True if an axis has another aim, or begins or ends to move."""
    return any(
        abs(new - old) > _LEAST_CHANGE or (new == 0.0) != (old == 0.0)
        for new, old in zip(values, before, strict=True)
    )
