"""Steps that are still missing until a jog key moves the robot, each with its key.

Owns their order, which is the one in which they can be done: a stop is reset and a mode set in
control only, and a stop or another mode lets enabling go. The server decides if the robot may move;
this only spares a newcomer the refusals.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant import OperatingMode

from ..panel import wording
from ..panel.keyboard import axis_keys
from ..panel.panel import Panel


def missing_steps(panel: Panel, now: int) -> tuple[str, ...]:
    """Return the steps that are missing; empty where none is, or values are too old to tell."""
    cell, state = panel.cell, panel.cell.state
    if state is None or cell.is_stale(now):
        return ()
    missing = []
    if not cell.in_control:
        missing.append("c takes control" if not state.holder else "c asks for control")
    if cell.is_stopped:
        missing.append("x resets the stop")
    if cell.mode is OperatingMode.AUTOMATIC:
        missing.append(f"m 1 sets {wording.MODES[OperatingMode.MANUAL_REDUCED][0]}")
    if not panel.enabling.is_on and cell.mode is not None:
        missing.append("v holds enabling")
    if state.override == 0.0:
        missing.append("+ raises the speed")
    return tuple(missing)


def steps_line(panel: Panel, now: int) -> str:
    """Return the missing steps and what moves the robot then, as one line; empty without values."""
    state = panel.cell.state
    if state is None or panel.cell.is_stale(now):
        return ""
    axis = panel.jog.axis_names[0]
    (plus,), (minus,) = axis_keys([1.0]), axis_keys([-1.0])
    steps = (*missing_steps(panel, now), f"{plus}/{minus} jogs {axis} + and -")
    return f"to move: {', '.join(steps)}"
