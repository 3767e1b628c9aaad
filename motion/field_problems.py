"""What is wrong with a file's fields, in words: where, what stands there, what would be accepted.

Owns the wording of what a pydantic model finds, for every kind of file that people write. Knows
none of the models.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from typing import Any, TypeAlias

from pydantic import ValidationError

from .errors.wording import shortened

Problem: TypeAlias = tuple[str, str]
"""A field, such as `joints[2].axis`, and what is wrong there; no field for the whole file."""

_RULE = re.compile(r"\w+ should (?:be|have) (?P<accepted>.+)")


def field_problems(
    error: ValidationError, unions: Mapping[str, Collection[str]] | None = None
) -> tuple[Problem, ...]:
    """Return every problem that a model found, in its order; one or more.

    Args:
        error: what pydantic raised.
        unions: for each field of the file that holds one of several kinds, the kinds' names:
            pydantic puts them into its paths, where no file has them.
    """
    found: list[Mapping[str, Any]] = [*error.errors(include_url=False)]
    return tuple((_path(each["loc"], unions or {}), _sentence(each)) for each in found)


def _path(location: Iterable[int | str], unions: Mapping[str, Collection[str]]) -> str:
    parts = list(location)
    path = "".join(str(part) for part in parts[:1])
    for part in parts[1:]:
        if part not in unions.get(str(parts[0]), ()):
            path += f"[{part}]" if isinstance(part, int) else f".{part}"
    return path


def _sentence(found: Mapping[str, Any]) -> str:
    match found["type"]:
        case "missing":
            return "is missing; accepted: a value, which is required"
        case "extra_forbidden":
            return "is not permitted; accepted: the fields of the schema"
        case "union_tag_invalid":
            tag, accepted = found["ctx"]["tag"], found["ctx"]["expected_tags"]
            return f"is of kind {tag!r}; accepted: {accepted}"
    message: str = found["msg"]
    if rule := _RULE.fullmatch(message):
        return f"is {shortened(found['input'])}; accepted: {rule['accepted']}"
    return message[:1].lower() + message[1:]
