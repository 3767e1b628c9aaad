"""Management bodies: the request that a JSON body holds, or why it is refused.

Owns the one adapter of all operations, and the wording of what is wrong with a body: the first
place, in the order in which the request declares its fields, and the rule that it breaks.
"""

from __future__ import annotations

import json
from dataclasses import fields
from functools import reduce
from operator import or_
from typing import Annotated, Any

from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.management.declaration import SERVER_VALUES, Request
from openpendant.simplemsg.pendant.management.programs import EDIT, MOVE
from openpendant.simplemsg.verdicts import VerdictCode

from ..programs.editing.edits import Edit
from ..programs.language.statements import Move
from ..refusal import Refusal

LONGEST_TEXT = 400
"""A place may be as long as the request, and the answer has to fit a frame [characters]."""

SERVER_VALUES[EDIT] = Annotated[Edit, Field(discriminator="edit")]
SERVER_VALUES[MOVE] = Move | None

_KINDS: Any = reduce(or_, OPERATIONS.values())
_TOLD_APART: Any = Annotated[_KINDS, Field(discriminator="op")]
_ADAPTER: TypeAdapter[Any] = TypeAdapter(_TOLD_APART)

_TOGETHER = (("frames", "tools", "scene", "signals", "robots", "trace"), ("access", "users"))
"""Topics whose operations are named together where an unknown one of them is refused."""

_WITHOUT_TOPIC = ("snapshot", "cells", "why")

_ALONE = frozenset({*_WITHOUT_TOPIC, "jog.retreat"})
"""Operations that a fault does not name in front of its place."""

_IN_PROGRAMS = {EDIT, MOVE}
"""Fields that hold parts of a program: a key too many has the words there that files get."""

_LONGEST_NAME = 40


class _Named(BaseModel):
    """What all requests have, to say what is wrong with one of no known operation."""

    op: str


def parse(body: bytes) -> tuple[str, Request[Any] | Refusal]:
    """Return the name of the operation, empty where there is none, and the request or its fault."""
    try:
        request: Request[Any] = _ADAPTER.validate_json(body)
    except ValidationError as error:
        name = operation_of(body)
        return name, _fault(name, body, error)
    return request.op, request


def operation_of(body: bytes) -> str:
    """Return which operation a management body names; empty where it names none."""
    try:
        asked = json.loads(body)
    except (ValueError, RecursionError):
        return ""
    named = asked.get("op") if isinstance(asked, dict) else None
    return named if isinstance(named, str) else ""


def is_of_topic(name: str) -> bool:
    """Return True if the name of an operation, which there may be or not, begins with a topic."""
    return "." in name and bool(_known_with(name))


def unknown(name: str) -> Refusal:
    """Return why an operation that is none is refused."""
    known = _known_with(name) if "." in name else []
    if len(known) == 1:
        return _refusal(("op",), f"Input should be {known[0]!r}")
    if known:
        tags = ", ".join(map(repr, known))
        problem = f"Input tag '{name}' found using 'op' does not match any of the expected tags"
        return _refusal((), f"{problem}: {tags}")
    accepted = ", ".join(_WITHOUT_TOPIC)
    return _refusal(("op",), f"{name[:_LONGEST_NAME]!r}; accepted: {accepted}")


def _known_with(name: str) -> list[str]:
    """Return the operations that are named together with those of a name's topic."""
    topic = name.partition(".")[0]
    topics = next((each for each in _TOGETHER if topic in each), (topic,))
    return [op for each in topics for op in OPERATIONS if op.startswith(f"{each}.")]


def _fault(name: str, body: bytes, error: ValidationError) -> Refusal:
    kind = OPERATIONS.get(name)
    if kind is None:
        return _nameless(body)
    order = [each.name for each in fields(kind)]

    def rank(fault: Any) -> int:
        # The place begins with the tag of the union; pydantic looks at optional fields last.
        field = str(fault["loc"][1]) if len(fault["loc"]) > 1 else ""
        return order.index(field) if field in order else len(order)

    first = min(error.errors(include_url=False, include_input=False), key=rank)
    place, problem = first["loc"], first["msg"]
    if first["type"] == "unexpected_keyword_argument" and not _IN_PROGRAMS & set(place[1:2]):
        problem = "Extra inputs are not permitted"
    return _refusal(place[1:] if name in _ALONE else place, problem)


def _nameless(body: bytes) -> Refusal:
    """Return what is wrong with a body that names no operation, or one that is none."""
    try:
        named = _Named.model_validate_json(body).op
    except ValidationError as error:
        (first,) = error.errors(include_url=False, include_input=False)
        return _refusal(first["loc"], first["msg"])
    return unknown(named)


def _refusal(place: tuple[int | str, ...], problem: str) -> Refusal:
    where = ".".join(str(part) for part in place)
    text = f"{where}: {problem}" if where else problem
    return Refusal(VerdictCode.BAD_ARGUMENT, text[-LONGEST_TEXT:])
