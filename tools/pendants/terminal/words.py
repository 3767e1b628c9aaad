"""States of the cell in words: modes, lamps, stops, who is in control.

Owns the words, which the small display and the full screen share. A lamp is a word and a shape
before it is a colour.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from openpendant.simplemsg.pendant import (
    Activity,
    JogReason,
    LinkState,
    OperatingMode,
    ProgramState,
    StopKind,
)

from .cell_view import CellView

MODES = {
    OperatingMode.MANUAL_REDUCED: ("T1", "manual reduced speed"),
    OperatingMode.MANUAL_HIGH: ("T2", "manual high speed"),
    OperatingMode.AUTOMATIC: ("AUTO", "automatic"),
    OperatingMode.RECOVERY: ("REC", "recovery"),
}
"""The short and the long name of each mode."""


class Light(Enum):
    """How a lamp is lit; the value is its shape."""

    GOOD = "●"
    DOUBTFUL = "◐"
    BAD = "○"
    UNKNOWN = "?"


@dataclass(frozen=True, slots=True)
class Lamp:
    """One of the three lamps.

    Attributes:
        name: what it is about.
        light: how it is lit.
        word: the same, said.
    """

    name: str
    light: Light
    word: str

    def __str__(self) -> str:
        return f"{self.light.value} {self.name}: {self.word}"


def lamps(cell: CellView, now: int) -> tuple[Lamp, Lamp, Lamp]:
    """Return the lamps of pendant to server, server to controller, controller to drives."""
    return _server_lamp(cell, now), _controller_lamp(cell, now), _drives_lamp(cell, now)


def _server_lamp(cell: CellView, now: int) -> Lamp:
    name = "pendant–server"
    if cell.is_greeted and not cell.is_connected:
        return Lamp(name, Light.DOUBTFUL, "no login")
    if not cell.is_connected:
        return Lamp(name, Light.BAD, "down")
    age = cell.message_age(now)
    if age is None:
        return Lamp(name, Light.DOUBTFUL, "no state yet")
    if cell.is_silent(now):
        return Lamp(name, Light.DOUBTFUL, f"silent for {age:.1f} s")
    return Lamp(name, Light.GOOD, "up")


def _controller_lamp(cell: CellView, now: int) -> Lamp:
    name = "server–controller"
    # What a server said that is silent now may have changed since.
    if cell.state is None or cell.is_silent(now):
        return Lamp(name, Light.UNKNOWN, "unknown")
    match cell.state.link:
        case LinkState.UP:
            return Lamp(name, Light.GOOD, "up")
        case LinkState.STALE:
            return Lamp(name, Light.DOUBTFUL, "stale")
    return Lamp(name, Light.BAD, "down")


def _drives_lamp(cell: CellView, now: int) -> Lamp:
    name = "controller–drives"
    state = cell.state
    if state is None or cell.is_silent(now) or state.link == LinkState.DOWN:
        return Lamp(name, Light.UNKNOWN, "unknown")
    if state.e_stopped == 1:
        return Lamp(name, Light.BAD, "emergency stop at the controller")
    if state.in_error == 1:
        return Lamp(name, Light.BAD, f"error {state.error_code}")
    match state.drives_powered:
        case 1:
            return Lamp(name, Light.GOOD, "on")
        case 0:
            return Lamp(name, Light.BAD, "off")
    return Lamp(name, Light.UNKNOWN, "unknown")


def mode_name(cell: CellView) -> str:
    """Return the short name of the mode."""
    return "?" if cell.mode is None else MODES[cell.mode][0]


def owner(cell: CellView) -> str:
    """Return who is in control."""
    if cell.in_control:
        return "you"
    if cell.state is None:
        return "unknown"
    return (cell.owner or "another") if cell.state.holder else "nobody"


def stop(cell: CellView) -> str:
    """Return the latched stop in a sentence; empty where there is none."""
    if cell.state is None or not cell.is_stopped:
        return ""
    kind = "protective" if cell.state.stop == StopKind.PROTECTIVE else "software"
    by = f" by {cell.stopped_by}" if cell.stopped_by else ""
    why = f": {cell.stop_reason}" if cell.stop_reason else ""
    return f"{kind} stop{by}{why}"


def activity(cell: CellView) -> str:
    """Return what the cell is doing."""
    if cell.state is None:
        return "unknown"
    known = cell.state.activity in set(Activity)
    return Activity(cell.state.activity).name.lower() if known else "unknown"


def program_state(cell: CellView) -> str:
    """Return what the program is doing; empty for nothing."""
    state = ProgramState.NONE if cell.state is None else cell.state.program_state
    if state == ProgramState.NONE or state not in set(ProgramState):
        return ""
    return ProgramState(state).name.lower().replace("_", " ")


def slowed(cell: CellView) -> str:
    """Return why a jog is slower than asked; empty where it is not."""
    state = cell.state
    if state is None or state.jog_reason not in set(JogReason) or not state.jog_reason:
        return ""
    reason = JogReason(state.jog_reason).name.lower().replace("_", " ")
    joint = f" of joint {state.jog_joint + 1}" if state.jog_joint >= 0 else ""
    return f"jog at {100 * state.jog_scale:.0f} %: {reason}{joint}"


def staleness(cell: CellView, now: int) -> str:
    """Return why the values that are shown may not be how the robot stands."""
    age = cell.age(now)
    if age is None:
        return "no state yet"
    if cell.state is not None and cell.state.link != LinkState.UP and not cell.is_silent(now):
        return f"{_controller_lamp(cell, now)}"
    return f"the values are {age:.1f} s old"


def banner(cell: CellView, now: int) -> str:
    """Return the one sentence that matters most, with what to do; empty where all is well."""
    if cell.is_greeted and not cell.is_connected:
        return f"NO LOGIN: {cell.absence}; the space bar stops the robot all the same"
    if not cell.is_connected:
        return f"NO LINK: {cell.absence}; to stop the robot, use the hardware button"
    if cell.is_stopped:
        return f"STOPPED, {stop(cell)}; x resets, which moves nothing"
    if cell.is_stale(now):
        return f"STALE: {staleness(cell, now)}"
    state = cell.state
    if state is not None and (state.e_stopped == 1 or state.in_error == 1):
        return f"The controller cannot move: {_drives_lamp(cell, now).word}; clear it there"
    if not cell.in_control:
        return f"Observing: {owner(cell)} has control; c asks for it"
    return slowed(cell)
