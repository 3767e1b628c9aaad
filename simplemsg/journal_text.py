"""Spelling of values in a journal's lines; long values are spelled out later, in pieces.

Owns the spelling: bytes as hexadecimal digits or base64, everything else as JSON. To spell out a
megabyte takes milliseconds, which an event loop does not have, and one call for it keeps all
threads of the process from running. So a long value goes to the journal's writer as it is.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

LONG = 4_096
"""Bytes or characters from which a value is spelled out later; less takes some microseconds."""

PIECE = 3 * 16_384
"""Bytes or characters of a piece; whole groups of base64, so that pieces follow without a seam."""

_GAP = {"": ""}
"""Key of a long value's place in JSON: no other key of a journal is empty."""

_GAP_TEXT = json.dumps(_GAP)  # in a text its quotation marks would be escaped


@dataclass(frozen=True, slots=True, eq=False)
class LongValue:
    """A value that is not spelled out yet, and never changes.

    Attributes:
        content: the text or the bytes.
        spell: returns how a piece of it stands between the quotation marks.
    """

    content: str | bytes | memoryview
    spell: Callable[[Any], str]

    def __len__(self) -> int:
        """Return how long it is, before it is spelled out."""
        return len(self.content)

    def pieces(self) -> Iterator[str]:
        """Spell it out piece by piece, with its quotation marks."""
        yield '"'
        for begin in range(0, len(self.content), PIECE):
            yield self.spell(self.content[begin : begin + PIECE])
        yield '"'


Part: TypeAlias = str | LongValue
"""A part of a line: text that stands there so, or a value that is not spelled out yet."""


def hexadecimal(data: bytes) -> Part:
    """Return bytes as hexadecimal digits in quotation marks."""
    return f'"{data.hex()}"' if len(data) < LONG else LongValue(data, bytes.hex)


def base64_value(data: bytes | memoryview) -> Part:
    """Return bytes as a value for `json_parts`, which stands there in base64.

    Args:
        data: the bytes; a view is of single bytes.
    """
    return _base64(data) if len(data) < LONG else LongValue(data, _base64)


def with_long_texts(value: Any) -> Any:
    """Return JSON data with its long texts marked, so that `json_parts` leaves them to the writer.

    Looks at every value, so it is for data of few parts.
    """
    match value:
        case str():
            return value if len(value) < LONG else LongValue(value, _escaped)
        case dict():
            return {key: with_long_texts(each) for key, each in value.items()}
        case list() | tuple():
            return [with_long_texts(each) for each in value]
    return value


def json_parts(value: Any) -> Iterator[Part]:
    """Return JSON data as text; what is long and marked so is left for later.

    Args:
        value: what JSON can hold, and long values.

    Raises:
        TypeError: it holds something else.
    """
    later: list[LongValue] = []

    def leave(each: object) -> object:
        if not isinstance(each, LongValue):
            raise TypeError(f"{type(each).__name__} cannot stand in a journal")
        later.append(each)
        return _GAP

    first, *rest = json.dumps(value, default=leave).split(_GAP_TEXT)
    yield first
    for each, text in zip(later, rest, strict=True):
        yield each
        yield text


def spelled(part: Part) -> str:
    """Return a part as it stands in the file; for long ones this takes long."""
    return part if isinstance(part, str) else "".join(part.pieces())


def _base64(data: bytes | memoryview) -> str:
    return base64.b64encode(data).decode("ascii")


def _escaped(text: str) -> str:
    return json.dumps(text)[1:-1]
