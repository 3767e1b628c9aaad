"""What ends a program from outside, whether it is loaded, runs or waits; and why, in words.

Owns which news that is, and which conditions must hold on while no motion of it is under way: a
motion has its own watch. Ends nothing itself.
"""

from __future__ import annotations

from openpendant.simplemsg.verdicts import VerdictCode

from ..control.authority import Holder
from ..events.cell_events import (
    AuthorityTransferred,
    CellEvent,
    Interruption,
    OperatingModeChanged,
    StopLatch,
    StopLatchChanged,
)
from ..refusal import Refusal
from .execution.feedback import lost
from .interlocks import stop_refusal
from .robot_cell import RobotCell


def ending(news: CellEvent, by: Holder) -> Refusal | None:
    """Return why news ends a program; None where it goes on.

    Args:
        news: what happened.
        by: who runs the program.
    """
    match news:
        case Interruption(refusal=refusal):
            return refusal
        case StopLatchChanged(stop=StopLatch() as stop):
            return stop_refusal(stop)
        case OperatingModeChanged(mode=mode):
            text = f"the mode changed to {mode.name.lower().replace('_', ' ')}"
            return Refusal(VerdictCode.MODE_CHANGED, text)
        case AuthorityTransferred(change=change) if change.holder != by:
            return Refusal(VerdictCode.AUTHORITY_LOST)
    return None


def broken_condition(cell: RobotCell, by: Holder, now: int) -> Refusal | None:
    """Return why a program that will move by itself, once it has waited, may not; else None.

    Args:
        cell: the cell.
        by: who runs the program.
        now: monotonic time, ns.
    """
    if cell.modes.needs_enabling() and not cell.modes.is_enabled(by.session, now):
        return Refusal(VerdictCode.ENABLING_LOST)
    return lost(cell.feedback, now)
