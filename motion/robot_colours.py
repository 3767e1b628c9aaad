"""The colours that robots are shown in, by maker.

Owns the palettes: near what the makers paint their arms, so that a robot is known at a glance.
"""

from __future__ import annotations

from typing import NamedTuple


class Palette(NamedTuple):
    """`#rrggbb` of an arm's body, its joints and its foot."""

    body: str
    joint: str
    foot: str = "#3c4248"


_PLAIN = Palette("#9db4c8", "#4a5662")

# The first whose word is in maker and model counts, so a model goes before its maker.
_PALETTES: tuple[tuple[str, Palette], ...] = (
    ("iiwa", Palette("#c8ccd2", "#f07d20")),
    ("abb", Palette("#f26b21", "#4b4f54")),
    ("kuka", Palette("#ff7a14", "#2d2f33")),
    ("fanuc", Palette("#f5cf1b", "#4a4a48")),
    ("universal robots", Palette("#d3d8dc", "#5d9bce")),
    ("kawasaki", Palette("#eceef0", "#7c868f")),
    ("motoman", Palette("#2467b8", "#dfe5ec")),
    ("yaskawa", Palette("#2467b8", "#dfe5ec")),
    ("epson", Palette("#f2f1ec", "#a5abb1")),
    ("mitsubishi", Palette("#e4e6e8", "#6d747b")),
    ("unimation", Palette("#e6e0cf", "#6b757c")),
)


def palette(manufacturer: str, model: str) -> Palette:
    """Return the colours of a robot."""
    words = f"{manufacturer} {model}".lower()
    return next((colours for word, colours in _PALETTES if word in words), _PLAIN)
