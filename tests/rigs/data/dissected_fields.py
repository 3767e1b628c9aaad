"""Compares what tshark shows of a frame with what our codec decodes, field by field."""

import math
import struct
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from rigs.data.tshark_captures import PROTOCOL, Dissected, Shown

from openpendant import simplemsg as wire
from openpendant.simplemsg import declaration
from openpendant.simplemsg.framing import HEADER_SIZE
from openpendant.tools.reference.messages import filter_name

FAULTS = ("framing_fault", "header_fault", "body_fault")
"""Filters of what is wrong with a frame."""


@dataclass(frozen=True)
class Expected:
    """One field as our codec decodes it.

    Attributes:
        field: its declaration; a plain integer for the count of an array.
        value: its value; a number for each slot of an array of reals.
    """

    name: str
    field: declaration.Field
    value: Any
    raw: bytes


def _expected(message: wire.Message, frame: bytes, real_size: int) -> list[Expected]:
    if isinstance(message, wire.HeaderOnly | wire.Opaque):
        return []
    rest = memoryview(frame)[HEADER_SIZE:]
    found, rest = _record_fields(
        f"{PROTOCOL}.{filter_name(type(message))}", message, rest, real_size
    )
    assert not rest or message.PLACE.any_body
    return found


def _record_fields(
    path: str, record: declaration.Record, rest: memoryview, real_size: int
) -> tuple[list[Expected], memoryview]:
    found: list[Expected] = []

    def take(name: str, field: declaration.Field, value: Any, size: int) -> None:
        nonlocal rest
        found.append(Expected(f"{path}.{name}", field, value, bytes(rest[:size])))
        rest = rest[size:]

    for name, field in record.FIELDS.items():
        value = getattr(record, name)
        match field:
            case declaration.Int():
                take(name, field, value, 4)
            case declaration.Real():
                take(name, field, value, real_size)
            case declaration.Reals():
                for real in value:
                    take(name, field, real, real_size)
            case declaration.Text():
                take(name, field, value, field.size)
            case declaration.Tail():
                if value:
                    take(name, field, value, len(value))
            case declaration.Array():
                count = declaration.Int("number of records")
                if field.count_place is declaration.CountPlace.BEFORE:
                    take(field.count_name, count, len(value), 4)
                for inner in value:
                    fields, rest = _record_fields(f"{path}.{name}", inner, rest, real_size)
                    found += fields
                if field.count_place is declaration.CountPlace.AFTER:
                    take(field.count_name, count, len(value), 4)
    return found, rest


def _agree(shown: Shown, expected: Expected, codec: wire.Codec) -> bool:
    if (shown.name, shown.raw) != (expected.name, expected.raw):
        return False
    match expected.field:
        case declaration.Int():
            name = declaration.value_name(expected.field, expected.value)
            return int(shown.show) == expected.value and (name is None or name in shown.label)
        case declaration.Real() | declaration.Reals():
            code = "f" if codec.real_size == 4 else "d"
            (exact,) = struct.unpack(codec.byte_order.value + code, shown.raw)
            return _same(exact, expected.value) and _near(shown.show, expected.value)
        case declaration.Text():
            return shown.show == expected.value or not expected.value.isprintable()
    return bytes(expected.value) == shown.raw


def _same(one: float, other: float) -> bool:
    return struct.pack("d", one) == struct.pack("d", other) or (
        math.isnan(one) and math.isnan(other)
    )


def _near(printed: str, value: float) -> bool:
    """tshark prints fifteen digits; zero, its sign, infinity and not-a-number come out exactly."""
    if not math.isfinite(value) or value == 0:
        return _same(float(printed), value)
    # The largest number, printed with fifteen digits, is infinite as a float.
    shown, exact = Decimal(printed), Decimal(value)
    return shown.is_finite() and abs(shown - exact) <= abs(exact) * Decimal("1e-14")


def differences(dissected: Dissected, frame: bytes, codec: wire.Codec) -> list[str]:
    """Compare everything that tshark shows of a frame with what our codec decodes."""
    faults = [kind for kind in FAULTS if dissected.find(kind)]
    if len(frame) < HEADER_SIZE:
        return [] if faults == ["framing_fault"] else [f"shown with {faults}"]
    header = struct.unpack_from(f"{codec.byte_order.value}4i", frame)
    names = ("length", "msg_type", "comm_type", "reply_code")
    found = [
        f"{name}: {dissected.find(name)} is not {value}"
        for name, value in zip(names, header, strict=True)
        if dissected.find(name) != [str(value)]
    ]
    try:
        message = codec.decode(frame)
    except (wire.HeaderFault, wire.BodyFault) as fault:
        kind = "header_fault" if isinstance(fault, wire.HeaderFault) else "body_fault"
        if dissected.body() or faults != [kind]:
            found.append(f"{fault}: shown with {faults}")
        return found
    if dissected.find("name") != [codec.name_of(wire.message_type(message), message.comm_type)]:
        found.append(f"name: {dissected.find('name')}")
    expected = _expected(message, frame, codec.real_size)
    shown = dissected.body()
    found += [
        f"{one} is not {other}"
        for one, other in zip(shown, expected, strict=False)
        if not _agree(one, other, codec)
    ]
    if len(shown) != len(expected):
        found.append(f"{len(shown)} fields, not {len(expected)}")
    if faults:
        found.append(f"shown with {faults}")
    return found
