from __future__ import annotations

import inspect
import json
from typing import Any

import pytest
from pydantic import BaseModel

from openpendant.server import why
from openpendant.server.pendant import management, served_cells, snapshot
from openpendant.tools.reference.schemas import BODIES, schema_files

SCHEMAS = {name: json.loads(text) for name, text in schema_files().items()}


def test_every_model_of_the_management_messages_has_its_schema() -> None:
    models = {
        name
        for module in (management, served_cells, snapshot, why)
        for name, model in inspect.getmembers(module, inspect.isclass)
        if issubclass(model, BaseModel)
        and model.__module__ == module.__name__
        and not name.startswith("_")
    }
    told = {body.__name__ for body in BODIES.values()}
    inside = {name for schema in SCHEMAS.values() for name in _models_inside(schema)}
    assert models == told | inside


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_schema_refuses_unknown_keys(name: str) -> None:
    schema = SCHEMAS[name]
    assert schema["additionalProperties"] is False
    assert all(inner["additionalProperties"] is False for inner in _models_inside(schema).values())


def _models_inside(schema: dict[str, Any]) -> dict[str, Any]:
    inside = schema.get("$defs", {}).items()
    return {name: inner for name, inner in inside if inner["type"] == "object"}


@pytest.mark.parametrize("operation", management.OPERATIONS)
def test_the_request_schema_names_its_operation(operation: str) -> None:
    request = SCHEMAS[f"{operation}-request.json"]
    assert request["properties"]["op"]["const"] == operation
    assert request["required"] == ["op"]
