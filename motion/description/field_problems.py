"""Field problems of a file in words: the field, its value, and what would be accepted.

Owns the wording of what a pydantic model finds, for every kind of file that people write. Knows
none of the models: the place of a field and the names of its neighbours come from the JSON schema
that pydantic makes of each.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

from pydantic import BaseModel, ValidationError

from ..errors import shortened

Problem: TypeAlias = tuple[str, str]
"""A field, such as `joints[2].axis`, and its problem; no field for the whole file."""

_Schema: TypeAlias = Mapping[str, Any]

_RULE = re.compile(r"\w+ should (?:be|have) (?P<accepted>.+)")
_ELEMENTS = {"number": "numbers", "integer": "whole numbers", "string": "texts"}
"""Names of the elements of a list, by their type in a JSON schema."""
_LONGEST_PART = 80
"""Characters of a field's name that are shown."""
_MOST_GUESSED = 20
"""Greatest number of unknown fields for which a similar name is searched, as that takes a while."""


def field_problems(error: ValidationError, model: type[BaseModel]) -> tuple[Problem, ...]:
    """Return every problem that a model found, in its order; one or more."""
    schema = model.model_json_schema()
    problems = []
    for number, found in enumerate(error.errors(include_url=False)):
        place = _place(found["loc"], schema)
        if found["type"] in ("union_tag_invalid", "union_tag_not_found"):
            problems.append(_kind_problem(found, place))
        else:
            problems.append((place.path, _sentence(found, place, guess=number < _MOST_GUESSED)))
    return tuple(problems)


class _Place(NamedTuple):
    """Field as the file has it, with its known schema and the fields known beside it."""

    path: str
    node: _Schema
    neighbours: tuple[str, ...]


def _place(location: Iterable[int | str], schema: _Schema) -> _Place:
    """Return the place of a problem that pydantic found.

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
            name = part[:_LONGEST_PART]
            path += f".{name}" if path else name
        node = _below(node, part)
    return _Place(path, _resolved(node, schema), neighbours)


def _resolved(node: _Schema, schema: _Schema) -> _Schema:
    """Return the schema that a node stands for: its reference, or its type besides null."""
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


def _kind_problem(found: Mapping[str, Any], place: _Place) -> Problem:
    # The field that holds the kind of a part, such as `type`, has the problem, not the part.
    discriminator = place.node["discriminator"]
    field, kinds = discriminator["propertyName"], ", ".join(discriminator["mapping"])
    where = f"{place.path}.{field}" if place.path else field
    tag = found["ctx"].get("tag")
    return where, ("is missing" if tag is None else f"is {shortened(tag)}") + f"; accepted: {kinds}"


def _sentence(found: Mapping[str, Any], place: _Place, *, guess: bool) -> str:
    neighbours = place.neighbours
    match found["type"]:
        case "missing":
            return "is missing; accepted: a value, which is required"
        case "extra_forbidden":
            unknown = str(found["loc"][-1])
            near = difflib.get_close_matches(unknown, neighbours, n=1) if guess else ()
            meant = "".join(f", perhaps {name!r} is meant" for name in near)
            return f"is not permitted{meant}; accepted: {', '.join(neighbours)}"
    accepted = _accepted(found, place.node)
    message: str = found["msg"]
    if accepted is None:
        return message[:1].lower() + message[1:]
    return f"is {shortened(found['input'])}; accepted: {accepted}"


def _accepted(found: Mapping[str, Any], node: _Schema) -> str | None:
    """Return the accepted values, in the words of a file and not of Python; None if unknown."""
    context = found.get("ctx", {})
    match found["type"]:
        case "tuple_type" | "list_type":
            return _list_in_words(node)
        case "too_short":
            return f"at least {_items(context['min_length'])}"
        case "too_long":
            return f"at most {_items(context['max_length'])}"
        case "string_type":
            return "text"
        case "model_type" | "model_attributes_type" | "dict_type":
            fields = ", ".join(node.get("properties", ()))
            return f"a mapping with the fields {fields}" if fields else "a mapping"
        case "literal_error" | "enum":
            values = node.get("enum", (node["const"],) if "const" in node else ())
            if values:
                return _alternatives([repr(value) for value in values])
    rule = _RULE.fullmatch(found["msg"])
    return None if rule is None else rule["accepted"]


def _list_in_words(node: _Schema) -> str:
    places = node.get("prefixItems", ())
    kinds = {place.get("type") for place in places} or {node.get("items", {}).get("type")}
    elements = _ELEMENTS.get(kinds.pop(), "items") if len(kinds) == 1 else "items"
    return f"a list of {len(places)} {elements}" if places else f"a list of {elements}"


def _items(count: int) -> str:
    return f"{count} item" if count == 1 else f"{count} items"


def _alternatives(words: Sequence[str]) -> str:
    *all_but_last, last = words
    return f"{', '.join(all_but_last)} or {last}" if all_but_last else last
