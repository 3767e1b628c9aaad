"""Layout of declared fields in bytes: `struct` codes, and the value that does not fit.

The one place that knows `struct` formats of fields. It knows nothing of streams, and nothing of how
fast a message must be packed (`packing`). Packing checks nothing beforehand, which would cost more
than packing itself; only once it failed is the message searched, value by value, to name the one at
fault in the error.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

from .codes import CommType
from .declaration import MASK, Array, Field, Int, Message, Real, Reals, Tail, Text
from .errors import LocalProtocolError, NotEncodable
from .framing import Bytes, broken_header_rule
from .real_records import RealRecords

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
            prefix: `struct` codes of what stands in front of them.
        """
        codes = "".join(self.format_of(field) for field in fields.values())
        return struct.Struct(self.order + prefix + codes)


_REAL_WIDTHS = {"f": 4, "d": 8}


@dataclass(frozen=True, slots=True)
class _Unfit:
    """One value that does not fit."""

    path: str
    value: object
    expected: str


def encoding_fault(message: Message, form: WireForm) -> LocalProtocolError:
    """Return the error that says why a declared message could not be packed."""
    place = message.PLACE
    reason = header_fault(place.msg_type, message.comm_type, message.reply_code)
    if reason is None and place.is_reply and message.comm_type != CommType.REPLY:
        reason = f"this layout is a reply's, communication type {message.comm_type} is not"
    if reason is not None:
        return LocalProtocolError(f"{place.name}: {reason}")
    for unfit in chain(_unfit_fields(message, message.FIELDS, form), _unfit_numbers(message)):
        return NotEncodable(place.name, unfit.path, unfit.value, unfit.expected)
    return LocalProtocolError(f"{place.name}: the message cannot be packed")


def header_fault(msg_type: int, comm_type: int, reply_code: int) -> str | None:
    """Return the fault of a header of ours, None where it has none."""
    header = {"message type": msg_type, "communication type": comm_type, "reply code": reply_code}
    for name, value in header.items():
        if not _packs("=i", value):
            return f"the {name} is no integer of 32 bits"
    return broken_header_rule(msg_type, comm_type, reply_code)


def _unfit_fields(
    record: object, fields: Mapping[str, Field], form: WireForm, path: str = ""
) -> Iterator[_Unfit]:
    for name, field in fields.items():
        yield from _unfit_value(f"{path}{name}", field, getattr(record, name, None), form)


def _unfit_value(path: str, field: Field, value: Any, form: WireForm) -> Iterator[_Unfit]:
    match field:
        case Int():
            if not _packs("=i", value):
                yield _Unfit(path, value, "an integer of 32 bits")
        case Real():
            yield from _unfit_real(path, value, form)
        case Reals():
            if not isinstance(value, Collection) or len(value) != field.count:
                yield _Unfit(path, value, f"{field.count} real numbers")
                return
            for index, real in enumerate(value):
                yield from _unfit_real(f"{path}[{index}]", real, form)
        case Text():
            if not _is_text(value, field.size):
                told = MASK if field.secret else value
                yield _Unfit(path, told, f"up to {field.size} bytes of UTF-8 without a zero byte")
        case Tail():
            if not isinstance(value, bytes | bytearray | memoryview):
                yield _Unfit(path, value, "bytes")
        case Array():
            if not isinstance(value, tuple | list | RealRecords):
                yield _Unfit(path, value, "a tuple of records")
            elif not field.least <= len(value) <= field.most:
                yield _Unfit(path, len(value), f"{field.least} to {field.most} records")
            else:
                assert field.of is not None
                for index, record in enumerate(value):
                    yield from _unfit_fields(record, field.of.FIELDS, form, f"{path}[{index}].")


def _unfit_numbers(message: Message) -> Iterator[_Unfit]:
    """Compare the number of records with the number that is meant."""
    for name, field in message.FIELDS.items():
        if isinstance(field, Array) and field.meant_by:
            number, meant = len(getattr(message, name)), getattr(message, field.meant_by)
            if not field.takes(number, meant):
                expected = f"{field.least} to {number}, with as many records or {field.most}"
                yield _Unfit(field.meant_by, meant, f"{expected}; there are {number}")


def _unfit_real(path: str, value: object, form: WireForm) -> Iterator[_Unfit]:
    if not _packs(f"={form.real}", value):
        yield _Unfit(path, value, f"a real number that fits {_REAL_WIDTHS[form.real]} bytes")


def _packs(code: str, value: object) -> bool:
    try:
        struct.pack(code, value)
    except (struct.error, OverflowError, TypeError, ValueError):
        return False
    return True


def _is_text(value: object, size: int) -> bool:
    if not isinstance(value, str):
        return False
    try:
        raw = value.encode()
    except UnicodeEncodeError:  # a lone surrogate
        return False
    return len(raw) <= size and 0 not in raw
