"""The typed calls of both clients, and what the server says a second time of some of them."""

import inspect
from collections.abc import Mapping
from typing import Any, is_typeddict

import pytest
from pydantic import BaseModel, TypeAdapter
from rigs.data.case_table import every

from openpendant.server.cell.why import WhyReply
from openpendant.server.endpoints.pendant.jog_requests import RetreatReply
from openpendant.server.endpoints.pendant.management import Snapshot
from openpendant.simplemsg.pendant.management import (
    cell,
    edits,
    program_values,
    programs,
    statements,
)
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.loop_thread import LoopThread
from openpendant.tools.pendants.management.calls import AsyncCalls, CallGroup, call
from openpendant.tools.pendants.sync_client import SyncPendantClient
from openpendant.tools.reference.docstrings import model_of
from openpendant.tools.reference.operations import (
    GROUPS,
    PublishedOperation,
    published_operations,
)
from openpendant.tools.reference.operations_page import meaning_of
from openpendant.tools.reference.schemas import field_rows

ALL = published_operations()


def test_every_declaration_says_what_it_is_for_and_what_each_field_means() -> None:
    every(ALL.items(), _says_what_each_argument_means)


def _says_what_each_argument_means(operation: PublishedOperation) -> None:
    told = operation.told
    assert told.about
    assert set(told.section("Args")) == {each.name for each in operation.arguments}
    assert all(told.section("Args").values())


GIVEN = {name: kind for name, kind in vars(edits).items() if is_typeddict(kind)}

READ_NARROWER = {
    ("PointPose", "position"): ("3 of number", "list: number"),
    ("PointPose", "quaternion"): ("4 of number", "list: number"),
    ("DescribeProgram", "name"): ("text or null", "null"),
}
"""Fields for which clients have another type than the class that is read."""


@pytest.mark.parametrize("name", GIVEN)
def test_what_clients_give_has_the_fields_of_the_class_that_it_is_read_as(name: str) -> None:
    read = getattr(statements if hasattr(statements, name) else program_values, name)
    theirs, ours = (_fields(kind) for kind in (read, model_of(GIVEN[name])))
    for (kind, field), (wide, narrow) in READ_NARROWER.items():
        if kind == name:
            assert (theirs.pop(field)[0], ours.pop(field)[0]) == (wide, narrow)
    assert ours == theirs


@pytest.mark.parametrize("name", GIVEN)
def test_it_is_said_what_each_field_of_an_edit_or_a_statement_means(name: str) -> None:
    fields = GIVEN[name].__annotations__.keys() - {"edit", "statement"}
    assert [each for each in fields if not meaning_of(name, each)] == []


def _fields(kind: Any) -> dict[str, tuple[str, bool]]:
    """Return the type of each field in words, and whether it must be given."""
    schema = TypeAdapter(kind).json_schema()
    needed, tags = set(schema.get("required", ())), {"edit", "statement"}
    told = [row for row in field_rows(schema, lambda *_: "") if "." not in row.path]
    kinds = {row.path: row.kind.replace("0 to 200 of ", "") for row in told}
    names = kinds.keys() | tags & schema["properties"].keys()
    return {name: (kinds.get(name, "a tag"), name in needed | tags) for name in names}


@pytest.mark.parametrize(
    ("name", "theirs"),
    [
        ("snapshot", Snapshot),
        ("why", WhyReply),
        ("jog.retreat", RetreatReply),
    ],
)
def test_a_reply_that_the_server_has_a_model_of_has_its_fields(
    name: str, theirs: type[BaseModel]
) -> None:
    assert _paths(published_operations()[name].returned) == _paths(theirs)


def _paths(kind: Any) -> set[str]:
    """Return the names of all fields, those of objects inside among them."""
    schema = TypeAdapter(kind).json_schema(mode="serialization")
    inside = schema.get("$defs", {}).values()
    return {name for each in (schema, *inside) for name in each.get("properties", {})}


def test_both_clients_have_the_same_groups_with_the_same_calls() -> None:
    thread = LoopThread("nobody")
    background = PendantClient()
    blocking = SyncPendantClient(thread, background)
    try:
        for group, (kind, _) in GROUPS.items():
            own, other = (
                getattr(client, group) if group else client for client in (background, blocking)
            )
            assert isinstance(own, kind)
            assert isinstance(other, kind)
            extra = {"programs": ["run"], "recordings": ["play"]}.get(group, [])
            for name in extra:
                assert inspect.signature(getattr(own, name)).parameters.keys() == (
                    inspect.signature(getattr(other, name)).parameters.keys()
                )
    finally:
        thread.end()


class Group(CallGroup[AsyncCalls]):
    """Calls of a client, awaited."""

    save = call(programs.SaveProgram)
    retreat: call[[], list[cell.Hold]] = call(cell.RetreatRequest, part="holds")


async def _manage(request: dict[str, Any]) -> dict[str, Any]:
    return {**request, "holds": ["one"]}


async def test_an_awaited_call_returns_the_reply_or_the_part_of_it_that_is_meant() -> None:
    group = Group(AsyncCalls(_manage))
    sent: Mapping[str, Any] = await group.save("weld", "text", 3, part=2)
    fields = {"name": "weld", "body": "text", "expected_revision": 3, "format": "text"}
    assert sent == {"op": "programs.save", **fields, "part": 2, "parts": 1, "holds": ["one"]}
    # In the order of the call, so that no byte depends on how the fields are declared.
    assert list(sent)[:5] == ["op", *fields]
    retreat: list[Any] = list(await group.retreat())
    assert retreat == ["one"]
    assert (group.save.__doc__ or "").startswith("Save a whole program; ")


def test_a_wrong_argument_is_python_s_own_error_and_never_leaves() -> None:
    with pytest.raises(TypeError, match="louder"):
        Group(AsyncCalls(_manage)).save("weld", "", 0, louder=True)  # type: ignore[call-arg, unused-coroutine]
