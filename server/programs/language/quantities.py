"""Quantities: numbers with units in a program's text, and back, without losing a bit.

Owns the unit words and their conversion into SI. A decimal is converted exactly and then rounded
once to the nearest real, so every real has a text in degrees or millimetres that reads back as
itself, which a multiplication of reals by π/180 could not guarantee. Knows no grammar.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Context, Decimal
from enum import Enum
from functools import cache

LONGEST_NUMBER = 40
"""Greatest number of characters of a number."""

_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?", re.ASCII)
_EXACT = Context(prec=60)
_DEGREE = _EXACT.divide(
    Decimal("3.14159265358979323846264338327950288419716939937510582097494459"), Decimal(180)
)
_DIGITS = (12, 15, 16, 17, 18, 19, 20)
"""Numbers of digits tried in order: those that people type, then those that any real needs."""


class Dimension(Enum):
    """Quantity that a number measures."""

    ANGLE = "an angle"
    LENGTH = "a length"
    TIME = "a time"
    FRACTION = "a fraction"
    VELOCITY = "a speed of the tool"


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit word.

    Attributes:
        factor: its size in SI.
    """

    dimension: Dimension
    factor: Decimal


UNITS: Mapping[str, Unit] = {
    "deg": Unit(Dimension.ANGLE, _DEGREE),
    "rad": Unit(Dimension.ANGLE, Decimal(1)),
    "mm": Unit(Dimension.LENGTH, Decimal("0.001")),
    "m": Unit(Dimension.LENGTH, Decimal(1)),
    "s": Unit(Dimension.TIME, Decimal(1)),
    "ms": Unit(Dimension.TIME, Decimal("0.001")),
    "%": Unit(Dimension.FRACTION, Decimal("0.01")),
    "mm/s": Unit(Dimension.VELOCITY, Decimal("0.001")),
    "m/s": Unit(Dimension.VELOCITY, Decimal(1)),
}
"""Every unit word of the grammar; those of one dimension stand together."""


@cache
def unit_words(*dimensions: Dimension) -> tuple[str, ...]:
    """Return the unit words of some dimensions."""
    return tuple(word for word, unit in UNITS.items() if unit.dimension in dimensions)


@cache
def units_of(*dimensions: Dimension) -> str:
    """Return the unit words of some dimensions, for a message."""
    return " or ".join(unit_words(*dimensions))


def is_number(text: str) -> bool:
    """Return True if a word is a number of the grammar."""
    return len(text) <= LONGEST_NUMBER and _NUMBER.fullmatch(text) is not None


def to_si(number: str, unit: str) -> float:
    """Return a number with a unit in SI: the nearest real, an infinity beyond all reals.

    Args:
        number: a text for which `is_number` holds.
        unit: a word of `UNITS`.
    """
    return float(_EXACT.multiply(Decimal(number), UNITS[unit].factor)) + 0.0


def from_si(value: float, unit: str) -> str:
    """Return the number that reads back as a real with this unit, with few digits.

    Args:
        value: a finite real, SI.
        unit: a word of `UNITS`.
    """
    exact = _EXACT.divide(Decimal(value), UNITS[unit].factor)
    for digits in _DIGITS:
        text = _plain(Context(prec=digits).plus(exact))
        if to_si(text, unit) == value:
            return text
    raise AssertionError("twenty digits tell all reals apart")


def plain_number(value: float) -> str:
    """Return a finite real without a unit, as short as it reads back exactly."""
    return _plain(Decimal(repr(value)))


def _plain(value: Decimal) -> str:
    if not value:
        return "0"
    value = value.normalize(_EXACT)
    # People do not write 1E+2; but neither do they write forty zeros.
    return format(value, "f") if -9 <= value.adjusted() <= 15 else str(value).replace("E+", "E")


def read_number(number: str) -> float:
    """Return the real nearest to a number for which `is_number` holds; infinite beyond all."""
    return float(number) + 0.0
