"""Settings of the gamepad: a TOML file, and the map from numbers of the device to the robot.

Owns the keys, their bounds, the maps of a gamepad and of a SpaceMouse, and what a stick asks of the
robot. Numbers are those of the device: `jstest` and `evtest` show them.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import PurePath
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from ..connection_errors import DEFAULT_PORT
from ..settings_file import ServerAddress, SettingsRefused

AXES = "xyzabc"
"""Axes of a frame: along x, y, z and about them; in joint space the joints 1 to 6."""

Aim = tuple[float, ...]
"""(6,) part of the jog speed along and about each axis, -1 to 1."""


class DeviceKind(StrEnum):
    """How a device tells its events, and which map it has where the file says none."""

    GAMEPAD = "gamepad"
    """The joystick interface."""
    SPACEMOUSE = "spacemouse"
    """Evdev."""


def kind_of(path: str) -> DeviceKind:
    """Return the kind of a device by its name: `eventN` are those of evdev."""
    is_evdev = PurePath(path).name.startswith("event")
    return DeviceKind.SPACEMOUSE if is_evdev else DeviceKind.GAMEPAD


Number = Annotated[int, Field(ge=0, le=767)]
"""Of a button or an axis of the device."""

Direction = Annotated[str, Field(pattern=r"^[+-]?[xyzabc]$")]
"""An axis of the robot; with a minus where the device counts the other way."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Buttons(_Table):
    """Which button does what; one without a number is not there."""

    enabling: Number = 4
    """Held: enabling (training), and what the sticks say moves the robot."""
    stop: Number = 1
    """The software stop, always."""
    shift: Number | None = 5
    """Held: the sticks are those of `shifted`."""
    mode: Number | None = 0
    """The next frame: joints, base, tool, named frames."""
    slower: Number | None = 2
    faster: Number | None = 3


def _check_buttons(buttons: Buttons) -> Buttons:
    numbers = [number for number in buttons.model_dump().values() if number is not None]
    if len(set(numbers)) < len(numbers):
        raise ValueError("each button needs a number of its own")
    return buttons


class GamepadSettings(_Table):
    """All that the table `[gamepad]` of a file may say."""

    device: Annotated[str, Field(min_length=1)] = "/dev/input/js0"
    """Path of the device."""
    kind: DeviceKind = DeviceKind.GAMEPAD
    server: ServerAddress = f"127.0.0.1:{DEFAULT_PORT}"
    """HOST or HOST:PORT."""
    deadline: Annotated[float, Field(ge=0.05, le=0.25)] = 0.15
    """The robot ramps to rest so long after the last sign of this pendant [s]."""
    longest_still: Annotated[float, Field(ge=0.5, le=10.0)] = 2.0
    """All is let go so long after the last event of the device: a wireless one may be dead [s]."""
    dead_zone: Annotated[float, Field(ge=0.02, le=0.5)] = 0.15
    """Part of a stick's deflection that counts as none."""
    sticks: Mapping[Number, Direction] = Field({1: "-x", 0: "-y", 4: "-z", 3: "-c"}, min_length=1)
    """Axis of the device: axis of the robot."""
    shifted: Mapping[Number, Direction] = Field({0: "a", 1: "-b"})
    """Likewise while `shift` is held; what is not here stays."""
    buttons: Annotated[Buttons, AfterValidator(_check_buttons)] = Buttons()

    def aim(self, sticks: Mapping[int, float], *, is_shifted: bool) -> Aim:
        """Return what sticks ask for; two that move the same axis add up to its full speed.

        Args:
            sticks: value of each axis of the device, -1 to 1.
        """
        directions = {**self.sticks, **self.shifted} if is_shifted else self.sticks
        aim = [0.0] * len(AXES)
        for number, direction in directions.items():
            value = self._outside_dead_zone(sticks.get(number, 0.0))
            axis = AXES.index(direction[-1])
            total = aim[axis] + (-value if direction.startswith("-") else value)
            aim[axis] = max(-1.0, min(1.0, total))
        return tuple(aim)

    def are_centred(self, sticks: Mapping[int, float]) -> bool:
        """Return True if no stick that could move the robot is outside its dead zone."""
        mapped = {*self.sticks, *self.shifted}
        return not any(self._outside_dead_zone(sticks.get(number, 0.0)) for number in mapped)

    def _outside_dead_zone(self, value: float) -> float:
        """Return a value from 0 at the end of the dead zone, linear to 1."""
        outside = abs(value) - self.dead_zone
        if outside <= 0.0:
            return 0.0
        share = min(1.0, outside / (1.0 - self.dead_zone))
        return share if value > 0.0 else -share


_SPACEMOUSE: Mapping[str, Any] = {
    "dead_zone": 0.08,
    # The cap counts to the right, towards its user and down.
    "sticks": {1: "-x", 0: "-y", 2: "-z", 4: "-a", 3: "-b", 5: "-c"},
    "shifted": {},
    "buttons": {
        **{"enabling": 256, "stop": 257},
        **{"shift": None, "mode": None, "slower": None, "faster": None},
    },
}
"""What a SpaceMouse has in the place of the defaults; its two buttons are enabling and stop."""


def settings_of(data: Mapping[str, Any], given: Mapping[str, Any], source: str) -> GamepadSettings:
    """Check the plain data of a file and what goes before it.

    Args:
        data: of the whole file; tables other than `[gamepad]` are those of others.
        given: keys that the arguments name.
        source: the file, or "arguments".

    Raises:
        SettingsRefused: the first key that is unknown or out of bounds.
    """
    table = data.get("gamepad", {})
    if not isinstance(table, dict):
        raise SettingsRefused(f"{source}: gamepad: must be a table")
    named = {**table, **given}
    path = str(named.get("device", GamepadSettings.model_fields["device"].default))
    named.setdefault("kind", kind_of(path))
    defaults = _SPACEMOUSE if named["kind"] == DeviceKind.SPACEMOUSE else {}
    buttons = named.get("buttons")
    if defaults and isinstance(buttons, dict):
        named["buttons"] = {**defaults["buttons"], **buttons}
    try:
        return GamepadSettings.model_validate({**defaults, **named})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(["gamepad", *(str(part)[:80] for part in first["loc"])])
        problem = {"extra_forbidden": "unknown key"}.get(first["type"], first["msg"])
        raise SettingsRefused(f"{source}: {key}: {problem}") from None
