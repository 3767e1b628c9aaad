from __future__ import annotations

import inspect
import json

import pytest
from pydantic import BaseModel

from openpendant.server import management
from openpendant.tools.reference.schemas import BODIES, schema_files

SCHEMAS = {name: json.loads(text) for name, text in schema_files().items()}


def test_every_model_of_the_management_messages_has_its_schema() -> None:
    models = {
        name
        for name, model in inspect.getmembers(management, inspect.isclass)
        if issubclass(model, BaseModel)
        and model.__module__ == management.__name__
        and not name.startswith("_")
    }
    told = {body.__name__ for body in BODIES.values()}
    inside = {name for schema in SCHEMAS.values() for name in schema.get("$defs", {})}
    assert models == told | inside


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_schema_refuses_unknown_keys(name: str) -> None:
    schema = SCHEMAS[name]
    assert schema["additionalProperties"] is False
    assert all(inner["additionalProperties"] is False for inner in schema.get("$defs", {}).values())


def test_the_request_schema_names_its_operation() -> None:
    request = SCHEMAS["snapshot-request.json"]
    assert request["properties"]["op"]["const"] == "snapshot"
    assert request["required"] == ["op"]
