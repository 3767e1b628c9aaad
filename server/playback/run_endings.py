"""What ends a program from outside, whether it is loaded, runs or waits; and why, in words.

Owns which news that is, and which conditions must hold on while no motion of it is under way: a
motion has its own watch. Ends nothing itself.
"""

from __future__ import annotations

from openpendant.simplemsg.verdicts import VerdictCode

from ..authority import Holder
from ..driving.interruption import lost
from ..news import AuthorityMoved, Interrupted, LatchedStop, ModeMoved, News, StopMoved
from ..readiness import stop_refusal
from ..refusal import Refusal
from ..robot_cell import RobotCell


def ending(news: News, by: Holder) -> Refusal | None:
    """Return why news ends a program; None where it goes on.

    Args:
        news: what happened.
        by: who runs the program.
    """
    match news:
        case Interrupted(refusal=refusal):
            return refusal
        case StopMoved(stop=LatchedStop() as stop):
            return stop_refusal(stop)
        case ModeMoved(mode=mode):
            text = f"the mode changed to {mode.name.lower().replace('_', ' ')}"
            return Refusal(VerdictCode.MODE_CHANGED, text)
        case AuthorityMoved(change=change) if change.holder != by:
            return Refusal(VerdictCode.AUTHORITY_LOST)
    return None


def broken_condition(cell: RobotCell, by: Holder, now: int) -> Refusal | None:
    """Return why a program that will move by itself, once it has waited, may not; else None.

    Args:
        cell: the cell.
        by: who runs the program.
        now: monotonic time, ns.
    """
    if cell.modes.needs_enabling(cell.mode) and not cell.modes.is_enabled(by.session, now):
        return Refusal(VerdictCode.ENABLING_LOST)
    return lost(cell.feedback, now)
