"""TypeScript of the protocol for the pendant in a browser: messages, operations, codes, layouts.

What it says is erased or kept as it is by type stripping, so that a bundler and Node alike take the
files as they are: constant objects stand in place of enumerations. How frames are packed is the
business of `codec.ts` beside them, which is written by hand.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterable, Iterator, Mapping
from enum import IntEnum, IntFlag
from functools import cache
from pathlib import Path

from openpendant.simplemsg import MOTOMAN, STANDARD, Message
from openpendant.simplemsg.declaration import (
    Array,
    CountPlace,
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
from openpendant.simplemsg.pendant import PENDANT_MESSAGES, PROTOCOL_VERSION
from openpendant.simplemsg.standard import Ping
from openpendant.simplemsg.verdicts import CATALOGUE

from .messages import NOTICE, filter_name, own_messages
from .typescript_operations import operation_types
from .typescript_serial import serial_frames_file
from .typescript_words import field_meanings, field_words

FOLDER = Path("tools/pendants/web/frontend/src")
"""Of the files, below that of the repository."""

MOST_SOURCE = 90_000
"""Largest of the files, before the bundler leaves out what is not used [bytes]."""

_COUNTS = {CountPlace.BEFORE: "before", CountPlace.AFTER: "after", CountPlace.NOWHERE: "none"}

_PROTOCOL_HEAD = f"""\
// {NOTICE}
//
// The pendant protocol, version {PROTOCOL_VERSION}: messages with their codec, and codes.
// Lengths are m, angles rad, times s, quaternions x, y, z, w; joints count from 0.
import {{ decodeBy, encodeBy }} from "./codec.ts";
import type {{ Bare, Header, Layouts, Opaque, RealSize }} from "./codec.ts";

export type * from "./operations.ts";

export const PROTOCOL_VERSION = {PROTOCOL_VERSION};

/** A number with a name in T, or one that a newer server gave a meaning. */
export type Named<T> = T[keyof T] | (number & {{}});
"""

_OPERATIONS_HEAD = f"""\
// {NOTICE}
//
// The management operations of the pendant protocol: types alone, of which a bundle holds nothing.
// A request or reply is the JSON body of a Management message.
"""

_REMEDIES_HEAD = f"""\
// {NOTICE}
//
// The remedy of every code in English; its cause comes from the server, with joints and numbers.
"""

_FUNCTIONS = """\
/** Packs a message; throws a RangeError that names the field whose value does not fit. */
export function encode(message: Message, littleEndian = true, realSize: RealSize = 4): ArrayBuffer {
  return encodeBy(LAYOUTS, message, littleEndian, realSize);
}

/** Unpacks a whole frame of either byte order; throws a RangeError for what is none. */
export function decode(view: DataView, realSize: RealSize = 4): Message {
  return decodeBy(LAYOUTS, view, realSize) as Message;
}
"""


@cache
def typescript_files() -> Mapping[str, str]:
    """Return every generated file of TypeScript: its name in their folder, and its text."""
    return {
        "protocol.ts": _protocol(),
        "operations.ts": f"{_OPERATIONS_HEAD}\n{operation_types()}",
        "simple-message.ts": _controllers(),
        "field-words.ts": field_words(),
        "field-meanings.ts": field_meanings(),
        "remedies.ts": _remedies(),
        "keypad/serial-frames.ts": serial_frames_file(),
    }


def _protocol() -> str:
    messages: tuple[type[Message], ...] = (Ping, *PENDANT_MESSAGES)
    parts = [
        _PROTOCOL_HEAD,
        *_enumerations(messages),
        *_interfaces(messages),
        _union("Message", messages),
        _layouts(messages),
        _FUNCTIONS,
        *_codes(),
    ]
    return "\n".join(parts)


def _controllers() -> str:
    messages = (*STANDARD.messages, *own_messages(MOTOMAN))
    head = (
        f"// {NOTICE}\n//\n// The messages of controllers: those of the standard and Motoman's.\n"
        'import type { Bare, Header, Layouts, Opaque } from "./codec.ts";\n'
    )
    parts = [head, *_interfaces(messages, enumerated=False)]
    return "\n".join([*parts, _union("ControllerMessage", messages), _layouts(messages)])


def _enumerations(messages: Iterable[type[Message]]) -> Iterator[str]:
    found: dict[str, type[IntEnum] | type[IntFlag]] = {}
    for cls in messages:
        for field in cls.FIELDS.values():
            if isinstance(field, Int) and field.values is not None:
                found[field.values.__name__] = field.values
    for name, values in found.items():
        yield _comment(_first_line(values))
        named = ", ".join(f"{each.name}: {int(each)}" for each in values)
        yield f"export const {name} = {{ {named} }} as const;\n"


def _first_line(documented: object) -> str:
    return (inspect.getdoc(documented) or "").partition("\n")[0]


def _interfaces(messages: Iterable[type[Message]], *, enumerated: bool = True) -> Iterator[str]:
    records: dict[str, type[Record]] = {}
    for cls in messages:
        for field in cls.FIELDS.values():
            if isinstance(field, Array) and field.of is not None:
                records[field.of.__name__] = field.of
    for name, record in records.items():
        yield _comment(_first_line(record))
        yield f"export interface {name} {{\n{_members(record.FIELDS, enumerated)}}}\n"
    for cls in messages:
        place = cls.PLACE
        yield _comment(f"{int(place.msg_type)}, {place.direction.value}. {place.about}")
        yield (
            f"export interface {cls.__name__} extends Header {{\n"
            f'  type: "{filter_name(cls)}";\n{_members(cls.FIELDS, enumerated)}}}\n'
        )


def _members(fields: Mapping[str, Field], enumerated: bool) -> str:
    lines = []
    for name, field in fields.items():
        unit = f" [{field.unit}]" if field.unit else ""
        lines.append(f"  {_comment(field.meaning + unit)}")
        lines.append(f"  {name}: {_type(field, enumerated)};")
    return "".join(f"{line}\n" for line in lines)


def _type(field: Field, enumerated: bool) -> str:
    match field:
        case Int(values=values) if enumerated and values is not None:
            return "number" if issubclass(values, IntFlag) else f"Named<typeof {values.__name__}>"
        case Int() | Real():
            return "number"
        case Reals():
            return "number[]"
        case Text():
            return "string"
        case Tail():
            return "Uint8Array"
        case Array(of=of) if of is not None:
            return f"{of.__name__}[]"
    raise TypeError(f"no type for a {type(field).__name__}")


def _union(name: str, messages: Iterable[type[Message]]) -> str:
    names = "".join(f"\n  | {cls.__name__}" for cls in messages)
    return f"export type {name} ={names}\n  | Bare\n  | Opaque;\n"


def _layouts(messages: Iterable[type[Message]]) -> str:
    rows = "".join(f"  {filter_name(cls)}: {_layout(cls)},\n" for cls in messages)
    return f"export const LAYOUTS: Layouts = {{\n{rows}}};\n"


def _layout(cls: type[Message]) -> str:
    place = cls.PLACE
    usual = "reply" if issubclass(cls, Reply) else "topic" if issubclass(cls, Topic) else "request"
    if place.is_reply:
        usual = "answer"
    elif place.any_body:
        usual = "ignored"
    plain = {name: each for name, each in cls.FIELDS.items() if not isinstance(each, Array)}
    parts = [str(int(place.msg_type)), f'"{usual}"', f'"{_codes_of(plain)}"']
    for name, field in cls.FIELDS.items():
        if isinstance(field, Array) and field.of is not None:
            meant = f', meant: "{field.meant_by}"' if field.meant_by else ""
            parts.append(
                f'{{ name: "{name}", of: "{_codes_of(field.of.FIELDS)}",'
                f' count: "{_COUNTS[field.count_place]}",'
                f" least: {field.least}, most: {field.most}{meant} }}"
            )
    return f"[{', '.join(parts)}]"


def _codes_of(fields: Mapping[str, Field]) -> str:
    return " ".join(f"{name}:{_code(field)}" for name, field in fields.items())


def _code(field: Field) -> str:
    match field:
        case Int(mask=int(mask)):
            return f"i&{mask}"
        case Int():
            return "i"
        case Real():
            return "r"
        case Reals(count=count):
            return f"R{count}"
        case Text(size=size):
            return f"t{size}"
        case Tail():
            return "b"
    raise TypeError(f"{type(field).__name__} is no single field")


def _codes() -> Iterator[str]:
    yield "export type CodeText = readonly [cause: string, remedy: string];\n"
    yield _comment("Cause and remedy of every code by its number; codes.de.ts has them in German.")
    rows = "".join(
        f"  {int(code)}: [{_text(entry.cause)}, {_text(entry.remedy)}],\n"
        for code, entry in sorted(CATALOGUE.items())
    )
    yield "export const codeTexts = {"
    yield f"{rows}}} as const satisfies Record<number, CodeText>;\n"
    yield _comment("The texts of all codes in one language; without one a file does not compile.")
    yield "export type CodeTexts = Readonly<Record<keyof typeof codeTexts, CodeText>>;\n"


def _remedies() -> str:
    rows = "".join(
        f"  {int(code)}: {_text(entry.remedy)},\n" for code, entry in sorted(CATALOGUE.items())
    )
    table = "export const remedies: Readonly<Record<number, string>>"
    return f"{_REMEDIES_HEAD}\n{table} = {{\n{rows}}};\n"


def _text(told: str) -> str:
    return json.dumps(told, ensure_ascii=False)


def _comment(told: str) -> str:
    return f"/** {told.replace('*/', '* /')} */"
