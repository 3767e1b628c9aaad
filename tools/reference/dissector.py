"""The Wireshark dissector, in Lua: tables written from the declarations, then a fixed engine.

The engine, `dissector_engine.lua`, knows framing and how fields lie; it names no message.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum, IntFlag
from importlib.resources import files

from openpendant.simplemsg import MsgType
from openpendant.simplemsg.declaration import (
    Array,
    CountPlace,
    Field,
    Int,
    Message,
    Real,
    Reals,
    Tail,
    Text,
)

from .messages import ALL_MESSAGES, NOTICE, every_field, filter_name

PORTS = "11000,11002,11010,12000,12002,50240-50242"
"""TCP ports that carry simple message unless told otherwise."""


def lua_dissector() -> str:
    """Return the dissector as one Lua file that needs no other."""
    engine = (files(__package__) / "dissector_engine.lua").read_text(encoding="utf-8")
    tables = [
        f"-- {NOTICE}",
        "-- A Wireshark dissector of ROS-Industrial simple message: standard, Motoman and pendant",
        "-- messages. Run `wireshark -X lua_script:openpendant.lua`, or put it into the folder",
        "-- of personal Lua plugins.",
        "",
        f"local DEFAULT_PORTS = {_string(PORTS)}",
        f"local TYPE_NAMES = {_type_names()}",
        f"local NAMED_OPAQUE = {_opaque_names()}",
        "local VALUES = {",
        *_named_values(),
        "}",
        "local MESSAGES = {",
        *(_message(cls) for cls in ALL_MESSAGES),
        "}",
        "",
        engine,
    ]
    return "\n".join(tables)


def _type_names() -> str:
    names = {int(cls.PLACE.msg_type): cls.PLACE.name for cls in reversed(ALL_MESSAGES)}
    opaque = (MsgType.READ_INPUT, MsgType.WRITE_OUTPUT)
    return _numbered({**names, **{int(one): one.name.lower() for one in opaque}})


def _opaque_names() -> str:
    opaque = (MsgType.READ_INPUT, MsgType.WRITE_OUTPUT)
    return _numbered({int(one): one.name.lower() for one in opaque})


def _message(cls: type[Message]) -> str:
    place = cls.PLACE
    head = {
        "type": str(int(place.msg_type)),
        "name": _string(place.name),
        "filter": _string(filter_name(cls)),
        "is_reply": "true" if place.is_reply else "",
        "any_body": "true" if place.any_body else "",
    }
    return f"  {{ {_entries(head)}, fields = {_fields(cls.FIELDS, 4)} }},"


def _fields(fields: Mapping[str, Field], indent: int) -> str:
    if not fields:
        return "{}"
    margin = " " * indent
    rows = [f"{margin}{_field(name, field, indent)}," for name, field in fields.items()]
    return "\n".join(["{", *rows, f"{margin[2:]}}}"])


def _field(name: str, field: Field, indent: int) -> str:
    entries = {
        "name": _string(name),
        "unit": _string(field.unit) if field.unit else "",
        "meaning": _string(field.meaning),
    }
    match field:
        case Int():
            entries = {"kind": '"int"', **entries, **_values(field)}
        case Real():
            entries = {"kind": '"real"', **entries}
        case Reals():
            entries = {"kind": '"reals"', "size": str(field.count), **entries}
        case Text():
            entries = {"kind": '"text"', "size": str(field.size), **entries}
        case Tail():
            entries = {"kind": '"json"', **entries}
        case Array():
            assert field.of is not None
            counted = field.count_place is not CountPlace.NOWHERE
            entries = {
                "kind": '"array"',
                **entries,
                "least": str(field.least),
                "most": str(field.most),
                "count_name": _string(field.count_name) if counted else "",
                "count_place": _string(field.count_place.name.lower()) if counted else "",
                "meant_by": _string(field.meant_by) if field.meant_by else "",
                "record": _fields(field.of.FIELDS, indent + 2),
            }
    return f"{{ {_entries(entries)} }}"


def _values(field: Int) -> dict[str, str]:
    """Return what an integer field says of its values: names, bits, and the bits it keeps."""
    entries = {}
    if field.mask is not None:
        keeps = field.mask + 1
        if field.mask & keeps:
            raise ValueError(f"mask {field.mask:#x} does not keep the lowest bits only")
        entries["keeps"] = str(keeps)
    if field.values is None:
        return entries
    key = "bits" if issubclass(field.values, IntFlag) else "values"
    return {**entries, key: f"VALUES.{field.values.__name__}"}


def _named_values() -> list[str]:
    """Return the names of all values and bits, each set once."""
    sets: dict[str, str] = {}
    for cls in ALL_MESSAGES:
        for field in every_field(cls.FIELDS):
            if isinstance(field, Int) and field.values is not None:
                sets[field.values.__name__] = _value_set(field.values)
    return [f"  {name} = {values}," for name, values in sets.items()]


def _value_set(values: type[IntEnum] | type[IntFlag]) -> str:
    if issubclass(values, IntFlag):
        bits = ", ".join(f"{{ {int(bit)}, {_string(str(bit.name))} }}" for bit in values)
        return f"{{ {bits} }}"
    return _numbered({int(member): member.name for member in values})


def _entries(entries: Mapping[str, str]) -> str:
    return ", ".join(f"{key} = {value}" for key, value in entries.items() if value)


def _numbered(names: Mapping[int, str]) -> str:
    return f"{{ {', '.join(f'[{key}] = {_string(name)}' for key, name in names.items())} }}"


def _string(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
