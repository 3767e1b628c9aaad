"""Rounding allowances for numbers that travelled as 4-byte reals.

Owns the two allowances: how far a value may be from the one that was meant, and which decimal
time a 4-byte real stands for. Knows no messages and no limits.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable

_FLOAT32 = struct.Struct("<f")
_HALF_PLACE = 2.0**28
"""Half a unit in the last place of a 4-byte real, in such units of Python's 8-byte ones."""

_SIGNIFICANT_DIGITS = range(6, 9)

NANOSECONDS = 1_000_000_000
"""Nanoseconds in a second."""


def rounding(value: float) -> float:
    """Return the largest error that rounding to a 4-byte real may have left in a value."""
    return math.ulp(value) * _HALF_PLACE if value else 0.0


def roundings(values: Iterable[float]) -> list[float]:
    """Return the `rounding` of each value."""
    ulp = math.ulp
    return [ulp(value) * _HALF_PLACE if value else 0.0 for value in values]


def read_time(seconds: float) -> int:
    """Return a time from the wire in nanoseconds.

    A 4-byte real cannot hold 0.07 s, nor even a microsecond beyond 16 s, but the shortest decimal
    that rounds to it is what the sender meant. Times are differenced over steps of 10 ms, where
    the rounding left in would amount to accelerations of several percent of a limit.
    """
    if _as_float32(seconds) == seconds:
        for digits in _SIGNIFICANT_DIGITS:
            decimal = float(f"{seconds:.{digits}g}")
            if _as_float32(decimal) == seconds:
                return round(decimal * NANOSECONDS)
    return round(seconds * NANOSECONDS)


def _as_float32(value: float) -> float:
    try:
        (rounded,) = _FLOAT32.unpack(_FLOAT32.pack(value))
    except OverflowError:
        return math.inf
    return float(rounded)
