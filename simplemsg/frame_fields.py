"""Fields of a message in the order of their bytes, for whoever reads frames by hand or by table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from .declaration import Array, CountPlace, Field, Int, Message, Real, Reals, Record, Tail, Text
from .framing import HEADER_SIZE
from .layout import WireForm

_REAL_CODES = {4: "f", 8: "d"}


@dataclass(frozen=True, slots=True)
class FrameField:
    """One field of a frame.

    Attributes:
        offset: bytes before it in the frame, such as `16` or `20 + 40 i`.
        kind: its type on the wire.
        name: its name, `points[i].joints` inside a record.
    """

    offset: str
    kind: str
    name: str
    field: Field | None
    meaning: str


def frame_fields(cls: type[Message], real_size: int) -> list[FrameField]:
    """Return the fields of a message in the order of their bytes."""
    form = WireForm("<", _REAL_CODES[real_size])
    rows: list[FrameField] = []
    at = HEADER_SIZE
    for name, field in cls.FIELDS.items():
        if isinstance(field, Array):
            rows += _array_rows(name, field, at, form)
            continue
        rows.append(FrameField(str(at), _kind(field), name, field, field.meaning))
        if not isinstance(field, Tail):
            at += form.structure({name: field}).size
    return rows


def frame_size(cls: type[Message], real_size: int) -> str:
    """Return the size of a frame, prefix included, such as `60 bytes`."""
    form = WireForm("<", _REAL_CODES[real_size])
    at = HEADER_SIZE
    for name, field in cls.FIELDS.items():
        match field:
            case Tail():
                return f"{at} bytes and the {name}"
            case Array(of=of) if of is not None:
                at += 0 if field.count_place is CountPlace.NOWHERE else 4
                each = form.structure(of.FIELDS).size
                if field.least == field.most:
                    return f"{at + each * field.most} bytes"
                return f"{at} + {each} n bytes, n = {field.least} to {field.most}"
        at += form.structure({name: field}).size
    return f"{at} bytes"


def _array_rows(name: str, array: Array, at: int, form: WireForm) -> Iterator[FrameField]:
    of = _record(array)
    each = form.structure(of.FIELDS).size
    count = f"number n of records in `{name}`"
    if array.count_place is CountPlace.BEFORE:
        yield FrameField(str(at), "int32", array.count_name, None, count)
        at += 4
    for inner, field, offset in _offsets(of.FIELDS, form):
        yield FrameField(
            f"{at + offset} + {each} i", _kind(field), f"{name}[i].{inner}", field, field.meaning
        )
    if array.count_place is CountPlace.AFTER:
        yield FrameField(f"{at} + {each} n", "int32", array.count_name, None, count)


def _offsets(fields: Mapping[str, Field], form: WireForm) -> Iterator[tuple[str, Field, int]]:
    at = 0
    for name, field in fields.items():
        yield name, field, at
        at += form.structure({name: field}).size


def _record(array: Array) -> type[Record]:
    assert array.of is not None
    return array.of


def _kind(field: Field) -> str:
    match field:
        case Int():
            return "int32"
        case Real():
            return "real"
        case Reals():
            return "real" + "".join(f"[{size}]" for size in field.shape or (field.count,))
        case Text():
            return f"text[{field.size}]"
        case Tail():
            return "bytes to the end"
    raise TypeError(f"{type(field).__name__} is no single field")
