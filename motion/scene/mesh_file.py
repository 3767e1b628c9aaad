"""Mesh files: triangles from STL and OBJ files of unknown origin.

Owns the two formats and their bounds: size, counts, finite coordinates, indices that exist. Every
fault becomes a `MeshFileError` with the line, or the byte in a binary file. Knows no scene.

STL: ASCII `facet … vertex x y z`, or an 80-byte header, a count and 50 bytes a triangle (little
endian). OBJ: the elements `v` and `f`; polygons are split into fans; all else is skipped.
"""

from __future__ import annotations

import codecs
import io
import math
from array import array
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..bounded_file import read_bounded
from ..errors import MeshFileError
from ..pose import Array

MAX_BYTES = 64 << 20
MAX_TRIANGLES = 500_000
MAX_VERTICES = 3 * MAX_TRIANGLES
MAX_LINES = 8 * MAX_TRIANGLES
"""Most lines of a text file: of the greatest in ASCII STL each triangle has seven."""
MAX_LINE = 1 << 20
"""Longest line of a text file, characters."""

_HEADER = 80
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

Indices: TypeAlias = NDArray[np.int64]


class Triangles(NamedTuple):
    """A surface: `vertices` (v, 3) in the file's unit, `corners` (t, 3) places in `vertices`."""

    vertices: Array
    corners: Indices


def read_mesh(path: str | Path) -> Triangles:
    """Read a sound mesh, or raise `MeshFileError`; the ending `.stl` or `.obj` sets its format."""
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix not in (".stl", ".obj"):
        raise MeshFileError(str(path), "", f"ends in {suffix!r}; accepted: .stl or .obj")
    return triangles_of(str(path), read_bounded(file, MAX_BYTES, MeshFileError))


def triangles_of(path: str, content: bytes) -> Triangles:
    """Return the sound mesh that a file holds; raises and reads by its ending as `read_mesh`."""
    if path.lower().endswith(".obj"):
        return _obj(path, content)
    if len(content) >= _HEADER + 4:
        count = int.from_bytes(content[_HEADER : _HEADER + 4], "little")
        if len(content) == _HEADER + 4 + count * _TRIANGLE.itemsize:
            return _binary_stl(path, content, count)
    if content.lstrip()[:5].lower() == b"solid":
        return _ascii_stl(path, content)
    raise _not_binary_stl(path, content)


def _binary_stl(file: str, content: bytes, count: int) -> Triangles:
    _check_count(file, count)
    corners = np.frombuffer(content, _TRIANGLE, count, _HEADER + 4)["corners"]
    finite = np.isfinite(corners).all(axis=(1, 2))
    if not finite.all():
        byte = _HEADER + 4 + int(np.argmin(finite)) * _TRIANGLE.itemsize
        raise MeshFileError(file, f"byte {byte}", "a coordinate is not a finite number")
    return _soup(corners.astype(np.float64).reshape(-1, 3))


def _not_binary_stl(file: str, content: bytes) -> MeshFileError:
    if len(content) < _HEADER + 4:
        return MeshFileError(
            file, f"byte {len(content)}", f"ends; accepted: at least {_HEADER + 4} bytes of STL"
        )
    count = int.from_bytes(content[_HEADER : _HEADER + 4], "little")
    expected = _HEADER + 4 + count * _TRIANGLE.itemsize
    return MeshFileError(
        file,
        f"byte {_HEADER}",
        f"counts {count} triangles, {expected} bytes in all, but the file has {len(content)}",
    )


def _ascii_stl(file: str, content: bytes) -> Triangles:
    points = array("d")
    for number, words in _lines(file, content):
        match words:
            case ["endfacet", *_] if len(points) % 9:
                raise MeshFileError(file, f"line {number}", "a facet has not three vertices")
            case ["vertex", *values]:
                _check_room(file, number, len(points) // 9)
                points.extend(_point(file, number, values))
    if len(points) % 9:
        raise MeshFileError(file, "", "ends within a facet")
    _check_count(file, len(points) // 9)
    return _soup(np.array(points).reshape(-1, 3))


def _obj(file: str, content: bytes) -> Triangles:
    points, corners = array("d"), array("q")
    for number, words in _lines(file, content):
        match words:
            case ["v", *values]:
                if len(points) >= 3 * MAX_VERTICES:
                    problem = f"is vertex {MAX_VERTICES + 1}; accepted: {MAX_VERTICES}"
                    raise MeshFileError(file, f"line {number}", problem)
                points.extend(_point(file, number, values[:3]))
            case ["f", *named]:
                place = [_index(file, number, word, len(points) // 3) for word in named]
                if len(place) < 3:
                    raise MeshFileError(file, f"line {number}", "a face has not three corners")
                _check_room(file, number, len(corners) // 3)
                for edge in pairwise(place[1:]):
                    corners.extend((place[0], *edge))
    _check_count(file, len(corners) // 3)
    vertices = np.array(points).reshape(-1, 3)
    return Triangles(vertices, np.array(corners, dtype=np.int64).reshape(-1, 3))


def _lines(file: str, content: bytes) -> Iterator[tuple[int, list[str]]]:
    """Yield the words of each line, with its number; a list of them takes ten times the file."""
    _check_text(file, content)
    with io.TextIOWrapper(io.BytesIO(content), encoding="utf-8") as text:
        number = 0
        while line := text.readline(MAX_LINE + 1):
            number += 1
            if number > MAX_LINES:
                problem = f"is one more than the {MAX_LINES} lines that are accepted"
                raise MeshFileError(file, f"line {number}", problem)
            if len(line) > MAX_LINE:
                problem = f"is longer than {MAX_LINE} characters"
                raise MeshFileError(file, f"line {number}", problem)
            yield number, line.split()


def _check_text(file: str, content: bytes) -> None:
    decoder = codecs.getincrementaldecoder("utf-8")()
    for begin in range(0, len(content), MAX_LINE):
        end = begin + MAX_LINE
        try:
            decoder.decode(content[begin:end], final=end >= len(content))
        except UnicodeDecodeError as error:
            # What it had kept of the piece before stands in front of this one.
            byte = min(end, len(content)) - len(error.object) + error.start
            raise MeshFileError(file, f"byte {byte}", "is not UTF-8 text") from error


def _point(file: str, number: int, values: list[str]) -> tuple[float, float, float]:
    try:
        x, y, z = (float(value) for value in values)
    except ValueError:
        raise MeshFileError(file, f"line {number}", "a vertex is not three numbers") from None
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        raise MeshFileError(file, f"line {number}", "a coordinate is not a finite number")
    return x, y, z


def _index(file: str, number: int, word: str, count: int) -> int:
    """Return the place of a corner such as `7`, `7/1/3` or `-1`, the last vertex so far."""
    try:
        value = int(word.partition("/")[0])
    except ValueError:
        raise MeshFileError(file, f"line {number}", "a corner is not a whole number") from None
    place = value - 1 if value > 0 else count + value
    if value == 0 or not 0 <= place < count:
        problem = f"names vertex {value}; accepted: 1 to {count}"
        raise MeshFileError(file, f"line {number}", problem)
    return place


def _check_room(file: str, number: int, triangles: int) -> None:
    """Refuse one more triangle than may be, before any more are kept."""
    if triangles >= MAX_TRIANGLES:
        problem = f"begins triangle {triangles + 1}; accepted: 1 to {MAX_TRIANGLES}"
        raise MeshFileError(file, f"line {number}", problem)


def _check_count(file: str, triangles: int) -> None:
    if not 1 <= triangles <= MAX_TRIANGLES:
        raise MeshFileError(
            file, "", f"holds {triangles} triangles; accepted: 1 to {MAX_TRIANGLES}"
        )


def _soup(points: Array) -> Triangles:
    """Return triangles that share no vertex, three consecutive points each."""
    return Triangles(points, np.arange(len(points)).reshape(-1, 3))
