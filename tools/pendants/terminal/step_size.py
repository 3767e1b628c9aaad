"""The sizes of an increment: a length and an angle, from a ladder or typed.

Owns the ladder, what may be typed, and how a size is shown. Sizes are SI inside; people see
millimetres and degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

_LENGTHS_MM = (0.1, 1.0, 5.0, 10.0)
_ANGLES_DEG = (0.05, 0.5, 2.5, 5.0)
_LARGEST_MM, _LARGEST_DEG = 100.0, 45.0


class NotASize(ValueError):
    """A text that names no size; it says what would be accepted."""


@dataclass(frozen=True, slots=True)
class StepSize:
    """How far one increment goes.

    Attributes:
        millimetres: along an axis.
        degrees: about an axis.
    """

    millimetres: float = _LENGTHS_MM[1]
    degrees: float = _ANGLES_DEG[1]

    @property
    def metres(self) -> float:
        """The length [m]."""
        return self.millimetres / 1000

    @property
    def radians(self) -> float:
        """The angle [rad]."""
        return math.radians(self.degrees)

    def changed(self, by: int) -> StepSize:
        """Return the next size up or down the ladder, from a typed one too; the ends stay."""
        return StepSize(
            _neighbour(_LENGTHS_MM, self.millimetres, by), _neighbour(_ANGLES_DEG, self.degrees, by)
        )

    def typed(self, text: str) -> StepSize:
        """Return the sizes after one was typed, such as `2mm` or `1.5deg`.

        Raises:
            NotASize: it is none.
        """
        for unit, largest in (("mm", _LARGEST_MM), ("deg", _LARGEST_DEG)):
            if not text.endswith(unit):
                continue
            try:
                size = float(text.removesuffix(unit))
            except ValueError:
                break
            if 0.0 < size <= largest:
                length = size if unit == "mm" else self.millimetres
                return StepSize(length, size if unit == "deg" else self.degrees)
        if "," in text:
            raise NotASize(f"{text!r} is no step; accepted: a dot for decimals, as in 2.5mm")
        accepted = f"up to {_LARGEST_MM:g}mm or {_LARGEST_DEG:g}deg, above 0, with the unit"
        raise NotASize(f"{text or 'nothing'!r} is no step; accepted: {accepted}")


def _neighbour(ladder: tuple[float, ...], size: float, by: int) -> float:
    if by > 0:
        return next((each for each in ladder if each > size), ladder[-1])
    return next((each for each in reversed(ladder) if each < size), ladder[0])
