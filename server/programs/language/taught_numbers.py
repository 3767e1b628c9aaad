"""Numbers of a taught point: rounded to what people read, inside the limits that they were inside.

Owns the decimals that a taught angle and length have in a program's text, and that rounding never
carries a joint over a limit. What is typed or sent keeps every bit; only where the robot stood is
rounded, far below what a report of 4-byte reals tells, so that text, document and what is driven
are one number.
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal

from openpendant.motion.description.limits import JointLimits

from .lexer import UNITS, to_si

DECIMALS = {"deg": 6, "mm": 4}
"""Decimals of a taught number in its text, by its unit."""

_HALF_A_DIGIT = {"deg": "5e-7", "mm": "5e-5"}

_EXACT = Context(prec=60)


def taught_joints(joints: Sequence[float], limits: JointLimits) -> tuple[float, ...]:
    """Return (n,) joints as they are taught [rad or m].

    A joint that is outside its range by less than its text tells, or by no more than a 4-byte real
    is rounded by, is taught on its limit; one that is farther out stays outside.
    """
    reported = limits.as_float32()
    taught = []
    for index, value in enumerate(joints):
        unit = "mm" if limits.prismatic[index] else "deg"
        lower, upper = limits.lower[index], limits.upper[index]
        unseen = to_si(_HALF_A_DIGIT[unit], unit)
        least = min(reported.lower[index], lower - unseen)
        if not least <= value <= max(reported.upper[index], upper + unseen):
            taught.append(_nearest(value, unit))
            continue
        taught.append(_inside(min(max(value, lower), upper), unit, lower, upper))
    return tuple(taught)


def taught_position(position: Sequence[float]) -> tuple[float, float, float]:
    """Return the x, y, z of a taught pose [m]."""
    x, y, z = (_nearest(value, "mm") for value in position)
    return x, y, z


def _nearest(value: float, unit: str, rounding: str = ROUND_HALF_EVEN) -> float:
    """Return the real whose text in a unit has the decimals of a taught number."""
    exact = _EXACT.divide(Decimal(value), UNITS[unit].factor)
    step = Decimal(1).scaleb(-DECIMALS[unit])
    return to_si(str(exact.quantize(step, rounding=rounding, context=_EXACT)), unit)


def _inside(value: float, unit: str, lower: float, upper: float) -> float:
    """Return a value within a range, rounded, and inward where the nearest text is outside."""
    for rounding in (ROUND_HALF_EVEN, ROUND_FLOOR, ROUND_CEILING):
        rounded = _nearest(value, unit, rounding)
        if lower <= rounded <= upper:
            return rounded
    # The range is narrower than what people read.
    return value
