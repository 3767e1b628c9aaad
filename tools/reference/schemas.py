"""JSON Schemas of the management bodies, from the models that check them, and the same in words."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import TypeAdapter

from openpendant.server.endpoints.pendant.management import Failure

from .messages import NOTICE
from .operations import PublishedOperation, published_operations


def schema_files() -> dict[str, str]:
    """Return every schema: the name of its file and its text."""
    files = {"failure-reply.json": _text(Failure.model_json_schema(mode="serialization"))}
    for name, operation in published_operations().items():
        files[f"{name}-request.json"] = _text(request_schema(operation))
        files[f"{name}-reply.json"] = _text(reply_schema(operation.reply))
    return files


TITLES = {
    "scene.forbid": "AllowContact",
    "scene.detach": "AttachObject",
    "tools.import": "ImportFrames",
    "programs.dry_run_progress": "DryRunProgress",
    "users.enable": "DisableUser",
}
"""Titles of schemas that are not the name of their request: once they shared one with another."""


def request_schema(operation: PublishedOperation) -> dict[str, Any]:
    """Return the schema of an operation's request, its fields in the order of the declaration."""
    name, request = operation.name, operation.request
    schema: dict[str, Any] = TypeAdapter(request).json_schema()
    properties = schema["properties"]
    properties["op"] = {"const": name, "title": "Op", "type": "string"}
    for field, meaning in operation.told.section("Args").items():
        told = properties[field] | {"description": meaning}
        properties[field] = dict(sorted(told.items()))
    schema["title"] = TITLES.get(name, schema["title"])
    for each in dataclasses.fields(request):
        if each.default_factory is not dataclasses.MISSING:
            told = properties[each.name] | {"default": _as_json(each.default_factory())}
            properties[each.name] = dict(sorted(told.items()))
    order = ["op", *(each.name for each in dataclasses.fields(request) if each.name != "op")]
    schema["required"] = [each for each in order if each in {"op", *schema.get("required", ())}]
    schema["properties"] = {field: properties[field] for field in order}
    schema["description"] = operation.told.about
    return dict(sorted(schema.items()))


def _as_json(value: object) -> object:
    """Return a value as JSON gives it back."""
    return json.loads(json.dumps(value))


def reply_schema(kind: Any) -> dict[str, Any]:
    """Return the schema of a reply."""
    schema: dict[str, Any] = TypeAdapter(kind).json_schema(mode="serialization")
    shown: dict[str, Any] = _without_defaults(schema)
    return shown


def _without_defaults(schema: Any) -> Any:
    """Return a reply's schema without the defaults of keys that may be missing."""
    if isinstance(schema, list):
        return [_without_defaults(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    hidden = "default" if schema.get("default", ...) is None else ""
    return {key: _without_defaults(value) for key, value in schema.items() if key != hidden}


def _text(schema: dict[str, Any]) -> str:
    head = {"$comment": NOTICE, "$schema": "https://json-schema.org/draft/2020-12/schema"}
    return json.dumps(head | schema, indent=2, ensure_ascii=False) + "\n"


Schema = Mapping[str, Any]

TAGS = ("edit", "statement")
"""Fields that tell the kinds of an object apart; such objects have a section of their own."""

_WORDS = {
    "string": "text",
    "integer": "integer",
    "number": "number",
    "boolean": "true or false",
    "object": "object",
    "null": "null",
}


@dataclass(frozen=True, slots=True)
class FieldRow:
    """One field.

    Attributes:
        path: its name, behind the names of what it is in.
        kind: its type, with its bounds.
        default: its value where it is left out, as JSON; empty where there is none.
    """

    path: str
    kind: str
    default: str
    is_needed: bool
    meaning: str


Meaning = Callable[[str, str], str]
"""Tells what a field means that its schema does not tell of, by the names of type and field."""


def field_rows(schema: Schema, meaning: Meaning) -> Iterator[FieldRow]:
    """Return the fields of an object, and below each of them those of the objects in it."""
    yield from _rows(schema, schema.get("$defs", {}), meaning, "")


def tagged(schema: Schema) -> dict[str, Schema]:
    """Return the objects in a schema that a tag tells apart, by tag."""
    found = {}
    for inner in schema.get("$defs", {}).values():
        tag = _tag(inner)
        if tag:
            found[tag] = inner
    return found


def _tag(schema: Schema) -> str:
    for name in TAGS:
        value = schema.get("properties", {}).get(name, {}).get("const")
        if value:
            return f"{name} {value}"
    return ""


def _rows(schema: Schema, defs: Schema, meaning: Meaning, path: str) -> Iterator[FieldRow]:
    required = schema.get("required", ())
    for name, field in schema.get("properties", {}).items():
        if name in ("op", *TAGS) and "const" in field:
            continue
        inner, inside = _object_in(field, defs, f"{path}{name}")
        told = field.get("description") or meaning(schema.get("title", ""), name)
        if not told and inner is not None:
            told = inner.get("description", "").partition("\n")[0]
        default = json.dumps(field["default"]) if "default" in field else ""
        is_needed = name in required or "const" in field
        yield FieldRow(f"{path}{name}", _kind(field, defs), default, is_needed, told)
        if inner is not None:
            yield from _rows(inner, defs, meaning, f"{inside}.")


def _object_in(field: Schema, defs: Schema, path: str) -> tuple[Schema | None, str]:
    """Return the object that a field holds, alone or in a list, and its path."""
    if "$ref" in field:
        named = _resolved(field, defs)
        is_shown = "properties" in named and not _tag(named)
        return (named if is_shown else None), path
    if field.get("type") == "array" and "items" in field:
        return _object_in(field["items"], defs, f"{path}[]")
    for choice in field.get("anyOf", ()):
        found = _object_in(choice, defs, path)
        if found[0] is not None:
            return found
    return None, path


def _resolved(field: Schema, defs: Schema) -> Schema:
    named: Schema = defs[field["$ref"].rpartition("/")[2]]
    return named


def _kind(field: Schema, defs: Schema) -> str:
    """Return the type of a field in words."""
    if "$ref" in field:
        named = _resolved(field, defs)
        tag = _tag(named)
        return _link(tag) if tag else _kind(named, defs)
    if "const" in field:
        return f"`{json.dumps(field['const'])}`"
    if "enum" in field:
        return ", ".join(f"`{json.dumps(each)}`" for each in field["enum"])
    choices = field.get("anyOf") or field.get("oneOf")
    if choices:
        return " or ".join(dict.fromkeys(_kind(each, defs) for each in choices))
    if field.get("type") == "array":
        return _list(field, defs)
    return _WORDS[field["type"]] + _bounds(field)


def _link(tag: str) -> str:
    kind, _, value = tag.partition(" ")
    return f"[{value}](#{kind}-{value})"


def _list(field: Schema, defs: Schema) -> str:
    places = field.get("prefixItems")
    if places:
        return f"{len(places)} of {_kind(places[0], defs)}"
    least, most = field.get("minItems"), field.get("maxItems")
    count = "" if most is None else f"{least or 0} to {most} of "
    return f"list: {count}{_kind(field.get('items', {'type': 'object'}), defs)}"


def _bounds(field: Schema) -> str:
    least, most = field.get("minimum"), field.get("maximum")
    below = field.get("exclusiveMaximum")
    if least is not None and most is not None:
        return f", {least} to {most}"
    if least is not None and below is not None:
        return f", {least} to below {below}"
    return "" if least is None else f", {least} or more"
