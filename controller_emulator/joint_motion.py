"""The motion of one joint within a segment: its pieces, its ends, and what it may do.

Owns plain data. The rules that make pieces from ends are those of `polynomials` and `switching`;
times are seconds from the start of the segment.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import repeat
from typing import NamedTuple

Coefficients = tuple[float, float, float, float, float, float]
"""Position as c0 + c1·t + … + c5·t⁵, t counted from the start of the piece."""

Piece = tuple[float, Coefficients]
"""Start of a piece within its segment [s], and its polynomial."""

Pieces = tuple[Piece, ...]
"""The motion of one joint, in order of time."""


@dataclass(slots=True)
class Bounds:
    """What one joint may do within one segment; all four include their rounding allowances.

    Never changed, but not frozen, as that takes four times as long to make, for every joint of
    every point.

    Attributes:
        lower: least position [rad or m].
        upper: greatest position [rad or m].
        velocity: greatest speed [rad/s or m/s].
        acceleration: greatest acceleration [rad/s² or m/s²].
        smooth_acceleration: a polynomial is taken up to this acceleration, beyond it a motion that
            switches between accelerations [rad/s² or m/s²].
    """

    lower: float
    upper: float
    velocity: float
    acceleration: float
    smooth_acceleration: float


class End(NamedTuple):
    """State of one joint at one end of a segment.

    Attributes:
        position: [rad or m].
        velocity: [rad/s or m/s].
        acceleration: [rad/s² or m/s²], None where the sender left it open.
    """

    position: float
    velocity: float
    acceleration: float | None = None


def ends(
    position: Sequence[float],
    velocity: Sequence[float],
    acceleration: Sequence[float] | None,
) -> list[End]:
    """Return the state of each joint at one end of a segment.

    Args:
        position: (n,) [rad or m].
        velocity: (n,) […/s].
        acceleration: (n,) […/s²], None where the sender left it open.
    """
    stated: Iterable[float | None] = repeat(None) if acceleration is None else acceleration
    return list(map(_new_end, zip(position, velocity, stated, strict=False)))


_new_end = partial(tuple.__new__, End)
"""Makes an `End` of a tuple in half the time that a call of the class takes."""
