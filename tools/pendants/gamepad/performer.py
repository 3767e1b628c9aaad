"""Performer of the gamepad: its press and its enabling device on one connection.

Owns that letting go leaves at once, in front of all else and whatever is still to be answered, and
that of several aims meanwhile the newest alone leaves. A press whose aim is refused is let go: the
robot must not go on the old way. Everything else is carried out as for any panel.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterable

from openpendant.simplemsg.verdicts import VerdictCode

from ..client import ConnectionLost, FedEnabling, FedJog, PendantClient, PendantError, Refused
from ..panel import commands as do
from ..panel.performer import Performer
from .commands import AimSticks, GamepadCommand, PressSticks
from .gamepad import Gamepad

_LONGEST = 86_400.0
"""No press is waited for longer, so that a wait has an end [s]."""


class GamepadPerformer(Performer):
    """The commands of one gamepad that run on one connection."""

    def __init__(self, client: PendantClient, gamepad: Gamepad, deadline: float) -> None:
        """Hold nothing.

        Args:
            deadline: the robot ramps to rest so long after the last sign of a press [s].
        """
        super().__init__(client, gamepad)
        self._gamepad = gamepad
        self._deadline = deadline
        self._device: FedEnabling | None = None
        self._is_enabling = False
        self._held_jog: FedJog | None = None
        self._is_pressed = False
        self._wanted: AimSticks | None = None
        self._aiming: asyncio.Task[None] | None = None

    def perform(self, commands: Iterable[GamepadCommand]) -> None:
        """Carry out commands; what lets go has left when this returns."""
        for command in commands:
            match command:
                case do.Enable(held=True):
                    self._is_enabling = True
                    self._begin(self._enabled())
                case do.Enable():
                    self._let_go()
                case PressSticks():
                    self._press(command)
                case AimSticks():
                    self._wanted = command
                    self._aim()
                case do.ReleaseJog():
                    self._release()
                case do.FeedBeat():
                    self._beat()
                case _:
                    super().perform([command])

    async def close(self) -> None:
        """Let go, and cancel the commands that run; the caller closes the connection."""
        self._let_go()
        await super().close()
        if self._device is not None:
            await self._device.__aexit__(None, None, None)

    # What is held.

    async def _enabled(self) -> None:
        if not self._is_enabling:
            return  # let go before this turn came
        if self._device is None:
            self._device = self._client.fed_enabling()
            await self._device.__aenter__()
        else:
            self._device.hold()

    def _let_go(self) -> None:
        self._release()
        self._is_enabling = False
        if self._device is not None:
            with contextlib.suppress(ConnectionLost):
                self._device.let_go()

    def _release(self) -> None:
        jog, self._held_jog, self._wanted = self._held_jog, None, None
        if jog is not None:
            jog.let_go()

    def _beat(self) -> None:
        with contextlib.suppress(ConnectionLost):
            if self._held_jog is not None:
                self._held_jog.beat()
            elif self._device is not None:
                self._device.beat()

    # The press.

    def _press(self, command: PressSticks) -> None:
        self._release()
        jog = self._client.fed_jog(command.values, frame=command.frame, deadline=self._deadline)
        self._held_jog, self._is_pressed = jog, False
        self._begin(self._hold_press(jog))

    async def _hold_press(self, jog: FedJog) -> None:
        """Press, and wait until the robot is at rest again."""
        try:
            if not self._client.has_quotable_state:
                # The library would wait for a state, and move for a stick that was let go.
                self._panel.messages.add("STALE: no jog on values that are too old")
                return
            await jog.__aenter__()
            if self._held_jog is jog:
                self._is_pressed = True
                self._aim()
            await jog.hold(_LONGEST)
        except Refused as refused:
            if self._held_jog is jog or refused.code != VerdictCode.PRESS_DEAD:
                raise  # else it was let go here, which is no news
        finally:
            self._over(jog)

    def _aim(self) -> None:
        """Send the aim that is wanted, once the one before is answered."""
        jog = self._held_jog
        is_free = self._aiming is None or self._aiming.done()
        if jog is not None and self._is_pressed and self._wanted is not None and is_free:
            self._aiming = self._begin(self._aimed(jog))

    async def _aimed(self, jog: FedJog) -> None:
        try:
            while self._held_jog is jog and self._wanted is not None:
                wanted, self._wanted = self._wanted, None
                await jog.aim_at(wanted.values, wanted.frame)
        except PendantError:
            if self._held_jog is jog:
                self._over(jog)
                raise

    def _over(self, jog: FedJog) -> None:
        """Take that a press has ended, or must: let go of all, if it was held until now."""
        if self._held_jog is jog:
            self._release()
            self.perform(self._gamepad.jog_ended())
