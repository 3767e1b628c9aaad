"""TypeScript of what the fields of pendant frames mean: units, names of values, secrets, sentences.

The inspector of a pendant in a browser prints a frame as `openpendant packets decode` does; the
layouts say where a field is, and the words what stands beside its value. The sentences are a file
of their own: they make the page of reference, and the program has none of them.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from enum import IntEnum, IntFlag

from openpendant.simplemsg import Message
from openpendant.simplemsg.declaration import Array, Field, Int, Text
from openpendant.simplemsg.pendant import PENDANT_MESSAGES
from openpendant.simplemsg.standard import Ping

from .messages import NOTICE, filter_name

_HEAD = f"""\
// {NOTICE}
//
// What stands beside the fields of a frame where it is shown: units, names of values.
import * as protocol from "./protocol.ts";

/** Values by their names; of single bits where `areBits`. */
export interface ValueNames {{
  areBits: boolean;
  named: Readonly<Record<string, number>>;
}}

export interface FieldWords {{
  unit?: string;
  values?: string;
  isSecret?: true;
  /** What the count of the records is called. */
  count?: string;
}}

export interface MessageWords {{
  /** On the wire, where two messages share it. */
  name?: string;
  /** Those beside which something stands. */
  fields?: Readonly<Record<string, FieldWords>>;
}}
"""

_MEANINGS_HEAD = f"""\
// {NOTICE}
//
// What each message is for, and what its fields mean: the sentences of the page of reference.

export interface MessageMeaning {{
  number: number;
  about: string;
  fields: Readonly<Record<string, readonly [meaning: string, unit: string]>>;
}}
"""

_MESSAGES: tuple[type[Message], ...] = (Ping, *PENDANT_MESSAGES)


def field_words() -> str:
    """Return the file."""
    enumerations: dict[str, type[IntEnum] | type[IntFlag]] = {}
    rows = []
    for cls in _MESSAGES:
        told: dict[str, object] = {}
        if filter_name(cls) != cls.PLACE.name:
            told["name"] = cls.PLACE.name
        if words := dict(_words(cls.FIELDS, enumerations)):
            told["fields"] = words
        if told:
            rows.append(f"  {filter_name(cls)}: {_literal(told)},\n")
    named = "".join(f"  {name}: {_values(each)},\n" for name, each in enumerations.items())
    return "\n".join(
        [
            _HEAD,
            f"export const VALUE_NAMES: Readonly<Record<string, ValueNames>> = {{\n{named}}};\n",
            "export const WORDS: Readonly<Record<string, MessageWords>> ="
            f" {{\n{''.join(rows)}}};\n",
        ]
    )


def _words(
    fields: Mapping[str, Field], enumerations: dict[str, type[IntEnum] | type[IntFlag]]
) -> Iterator[tuple[str, dict[str, str | bool]]]:
    for name, field in fields.items():
        told: dict[str, str | bool] = {}
        if field.unit:
            told["unit"] = field.unit
        match field:
            case Int(values=values) if values is not None:
                enumerations[values.__name__] = values
                told["values"] = values.__name__
            case Text(secret=True):
                told["isSecret"] = True
            case Array(of=of) if of is not None:
                told["count"] = field.count_name
                yield from _words(of.FIELDS, enumerations)
        if told:
            yield name, told


def field_meanings() -> str:
    """Return the file of the sentences."""
    rows = []
    for cls in _MESSAGES:
        told = {"number": int(cls.PLACE.msg_type), "about": cls.PLACE.about}
        fields = {name: [each.meaning, each.unit] for name, each in _fields(cls.FIELDS)}
        rows.append(f"  {filter_name(cls)}: {_literal({**told, 'fields': fields})},\n")
    table = "export const MEANINGS: Readonly<Record<string, MessageMeaning>>"
    return f"{_MEANINGS_HEAD}\n{table} = {{\n{''.join(rows)}}};\n"


def _fields(fields: Mapping[str, Field]) -> Iterator[tuple[str, Field]]:
    for name, field in fields.items():
        if isinstance(field, Array) and field.of is not None:
            yield from _fields(field.of.FIELDS)
        yield name, field


def _values(values: type[IntEnum] | type[IntFlag]) -> str:
    bits = "true" if issubclass(values, IntFlag) else "false"
    return f"{{ areBits: {bits}, named: protocol.{values.__name__} }}"


def _literal(value: Mapping[str, object]) -> str:
    """Return plain data as TypeScript has it: names without quotes where they need none."""
    parts = []
    for name, each in value.items():
        key = name if name.isidentifier() or name.isdigit() else json.dumps(name)
        told = _literal(each) if isinstance(each, Mapping) else json.dumps(each, ensure_ascii=False)
        parts.append(f"{key}: {told}")
    return f"{{ {', '.join(parts)} }}" if parts else "{}"
