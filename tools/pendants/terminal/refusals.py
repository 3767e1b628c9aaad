"""Refusals as a person reads them: the code, what is wrong in degrees or millimetres, the remedy.

Owns the sentence, and which refusals of a connection no second attempt can heal.
"""

from __future__ import annotations

from collections.abc import Sequence

from openpendant.simplemsg.verdicts import VerdictCode

from ..client import Refused
from ..snapshot import JointFacts
from .remedies import remedy_of
from .screen_units import in_screen_units, joint_value

_HOPELESS = frozenset(
    {
        VerdictCode.VERSION,
        VerdictCode.UNKNOWN_CELL,
        VerdictCode.ADDRESS_NOT_ALLOWED,
        VerdictCode.BAD_ARGUMENT,
        VerdictCode.LOGIN_NEEDED,
        VerdictCode.LOGIN_FAILED,
        VerdictCode.ROLE_TOO_LOW,
        VerdictCode.PAIRING_WRONG,
        VerdictCode.BAD_ACCOUNT_NAME,
    }
)


def is_hopeless(refused: Refused) -> bool:
    """Tell whether a connection that was refused so would be refused for ever.

    What was asked must change: another cell, another password, another version.
    """
    return refused.code in _HOPELESS


def refusal_line(refused: Refused, joints: Sequence[JointFacts] = ()) -> str:
    """Return a refusal in one line.

    Args:
        refused: the refusal.
        joints: of the robot; a joint at fault is told with its unit.
    """
    remedy = remedy_of(refused)
    return f"{_name(refused)}: {_sentence(refused, joints)}{f' -> {remedy}' if remedy else ''}"


def connection_refused(refused: Refused) -> str:
    """Return why a pendant cannot be used as it was started, and how to start it."""
    if refused.code == VerdictCode.UNKNOWN_CELL:
        return f"{refused.text or refused.cause}; choose one: --cell NAME"
    return refusal_line(refused)


def _name(refused: Refused) -> str:
    return refused.code.name if isinstance(refused.code, VerdictCode) else str(refused.code)


def _sentence(refused: Refused, joints: Sequence[JointFacts]) -> str:
    if not 0 <= refused.joint < len(joints):
        return in_screen_units(refused.text or refused.cause)
    joint = joints[refused.joint]
    who, unit = f"joint {refused.joint + 1}, {joint['name']},", joint["unit"]
    match refused.code:
        case VerdictCode.OUT_OF_RANGE | VerdictCode.OUTSIDE_LIMITS:
            lower, upper = joint_value(joint["lower"], unit), joint_value(joint["upper"], unit)
            return (
                f"{who} at {joint_value(refused.value, unit)} is beyond its limit"
                f" {joint_value(refused.limit, unit)}; accepted: {lower} to {upper}"
            )
        case VerdictCode.TOO_FAST:
            value, limit = (joint_value(v, unit, "/s") for v in (refused.value, refused.limit))
            return f"{who} at {value} is faster than its limit {limit}"
        case VerdictCode.TOO_SHARP:
            value, limit = (joint_value(v, unit, "/s²") for v in (refused.value, refused.limit))
            return f"{who} accelerating at {value} exceeds its limit {limit}"
    return in_screen_units(refused.text or refused.cause)
