"""A message from words: its name, and `field=value` for the fields that are not zero.

Owns that spelling. The declaration alone decides which fields there are.
"""

from __future__ import annotations

import difflib
import json
from collections.abc import Sequence
from typing import Any

from openpendant.simplemsg import (
    Codec,
    CommType,
    HeaderOnly,
    Message,
    Opaque,
    ReplyCode,
    SpecialSequence,
)
from openpendant.simplemsg.declaration import (
    Array,
    Field,
    Int,
    Real,
    Reals,
    Record,
    Reply,
    Tail,
    Text,
    Topic,
)
from openpendant.simplemsg.errors import shown
from openpendant.simplemsg.packet_text import packet_from_json

from ..console import PacketToolError

STOP = "stop"
"""Short for a trajectory point with the sequence of STOP."""

_HEADER_KEYS = {"comm": "comm_type", "reply_code": "reply_code"}


def message_from_words(name: str, words: Sequence[str], codec: Codec) -> Message:
    """Return the message that words describe; fields that are not given are zero.

    Arrays are comma lists, filled up with zeros; records are JSON. `comm=topic|request|reply` and
    `reply_code=N` change the header.

    Raises:
        PacketToolError: no such message or field, or a value that does not fit.
        LocalProtocolError: as `packet_from_json`.
    """
    if name == STOP:
        name, words = "joint_traj_pt", [f"sequence={int(SpecialSequence.STOP)}", *words]
    cls = _class_named(name, codec)
    given = dict(_assignment(word) for word in words)
    header = {_HEADER_KEYS[key]: given.pop(key) for key in _HEADER_KEYS if key in given}
    if isinstance(cls, int):
        return _opaque(cls, given, header)
    fields = {field: _zero(declared) for field, declared in cls.FIELDS.items()}
    for key, text in given.items():
        if key not in fields:
            known = ", ".join(cls.FIELDS) or "none"
            raise PacketToolError(
                f"{cls.PLACE.name} has no field {shown(key)}; its fields: {known}"
            )
        fields[key] = _value(cls.FIELDS[key], text, f"{cls.PLACE.name}.{key}")
    values = _usual_header(cls) | _header(header)
    msg_type = int(cls.PLACE.msg_type)
    if values["comm_type"] == CommType.REPLY and not given and not issubclass(cls, Reply):
        return HeaderOnly(msg_type, **values)
    return packet_from_json({"msg_type": msg_type, **values, "fields": fields}, codec)


def _class_named(name: str, codec: Codec) -> type[Message] | int:
    """Return a message class by name or number; a number that nobody knows stays one."""
    classes = codec.dialect.messages
    if name.lstrip("-").isdecimal() and len(name) < 12:
        number = int(name)
        return next((cls for cls in classes if cls.PLACE.msg_type == number), number)
    for cls in classes:
        if cls.PLACE.name == name:
            return cls
    names = [STOP, *dict.fromkeys(cls.PLACE.name for cls in classes)]
    close = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {close[0]}?" if close else f"known: {', '.join(names)}"
    raise PacketToolError(
        f"{shown(name)} is no message of the {codec.dialect.name} dialect; {hint}"
    )


def _assignment(word: str) -> tuple[str, str]:
    key, equals, text = word.partition("=")
    if not equals or not key:
        raise PacketToolError(f"{shown(word)} is no field=value")
    return key, text


def _usual_header(cls: type[Message]) -> dict[str, int]:
    if issubclass(cls, Topic):
        return {"comm_type": int(CommType.TOPIC), "reply_code": 0}
    if issubclass(cls, Reply):
        return {"comm_type": int(CommType.REPLY), "reply_code": int(ReplyCode.SUCCESS)}
    return {"comm_type": int(CommType.REQUEST), "reply_code": 0}


def _header(words: dict[str, str]) -> dict[str, int]:
    header: dict[str, int] = {}
    for key, text in words.items():
        known = {member.name.lower(): int(member) for member in CommType}
        header[key] = known[text] if text in known else _integer(text, key)
    if header.get("comm_type") == CommType.REPLY:
        header.setdefault("reply_code", 1)
    elif "comm_type" in header:
        header.setdefault("reply_code", 0)
    return header


def _opaque(msg_type: int, given: dict[str, str], header: dict[str, str]) -> Message:
    body = given.pop("body", "")
    if given:
        raise PacketToolError(
            f"type {msg_type} is not known, so it has no field but body (hexadecimal digits)"
        )
    try:
        return Opaque(msg_type, bytes.fromhex(body), **_header(header))
    except ValueError:
        raise PacketToolError(f"body: {shown(body)} is no hexadecimal") from None


def _zero(field: Field) -> Any:
    match field:
        case Int():
            return 0
        case Real():
            return 0.0
        case Reals():
            return _shaped([0.0] * field.count, field.shape)
        case Array():
            return [_zero_record(field.of) for _ in range(field.least)]
    return ""


def _zero_record(cls: type[Record] | None) -> dict[str, Any]:
    return {name: _zero(field) for name, field in cls.FIELDS.items()} if cls else {}


def _value(field: Field, text: str, where: str) -> Any:
    match field:
        case Int():
            return _integer(text, where)
        case Real():
            return _real(text, where)
        case Reals():
            values = [_real(part, where) for part in text.strip("[]").split(",") if part.strip()]
            if len(values) > field.count:
                raise PacketToolError(f"{where} has {field.count} values, not {len(values)}")
            return _shaped(values + [0.0] * (field.count - len(values)), field.shape)
        case Array():
            return _json(text, where)
        case Text() | Tail():
            return text if isinstance(field, Text) else text.encode().hex()
    raise PacketToolError(f"{where} cannot be given as a word")


def _integer(text: str, where: str) -> int:
    try:
        return int(text, 0)
    except ValueError:
        raise PacketToolError(f"{where}: {shown(text)} is no integer") from None


def _real(text: str, where: str) -> float | str:
    word = text.strip().lower()
    if word in ("nan", "inf", "-inf"):
        return word
    try:
        return float(word)
    except ValueError:
        raise PacketToolError(f"{where}: {shown(text)} is no real number") from None


def _json(text: str, where: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise PacketToolError(f"{where}: {shown(text)} is no JSON list of records") from None


def _shaped(values: list[Any], shape: tuple[int, ...]) -> list[Any]:
    for size in reversed(shape[1:]):
        values = [values[at : at + size] for at in range(0, len(values), size)]
    return values
