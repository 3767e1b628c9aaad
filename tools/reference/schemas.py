"""JSON Schemas of the management bodies, from the models that check them."""

from __future__ import annotations

import json
from typing import Any

from pydantic import TypeAdapter

from openpendant.server.pendant.management import Failure

from .notice import NOTICE
from .operations import PublishedOperation, published_operations

COMMENT = NOTICE.replace("simplemsg/", "server/ and tools/pendants/management/")


def schema_files() -> dict[str, str]:
    """Return every schema: the name of its file and its text."""
    files = {"failure-reply.json": _text(Failure.model_json_schema(mode="serialization"))}
    for name, operation in published_operations().items():
        files[f"{name}-request.json"] = _text(request_schema(operation))
        files[f"{name}-reply.json"] = _text(reply_schema(operation.reply))
    return files


def request_schema(operation: PublishedOperation) -> dict[str, Any]:
    """Return the schema of an operation's request; a model that several share names this one."""
    schema = operation.request.model_json_schema() | {"description": operation.told.about}
    schema["properties"]["op"] = {"const": operation.name, "title": "Op", "type": "string"}
    for name, meaning in operation.told.section("Args").items():
        schema["properties"][name]["description"] = meaning
    return schema


def reply_schema(kind: Any) -> dict[str, Any]:
    """Return the schema of a reply.

    Args:
        kind: its model, or a plain object.
    """
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
    head = {"$comment": COMMENT, "$schema": "https://json-schema.org/draft/2020-12/schema"}
    return json.dumps(head | schema, indent=2, ensure_ascii=False) + "\n"
