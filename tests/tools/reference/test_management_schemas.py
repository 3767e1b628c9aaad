"""What is published of the management operations: none is left out, and nothing is made up."""

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from rigs.data.case_table import every

from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.reference.operations import PublishedOperation, published_operations
from openpendant.tools.reference.operations_page import operations_page
from openpendant.tools.reference.schemas import (
    field_rows,
    reply_schema,
    request_schema,
    schema_files,
)

GENERATED = Path(__file__).parents[3] / "docs" / "generated"


@cache
def schemas() -> dict[str, Any]:
    return {name: json.loads(text) for name, text in schema_files().items()}


@cache
def page() -> str:
    return operations_page()


def test_every_operation_that_the_server_knows_is_published() -> None:
    assert set(published_operations()) == set(OPERATIONS)


def test_every_operation_has_a_schema_of_its_request_and_of_its_reply() -> None:
    kinds = [
        f"{name}-{kind}.json" for name in published_operations() for kind in ("request", "reply")
    ]
    assert set(schemas()) == {"failure-reply.json", *kinds}


def test_every_request_names_its_operation_and_refuses_unknown_keys() -> None:
    every(published_operations().items(), _names_its_operation_and_refuses_unknown_keys)


def _names_its_operation_and_refuses_unknown_keys(operation: PublishedOperation) -> None:
    schema = schemas()[f"{operation.name}-request.json"]
    assert schema["properties"]["op"]["const"] == operation.name
    assert "op" in schema["required"]
    assert schema["additionalProperties"] is False
    assert all(inner["additionalProperties"] is False for inner in _objects_inside(schema))


def _objects_inside(schema: dict[str, Any]) -> list[dict[str, Any]]:
    return [inner for inner in schema.get("$defs", {}).values() if inner["type"] == "object"]


def test_the_page_has_role_call_schemas_and_every_field_of_every_operation() -> None:
    every(published_operations().items(), _is_on_the_page_with_all_its_fields)


def _is_on_the_page_with_all_its_fields(operation: PublishedOperation) -> None:
    section = _section(operation.name)
    role = "anybody" if operation.role is None else operation.role.value
    assert f"Role: {role}" in section
    assert f"`pendant.{operation.usage}`" in section
    for kind in ("request", "reply"):
        link = f"schemas/{operation.name}-{kind}.json"
        assert link in section
        assert (GENERATED / link).is_file()
    for name in operation.told.section("Args"):
        assert re.search(rf"^\| `{name}` \| \S.* \| .* \| \S.* \|$", section, re.MULTILINE), name
    for row in field_rows(reply_schema(operation.reply), lambda *_: ""):
        assert f"\n| `{row.path}` | " in section, row.path


def _section(name: str) -> str:
    return page().partition(f"\n### {name}\n")[2].partition("\n### ")[0]


def test_no_field_is_without_a_meaning() -> None:
    rows = [line for line in page().splitlines() if line.startswith("| `")]
    assert len(rows) > 300
    assert [row for row in rows if row.endswith("|  |")] == []


@pytest.mark.parametrize(
    "tag", ["edit insert", "edit touch-up", "statement move", "statement wait"]
)
def test_edits_and_statements_have_sections_that_operations_link_to(tag: str) -> None:
    kind, value = tag.split()
    assert f'<a id="{kind}-{value}"></a>\n### {kind} `{value}`' in page()
    assert f"(#{kind}-{value})" in _section("programs.edit") + _section("programs.record") + page()


def test_every_link_of_the_page_leads_somewhere() -> None:
    headings = re.findall(r"^### (\S+)$", page(), re.MULTILINE)
    places = {re.sub(r"[^\w-]", "", name) for name in headings}
    places |= set(re.findall(r'<a id="([^"]+)">', page()))
    assert set(re.findall(r"\]\(#([^)]+)\)", page())) <= places
    codes = {int(number) for number in re.findall(r"errors\.md#code-(\d+)", page())}
    assert codes
    assert codes <= {code.value for code in VerdictCode}


def test_bounds_defaults_and_roles_are_those_of_the_server() -> None:
    play = _section("recordings.play")
    assert "| `factor` | number, 0.1 to 4.0 | `1.0` |" in play
    assert f"Role: {Role.OPERATOR.value} (`run-program`)" in play
    assert "| `repeats` | integer, 1 to " in play


def test_a_model_that_two_operations_share_is_published_for_each() -> None:
    for name in ("scene.allow", "scene.forbid"):
        assert request_schema(published_operations()[name])["properties"]["op"]["const"] == name


def test_a_key_that_may_be_missing_is_not_required() -> None:
    nearest = schemas()["scene.nearest-reply.json"]
    assert nearest["required"] == ["distance"]
    assert "default" not in nearest["properties"]["first"]
