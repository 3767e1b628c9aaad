"""What to do about a refusal on this pendant, where the catalogue's words do not fit its keys.

Owns these few sentences. The catalogue speaks to every pendant and to authors of new ones; a
terminal has a toggle where it says "hold", and counts presses by itself.
"""

from __future__ import annotations

from openpendant.simplemsg.verdicts import VerdictCode

from ..client import Refused

_HERE = {
    VerdictCode.NOT_ENABLED: "Press v, which holds it until 5 s without a key; then try again.",
    VerdictCode.ENABLING_LOST: "Press v, which holds it anew; then ask for the motion again.",
    VerdictCode.MODE_CHANGED: "Press v in a manual mode, then ask for the motion again.",
    VerdictCode.NOT_IN_CONTROL: "Press c, which asks for control.",
    VerdictCode.HELD_BY_OTHER: "Wait until it is given back; C takes it over, by role.",
    VerdictCode.AUTHORITY_LOST: "Press c, which asks for control; nothing resumes by itself.",
    VerdictCode.STOP_LATCHED: "Press x in control, which resets it and moves nothing.",
    VerdictCode.STOPPED: "Press x in control to reset the stop; then ask for the motion again.",
    VerdictCode.PROTECTIVE_STOP: "Remove the reason, then press x, which resets the stop.",
    VerdictCode.PAUSED: "Press 8 to resume it, or 9 to end it.",
    VerdictCode.PRESS_DEAD: "Strike the key again.",
    VerdictCode.PRESS_STALE: "Strike the key again once the values are fresh.",
    VerdictCode.OVERRIDE_ZERO: "Press +, then ask for the motion again.",
    VerdictCode.OUTSIDE_LIMITS: "Jog the joint back inside; where m sets the mode, press m and 4"
    " first, recovery.",
    VerdictCode.REVISION_CONFLICT: "It was loaded anew: look at it, then ask again.",
    VerdictCode.PROGRAM_UNKNOWN: "Press n, which lists the programs.",
    VerdictCode.PROGRAM_RUNNING: "Press 9 to end it; to step it or run it on, 8 pauses it.",
}


def remedy(code: VerdictCode | int, otherwise: str) -> str:
    """Return what to do about a refusal.

    Args:
        code: of the refusal.
        otherwise: the catalogue's remedy.
    """
    return _HERE.get(VerdictCode(code), otherwise) if code in set(VerdictCode) else otherwise


def remedy_of(refused: Refused) -> str:
    """Return what to do about a refusal that was caught; empty for a code of a newer server."""
    return remedy(refused.code, refused.remedy)
