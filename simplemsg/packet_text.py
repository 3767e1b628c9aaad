"""Packets as JSON objects for people and scripts, and back.

Field names and the spelling of non-finite reals ("nan", "inf", "-inf") are those of the reference
vectors. Knows nothing of bytes: the codec is the only one that does.
"""

from __future__ import annotations

import math
from typing import Any

from .codec import Codec
from .declaration import (
    MASK,
    Array,
    CountPlace,
    Field,
    Int,
    Message,
    Real,
    Reals,
    Record,
    Tail,
    Text,
)
from .errors import LocalProtocolError, shown
from .masking import masked_body
from .standard import HeaderOnly, Opaque, message_type

_NON_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


def packet_to_json(message: Message, codec: Codec) -> dict[str, Any]:
    """Return a packet as a JSON object.

    Returns:
        `msg_type`, `comm_type`, `reply_code`, `name` and `fields`; the body of an opaque packet
        is the field `body`, in hexadecimal. A secret is shown as asterisks.
    """
    number = message_type(message)
    return {
        "msg_type": int(number),
        "comm_type": int(message.comm_type),
        "reply_code": int(message.reply_code),
        "name": codec.name_of(number, message.comm_type),
        "fields": _fields_to_json(message),
    }


def _fields_to_json(record: Record) -> dict[str, Any]:
    if isinstance(record, HeaderOnly):
        return {}
    if isinstance(record, Opaque):
        return {"body": masked_body(record.msg_type, record.body).hex()} if record.body else {}
    fields: dict[str, Any] = {}
    for name, field in record.FIELDS.items():
        value = getattr(record, name)
        if isinstance(field, Array) and field.count_place is CountPlace.BEFORE:
            fields[field.count_name] = len(value)
        fields[name] = _value_to_json(field, value)
        if isinstance(field, Array) and field.count_place is CountPlace.AFTER:
            fields[field.count_name] = len(value)
    return fields


def _value_to_json(field: Field, value: Any) -> Any:
    match field:
        case Int():
            return int(value)
        case Real():
            return _real_to_json(value)
        case Reals():
            return _nested([_real_to_json(real) for real in value], field.shape)
        case Array():
            return [_fields_to_json(record) for record in value]
        case Tail():
            return bytes(value).hex()
        case Text(secret=True):
            return MASK if value else ""
    return value


def _nested(values: list[Any], shape: tuple[int, ...]) -> list[Any]:
    for size in reversed(shape[1:]):
        values = [values[at : at + size] for at in range(0, len(values), size)]
    return values


def _flat(value: Any, shape: tuple[int, ...]) -> list[Any] | None:
    """Return nested lists as one list, or None where a list has another length than `shape`."""
    parts: list[Any] = [value]
    for size in shape:
        if not all(isinstance(part, list) and len(part) == size for part in parts):
            return None
        parts = [inner for part in parts for inner in part]
    return parts


def _real_to_json(value: float) -> float | str:
    if math.isfinite(value):
        return float(value)
    return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"


def packet_from_json(packet: Any, codec: Codec) -> Message:
    """Return the message that a JSON object describes.

    The type alone decides the layout; `name` is for the reader and may be left out. Empty `fields`
    are an empty body, and a lone field `body` holds any other body in hexadecimal.

    Raises:
        LocalProtocolError: a key is missing, unknown or of the wrong kind; the text names it.
    """
    if not isinstance(packet, dict):
        raise LocalProtocolError(f"a packet is a JSON object, not {shown(packet)}")
    unknown = set(packet) - {"msg_type", "comm_type", "reply_code", "name", "fields"}
    if unknown:
        raise LocalProtocolError(f"a packet has no key {shown(min(unknown))}")
    msg_type, comm_type, reply_code = (
        _integer(packet.get(key), key) for key in ("msg_type", "comm_type", "reply_code")
    )
    fields = packet.get("fields")
    if not isinstance(fields, dict):
        raise LocalProtocolError("fields must be a JSON object")
    cls = codec.message_class(msg_type, comm_type)
    if cls is None or (set(fields) == {"body"} and set(cls.FIELDS) != {"body"}):
        return Opaque(msg_type, _opaque_body(fields), comm_type=comm_type, reply_code=reply_code)
    if not fields and cls.FIELDS:
        return HeaderOnly(msg_type, comm_type=comm_type, reply_code=reply_code)
    values = _fields_from_json(cls, fields, cls.PLACE.name)
    return cls(comm_type=comm_type, reply_code=reply_code, **values)


def _integer(value: Any, where: str) -> int:
    if type(value) is not int:
        raise LocalProtocolError(f"{where} must be an integer, not {shown(value)}")
    return value


def _opaque_body(fields: dict[str, Any]) -> bytes:
    unknown = set(fields) - {"body"}
    if unknown:
        raise LocalProtocolError(
            f"unknown field {shown(min(unknown))}: a packet of this type has only a body"
        )
    return _hexadecimal(fields.get("body", ""), "body")


def _hexadecimal(value: Any, where: str) -> bytes:
    try:
        return bytes.fromhex(value)
    except (ValueError, TypeError):
        raise LocalProtocolError(
            f"{where} must be a string of hexadecimal digits, not {shown(value)}"
        ) from None


def _fields_from_json(cls: type[Record], fields: Any, where: str) -> dict[str, Any]:
    if not isinstance(fields, dict):
        raise LocalProtocolError(f"{where} must be a JSON object, not {shown(fields)}")
    counts = {field.count_name for field in cls.FIELDS.values() if isinstance(field, Array)}
    unknown = set(fields) - set(cls.FIELDS) - counts
    if unknown:
        raise LocalProtocolError(f"{where} has no field {shown(min(unknown))}")
    values: dict[str, Any] = {}
    for name, field in cls.FIELDS.items():
        if name not in fields:
            raise LocalProtocolError(f"{where}.{name} is missing")
        values[name] = _value_from_json(field, fields[name], f"{where}.{name}")
        if isinstance(field, Array) and field.count_name in fields:
            counter = f"{where}.{field.count_name}"
            count = _integer(fields[field.count_name], counter)
            if count != len(values[name]):
                raise LocalProtocolError(
                    f"{counter} is {shown(count)}, there are {len(values[name])} records"
                )
    return values


def _value_from_json(field: Field, value: Any, where: str) -> Any:
    match field:
        case Int():
            return _integer(value, where)
        case Real():
            return _real_from_json(value, where)
        case Reals():
            shape = field.shape or (field.count,)
            reals = _flat(value, shape)
            if reals is None:
                size = " lists of ".join(str(number) for number in shape)
                raise LocalProtocolError(f"{where} must be a list of {size} real numbers")
            return tuple(_real_from_json(real, f"{where}[{i}]") for i, real in enumerate(reals))
        case Array():
            if not isinstance(value, list) or field.of is None:
                raise LocalProtocolError(f"{where} must be a list of objects, not {shown(value)}")
            return tuple(
                field.of(**_fields_from_json(field.of, record, f"{where}[{i}]"))
                for i, record in enumerate(value)
            )
        case Tail():
            return _hexadecimal(value, where)
        case Text():
            if not isinstance(value, str):
                told = MASK if field.secret else shown(value)
                raise LocalProtocolError(f"{where} must be a string, not {told}")
    return value


def _real_from_json(value: Any, where: str) -> float:
    if isinstance(value, str) and value in _NON_FINITE:
        return _NON_FINITE[value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise LocalProtocolError(f"{where} must be a real number, not {shown(value)}")
    try:
        real = float(value)
    except OverflowError:
        raise LocalProtocolError(f"{where} is too large for a real number") from None
    # JSON reads 1e400 as infinity; whoever means infinity spells it.
    if not math.isfinite(real):
        raise LocalProtocolError(f'{where} is not finite; accepted then: "nan", "inf" and "-inf"')
    return real
