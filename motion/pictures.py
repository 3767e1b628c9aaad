"""Facets of a drawing as an SVG or a PNG picture, without any drawing library.

Owns the two formats. An SVG lists the polygons, the farthest first. A PNG is filled point by point
with the nearest facet, each point being the mean of several samples. Sources: W3C "Scalable Vector
Graphics 1.1"; W3C "Portable Network Graphics", second edition.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .drawing import Facet
from .errors import BadArgument
from .pose import Array

Pixels: TypeAlias = NDArray[np.uint8]

SIZE = 720
"""Width and height of a picture in points."""

_MARGIN = 1.06  # of the half picture that the drawing fills
_SAMPLES = 2  # per point and direction
_EDGE = 1e-9
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_WHITE = 255


def write_picture(facets: Sequence[Facet], path: Path, title: str) -> None:
    """Write a picture; its format is told by the ending, `.svg` or `.png`.

    Raises:
        BadArgument: another ending, or the file cannot be written.
    """
    match path.suffix.lower():
        case ".svg":
            content = svg(facets, title).encode()
        case ".png":
            content = png(facets)
        case other:
            raise BadArgument("picture", str(path), f".svg or .png, not {other!r}")
    try:
        path.write_bytes(content)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not a legal file name"
        raise BadArgument("picture", str(path), f"a file that can be written ({reason})") from error


def svg(facets: Sequence[Facet], title: str) -> str:
    """Return an SVG document."""
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{SIZE}" height="{SIZE}"'
        f' viewBox="0 0 {SIZE} {SIZE}">',
        f"<title>{_escaped(title)}</title>",
        f'<rect width="{SIZE}" height="{SIZE}" fill="#ffffff"/>',
        '<g stroke-width="0.6" stroke-linejoin="round">',
    ]
    for facet in facets:
        corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in _on_screen(facet.points, SIZE))
        colour = "#" + "".join(f"{value:02x}" for value in facet.colour)
        # The stroke covers the hairline that smoothing leaves between neighbours.
        lines.append(f'<polygon points="{corners}" fill="{colour}" stroke="{colour}"/>')
    return "\n".join([*lines, "</g>", "</svg>", ""])


def png(facets: Sequence[Facet]) -> bytes:
    """Return a PNG file's bytes, 8 bits each of red, green and blue."""
    pixels = raster(facets)
    height, width, _ = pixels.shape
    # Each line begins with its filter's number; 0 is none.
    lines = np.concatenate((np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)), axis=1)
    return b"".join(
        (
            _PNG_SIGNATURE,
            _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
            _chunk(b"IDAT", zlib.compress(lines.tobytes(), 9)),
            _chunk(b"IEND", b""),
        )
    )


def raster(facets: Sequence[Facet]) -> Pixels:
    """Return the picture's (height, width, 3) points."""
    fine = SIZE * _SAMPLES
    colours = np.full((fine, fine, 3), _WHITE, np.uint8)
    nearest = np.full((fine, fine), np.inf)
    for facet in facets:
        _fill(facet, colours, nearest)
    samples = colours.reshape(SIZE, _SAMPLES, SIZE, _SAMPLES, 3).astype(np.uint16)
    count = _SAMPLES * _SAMPLES
    points: Pixels = ((samples.sum(axis=(1, 3)) + count // 2) // count).astype(np.uint8)
    return points


def _fill(facet: Facet, colours: Pixels, nearest: Array) -> None:
    corners = _on_screen(facet.points, len(nearest))
    low = np.clip(np.floor(corners.min(axis=0)).astype(int), 0, len(nearest))
    high = np.clip(np.ceil(corners.max(axis=0)).astype(int) + 1, 0, len(nearest))
    if (low >= high).any():
        return
    x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
    # A point is inside a convex polygon if it is on the same side of every edge.
    sides = [
        (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    inside = np.all([side <= _EDGE for side in sides], axis=0)
    depth = _depth_at(corners, facet.depths, x, y)
    place = (slice(low[1], high[1]), slice(low[0], high[0]))
    shown = inside & (depth < nearest[place])
    nearest[place][shown] = depth[shown]
    colours[place][shown] = facet.colour


def _depth_at(corners: Array, depths: Array, x: Array, y: Array) -> Array:
    """Return the depth of the facet's plane at points, by a plane through its corners."""
    system = np.column_stack((corners, np.ones(len(corners))))
    (per_x, per_y, constant), *_ = np.linalg.lstsq(system, depths, rcond=None)
    plane: Array = per_x * x + per_y * y + constant
    return plane


def _on_screen(points: Array, size: int) -> Array:
    """Return (k, 2) points in picture units: from the top left corner, y down."""
    half = size / 2.0
    screen: Array = half + points * np.array([1.0, -1.0]) * half / _MARGIN
    return screen


def _chunk(kind: bytes, content: bytes) -> bytes:
    check = zlib.crc32(kind + content)
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)


def _escaped(text: str) -> str:
    shown = "".join(char if char.isprintable() else " " for char in text)
    return shown.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
