"""Bridge from a gamepad to a pendant server: one event loop that reads, beats and is connected.

Owns that the device is opened again after it was gone, and that both ends are told of each other.
The signs of what is held come from the loop that reads the device: where it hangs, they end.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sequence

from ..client import PendantClient
from ..panel.connection import Connect, LogIn, PanelConnection, as_nobody
from ..panel.panel import Panel
from .commands import GamepadCommand
from .device import DeviceUnusable, InputDevice
from .device_events import DeviceEvent
from .gamepad import Gamepad
from .performer import GamepadPerformer
from .settings import GamepadSettings

TICK = 0.02
"""Time between two looks at the clock [s]."""

_PAUSES = (0.5, 1.0, 2.0, 4.0, 5.0)
"""Before the device is opened again, attempt by attempt [s]."""

_STEADY = 10.0
"""A device that was there for so long is tried for from the first pause on [s]."""


class GamepadConnection(PanelConnection):
    """The connection of one gamepad, made again after each loss."""

    def __init__(
        self,
        gamepad: Gamepad,
        settings: GamepadSettings,
        connect: Connect,
        log_in: LogIn,
        clock: Callable[[], int],
    ) -> None:
        """Make a connection that is not started; arguments as of any panel's."""

        def performer(client: PendantClient, _: Panel) -> GamepadPerformer:
            return GamepadPerformer(client, gamepad, settings.deadline)

        super().__init__(gamepad, connect, log_in, clock, performer)

    def perform(self, commands: Sequence[GamepadCommand]) -> None:
        """Carry out commands; without a connection they are dropped."""
        if isinstance(self._performer, GamepadPerformer):
            self._performer.perform(commands)


class GamepadBridge:
    """One gamepad at one server, each found again after it was lost."""

    def __init__(
        self,
        settings: GamepadSettings,
        connect: Connect,
        log_in: LogIn = as_nobody,
        clock: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Make a bridge that is not started.

        Args:
            connect: makes a connection; raises `OSError` or `PendantError`.
            clock: returns monotonic time [ns].
        """
        self.gamepad = Gamepad(settings)
        self._settings = settings
        self._clock = clock
        self._connection = GamepadConnection(self.gamepad, settings, connect, log_in, clock)
        self._device: InputDevice | None = None
        self._is_gone = asyncio.Event()

    async def run(self) -> None:
        """Serve the gamepad until cancelled; what it holds is let go at the end.

        Raises:
            PendantError: the server refuses the connection, and would refuse each further attempt.
        """
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._connection.run())
                tasks.create_task(self._stay_open())
                tasks.create_task(self._tick())
        except ExceptionGroup as failed:
            raise failed.exceptions[0] from None
        finally:
            if self._device is not None:
                self._device.close()

    async def _tick(self) -> None:
        while True:
            if self._device is not None and (events := self._device.tick()):
                self._connection.perform(self.gamepad.take(events, self._clock(), is_sign=False))
            self._connection.perform(self.gamepad.advance(self._clock()))
            await asyncio.sleep(TICK)

    async def _stay_open(self) -> None:
        """Open the device, and again after it was gone; one line for each change."""
        attempt, told, path = 0, "", self._settings.device
        loop = asyncio.get_running_loop()
        while True:
            opened = loop.time()
            try:
                self._is_gone.clear()
                self._device = InputDevice(
                    *(path, self._settings.kind, self._took, self._gone, self._clock)
                )
            except DeviceUnusable as unusable:
                if str(unusable) != told:
                    told = str(unusable)
                    self.gamepad.messages.add(f"{told}. Trying every {_PAUSES[0]:g} to 5 s")
            else:
                told = ""
                self.gamepad.plugged()
                self.gamepad.messages.add(f"reading {path}")
                await self._is_gone.wait()
                if loop.time() - opened >= _STEADY:
                    attempt = 0
            await asyncio.sleep(_PAUSES[min(attempt, len(_PAUSES) - 1)])
            attempt += 1

    def _took(self, events: list[DeviceEvent]) -> None:
        self._connection.perform(self.gamepad.take(events, self._clock()))

    def _gone(self, why: str) -> None:
        self._device = None
        self._connection.perform(self.gamepad.unplugged(f"{why}. Trying again"))
        self._is_gone.set()
