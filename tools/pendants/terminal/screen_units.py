"""Degrees and millimetres, for the screen: everywhere else angles and lengths are SI.

Owns the conversion for the screen, of a joint's value and of the quantities in a sentence of the
server.
"""

from __future__ import annotations

import math
import re
from typing import Literal

_NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"

# `1.5 rad`, `-6.28 to 6.28 rad`, `3 rad/s²`, `0.25 m`; no more than a unit itself follows.
_QUANTITY = re.compile(
    rf"(?<![\w.])(?P<first>{_NUMBER})(?P<to> to (?P<second>{_NUMBER}))?"
    r" (?P<unit>rad|m)(?P<per>/s²?)?(?![\w/²])"
)

# A number with more decimals than anybody reads, in whatever unit.
_LONG = re.compile(r"(?<![\w.:])-?\d+\.\d{5,}(?:e[+-]?\d+)?(?![\w.])")


def joint_value(value: float, unit: Literal["rad", "m"], per: str = "") -> str:
    """Return a value of a joint as people read it, such as `-45.00°` or `120.0 mm/s`.

    Args:
        value: in the unit [rad, m], or per second of it.
        unit: of the joint.
        per: what follows the unit: nothing, `/s` or `/s²`.
    """
    return f"{_number(value, unit)}{_sign(unit)}{per}"


def in_screen_units(sentence: str) -> str:
    """Return a sentence with its angles in degrees and its lengths in millimetres.

    What has another unit, or none, keeps four decimals at most.

    Args:
        sentence: of the server, which names the unit of each quantity: `1.57 rad`, `0.25 m`.
    """
    return _LONG.sub(_shortened, _QUANTITY.sub(_converted, sentence))


def _shortened(found: re.Match[str]) -> str:
    value = float(found[0])
    return f"{value:.4f}" if value == 0.0 or abs(value) >= 0.001 else f"{value:.2g}"


def _converted(found: re.Match[str]) -> str:
    unit: Literal["rad", "m"] = "rad" if found["unit"] == "rad" else "m"
    numbers = [found["first"], *([found["second"]] if found["to"] else [])]
    shown = " to ".join(_number(float(number), unit) for number in numbers)
    return f"{shown}{_sign(unit)}{found['per'] or ''}"


def _number(value: float, unit: Literal["rad", "m"]) -> str:
    """Return a number without its unit: hundredths of a degree, tenths of a millimetre."""
    return f"{math.degrees(value):.2f}" if unit == "rad" else f"{1000 * value:.1f}"


def _sign(unit: Literal["rad", "m"]) -> str:
    return "°" if unit == "rad" else " mm"
