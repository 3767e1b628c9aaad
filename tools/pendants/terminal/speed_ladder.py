"""The speeds that the keys step through: the override, and the cap of the tool."""

from __future__ import annotations

from openpendant.simplemsg.pendant import State

from .commands import SetSpeed
from .keyboard import Intent

_OVERRIDES = (0.01, 0.03, 0.05, 0.1, 0.25, 0.5, 0.75, 1.0)
_CAPS = (0.01, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0)  # m/s


def speed_asked(intent: Intent, state: State) -> SetSpeed:
    """Return what a key asks for, from where the cell is.

    Args:
        intent: slower or faster; a lower or higher cap.
        state: the newest state.
    """
    match intent:
        case Intent.SLOWER | Intent.FASTER:
            return SetSpeed(_next_of(_OVERRIDES, state.override, intent is Intent.FASTER))
    wanted = _next_of(_CAPS, state.tool_speed_cap, intent is Intent.CAP_UP)
    return SetSpeed(state.override, wanted)


def _next_of(ladder: tuple[float, ...], value: float, up: bool) -> float:
    """Return the next rung; values of 4 bytes are a little off their rungs."""
    slack = 1e-6
    if up:
        return next((rung for rung in ladder if rung > value + slack), ladder[-1])
    return next((rung for rung in reversed(ladder) if rung < value - slack), ladder[0])
