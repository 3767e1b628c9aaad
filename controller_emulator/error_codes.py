"""Error codes, violations and refusals of the controller, as closed sets.

Owns the numbers that STATUS carries in `error_code` and the names in the referee's report. Knows no
messages and no limits.
"""

from __future__ import annotations

from enum import IntEnum, StrEnum
from typing import NamedTuple


class ErrorCode(IntEnum):
    """STATUS `error_code` of the emulated controller; vendors number theirs as they like.

    An error stays until the next trajectory is accepted or the operator resets.
    """

    NONE = 0
    NOT_FINITE = 101
    POSITION_LIMIT = 102
    VELOCITY_LIMIT = 103
    ACCELERATION_LIMIT = 104
    TIME_ORDER = 105
    SEQUENCE = 106
    START_STATE = 107
    POINT_UNUSABLE = 108
    BUFFER_UNDERRUN = 109
    BUFFER_OVERFLOW = 110
    LINK_LOST = 111


class ViolationKind(StrEnum):
    """Kinds of violation that the referee counts; a correct sender never causes one."""

    RANGE = "range"
    VELOCITY = "velocity"
    POSITION_STEP = "position-step"
    ACCELERATION = "acceleration"
    VELOCITY_STEP = "velocity-step"
    NOT_FINITE = "not-finite"
    SEQUENCE = "sequence"
    START_POSITION = "start-position"
    START_VELOCITY = "start-velocity"
    TIME = "time"


ERROR_OF: dict[ViolationKind, ErrorCode] = {
    ViolationKind.RANGE: ErrorCode.POSITION_LIMIT,
    ViolationKind.VELOCITY: ErrorCode.VELOCITY_LIMIT,
    ViolationKind.POSITION_STEP: ErrorCode.VELOCITY_LIMIT,
    ViolationKind.ACCELERATION: ErrorCode.ACCELERATION_LIMIT,
    ViolationKind.VELOCITY_STEP: ErrorCode.ACCELERATION_LIMIT,
    ViolationKind.NOT_FINITE: ErrorCode.NOT_FINITE,
    ViolationKind.SEQUENCE: ErrorCode.SEQUENCE,
    ViolationKind.START_POSITION: ErrorCode.START_STATE,
    ViolationKind.START_VELOCITY: ErrorCode.START_STATE,
    ViolationKind.TIME: ErrorCode.TIME_ORDER,
}


class PointRefusal(NamedTuple):
    """Reason for which a point is not taken.

    Attributes:
        code: the error that STATUS shows from now on.
        kind: what the referee counts, None where the sender broke no rule of motion.
        joint: index of the joint at fault, -1 where it is not one joint's fault.
        value: the offending value [SI units of what `kind` measures].
    """

    code: ErrorCode
    kind: ViolationKind | None = None
    joint: int = -1
    value: float = 0.0
    limit: float = 0.0


def violation(
    kind: ViolationKind, joint: int = -1, value: float = 0.0, limit: float = 0.0
) -> PointRefusal:
    """Return the refusal of a point that breaks a rule, with the error code of that rule."""
    return PointRefusal(ERROR_OF[kind], kind, joint, value, limit)
