"""The typed calls of both clients, and what the server says a second time of some of them."""

import inspect
from collections.abc import Mapping
from typing import Any, get_args, get_type_hints

import pytest
from pydantic import BaseModel, TypeAdapter
from rigs.data.case_table import every

from openpendant.server.cell.why import WhyReply
from openpendant.server.endpoints.pendant.jog_requests import RetreatReply
from openpendant.server.endpoints.pendant.management import ServedCells, Snapshot
from openpendant.server.programs.editing import edits as server_edits
from openpendant.server.programs.language import statements as server_statements
from openpendant.simplemsg.pendant.management import cell, edits, programs
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.loop_thread import LoopThread
from openpendant.tools.pendants.management.calls import AsyncCalls, CallGroup, call
from openpendant.tools.pendants.sync_client import SyncPendantClient
from openpendant.tools.reference.docstrings import is_optional
from openpendant.tools.reference.operations import GROUPS, PublishedOperation, published_operations

ALL = published_operations()


def test_every_declaration_says_what_it_is_for_and_what_each_field_means() -> None:
    every(ALL.items(), _says_what_each_argument_means)


def _says_what_each_argument_means(operation: PublishedOperation) -> None:
    told = operation.told
    assert told.about
    assert set(told.section("Args")) == {each.name for each in operation.arguments}
    assert all(told.section("Args").values())


def _by_tag(union: Any, tag: str) -> dict[str, Any]:
    found = {}
    for member in get_args(union):
        (value,) = get_args(get_type_hints(member)[tag])
        found[value] = member
    return found


TAGGED = [
    ("edit", server_edits.Edit, edits.Edit),
    ("statement", server_statements.Statement, edits.Statement),
]


@pytest.mark.parametrize(("tag", "theirs", "ours"), TAGGED, ids=["edits", "statements"])
def test_edits_and_statements_have_the_fields_of_the_server(
    tag: str, theirs: Any, ours: Any
) -> None:
    known, typed = _by_tag(theirs, tag), _by_tag(ours, tag)
    assert set(typed) == set(known)
    for value, kind in typed.items():
        properties, required = _fields(known[value])
        keys = get_type_hints(kind)
        assert set(keys) == set(properties), value
        needed = {name for name in keys if not is_optional(kind, name)} - {tag}
        assert needed == required - {tag}, value


def _fields(kind: Any) -> tuple[Mapping[str, Any], set[str]]:
    schema = TypeAdapter(kind).json_schema()
    return schema["properties"], set(schema.get("required", ()))


@pytest.mark.parametrize(
    ("name", "nested"),
    [
        ("Move", "speed"),
        ("RecordPoint", "point"),
        ("TouchUp", "pose"),
        ("TouchUp", "configuration"),
    ],
)
def test_what_is_inside_an_edit_has_the_fields_of_the_server(name: str, nested: str) -> None:
    theirs = getattr(server_edits if name != "Move" else server_statements, name)
    ours = getattr(edits, name)
    their_kind, our_kind = (_inner(get_type_hints(kind)[nested]) for kind in (theirs, ours))
    assert set(get_type_hints(our_kind)) == set(_fields(their_kind)[0])


def _inner(kind: Any) -> Any:
    choices = [each for each in get_args(kind) if each is not type(None)]
    return choices[0] if choices else kind


@pytest.mark.parametrize(
    ("name", "theirs"),
    [
        ("snapshot", Snapshot),
        ("cells", ServedCells),
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


@pytest.mark.asyncio
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
