"""A gamepad's core with a cell that stands ready, a device that a test moves, and a clock."""

from dataclasses import replace
from typing import Any

from rigs.cells.panel_rig import HELLO, MS, S, snapshot
from rigs.data.device_bytes import (
    ABS,
    ENABLING,
    KEY,
    LEFT_KEY,
    LEFT_Y,
    axis,
    button,
    opening,
    report,
)
from rigs.peers.scripted_pendant_server import SESSION, state

from openpendant.tools.pendants.gamepad.commands import GamepadCommand
from openpendant.tools.pendants.gamepad.device_events import (
    EvdevReader,
    EventReader,
    JoystickReader,
)
from openpendant.tools.pendants.gamepad.gamepad import Gamepad
from openpendant.tools.pendants.gamepad.settings import DeviceKind, settings_of


class GamepadRig:
    """A gamepad in control of a cell; the state is fresh unless a test says otherwise."""

    def __init__(self, *, path: str = "/dev/input/js0", dof: int = 6, **table: Any) -> None:
        self.settings = settings_of({"gamepad": {"device": path, **table}}, {}, "")
        self.pad = Gamepad(self.settings)
        self.now = 100 * S
        self._sequence = 0
        self.pad.cell.connected(HELLO, snapshot(dof))
        self.pad.connected()
        self.state()
        self.plug()

    def plug(self) -> None:
        is_evdev = self.settings.kind is DeviceKind.SPACEMOUSE
        self.reader: EventReader = EvdevReader() if is_evdev else JoystickReader()
        self.pad.plugged()

    def state(self, **changes: Any) -> None:
        """Let a state come that differs from that of an idle cell in our control."""
        self._sequence += 1
        values = {"holder": SESSION, **changes}
        self.pad.cell.take_state(replace(state(self._sequence), **values), self.now)

    def read(self, data: bytes) -> list[GamepadCommand]:
        """Read bytes of the device."""
        return self.pad.take(self.reader.receive(data, self.now), self.now)

    def open(self, **axes: Any) -> list[GamepadCommand]:
        return self.read(opening(**axes))

    def hold(self) -> list[GamepadCommand]:
        return self.read(button(ENABLING, down=True))

    def let_go(self) -> list[GamepadCommand]:
        return self.read(button(ENABLING, down=False))

    def stick(self, share: float, number: int = LEFT_Y) -> list[GamepadCommand]:
        return self.read(axis(number, share))

    def cap(self, *events: tuple[int, int, int]) -> list[GamepadCommand]:
        """Read a set of events of a SpaceMouse."""
        return self.read(report(*events))

    def pass_time(self, milliseconds: int, *, in_steps_of: int = 20) -> list[GamepadCommand]:
        """Let time pass as the loop does, with fresh states; return what was asked for."""
        asked: list[GamepadCommand] = []
        for _ in range(milliseconds // in_steps_of):
            self.now += in_steps_of * MS
            self.state()
            asked += self.pad.take(self.reader.tick(self.now), self.now, is_sign=False)
            asked += self.pad.advance(self.now)
        return asked


def push(*, along: int = 0, value: int = -350) -> tuple[int, int, int]:
    return (ABS, along, value)


def left(*, down: bool) -> tuple[int, int, int]:
    return (KEY, LEFT_KEY, int(down))
