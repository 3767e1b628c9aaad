"""TypeScript of the management operations: a request and a reply each, from their JSON Schemas."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from .operations import PublishedOperation, published_operations
from .operations_page import meaning_of, reply_cells
from .schemas import Schema, reply_schema, request_schema

_WORDS = {
    "string": "string",
    "integer": "number",
    "number": "number",
    "boolean": "boolean",
    "null": "null",
}


def operation_types() -> str:
    """Return the types of all operations, and a table of them by name."""
    shared = _Shared()
    parts = [part for each in published_operations().values() for part in _operation(each, shared)]
    table = "".join(
        f'  "{name}": [{_name(name)}Request, {_name(name)}Reply];\n'
        for name in published_operations()
    )
    return "\n".join(
        [
            *shared.types(),
            *parts,
            "/** Request and reply of every operation by the value of `op`. */",
            f"export interface Operations {{\n{table}}}",
            "",
        ]
    )


def _name(op: str) -> str:
    return "".join(part.capitalize() for part in op.replace(".", "_").split("_"))


def _operation(operation: PublishedOperation, shared: _Shared) -> Iterator[str]:
    role = "anybody" if operation.role is None else operation.role.value
    about = operation.told.about.partition("\n\n")[0].replace("\n", " ")
    authority = operation.authority.value
    needs = "" if authority == "never" else f" Motion authority: {authority}."
    name = _name(operation.name)
    request, reply = request_schema(operation), reply_schema(operation.reply)
    yield f"/** {about} Role: {role}.{needs} */"
    yield f"export interface {name}Request {shared.body(request)}"
    told = {cells[0].strip("`"): cells[2] for cells in reply_cells(operation)}
    yield f"export interface {name}Reply {shared.body(reply, told)}"


@dataclass(frozen=True, slots=True)
class _Place:
    """Place in a body, and what is said of the fields there.

    Attributes:
        defs: the named types of the schema.
        told: meanings of fields by their paths.
    """

    defs: Schema
    told: Mapping[str, str]
    path: str = ""

    def at(self, name: str) -> _Place:
        """Return the place of a field of the object here."""
        return replace(self, path=f"{self.path}.{name}" if self.path else name)

    @property
    def item(self) -> _Place:
        """The place of what is in the list here."""
        return replace(self, path=f"{self.path}[]")

    @property
    def meaning(self) -> str:
        """What is said of the field here; empty for nothing."""
        return self.told.get(self.path, "")


class _Shared:
    """Types that several bodies use, each once; two of one name that differ get numbers."""

    def __init__(self) -> None:
        self._names: dict[str, str] = {}
        self._texts: dict[str, str] = {}

    def types(self) -> list[str]:
        """Return the declarations."""
        return [f"export type {name} = {text};" for name, text in self._texts.items()]

    def body(self, schema: Schema, told: Mapping[str, str] | None = None) -> str:
        """Return an object type; the schema, or `told` by path, says what its fields mean."""
        return self._object(schema, _Place(schema.get("$defs", {}), told or {}))

    def _object(self, schema: Schema, place: _Place) -> str:
        required = set(schema.get("required", ()))
        lines = []
        for name, field in schema.get("properties", {}).items():
            inner = place.at(name)
            meaning = (
                field.get("description")
                or inner.meaning
                or meaning_of(schema.get("title", ""), name)
            )
            comment = f"/** {meaning} */ " if meaning and "const" not in field else ""
            mark = "" if name in required or "const" in field else "?"
            lines.append(f"  {comment}{name}{mark}: {self._type(field, inner)};")
        if not lines:
            return "Record<string, unknown>" if schema.get("additionalProperties") else "{}"
        return "{\n" + "\n".join(lines) + "\n}"

    def _type(self, field: Schema, place: _Place) -> str:
        if "$ref" in field:
            return self._named(field["$ref"].rpartition("/")[2], place)
        if "const" in field:
            return json.dumps(field["const"])
        if "enum" in field:
            return " | ".join(json.dumps(each) for each in field["enum"])
        choices = field.get("anyOf") or field.get("oneOf")
        if choices:
            return " | ".join(dict.fromkeys(self._type(each, place) for each in choices))
        match field.get("type"):
            case "array":
                return self._list(field, place)
            case "object":
                return "Record<string, unknown>"
            case str() as kind:
                return _WORDS[kind]
        return "unknown"

    def _list(self, field: Schema, place: _Place) -> str:
        each = place.item
        fixed = field.get("prefixItems")
        if fixed:
            return f"[{', '.join(self._type(item, each) for item in fixed)}]"
        inner = self._type(field.get("items", {}), each)
        return f"({inner})[]" if " | " in inner else f"{inner}[]"

    def _named(self, name: str, place: _Place) -> str:
        schema: Any = place.defs[name]
        key = json.dumps([name, schema], sort_keys=True)
        if key not in self._names:
            self._names[key] = name  # before its parts: a type may hold itself
            text = (
                self._object(schema, place) if "properties" in schema else self._type(schema, place)
            )
            self._names[key] = self._kept(name, text)
        return self._names[key]

    def _kept(self, name: str, text: str) -> str:
        """Keep the text of a type; return the name under which it is kept, perhaps already."""
        found, number = name, 2
        while self._texts.setdefault(found, text) != text:
            found, number = f"{name}{number}", number + 1
        return found
