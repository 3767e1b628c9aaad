"""Layout of declared fields in bytes: `struct` codes and texts.

The one place that knows `struct` formats of fields. It knows nothing of streams, and nothing of how
fast a message must be packed (`fixed`, `variable`).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from .declaration import Field, Int, Message, Real, Reals, Text
from .framing import Bytes

Encode = Callable[[Message], bytes]
Decode = Callable[[Bytes], Message]


class Misfit(ValueError):
    """A body does not have the layout that its message type declares; the text says how."""


@dataclass(frozen=True, slots=True)
class WireForm:
    """Form of numbers on a connection: byte order prefix of `struct` and width of a real.

    Attributes:
        order: "<" or ">".
        real: "f" or "d".
    """

    order: str
    real: str

    def format_of(self, field: Field) -> str:
        """Return the `struct` code of one field of fixed size."""
        match field:
            case Int():
                return "i"
            case Real():
                return self.real
            case Reals():
                return f"{field.count}{self.real}"
            case Text():
                return f"{field.size}s"
        raise TypeError(f"{type(field).__name__} has no fixed size")

    def structure(self, fields: Mapping[str, Field], prefix: str = "") -> struct.Struct:
        """Return the packed structure of several fields of fixed size.

        Args:
            fields: the fields by name.
            prefix: `struct` codes of what stands in front of them.
        """
        codes = "".join(self.format_of(field) for field in fields.values())
        return struct.Struct(self.order + prefix + codes)


def text_to_wire(value: str, size: int) -> bytes:
    """Return UTF-8 text for a fixed field of `size` bytes (padding is left to `struct`).

    Raises:
        ValueError: it is longer than the field, is no Unicode text (a lone surrogate), or holds a
            zero byte, which ends a text.
    """
    raw = value.encode("utf-8")
    if len(raw) > size or b"\0" in raw:
        raise ValueError(f"{len(raw)} bytes for a field of {size}, or a zero byte")
    return raw


def text_from_wire(raw: bytes) -> str:
    """Return the text before the first zero byte.

    Raises:
        UnicodeDecodeError: it is not UTF-8; also where the field's end cuts a character in two.
    """
    return raw.split(b"\0", 1)[0].decode("utf-8")
