"""What is assumed of a joint that nobody described fully, and how such values read and are typed.

Owns the rules, which `docs/robots.md` lists. They are cautious: a robot is moved slower than it
could be, never faster than anybody said. Screens show and take degrees and millimetres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import BadArgument
from .imported_chain import ImportedJoint

RAMP = 0.5
"""Time to full speed [s] where accelerations are not stated: acceleration = velocity / ramp."""


@dataclass(frozen=True, slots=True)
class AssumedLimits:
    """Range and speed [rad or m, s], and the rule in words."""

    lower: float
    upper: float
    velocity: float
    rule: str


REVOLUTE = AssumedLimits(-math.pi, math.pi, 1.0, "half a turn to either side")
CONTINUOUS = AssumedLimits(
    -2.0 * math.pi, 2.0 * math.pi, 1.0, "it turns without end; a turn to either side"
)
PRISMATIC = AssumedLimits(0.0, 1.0, 0.25, "a metre from its zero")


def assumed_limits(joint: ImportedJoint) -> AssumedLimits:
    """Return what is assumed of a driven joint."""
    if joint.unit == "m":
        return PRISMATIC
    return CONTINUOUS if joint.continuous else REVOLUTE


def on_screen(value: float, unit: str) -> str:
    """Return a value [rad or m] in degrees or millimetres, with its unit."""
    return f"{1000.0 * value:zg} mm" if unit == "m" else f"{math.degrees(value):zg}°"


def typed_range(text: str, unit: str) -> tuple[float, float]:
    """Read two values, in degrees or millimetres, as a range [rad or m].

    Raises:
        BadArgument: not two numbers, the first less than the second.
    """
    values = typed_values(text, (unit, unit))
    if not values[0] < values[1]:
        raise BadArgument("range", text, "the least value, then the greatest")
    return values[0], values[1]


def typed_rate(text: str, unit: str) -> float:
    """Read a rate per second, in degrees or millimetres, as [rad/s or m/s].

    Raises:
        BadArgument: not one number more than 0.
    """
    (value,) = typed_values(text, (unit,))
    if not value > 0.0:
        raise BadArgument("speed", text, "more than 0")
    return value


def typed_values(text: str, units: tuple[str, ...]) -> tuple[float, ...]:
    """Read numbers separated by spaces or commas, in degrees or millimetres, as [rad or m].

    Raises:
        BadArgument: not one finite number per unit.
    """
    accepted = f"{len(units)} finite numbers" if len(units) > 1 else "a finite number"
    try:
        values = [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise BadArgument("answer", text, accepted) from None
    if len(values) != len(units) or not all(map(math.isfinite, values)):
        raise BadArgument("answer", text, accepted)
    return tuple(
        value / 1000.0 if unit == "m" else math.radians(value)
        for value, unit in zip(values, units, strict=True)
    )
