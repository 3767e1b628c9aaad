"""Catalogue of the pendant protocol as data: codes, messages and management operations.

One source for the file `docs/generated/catalogue.json` and for the operation `catalogue`, which
serves the same entries. Made from the declarations alone; says nothing that they do not.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, fields
from enum import IntFlag
from functools import cache
from typing import Any

from ..declaration import Int, Message, Reply, Topic
from ..frame_fields import FrameField, frame_fields
from ..verdicts import CATALOGUE, since
from . import PENDANT_MESSAGES
from .management import OPERATIONS
from .management.declaration import Request
from .roles import LEAST_ROLE

_REAL_SIZE = 4
"""Of the pendant port: the offsets are those of its frames."""


def _codes() -> Iterator[dict[str, Any]]:
    for code, entry in sorted(CATALOGUE.items()):
        yield {
            "number": int(code),
            "name": code.name,
            "cause": entry.cause,
            "remedy": entry.remedy,
            "since": since(code),
        }


def _messages() -> Iterator[dict[str, Any]]:
    for cls in PENDANT_MESSAGES:
        place = cls.PLACE
        yield {
            "id": int(place.msg_type),
            "name": place.name,
            "is_reply": place.is_reply,
            "way": place.direction.value,
            "usually": _usual(cls),
            "reply": place.reply,
            "about": place.about,
            "since": place.since,
            "fields": [_field(row) for row in frame_fields(cls, _REAL_SIZE)],
        }


def _usual(cls: type[Message]) -> str:
    return "reply" if issubclass(cls, Reply) else "topic" if issubclass(cls, Topic) else "request"


def _field(row: FrameField) -> dict[str, Any]:
    values = row.field.values if isinstance(row.field, Int) else None
    return {
        "name": row.name,
        "type": row.kind,
        "offset": row.offset,
        "unit": "" if row.field is None else row.field.unit,
        "meaning": row.meaning,
        "is_bits": values is not None and issubclass(values, IntFlag),
        "values": {} if values is None else {each.name: int(each) for each in values},
    }


def _operations() -> Iterator[dict[str, Any]]:
    for op, request in OPERATIONS.items():
        yield {
            "op": op,
            "about": (inspect.getdoc(request) or "").partition("\n\n")[0].replace("\n", " "),
            "role": None if request.NEEDS is None else LEAST_ROLE[request.NEEDS].value,
            "permission": None if request.NEEDS is None else request.NEEDS.value,
            "authority": request.AUTHORITY.value,
            "in_order": request.IN_ORDER,
            "since": request.SINCE,
            "fields": [
                {"name": name, "needed": needed} for name, needed in _request_fields(request)
            ],
        }


def _request_fields(request: type[Request[Any]]) -> Iterator[tuple[str, bool]]:
    for each in fields(request):
        if each.name != "op":
            yield each.name, each.default is MISSING and each.default_factory is MISSING


PARTS: Mapping[str, Callable[[], Iterator[dict[str, Any]]]] = {
    "codes": _codes,
    "messages": _messages,
    "operations": _operations,
}
"""What makes the entries of each part."""


@cache
def entries(part: str) -> tuple[str, ...]:
    """Return the entries of a part as JSON texts without blanks between their parts.

    Raises:
        KeyError: there is no such part.
    """
    return tuple(
        json.dumps(each, ensure_ascii=False, separators=(",", ":")) for each in PARTS[part]()
    )
