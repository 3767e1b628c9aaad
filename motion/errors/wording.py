"""Turns of phrase that several refusals share: numbers with units, places in files and on paths.

Owns how a number is shown to people: millimetres and degrees. Knows none of the refusals.
"""

from __future__ import annotations

import math

_LONGEST = 80


def shortened(value: object) -> str:
    """Return a value as Python writes it, cut after 80 characters."""
    text = repr(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def for_a_screen(value: float, unit: str) -> str:
    """Return a number with its unit: metres as millimetres, radians as degrees."""
    match unit:
        case "m":
            return f"{1e3 * value:.3g} mm"
        case "rad":
            return f"{math.degrees(value):.3g}°"
    return f"{value:.3g} {unit}".rstrip()


def on_the_path(fraction: float | None) -> str:
    """Return how far along a path something lies, 0 to 1, to end a clause; nothing for None."""
    return "" if fraction is None else f" at {fraction:.1%} of the path"


def in_file(file: str, place: str, problem: str) -> str:
    """Return a problem behind the file and the place in it, which is empty for the whole file."""
    return f"{file}: {place}: {problem}" if place else f"{file}: {problem}"
