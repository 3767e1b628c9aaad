"""What is wrong with a file's fields, in words: where, what stands there, what would be accepted.

Owns the wording of what a pydantic model finds, for every kind of file that people write. Knows
none of the models: where a field stands and what its neighbours are called is read from the JSON
schema that pydantic makes of each.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

from pydantic import BaseModel, ValidationError

from .errors.wording import shortened

Problem: TypeAlias = tuple[str, str]
"""A field, such as `joints[2].axis`, and what is wrong there; no field for the whole file."""

_Schema: TypeAlias = Mapping[str, Any]

_RULE = re.compile(r"\w+ should (?:be|have) (?P<accepted>.+)")
_MOST_GUESSED = 20
"""Unknown fields of a file for which the one that is meant is looked for; it takes a while."""


def field_problems(error: ValidationError, model: type[BaseModel]) -> tuple[Problem, ...]:
    """Return every problem that a model found, in its order; one or more.

    Args:
        error: what pydantic raised.
        model: what the whole file was read as.
    """
    schema = model.model_json_schema()
    problems = []
    for number, found in enumerate(error.errors(include_url=False)):
        path, neighbours = _place(found["loc"], schema)
        problems.append((path, _sentence(found, neighbours, guess=number < _MOST_GUESSED)))
    return tuple(problems)


def _place(location: Iterable[int | str], schema: _Schema) -> tuple[str, tuple[str, ...]]:
    """Return a field as the file has it, and the fields that are known beside it.

    Pydantic's location also names the kind of a part that may be of several kinds, as in
    `objects.0.shape.box.size`. The file has no such level.
    """
    path, neighbours = "", ()
    node = schema
    for part in location:
        node = _resolved(node, schema)
        kinds = node.get("discriminator", {}).get("mapping", {})
        if part in kinds:
            node = {"$ref": kinds[part]}
            continue
        neighbours = tuple(node.get("properties", ()))
        if isinstance(part, int):
            path += f"[{part}]"
        else:
            path += f".{part}" if path else part
        node = _below(node, part)
    return path, neighbours


def _resolved(node: _Schema, schema: _Schema) -> _Schema:
    """Return the schema that a node stands for: what it refers to, or what it is unless null."""
    options = [each for each in node.get("anyOf", ()) if each.get("type") != "null"]
    if len(options) == 1:
        node = options[0]
    if "$ref" not in node:
        return node
    referred: _Schema = schema["$defs"][node["$ref"].rpartition("/")[2]]
    return referred


def _below(node: _Schema, part: int | str) -> _Schema:
    """Return the schema of an element or field of a node; an empty one where it has none."""
    if isinstance(part, int):
        places = node.get("prefixItems", ())
        found = places[part] if part < len(places) else node.get("items")
    else:
        found = node.get("properties", {}).get(part) or node.get("additionalProperties")
    return found if isinstance(found, Mapping) else {}


def _sentence(found: Mapping[str, Any], neighbours: tuple[str, ...], *, guess: bool) -> str:
    match found["type"]:
        case "missing":
            return "is missing; accepted: a value, which is required"
        case "extra_forbidden":
            unknown = str(found["loc"][-1])
            near = difflib.get_close_matches(unknown, neighbours, n=1) if guess else ()
            meant = "".join(f", perhaps {name!r} is meant" for name in near)
            return f"is not permitted{meant}; accepted: {', '.join(neighbours)}"
        case "union_tag_invalid":
            tag, accepted = found["ctx"]["tag"], found["ctx"]["expected_tags"]
            return f"is of kind {tag!r}; accepted: {accepted}"
    message: str = found["msg"]
    if rule := _RULE.fullmatch(message):
        return f"is {shortened(found['input'])}; accepted: {rule['accepted']}"
    return message[:1].lower() + message[1:]
