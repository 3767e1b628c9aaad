"""The arguments of jog messages, checked before anything is made of them.

Pure functions: values to the refusal that they deserve, None where they are in order. How many
joints the robot has is `joint_slots`' business, and which frames there are the robot's.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

from openpendant.simplemsg.pendant import JogSpace
from openpendant.simplemsg.verdicts import VerdictCode

from ..joint_slots import JointSlots
from ..refusal import NO_JOINT, Refusal

TOOL_VALUES = 6
"""Along x, y, z and about x, y, z."""

_AXES = ("along x", "along y", "along z", "about x", "about y", "about z")
_FOUR_BYTES = struct.Struct("<f")
_MOST_DIGITS = 9
"""Tell any two 4-byte reals apart (IEEE 754)."""


def count_fault(slots: JointSlots, space: int, count: int) -> Refusal | None:
    """Return why a message with so many values in a space is none for this robot."""
    if space == JogSpace.JOINTS:
        return slots.count_fault(count)
    if space != JogSpace.TOOL:
        return Refusal(VerdictCode.BAD_ARGUMENT, f"space {space}; accepted: 1 joints, 2 tool")
    if count != TOOL_VALUES:
        text = f"{count} values for the tool; accepted: 6, x, y, z and about x, y, z"
        return Refusal(VerdictCode.BAD_ARGUMENT, text, value=count, limit=TOOL_VALUES)
    return None


def shares_fault(space: int, values: Sequence[float]) -> Refusal | None:
    """Judge the shares of a press, each -1 to 1 of the jog speed; the faulty one is named."""
    for index, value in enumerate(values):
        if not -1.0 <= value <= 1.0:
            joint, name = _named(space, index)
            if not math.isfinite(value):
                text = f"the share of {name} is not a finite number"
                return Refusal(VerdictCode.NOT_FINITE, text, joint)
            text = f"the share of {name} is {told(value)}; accepted: -1 to 1"
            limit = math.copysign(1.0, value)
            return Refusal(VerdictCode.BAD_ARGUMENT, text, joint, value, limit)
    return None


def increment_fault(space: int, values: Sequence[float]) -> Refusal | None:
    """Judge the increments of a step: each must be a number; the faulty one is named."""
    for index, value in enumerate(values):
        if not math.isfinite(value):
            joint, name = _named(space, index)
            text = f"the increment of {name} is not a finite number"
            return Refusal(VerdictCode.NOT_FINITE, text, joint)
    return None


def _named(space: int, index: int) -> tuple[int, str]:
    """Return the index of the joint, -1 for none, and what a value is for."""
    if space == JogSpace.JOINTS:
        return index, f"joint {index + 1}"
    return NO_JOINT, f"the tool {_AXES[index]}"


def told(value: float) -> str:
    """Return a finite number in the fewest digits that mean it, as it came: in 4 bytes or in 8."""
    try:
        is_short = _as_four_bytes(value) == value
    except OverflowError:
        is_short = False
    if not is_short:
        return repr(value)
    for digits in range(1, _MOST_DIGITS):
        text = f"{value:.{digits}g}"
        if _as_four_bytes(float(text)) == value:
            return text
    return f"{value:.{_MOST_DIGITS}g}"


def _as_four_bytes(value: float) -> float:
    rounded: float = _FOUR_BYTES.unpack(_FOUR_BYTES.pack(value))[0]
    return rounded
