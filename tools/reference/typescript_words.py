"""TypeScript of what the fields of pendant frames mean: units, names of values, secrets.

The inspector of a pendant in a browser prints a frame as `openpendant packets decode` does; the
layouts say where a field is, and these words what stands beside its value.
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
// What stands beside the fields of a frame where it is shown: meanings, units, names of values.
import * as protocol from "./protocol.ts";

/** Values by their names; of single bits where `areBits`. */
export interface ValueNames {{
  areBits: boolean;
  named: Readonly<Record<string, number>>;
}}

export interface FieldWords {{
  meaning: string;
  unit?: string;
  values?: string;
  isSecret?: true;
  /** What the count of the records is called. */
  count?: string;
}}

export interface MessageWords {{
  about: string;
  /** On the wire, where two messages share it. */
  name?: string;
  fields: Readonly<Record<string, FieldWords>>;
}}
"""


def field_words() -> str:
    """Return the file."""
    messages: tuple[type[Message], ...] = (Ping, *PENDANT_MESSAGES)
    enumerations: dict[str, type[IntEnum] | type[IntFlag]] = {}
    rows = []
    for cls in messages:
        told: dict[str, object] = {"about": cls.PLACE.about}
        if filter_name(cls) != cls.PLACE.name:
            told["name"] = cls.PLACE.name
        told["fields"] = dict(_words(cls.FIELDS, enumerations))
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
        told: dict[str, str | bool] = {"meaning": field.meaning}
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
        yield name, told


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
